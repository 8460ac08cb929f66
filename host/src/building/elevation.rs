//! A plane seen from its side: u runs level along it, z up. Meters.

use crate::model::{PlanarPolygon, Plane};
use biplane_geometry::PortableMath;

/// From where to where, meters.
pub(crate) type Span = [f64; 2];

/// From the lowest to the highest of some values.
pub(crate) fn extent(values: impl Iterator<Item = f64>) -> Span {
    values.fold([f64::INFINITY, f64::NEG_INFINITY], |[low, high], value| [low.min(value), high.max(value)])
}

/// Planes with a smaller level part of their normal have no side: 3 degrees from level.
const MIN_LEVEL: f64 = 0.05;

/// The coordinates of one plane.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Elevation {
    along: [f64; 2],
    /// Level part of the normal, of unit length.
    across: [f64; 2],
    /// Distance from the origin along `across` is `offset_m - slope * z`.
    offset_m: f64,
    slope: f64,
}

impl Elevation {
    /// Of a plane; `None` when it is level.
    pub(crate) fn new(plane: &Plane) -> Option<Self> {
        let [x, y, z] = plane.normal;
        let length = x.portable_hypot(y);
        (length > MIN_LEVEL).then(|| Self {
            along: [-y / length, x / length],
            across: [x / length, y / length],
            offset_m: plane.offset_m / length,
            slope: z / length,
        })
    }

    /// Place of a point along the plane.
    pub(crate) fn u(&self, [x, y]: [f64; 2]) -> f64 {
        self.along[0] * x + self.along[1] * y
    }

    /// x and y of the place `u` at a height.
    pub(crate) fn point(&self, u: f64, z_m: f64) -> [f64; 2] {
        let away = self.offset_m - self.slope * z_m;
        [0, 1].map(|axis| u * self.along[axis] + away * self.across[axis])
    }

    /// Where a polygon is at a height.
    pub(crate) fn row(&self, polygon: &PlanarPolygon, z_m: f64) -> Vec<Span> {
        let passed = edges(polygon).filter_map(|(p, q)| crossing(p, q, z_m)).map(|at| self.u(at));
        pairs(passed.collect())
    }

    /// Where any of these polygons is at a height.
    pub(crate) fn rows(&self, polygons: &[&PlanarPolygon], z_m: f64) -> Vec<Span> {
        joined(polygons.iter().flat_map(|polygon| self.row(polygon, z_m)).collect())
    }

    /// Heights at which any of these polygons is over the place `u`.
    pub(crate) fn column(&self, polygons: &[&PlanarPolygon], u: f64) -> Vec<Span> {
        let of_one = |polygon: &&PlanarPolygon| {
            let flat = |p: [f64; 3]| [p[2], 0.0, self.u([p[0], p[1]])];
            let passed = edges(polygon).filter_map(|(p, q)| crossing(flat(p), flat(q), u)).map(|at| at[0]);
            pairs(passed.collect())
        };
        joined(polygons.iter().flat_map(of_one).collect())
    }
}

/// All edges of a polygon, those of its holes too.
fn edges(polygon: &PlanarPolygon) -> impl Iterator<Item = ([f64; 3], [f64; 3])> + '_ {
    let rings = std::iter::once(&polygon.outer_m).chain(&polygon.holes_m);
    rings.flat_map(|ring| ring.iter().copied().zip(ring.iter().copied().cycle().skip(1)))
}

/// In and out, in and out.
fn pairs(mut passed: Vec<f64>) -> Vec<Span> {
    passed.sort_by(f64::total_cmp);
    passed.as_chunks().0.iter().filter(|[from, to]| to > from).copied().collect()
}

/// Spans closer than this are one, meters: seams between polygons of a plane.
const SEAM_M: f64 = 0.02;

/// Spans from below, those that touch made one.
fn joined(mut spans: Vec<Span>) -> Vec<Span> {
    spans.sort_by(|a, b| a[0].total_cmp(&b[0]));
    let mut out: Vec<Span> = Vec::new();
    for span in spans {
        match out.last_mut() {
            Some(last) if span[0] <= last[1] + SEAM_M => last[1] = last[1].max(span[1]),
            _ => out.push(span),
        }
    }
    out
}

/// Where an edge passes a height; an edge that only ends there passes it when it comes from below.
pub(crate) fn crossing(p: [f64; 3], q: [f64; 3], z_m: f64) -> Option<[f64; 2]> {
    if (p[2] <= z_m) == (q[2] <= z_m) {
        return None;
    }
    let share = (z_m - p[2]) / (q[2] - p[2]);
    Some([p[0] + share * (q[0] - p[0]), p[1] + share * (q[1] - p[1])])
}
