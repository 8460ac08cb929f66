//! The plan of a storey: everything cut at one height, and the outlines of its floors and ceilings.

use biplane_geometry::PortableMath;
use std::collections::BTreeMap;

use super::Building;
use super::elevation::Elevation;
use super::section::{Line, cut, cut_mesh};
use crate::building::part::CUT_M;
use crate::building::part::Kind;
use crate::model::{Model, PlanarPolygon};

/// Shorter pieces of a line are noise of a border, meters.
const MIN_M: f64 = 0.02;

/// A ring of x and y, meters.
pub(crate) type Outline = Vec<[f64; 2]>;

/// The plan of one storey. Frame `map`, meters.
#[derive(Clone, Debug, Default, PartialEq)]
pub(crate) struct Plan {
    /// Height of the floor.
    pub floor_m: f64,
    /// Walls, one line for each stretch of a plane.
    pub walls: Vec<Line>,
    /// Leaves of closed doors.
    pub leaves: Vec<Line>,
    /// Everything else that is cut.
    pub section: Vec<Line>,
    /// Outlines of the floors, holes included.
    pub floors: Vec<Outline>,
    /// Outlines of the ceilings, holes included.
    pub ceilings: Vec<Outline>,
}

/// Draws the plan of a storey.
pub(crate) fn draw(model: &Model, building: &Building, storey: usize) -> Option<Plan> {
    let floor_m = *building.floors_m.get(storey)?;
    let z_m = floor_m + CUT_M;
    let mut plan = Plan { floor_m, ..Plan::default() };
    let mut walls: BTreeMap<usize, Vec<&PlanarPolygon>> = BTreeMap::new();
    for (polygon, part) in model.polygons.iter().zip(&building.parts) {
        let Some(plane) = model.planes.get(polygon.plane) else { continue };
        match part.kind {
            Kind::Wall => walls.entry(polygon.plane).or_default().push(polygon),
            Kind::Leaf => plan.leaves.extend(cut(polygon, plane, z_m)),
            Kind::Other => plan.section.extend(cut(polygon, plane, z_m)),
            Kind::Floor if part.storey == storey => plan.floors.extend(outlines(polygon)),
            Kind::Ceiling if part.storey == storey => plan.ceilings.extend(outlines(polygon)),
            Kind::Floor | Kind::Ceiling => {}
        }
    }
    for (plane, polygons) in walls {
        let Some(elevation) = Elevation::new(&model.planes[plane]) else { continue };
        let spans = elevation.rows(&polygons, z_m).into_iter();
        plan.walls.extend(spans.map(|span| span.map(|u| elevation.point(u, z_m))));
    }
    plan.section.extend(cut_mesh(&model.leftovers, z_m));
    for lines in [&mut plan.walls, &mut plan.leaves, &mut plan.section] {
        lines.retain(|[a, b]| (b[0] - a[0]).portable_hypot(b[1] - a[1]) >= MIN_M);
    }
    Some(plan)
}

fn outlines(polygon: &PlanarPolygon) -> impl Iterator<Item = Outline> + '_ {
    let rings = std::iter::once(&polygon.outer_m).chain(&polygon.holes_m);
    rings.map(|ring| ring.iter().map(|p| [p[0], p[1]]).collect())
}
