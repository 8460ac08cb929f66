//! Surface that no laser saw, and that is there by all that is known of the building: floors, walls
//! below the lowest beam, and walls around openings.

use super::{PlanarPolygon, Plane};
use biplane_geometry::vec3::{cross, dot};
use serde::{Deserialize, Serialize};

/// What an inferred surface is.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum InferredKind {
    /// The ground on which the robot drove, or that the lower laser saw to be free.
    Floor,
    /// The strip of a wall between the floor and the lowest that was seen of it.
    WallBase,
    /// What of a wall is missing around a door or window.
    OpeningSurround,
}

impl InferredKind {
    /// A word for it.
    pub fn name(self) -> &'static str {
        match self {
            Self::Floor => "floor",
            Self::WallBase => "wall base",
            Self::OpeningSurround => "opening surround",
        }
    }
}

/// A flat surface that nobody measured. Frame `map`, meters.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct InferredSurface {
    /// What it is.
    pub kind: InferredKind,
    /// The name of the wall or storey that it is a part of, as in `building.json`.
    pub part_of: String,
    /// Unit normal; points to where the robot was.
    pub normal: [f64; 3],
    /// Distance of its plane from the origin along the normal.
    pub offset_m: f64,
    /// Outer ring, counter-clockwise seen from the normal's tip, first vertex not repeated.
    pub outer_m: Vec<[f64; 3]>,
    /// What is not known or not there, clockwise.
    pub holes_m: Vec<Vec<[f64; 3]>>,
}

impl InferredSurface {
    /// The name by which files tell of it.
    pub fn name(&self) -> String {
        format!("{} {} (inferred)", self.part_of, self.kind.name())
    }

    /// Its area, square meters.
    pub fn area_m2(&self) -> f64 {
        let rings = std::iter::once(&self.outer_m).chain(&self.holes_m);
        rings.map(|ring| self.signed_area_m2(ring)).sum()
    }

    /// Positive counter-clockwise seen from the normal's tip.
    fn signed_area_m2(&self, ring: &[[f64; 3]]) -> f64 {
        let ends = ring.iter().zip(ring.iter().cycle().skip(1));
        0.5 * ends.map(|(a, b)| dot(cross(*a, *b), self.normal)).sum::<f64>()
    }

    /// Its plane; no point is on it.
    pub fn plane(&self) -> Plane {
        Plane { normal: self.normal, offset_m: self.offset_m, points: 0, rms_m: 0.0 }
    }

    /// Its rings, as those of a polygon of its own plane.
    pub fn polygon(&self) -> PlanarPolygon {
        PlanarPolygon { plane: 0, outer_m: self.outer_m.clone(), holes_m: self.holes_m.clone() }
    }
}
