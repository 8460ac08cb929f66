//! One number for all that a run recorded and said: the same seed gives the same.

use std::hash::{DefaultHasher, Hash, Hasher};

use super::witness::Witness;
use crate::rig::SimRig;

/// The number.
#[must_use]
pub(crate) fn digest(sim: &mut SimRig<Witness>) -> u64 {
    let mut hasher = DefaultHasher::new();
    sim.transcript().hash(&mut hasher);
    sim.engine_allocations.hash(&mut hasher);
    let witness = sim.engine.sink();
    for scan in witness.scans.iter().flatten() {
        (scan.log_ns, scan.stamp_ns, &scan.ranges_mm).hash(&mut hasher);
    }
    for sample in &witness.samples {
        (sample.log_ns, sample.stamp_ns, sample.numbers.map(f32::to_bits)).hash(&mut hasher);
    }
    (&witness.odometry_ns, witness.poses).hash(&mut hasher);
    format!("{:?}", witness.health).hash(&mut hasher);
    hasher.finish()
}
