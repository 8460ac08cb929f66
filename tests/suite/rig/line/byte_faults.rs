//! What can happen to single bytes on their way: lost, flipped, doubled, out of order, held back,
//! overwritten; each alone, as often as asked.
//!
//! Times are nanoseconds on the rig's clock.

use std::collections::VecDeque;

use biplane_mock::line::{Arrival, Channel, Fault};
use biplane_mock::rng::Rng;

use crate::rig::MS;

/// Longest run of bytes that is doubled, or changes places with the run behind it.
const LONGEST_RUN: f64 = 16.0;
/// Longest run of bytes that a burst overwrites.
const LONGEST_BURST: f64 = 64.0;
/// Longest time for which everything is held back, milliseconds: as a stalling adapter does.
const LONGEST_STALL_MS: f64 = 300.0;

/// What happens to bytes.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Harm {
    /// A byte is lost.
    Drop,
    /// One of its bits is flipped.
    Flip,
    /// A run of up to 16 bytes comes twice.
    Duplicate,
    /// A run of up to 16 bytes comes behind the run that followed it.
    Reorder,
    /// Everything is held back for up to 0.3 s, and then comes at once.
    Stall,
    /// A run of up to 64 bytes is overwritten by other bytes.
    Burst,
}

impl Harm {
    /// What it is called.
    #[must_use]
    pub(crate) fn name(self) -> &'static str {
        match self {
            Self::Drop => "bytes dropped",
            Self::Flip => "bits flipped",
            Self::Duplicate => "bytes duplicated",
            Self::Reorder => "bytes reordered",
            Self::Stall => "bytes stalled",
            Self::Burst => "bursts of noise",
        }
    }

    /// A direction of a line on which it happens once in so many bytes on average.
    #[must_use]
    pub(crate) fn channel(self, once_in: u32, seed: u64, stream: u64) -> Channel {
        let rng = Rng::new(seed, 0xB17E + stream, self as i64);
        Channel::of(vec![Box::new(Harmed { harm: self, once_in, rng, under_way: UnderWay::Nothing })])
    }
}

/// A direction of a line.
struct Harmed {
    harm: Harm,
    once_in: u32,
    rng: Rng,
    under_way: UnderWay,
}

/// What has begun and is not over.
enum UnderWay {
    Nothing,
    /// So many bytes are still to be overwritten.
    Noise(usize),
    /// A run is gathered: so many bytes still belong to it.
    Gathered(Vec<u8>, usize),
    /// It waits until so many bytes have passed.
    Held(Vec<u8>, usize),
    /// Nothing passes before this time.
    Stalled(i64),
}

impl Harmed {
    fn run(&mut self, longest: f64) -> usize {
        self.rng.between(1.0, longest + 1.0) as usize
    }

    /// The harm begins with this byte; what of it comes now.
    fn begin(&mut self, now_ns: i64, byte: u8, out: &mut Vec<u8>) {
        match self.harm {
            Harm::Drop => {}
            Harm::Flip => out.push(byte ^ (1 << (self.rng.bits() & 7))),
            Harm::Duplicate | Harm::Reorder => {
                let length = self.run(LONGEST_RUN);
                self.under_way = UnderWay::Gathered(Vec::new(), length);
                self.pass_byte(now_ns, byte, out);
            }
            Harm::Stall => {
                let until_ns = now_ns + (self.rng.between(5.0, LONGEST_STALL_MS) * MS as f64) as i64;
                self.under_way = UnderWay::Stalled(until_ns);
                out.push(byte);
            }
            Harm::Burst => {
                self.under_way = UnderWay::Noise(self.run(LONGEST_BURST));
                self.pass_byte(now_ns, byte, out);
            }
        }
    }

    /// Returns whether the byte was harmed.
    fn pass_byte(&mut self, now_ns: i64, byte: u8, out: &mut Vec<u8>) -> bool {
        match std::mem::replace(&mut self.under_way, UnderWay::Nothing) {
            UnderWay::Nothing if self.rng.unit() * f64::from(self.once_in) < 1.0 => {
                self.begin(now_ns, byte, out);
            }
            UnderWay::Stalled(until_ns) if now_ns < until_ns => {
                out.push(byte);
                self.under_way = UnderWay::Stalled(until_ns);
            }
            UnderWay::Nothing | UnderWay::Stalled(_) => {
                out.push(byte);
                return false;
            }
            UnderWay::Noise(left) => {
                out.push(self.rng.bits().to_le_bytes()[0]);
                self.under_way = if left > 1 { UnderWay::Noise(left - 1) } else { UnderWay::Nothing };
            }
            UnderWay::Gathered(mut run, left) => {
                run.push(byte);
                self.under_way = match (left, self.harm) {
                    (2.., _) => UnderWay::Gathered(run, left - 1),
                    (_, Harm::Duplicate) => {
                        out.extend(run.repeat(2));
                        UnderWay::Nothing
                    }
                    _ => UnderWay::Held(run, self.run(LONGEST_RUN)),
                };
            }
            UnderWay::Held(run, left) => {
                out.push(byte);
                if left > 1 {
                    self.under_way = UnderWay::Held(run, left - 1);
                } else {
                    out.extend(run);
                }
            }
        }
        true
    }
}

impl Fault for Harmed {
    fn pass(&mut self, now_ns: i64, bytes: &[u8], arrivals: &mut VecDeque<Arrival>) -> u64 {
        let mut out = Vec::new();
        let harmed = bytes.iter().filter(|byte| self.pass_byte(now_ns, **byte, &mut out)).count();
        let free_ns = match self.under_way {
            UnderWay::Stalled(until_ns) => until_ns,
            _ => now_ns,
        };
        let at_ns = arrivals.back().map_or(free_ns, |last| last.at_ns.max(free_ns));
        if !out.is_empty() {
            arrivals.push_back(Arrival { at_ns, bytes: out });
        }
        harmed as u64
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A count upwards through a channel, a byte each millisecond.
    fn through(harm: Harm, once_in: u32) -> Vec<(i64, u8)> {
        let mut channel = harm.channel(once_in, 1, 0);
        let mut arrived = Vec::new();
        let mut out = Vec::new();
        for ms in 0..20_000 {
            if ms < 19_000 {
                channel.push(ms * MS, &[(ms & 0xFF) as u8]);
            }
            channel.take(ms * MS, &mut out);
            arrived.extend(out.drain(..).map(|byte| (ms, byte)));
        }
        arrived
    }

    #[test]
    fn each_harm_does_what_it_is_called_and_no_more() {
        let sorted = |mut bytes: Vec<u8>| {
            bytes.sort_unstable();
            bytes
        };
        let sent: Vec<u8> = (0..19_000).map(|ms| (ms & 0xFF) as u8).collect();
        let bytes = |harm| -> Vec<u8> { through(harm, 1000).into_iter().map(|(_, byte)| byte).collect() };
        let lost = sent.len() - bytes(Harm::Drop).len();
        assert!((8..40).contains(&lost), "{lost}");
        let flipped = bytes(Harm::Flip);
        let bits: Vec<u32> = sent.iter().zip(&flipped).map(|(a, b)| (a ^ b).count_ones()).collect();
        assert!(bits.iter().all(|bits| *bits <= 1) && (8..40).contains(&bits.iter().sum::<u32>()));
        let extra = bytes(Harm::Duplicate).len() - sent.len();
        assert!((40..400).contains(&extra), "{extra}");
        let reordered = bytes(Harm::Reorder);
        assert!(reordered != sent && sorted(reordered) == sorted(sent.clone()));
        let stalled = through(Harm::Stall, 1000);
        assert_eq!(stalled.iter().map(|(_, byte)| *byte).collect::<Vec<_>>(), sent);
        let latest = stalled.iter().zip(0..).map(|((at_ms, _), ms)| at_ms - ms).max();
        assert!(latest.is_some_and(|late_ms| (150..=300).contains(&late_ms)), "{latest:?}");
        let burst = bytes(Harm::Burst);
        let differing = sent.iter().zip(&burst).filter(|(a, b)| a != b).count();
        assert!(burst.len() == sent.len() && (200..1200).contains(&differing), "{differing}");
    }
}
