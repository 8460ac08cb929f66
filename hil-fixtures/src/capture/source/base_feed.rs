//! A capture's odometry packets for a mock base: each as it was, at its time since the capture's start. Where
//! the capture pauses, the packet before is sent again: a base never falls silent.

use super::base_track::BaseTrack;
use super::laser_feed::HOLD_NS;
use crate::devices::base::feed::{Sip, SipAnswer, SipFeed};
use crate::devices::run::Run;
use std::sync::Arc;

/// Before the run and after the capture's end the first and the last packet go out again and again, this far
/// apart.
const CYCLE_NS: i64 = 100_000_000;

/// The feed.
pub struct CapturePackets {
    track: Arc<BaseTrack>,
    origin_ns: i64,
    run: Run,
    run_number: u64,
    next: usize,
    /// When a packet may be repeated.
    repeat_ns: i64,
    once: bool,
}

impl CapturePackets {
    /// `origin_ns` is the capture's start; with `once` the feed ends with the capture.
    #[must_use]
    pub fn new(track: Arc<BaseTrack>, origin_ns: i64, run: Run, once: bool) -> Self {
        Self { track, origin_ns, run, run_number: 0, next: 0, repeat_ns: i64::MIN, once }
    }

    fn repeat(&mut self, index: usize, now_ns: i64) -> SipAnswer {
        if now_ns < self.repeat_ns {
            return SipAnswer::Later(self.repeat_ns);
        }
        self.repeat_ns = now_ns + CYCLE_NS;
        self.packet(index)
    }

    /// Until the next packet is due: nothing, or in a long pause the packet before.
    fn pause(&mut self, now_ns: i64, due_ns: i64) -> SipAnswer {
        let before = self.next.checked_sub(1).and_then(|index| self.track.packets.get(index));
        let next = self.track.packets.get(self.next);
        let pause_ns = next.zip(before).map_or(0, |(next, before)| next.time_ns - before.time_ns);
        let is_long = pause_ns > HOLD_NS && self.repeat_ns.max(now_ns) + CYCLE_NS <= due_ns;
        if is_long { self.repeat(self.next - 1, now_ns) } else { SipAnswer::Later(due_ns) }
    }

    fn packet(&self, index: usize) -> SipAnswer {
        self.track
            .packets
            .get(index)
            .map_or(SipAnswer::Ended, |p| SipAnswer::Now(Sip::Recorded(p.body.clone())))
    }
}

impl SipFeed for CapturePackets {
    fn next(&mut self, now_ns: i64) -> SipAnswer {
        let Some(begun) = self.run.begun() else { return self.repeat(0, now_ns) };
        if begun.number != self.run_number {
            self.run_number = begun.number;
            self.next = 0;
        }
        match self.track.packets.get(self.next) {
            Some(packet) => {
                let due_ns = begun.start_ns + packet.time_ns - self.origin_ns;
                if now_ns < due_ns {
                    return self.pause(now_ns, due_ns);
                }
                self.next += 1;
                self.repeat_ns = due_ns + CYCLE_NS;
                self.packet(self.next - 1)
            }
            None if self.once => SipAnswer::Ended,
            None => self.repeat(self.track.packets.len().saturating_sub(1), now_ns),
        }
    }
}
