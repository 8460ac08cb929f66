//! Loop closure: where the robot was before, searched, verified, and accepted only when loops support each
//! other.

pub(crate) mod agreement;
pub(crate) mod candidate;
pub(crate) mod checkpoint;
pub(crate) mod join_recordings;
pub(crate) mod overlap;
pub(crate) mod pairwise_consistency;
pub(crate) mod params;
pub(crate) mod perceptual_aliasing;
pub(crate) mod search_region;
pub(crate) mod selection;
pub(crate) mod verification;
