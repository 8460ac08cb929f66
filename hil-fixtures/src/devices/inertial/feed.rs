//! Where a mock unit's samples come from: a world driven through, or a capture played back.
//!
//! Times are nanoseconds on the device's clock.

use crate::devices::lms::scans::feed::Timeline;
use crate::rig::inertial::{InertialSample, SimulatedInertial};
use crate::world::pose::Pose;

/// Gives a mock unit its samples.
pub trait InertialFeed: Send {
    /// The mean over the `period_ns` about `middle_ns`; `None` when there is none. Asked in order.
    fn sample(&mut self, middle_ns: i64, period_ns: i64) -> Option<InertialSample>;
}

/// What a unit feels on a robot that drives through a world.
pub struct DrivenInertial<F> {
    source: SimulatedInertial<F>,
    timeline: Box<dyn Timeline>,
}

impl<F: Fn(i64) -> Pose> DrivenInertial<F> {
    /// What `source` feels, at the world's times.
    #[must_use]
    pub fn new(source: SimulatedInertial<F>, timeline: Box<dyn Timeline>) -> Self {
        Self { source, timeline }
    }
}

impl<F: Fn(i64) -> Pose + Send> InertialFeed for DrivenInertial<F> {
    fn sample(&mut self, middle_ns: i64, period_ns: i64) -> Option<InertialSample> {
        Some(self.source.sample_over(self.timeline.world_ns(middle_ns), period_ns))
    }
}
