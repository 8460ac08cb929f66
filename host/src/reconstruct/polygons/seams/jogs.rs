//! Jogs of finished polygons: small steps of a border are evened out where no neighbor has the same step.
//!
//! Two planes may lie two centimeters apart, and a few points of one look like points of the other. The
//! border of a wall then follows either of them in turn. What was too small to be a polygon is gone, and its
//! steps are left in the walls. Frame `map`, meters.

use super::clearance;
use super::met_edges::{MetEdges, PlaneSeams};
use crate::model::{PlanarPolygon, Plane};
use crate::reconstruct::polygons::flat_polygon::{flat, lifted};
use crate::reconstruct::polygons::outline::jogs::without_jogs;
use crate::reconstruct::polygons::outline::union::repair;
use crate::reconstruct::polygons::plane_frame::{Frame, STEP_M};
use rayon::prelude::*;
use std::collections::BTreeSet;

/// Evens out jogs of up to `limit_m` in the polygons of planes that have these neighbors. Returns the planes
/// whose polygons are other ones now.
pub(crate) fn even_out(
    planes: &[Plane],
    polygons: &mut [PlanarPolygon],
    neighbors: &[Vec<usize>],
    limit_m: f64,
) -> BTreeSet<usize> {
    let met = MetEdges::new(planes, polygons, neighbors);
    let even = |polygon: &mut PlanarPolygon| {
        let frame = Frame::new(&planes[polygon.plane], *polygon.outer_m.first()?);
        *polygon = evened(&frame, polygon, &met.of_plane(polygon.plane, &frame), limit_m)?;
        Some(polygon.plane)
    };
    polygons.par_iter_mut().filter_map(even).collect()
}

/// A polygon without its jogs; `None` when it has none, or is no polygon without them.
fn evened(frame: &Frame, polygon: &PlanarPolygon, seams: &PlaneSeams, limit_m: f64) -> Option<PlanarPolygon> {
    let shape = flat(frame, polygon)?;
    let is_met = |ends: [[f64; 2]; 2]| seams.meet(ends);
    let even: Vec<_> = shape.iter().map(|ring| without_jogs(ring, &is_met, limit_m / STEP_M)).collect();
    if even == shape {
        return None;
    }
    let shapes = clearance::clear(repair(&[even]));
    // Better a jog than a polygon in pieces.
    (shapes.len() == 1).then(|| lifted(polygon.plane, frame, shapes, &[polygon]).pop())?
}

#[cfg(test)]
mod tests {
    use super::even_out;
    use crate::model::sample::{plane, polygon};
    use crate::model::{PlanarPolygon, Plane};

    /// A wall under a ceiling at 2.5 m; from 1 to 2 m along it ends in the plane of a lamp, 2 cm lower.
    fn room() -> (Vec<Plane>, Vec<PlanarPolygon>) {
        let planes =
            vec![plane([0.0, -1.0, 0.0], 0.0), plane([0.0, 0.0, -1.0], -2.5), plane([0.0, 0.0, -1.0], -2.48)];
        let wall = [
            [0.0, 0.0, 0.5],
            [4.0, 0.0, 0.5],
            [4.0, 0.0, 2.5],
            [2.0, 0.0, 2.5],
            [2.0, 0.0, 2.48],
            [1.0, 0.0, 2.48],
            [1.0, 0.0, 2.5],
            [0.0, 0.0, 2.5],
        ];
        let ceiling = [[0.0, 0.0, 2.5], [4.0, 0.0, 2.5], [4.0, -3.0, 2.5], [0.0, -3.0, 2.5]];
        (planes, vec![polygon(0, &wall), polygon(1, &ceiling)])
    }

    #[test]
    fn a_step_that_no_neighbor_has_goes() {
        let (planes, mut polygons) = room();
        even_out(&planes, &mut polygons, &[vec![1, 2], vec![0], vec![0]], 0.03);
        assert_eq!(polygons[0].outer_m.len(), 4, "{:?}", polygons[0]);
        assert_eq!(polygons[1], room().1[1]);
    }

    #[test]
    fn a_step_that_a_neighbor_has_stays() {
        let (planes, mut polygons) = room();
        let lamp = [[1.0, 0.0, 2.48], [2.0, 0.0, 2.48], [2.0, -1.0, 2.48], [1.0, -1.0, 2.48]];
        polygons.push(polygon(2, &lamp));
        let before = polygons.clone();
        even_out(&planes, &mut polygons, &[vec![1, 2], vec![0], vec![0]], 0.03);
        assert_eq!(polygons, before);
    }
}
