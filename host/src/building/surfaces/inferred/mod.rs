//! Surface that no laser saw, added where nothing that was seen speaks against it: walls down to the floor,
//! the floor itself, and walls around openings.
//!
//! The fan looks upward, so it sees nothing of a building under its own height. What is measured stays as it
//! is: inferred surfaces are a list of their own. Frame `map`, meters.

mod floor;
mod simplify;
mod surround;
mod wall_base;

use crate::building::elements::Elements;
use crate::building::spaces::evidence::Evidence;
use crate::model::PlanarPolygon;
use crate::model::inferred::InferredSurface;

/// The floor of each storey, then the bases of its walls, plane by plane, and what surrounds openings.
/// `polygons` are the surfaces that were seen.
pub(crate) fn surfaces(
    evidence: &Evidence<'_>,
    elements: &Elements,
    polygons: &[PlanarPolygon],
) -> Vec<InferredSurface> {
    let mut found = floor::surfaces(evidence, elements);
    found.extend(wall_base::surfaces(evidence, elements, polygons));
    found.extend(surround::surfaces(evidence, elements, polygons, &found));
    found
}
