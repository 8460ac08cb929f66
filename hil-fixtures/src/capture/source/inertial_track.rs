//! The samples of an inertial unit in a capture, and a mock unit's feed of them.
//!
//! A sample's time is that of the unit's own clock, put on the capture's by the first message; times are
//! nanoseconds. A mock unit that plays them has its own rate and count.

use crate::devices::inertial::feed::InertialFeed;
use crate::devices::run::Run;
use crate::rig::inertial::InertialSample;
use biplane_wire::xsens::{Deframer, Message, Report, Sample};
use biplane_wire::{Item, WireError};
use std::sync::Arc;

/// Nanoseconds of a tick of a unit's clock.
const TICK_NS: i64 = 100_000;
/// A clock that goes on by more between two messages began anew, or the message is damaged.
const LONGEST_PAUSE_NS: i64 = 10_000_000_000;

/// The samples, in order of time.
#[derive(Clone, Debug, Default)]
pub struct InertialTrack {
    samples: Vec<InertialSample>,
}

impl InertialTrack {
    /// When each sample was taken.
    pub fn times_ns(&self) -> impl Iterator<Item = i64> + '_ {
        self.samples.iter().map(|sample| sample.time_ns)
    }

    /// The last sample that was taken by then, else the first.
    fn at(&self, time_ns: i64) -> Option<InertialSample> {
        let behind = self.samples.partition_point(|sample| sample.time_ns <= time_ns);
        self.samples.get(behind.saturating_sub(1)).copied()
    }
}

/// Reads the bytes of a unit's line.
#[derive(Default)]
pub(super) struct InertialReading {
    deframer: Deframer,
    track: InertialTrack,
    /// The last message's ticks.
    last: Option<u32>,
}

impl InertialReading {
    pub(super) fn take(&mut self, time_ns: i64, bytes: &[u8]) {
        let Self { deframer, track, last } = self;
        deframer.feed(bytes, |item| {
            let Item::Frame { bytes, .. } = item else { return };
            let Ok(Some((ticks, mut sample))) = measurement(bytes) else { return };
            let passed_ns = last.replace(ticks).map(|last| i64::from(ticks.wrapping_sub(last)) * TICK_NS);
            let before_ns = track.samples.last().map(|sample| sample.time_ns);
            sample.time_ns = match passed_ns.zip(before_ns) {
                Some((passed_ns, before_ns)) if passed_ns <= LONGEST_PAUSE_NS => before_ns + passed_ns,
                Some((_, before_ns)) => time_ns.max(before_ns),
                None => time_ns,
            };
            track.samples.push(sample);
        });
    }

    /// Bytes looked through.
    pub(super) fn position(&self) -> u64 {
        self.deframer.position()
    }

    /// The samples; `None` where there are none.
    pub(super) fn finish(self) -> Option<InertialTrack> {
        Some(self.track).filter(|track| !track.samples.is_empty())
    }
}

/// The time and the sample of a measurement that has both.
fn measurement(frame: &[u8]) -> Result<Option<(u32, InertialSample)>, WireError> {
    let Report::Data(items) = Message::parse(frame)?.report()? else { return Ok(None) };
    let Sample { time_fine, turn_rad_s, acceleration_m_s2, .. } = Sample::of(&items)?;
    Ok(time_fine.zip(turn_rad_s.zip(acceleration_m_s2)).map(|(ticks, (turn_rad_s, force_m_s2))| {
        (ticks, InertialSample { time_ns: 0, turn_rad_s, force_m_s2 })
    }))
}

/// A mock unit's feed: before the run the first sample, after the capture's end the last.
pub struct CapturedInertial {
    track: Arc<InertialTrack>,
    origin_ns: i64,
    run: Run,
    once: bool,
}

impl CapturedInertial {
    /// `origin_ns` is the capture's start; with `once` the feed ends with the capture.
    #[must_use]
    pub fn new(track: Arc<InertialTrack>, origin_ns: i64, run: Run, once: bool) -> Self {
        Self { track, origin_ns, run, once }
    }
}

impl InertialFeed for CapturedInertial {
    fn sample(&mut self, middle_ns: i64, _period_ns: i64) -> Option<InertialSample> {
        let start_ns = self.run.begun().map_or(i64::MAX, |begun| begun.start_ns);
        let time_ns = middle_ns.saturating_sub(start_ns).saturating_add(self.origin_ns);
        let is_over = self.track.samples.last().is_some_and(|last| time_ns > last.time_ns);
        if self.once && is_over { None } else { self.track.at(time_ns) }
    }
}

#[cfg(test)]
mod tests {
    use super::InertialReading;
    use crate::devices::inertial::message::message;
    use crate::devices::inertial::outputs::Outputs;
    use crate::rig::inertial::InertialSample;

    #[test]
    fn samples_have_the_times_of_their_units_clock_and_damage_is_passed_over() {
        let asked: Vec<u8> = [0x1020, 0xFFFF, 0x1060, 0xFFFF, 0x4020, 100, 0x8020, 100_u16]
            .into_iter()
            .flat_map(u16::to_be_bytes)
            .collect();
        let outputs = Outputs::parse(&asked, 400);
        let mut reading = InertialReading::default();
        for n in 0..10_u32 {
            let turn_rad_s = [f64::from(n), 0.0, 0.0];
            let sample = InertialSample { time_ns: 0, turn_rad_s, force_m_s2: [0.0, 0.0, 9.75] };
            let mut bytes = message(0x36, &outputs.items(n as u16, (n * 100).wrapping_sub(300), &sample));
            if n == 4 {
                bytes[20] ^= 1;
            }
            // Read late by a time that differs.
            reading.take(i64::from(n) * 10_000_000 + i64::from(n * 7 % 5) * 1_000_000, &bytes);
        }
        let track = reading.finish().expect("there are some");
        let times_ms: Vec<i64> = track.times_ns().map(|time_ns| time_ns / 1_000_000).collect();
        assert_eq!(times_ms, [0, 10, 20, 30, 50, 60, 70, 80, 90]);
        let turn = |time_ms: i64| track.at(time_ms * 1_000_000).map(|sample| sample.turn_rad_s[0]);
        assert_eq!([-5, 0, 49, 50, 1000].map(turn), [0.0, 0.0, 3.0, 5.0, 9.0].map(Some));
    }
}
