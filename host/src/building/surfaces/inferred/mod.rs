//! Surface that no laser saw, added where nothing that was seen speaks against it: walls down to the floor,
//! the floor itself, and walls around openings.
//!
//! The fan looks upward, so it sees nothing of a building under its own height. What is measured stays as it
//! is: inferred surfaces are a list of their own. Frame `map`, meters.

mod floor;
mod simplify;
mod surround;
mod wall_base;

use crate::building::elements::{Elements, Wall};
use crate::building::spaces::evidence::{Evidence, Seen};
use crate::model::inferred::{InferredKind, InferredSurface};
use crate::model::{PlanarPolygon, Plane};

/// A surface in the plane of a wall's face, as rings: the outer one, and its holes.
fn of_wall(
    kind: InferredKind,
    wall: &Wall,
    plane: &Plane,
    mut rings: impl Iterator<Item = Vec<[f64; 3]>>,
) -> Option<InferredSurface> {
    let (outer_m, holes_m) = (rings.next()?, rings.collect());
    let (part_of, Plane { normal, offset_m, .. }) = (wall.id.clone(), *plane);
    Some(InferredSurface { kind, part_of, normal, offset_m, outer_m, holes_m })
}

/// Whether the lower laser looked through a wall: saw free floor so far behind a place on its face.
fn is_free_behind(evidence: &Evidence<'_>, plane: &Plane, [x, y, _]: [f64; 3], behind_m: f64) -> bool {
    let [nx, ny, _] = plane.normal;
    let cell = evidence.area.grid.cell([x - behind_m * nx, y - behind_m * ny]);
    cell.is_some_and(|cell| evidence.seen[cell] == Seen::Free)
}

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
