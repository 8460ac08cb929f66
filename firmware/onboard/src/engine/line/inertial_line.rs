//! The line of an inertial unit, and the stamps of its samples.

use biplane_recording::rig::InertialUnit;

use crate::engine::line::Line;
use crate::engine::options::Feed;
use crate::engine::out::health::LineHealth;
use crate::session::device_session::Session;
use crate::session::event::Event;
use crate::session::inertial::InertialSession;
use crate::session::inertial::event::InertialEvent;
use crate::session::inertial::reading::InertialReading;
use crate::stamping::arrivals::Extent;
use crate::stamping::device_clock::{DeviceClock, Stated};
use crate::types::byte_time::byte_time_ns;

/// From a sample to the first byte of its message, microseconds: data sheets of the MTi series say less than
/// 2 ms. Wrong by one: all stamps are off by one.
const LATENCY_US: i64 = 1_000;

/// An inertial unit's line.
#[derive(Debug)]
pub(crate) struct InertialLine {
    /// The line.
    pub line: Line<InertialSession>,
    device_clock: DeviceClock,
    /// From sample to sample as the rig asks, microseconds.
    interval_us: f64,
}

impl InertialLine {
    /// The line of this unit of the rig, whose session begins at `now_ns`.
    #[must_use]
    pub(crate) fn new(unit: &InertialUnit, feed: Feed, now_ns: i64) -> Self {
        let session = match feed {
            Feed::Live => InertialSession::streaming(unit, now_ns),
            Feed::Recorded => InertialSession::listening(unit, now_ns),
        };
        Self {
            line: Line::new(session, None),
            device_clock: DeviceClock::default(),
            interval_us: 1e6 / f64::from(unit.rate_hz.max(1)),
        }
    }

    /// The stamp of a sample. A unit states the end of the time over which it has averaged; its middle is
    /// meant.
    pub(crate) fn stamp_ns(&mut self, now_ns: i64, reading: &InertialReading) -> i64 {
        let InertialReading { offset, length, time, .. } = *reading;
        if time.interval_us > 0.0 {
            self.interval_us = time.interval_us;
        }
        let byte_ns = byte_time_ns(self.line.session.baud());
        // Of messages that arrive in one read, each was on the line for as long as its bytes take. An answer
        // may follow at once, so that the interval says nothing here.
        let spacing_ns = byte_ns.saturating_mul(length as i64);
        let message = Extent { offset, length, byte_ns, burst: usize::MAX, spacing_ns };
        let left_ns = self.line.arrivals.departure(&message).map_or(now_ns, |bound| bound.time_ns);
        let interval_us = (self.interval_us.round() as i64).max(1);
        let stated = Stated { sent_us: time.time_us as u32, counter: time.counter, interval_us };
        let stamp_ns = self.device_clock.stamp_ns(stated, left_ns, interval_us / 2 + LATENCY_US);
        self.line.meter.count(now_ns, stamp_ns);
        stamp_ns
    }

    /// Whether the unit's own clock began anew since this was asked last.
    pub(crate) fn restart_news(&mut self) -> Option<Event> {
        self.device_clock.take_restart().then_some(Event::Inertial(InertialEvent::Restarted))
    }

    /// State of the line, for diagnostics.
    pub(crate) fn health(&mut self, interval_s: f64) -> LineHealth {
        let streaming = self.line.session.is_streaming();
        self.line.health(interval_s, streaming)
    }
}
