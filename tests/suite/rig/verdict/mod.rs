//! What a run should have recorded, held against what it did record.

pub(crate) mod digest;
pub(crate) mod inertial;
pub(crate) mod truth;
pub(crate) mod witness;
