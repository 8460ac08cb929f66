//! Which edges of a polygon are met by polygons of other planes: where both have a piece of their seam as a
//! border. Frame `map`, meters.

use super::plane_intersection;
use super::weld::ON_PLANE_M;
use crate::model::{PlanarPolygon, Plane};
use crate::reconstruct::polygons::flat_polygon::rings;
use crate::reconstruct::polygons::outline::border::ON_SEAM_STEPS;
use crate::reconstruct::polygons::outline::line::Line;
use crate::reconstruct::polygons::plane_frame::{FlatPoint, Frame};
use std::collections::BTreeMap;

/// Edges that have less than this in common only meet in their ends, steps.
const COMMON_STEPS: f64 = 20.0;

/// The edges of all polygons that lie in neighboring planes.
pub(crate) struct MetEdges<'a> {
    planes: &'a [Plane],
    neighbors: &'a [Vec<usize>],
    /// By the plane of the polygon and the neighboring plane.
    edges: BTreeMap<(usize, usize), Vec<[[f64; 3]; 2]>>,
}

impl<'a> MetEdges<'a> {
    /// Of polygons whose planes have these neighbors.
    pub(crate) fn new(planes: &'a [Plane], polygons: &[PlanarPolygon], neighbors: &'a [Vec<usize>]) -> Self {
        let mut edges: BTreeMap<(usize, usize), Vec<[[f64; 3]; 2]>> = BTreeMap::new();
        for polygon in polygons {
            for (from, to) in rings(polygon).flat_map(|ring| ring.iter().zip(ring.iter().cycle().skip(1))) {
                for other in &neighbors[polygon.plane] {
                    if [from, to].iter().all(|p| planes[*other].distance_m(**p).abs() < ON_PLANE_M) {
                        edges.entry((polygon.plane, *other)).or_default().push([*from, *to]);
                    }
                }
            }
        }
        Self { planes, neighbors, edges }
    }

    /// Where other planes meet plane `index`, in the coordinates of its frame.
    pub(crate) fn of_plane(&self, index: usize, frame: &Frame) -> PlaneSeams {
        let plane = &self.planes[index];
        let near_m = frame.lift(FlatPoint::new(0, 0));
        let seam = |other: &usize| {
            let (at_m, along) = plane_intersection::line(plane, self.planes.get(*other)?, near_m)?;
            let line = Line { at: frame.steps(at_m), direction: frame.direction(along)? };
            let met = self.edges.get(&(*other, index))?;
            let spans = met.iter().map(|ends| span(&line, ends.map(|p| frame.steps(p)))).collect();
            Some(Seam { line, spans })
        };
        PlaneSeams { seams: self.neighbors[index].iter().filter_map(seam).collect() }
    }
}

/// The seams of one plane.
pub(crate) struct PlaneSeams {
    seams: Vec<Seam>,
}

/// A seam, and from where to where polygons of the other plane have it as a border, steps.
struct Seam {
    line: Line,
    spans: Vec<[f64; 2]>,
}

impl PlaneSeams {
    /// Whether a polygon of another plane meets an edge, given its ends in steps.
    pub(crate) fn meet(&self, ends: [[f64; 2]; 2]) -> bool {
        self.seams.iter().any(|seam| {
            let [from, to] = span(&seam.line, ends);
            ends.iter().all(|p| seam.line.off(*p).abs() <= ON_SEAM_STEPS)
                && seam.spans.iter().any(|span| to.min(span[1]) - from.max(span[0]) > COMMON_STEPS)
        })
    }
}

/// From where to where an edge goes along a line.
fn span(line: &Line, ends: [[f64; 2]; 2]) -> [f64; 2] {
    let [a, b] = ends.map(|p| line.along(p));
    [a.min(b), a.max(b)]
}
