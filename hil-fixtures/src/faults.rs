//! Faults of a serial line, byte by byte: presets that stack on the way between a device and its host.
//!
//! Every preset draws from a seed. Times are nanoseconds on the device's clock. One file a preset in `faults/`.

pub mod bit_noise;
pub mod loose_connector;
pub mod usb_stall;

use crate::rng::Rng;
use std::collections::VecDeque;
use std::str::FromStr;

/// A fault that can be asked for by name.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub enum Preset {
    /// A bit in ten thousand flips.
    BitNoise,
    /// The plug loses contact for a moment every few seconds.
    LooseConnector,
    /// A USB adapter delivers late, and now and then holds everything back for a while.
    UsbStall,
}

/// A name that no preset has.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
#[error("unknown fault `{name}`; known: {}", Preset::names().join(", "))]
pub struct UnknownPreset {
    /// The name.
    pub name: String,
}

impl Preset {
    /// All presets.
    pub const ALL: [Self; 3] = [Self::BitNoise, Self::LooseConnector, Self::UsbStall];

    /// Name on the command line.
    #[must_use]
    pub fn name(self) -> &'static str {
        match self {
            Self::BitNoise => "bit-noise",
            Self::LooseConnector => "loose-connector",
            Self::UsbStall => "usb-stall",
        }
    }

    /// All names.
    #[must_use]
    pub fn names() -> Vec<&'static str> {
        Self::ALL.into_iter().map(Self::name).collect()
    }

    fn fault(self, rng: Rng) -> Box<dyn Fault> {
        match self {
            Self::BitNoise => Box::new(bit_noise::BitNoise::new(bit_noise::BitNoiseParams::default(), rng)),
            Self::LooseConnector => {
                let params = loose_connector::LooseConnectorParams::default();
                Box::new(loose_connector::LooseConnector::new(params, rng))
            }
            Self::UsbStall => Box::new(usb_stall::UsbStall::new(usb_stall::UsbStallParams::default(), rng)),
        }
    }
}

impl FromStr for Preset {
    type Err = UnknownPreset;

    fn from_str(name: &str) -> Result<Self, UnknownPreset> {
        let found = Self::ALL.into_iter().find(|preset| preset.name() == name);
        found.ok_or_else(|| UnknownPreset { name: name.to_owned() })
    }
}

/// One fault on one direction of one line.
pub trait Fault: Send {
    /// Bytes that left at `now_ns` become bytes that arrive, some later, some changed, some never. Returns how many it touched.
    fn pass(&mut self, now_ns: i64, bytes: &[u8], arrivals: &mut VecDeque<Arrival>) -> u64;
}

/// Bytes and when they arrive.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Arrival {
    /// When.
    pub at_ns: i64,
    /// What.
    pub bytes: Vec<u8>,
}

/// A direction of a line with its faults, the first of them nearest to the sender.
#[derive(Default)]
pub struct Channel {
    stages: Vec<(Box<dyn Fault>, VecDeque<Arrival>)>,
    arrived: VecDeque<Arrival>,
    changed_bytes: u64,
}

impl Channel {
    /// The presets in the order given; `stream` tells the directions and devices of one seed apart.
    #[must_use]
    pub fn new(presets: &[Preset], seed: u64, stream: u64) -> Self {
        let stages = presets.iter().zip(0..).map(|(preset, place)| {
            (preset.fault(Rng::new(seed, 0xFA17_0000 + stream, place)), VecDeque::new())
        });
        Self { stages: stages.collect(), ..Self::default() }
    }

    /// Bytes leave the sender.
    pub fn push(&mut self, now_ns: i64, bytes: &[u8]) {
        if !bytes.is_empty() {
            self.feed(0, now_ns, bytes);
        }
    }

    fn feed(&mut self, stage: usize, now_ns: i64, bytes: &[u8]) {
        match self.stages.get_mut(stage) {
            Some((fault, waiting)) => self.changed_bytes += fault.pass(now_ns, bytes, waiting),
            None => self.arrived.push_back(Arrival { at_ns: now_ns, bytes: bytes.to_vec() }),
        }
    }

    /// Appends what has arrived by `now_ns`.
    pub fn take(&mut self, now_ns: i64, out: &mut Vec<u8>) {
        for stage in 0..self.stages.len() {
            while self.stages[stage].1.front().is_some_and(|arrival| arrival.at_ns <= now_ns) {
                if let Some(arrival) = self.stages[stage].1.pop_front() {
                    self.feed(stage + 1, arrival.at_ns, &arrival.bytes);
                }
            }
        }
        while let Some(arrival) = self.arrived.pop_front() {
            out.extend(arrival.bytes);
        }
    }

    /// When the next bytes arrive.
    #[must_use]
    pub fn next_due_ns(&self) -> Option<i64> {
        self.stages.iter().filter_map(|(_, waiting)| waiting.front()).map(|arrival| arrival.at_ns).min()
    }

    /// Whether bytes are on the way.
    #[must_use]
    pub fn holds_bytes(&self) -> bool {
        self.next_due_ns().is_some()
    }

    /// Bytes changed, dropped or delayed by a fault so far.
    #[must_use]
    pub fn changed_bytes(&self) -> u64 {
        self.changed_bytes
    }
}

/// What a host at `client_baud` reads of bytes sent at `baud`: nonsense, more of it when it reads faster.
#[must_use]
pub fn garble(bytes: &[u8], baud: u32, client_baud: u32, rng: &mut Rng) -> Vec<u8> {
    let ratio = (f64::from(client_baud) / f64::from(baud.max(1))).clamp(0.02, 4.0);
    let mut noise = Vec::new();
    let mut owed = rng.unit();
    for _ in bytes {
        owed += ratio;
        while owed >= 1.0 {
            owed -= 1.0;
            noise.push(rng.bits().to_le_bytes()[0]);
        }
    }
    noise
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn an_unknown_name_is_answered_with_the_known_ones() {
        let error = "rain".parse::<Preset>().unwrap_err().to_string();
        assert_eq!(error, "unknown fault `rain`; known: bit-noise, loose-connector, usb-stall");
    }

    #[test]
    fn without_faults_bytes_pass_at_once() {
        let mut channel = Channel::new(&[], 1, 0);
        channel.push(5, b"abc");
        let mut out = Vec::new();
        channel.take(5, &mut out);
        assert_eq!(out, b"abc");
        assert_eq!(channel.changed_bytes(), 0);
    }

    #[test]
    fn every_fault_of_a_stack_acts() {
        let mut channel = Channel::new(&[Preset::UsbStall, Preset::BitNoise], 1, 0);
        channel.push(0, &vec![0; 1_000_000]);
        let mut out = Vec::new();
        channel.take(10_000_000_000, &mut out);
        let flipped = out.iter().filter(|&&byte| byte != 0).count();
        assert!((60..140).contains(&flipped), "{flipped}");
    }

    #[test]
    fn stacked_faults_repeat_with_their_seed_and_differ_with_another() {
        let run = |seed| {
            let mut channel = Channel::new(&Preset::ALL, seed, 3);
            let mut out = Vec::new();
            for step in 0..20_000 {
                channel.push(step * 1_000_000, &[0x55; 4]);
                channel.take(step * 1_000_000, &mut out);
            }
            out
        };
        assert_eq!(run(7), run(7));
        assert_ne!(run(7), run(8));
    }
}
