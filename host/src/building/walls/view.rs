//! One wall with everything that its openings are found with.

use super::rays::Elevation;
use super::slabs::Slab;
use crate::building::spaces::evidence::Evidence;
use crate::building::spaces::levels::Overhead;

/// Everything that openings of one wall are found with.
pub(crate) struct WallView<'a> {
    /// What the drive knows.
    pub evidence: &'a Evidence<'a>,
    /// What hangs over the floor.
    pub overhead: &'a Overhead,
    /// The wall.
    pub slab: &'a Slab,
    /// What rays tell of it.
    pub elevation: Elevation,
    /// Height of the ceiling beside it, meters.
    pub ceiling_m: f64,
}
