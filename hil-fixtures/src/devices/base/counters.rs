//! Two counters of a base that reports counts and no pose: the wheels of a RoboClaw, way and bearing of an
//! rFLEX base.
//!
//! Counters run freely and wrap at 32 bits. Times are nanoseconds on the device's clock.

use crate::devices::lms::scans::feed::Timeline;
use crate::rig::source::{OdometrySample, OdometrySource};
use biplane_recording::rig::BaseProtocol;

/// Both counters: left and right wheel, or way and bearing.
pub type Counts = [i32; 2];

/// What the counters count.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum CountScale {
    /// The wheels.
    Wheels {
        /// Between the wheels' tracks, meters.
        wheel_base_m: f64,
        /// Way of a count of the left wheel, meters.
        metres_per_count_left: f64,
        /// Way of a count of the right wheel, meters.
        metres_per_count_right: f64,
    },
    /// Path length and bearing.
    Axes {
        /// Counts of a meter.
        counts_per_m: f64,
        /// Counts of a radian.
        counts_per_rad: f64,
    },
}

impl CountScale {
    /// That of a rig's base; `None` for one that reports a pose.
    #[must_use]
    pub fn of(protocol: &BaseProtocol) -> Option<Self> {
        match *protocol {
            BaseProtocol::None | BaseProtocol::P2os { .. } => None,
            BaseProtocol::RoboClaw {
                wheel_base_m, metres_per_count_left, metres_per_count_right, ..
            } => Some(Self::Wheels { wheel_base_m, metres_per_count_left, metres_per_count_right }),
            BaseProtocol::Rflex { counts_per_m, counts_per_rad } => {
                Some(Self::Axes { counts_per_m, counts_per_rad })
            }
        }
    }

    /// The counters after this way and turn; they were zero at the start.
    #[must_use]
    pub fn counts(&self, sample: &OdometrySample) -> Counts {
        let (path_m, heading_rad) = (sample.path_um as f64 * 1e-6, sample.heading_urad as f64 * 1e-6);
        let counted = match *self {
            Self::Wheels { wheel_base_m, metres_per_count_left, metres_per_count_right } => {
                let aside_m = 0.5 * wheel_base_m * heading_rad;
                [(path_m - aside_m) / metres_per_count_left, (path_m + aside_m) / metres_per_count_right]
            }
            Self::Axes { counts_per_m, counts_per_rad } => {
                [path_m * counts_per_m, heading_rad * counts_per_rad]
            }
        };
        counted.map(|count| count.round() as i64 as i32)
    }
}

/// Gives a mock base its counters.
pub trait CountsFeed: Send {
    /// The counters at this time; `None` when the feed has ended.
    fn counts(&mut self, now_ns: i64) -> Option<Counts>;
}

/// The counters of a base that drives through a world.
pub struct SourceCounts {
    source: Box<dyn OdometrySource>,
    timeline: Box<dyn Timeline>,
    scale: CountScale,
}

impl SourceCounts {
    /// What `source` drives, counted by `scale`.
    #[must_use]
    pub fn new(source: Box<dyn OdometrySource>, timeline: Box<dyn Timeline>, scale: CountScale) -> Self {
        Self { source, timeline, scale }
    }
}

impl CountsFeed for SourceCounts {
    fn counts(&mut self, now_ns: i64) -> Option<Counts> {
        Some(self.scale.counts(&self.source.sample(self.timeline.world_ns(now_ns))))
    }
}

/// Counters as the device has them: they begin where it was told, and at zero whenever it is switched on.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Counters {
    first: Counts,
    /// What the feed had counted at the device's start.
    origin: Option<Counts>,
    last: Counts,
}

impl Counters {
    pub(crate) fn new(first: Counts) -> Self {
        Self { first, origin: None, last: first }
    }

    /// The power came back: from zero again.
    pub(crate) fn restart(&mut self) {
        *self = Self::new([0, 0]);
    }

    /// The counters now; those of before when the feed has ended.
    pub(crate) fn read(&mut self, feed: &mut dyn CountsFeed, now_ns: i64) -> Counts {
        if let Some(now) = feed.counts(now_ns) {
            let origin = *self.origin.get_or_insert(now);
            self.last = [0, 1].map(|i| self.first[i].wrapping_add(now[i].wrapping_sub(origin[i])));
        }
        self.last
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn wheels_and_axes_count_what_was_driven() {
        // 2 m ahead and a quarter of a turn to the left.
        let sample =
            OdometrySample { path_um: 2_000_000, heading_urad: 1_570_796, ..OdometrySample::default() };
        let wheels = CountScale::Wheels {
            wheel_base_m: 0.4,
            metres_per_count_left: 1e-4,
            metres_per_count_right: -1e-4,
        };
        // 0.2 m * pi / 2 = 0.31416 m aside each way.
        assert_eq!(wheels.counts(&sample), [16_858, -23_142]);
        let axes = CountScale::Axes { counts_per_m: 100_000.0, counts_per_rad: 35_000.0 };
        assert_eq!(axes.counts(&sample), [200_000, 54_978]);
    }

    #[test]
    fn a_device_that_is_switched_on_counts_from_zero_and_counters_wrap() {
        struct Steps(i32);
        impl CountsFeed for Steps {
            fn counts(&mut self, _now_ns: i64) -> Option<Counts> {
                self.0 += 10;
                Some([self.0, -self.0])
            }
        }
        let (mut feed, mut counters) = (Steps(0), Counters::new([i32::MAX - 5, 0]));
        assert_eq!(counters.read(&mut feed, 0), [i32::MAX - 5, 0]);
        assert_eq!(counters.read(&mut feed, 1), [i32::MIN + 4, -10]);
        counters.restart();
        assert_eq!(counters.read(&mut feed, 2), [0, 0]);
        assert_eq!(counters.read(&mut feed, 3), [10, -10]);
    }
}
