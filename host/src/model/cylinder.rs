//! Round things of a model: parts of cylinders, and the smooth meshes that stand for them. Frame `map`,
//! meters.

use super::Mesh;
use biplane_geometry::PortableMath;
use biplane_geometry::vec3::{cross, dot, minus, plus, scaled, unit};
use serde::{Deserialize, Serialize};

/// Farthest that a mesh lies off the cylinder that it stands for, meters: far below the noise of a range, and
/// few triangles. Larger: edges show. Smaller: more triangles.
pub(crate) const CHORD_ERROR_M: f64 = 0.002;
/// Fewest sides of a whole turn: a thin pole looks round still.
const MIN_SIDES: f64 = 12.0;

/// What a round thing is.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum CylinderKind {
    /// Upright, up to a ceiling or a roof.
    Column,
    /// Lying or slanted.
    Pipe,
    /// Upright, with nothing on top: lamp posts, trunks, bollards.
    Pole,
    /// A curved wall.
    Wall,
}

impl CylinderKind {
    /// The kind as it is written.
    pub(crate) fn name(self) -> &'static str {
        match self {
            Self::Column => "column",
            Self::Pipe => "pipe",
            Self::Pole => "pole",
            Self::Wall => "wall",
        }
    }
}

/// On which side of the surface the sensor was.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum SeenFrom {
    /// Away from the axis.
    Outside,
    /// At the axis.
    Inside,
}

/// A part of a cylinder.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Cylinder {
    /// What it is.
    pub kind: CylinderKind,
    /// The point of the axis from which lengths along it count.
    pub axis_point_m: [f64; 3],
    /// Direction of the axis, of length 1; upright ones point up.
    pub axis_direction: [f64; 3],
    /// The radius.
    pub radius_m: f64,
    /// Where the surface begins along the axis.
    pub from_m: f64,
    /// Where it ends.
    pub to_m: f64,
    /// From where to where it goes round, degrees; counted about the axis from [`Cylinder::zero`]. 360 apart
    /// where it is there all the way round.
    pub arc_deg: [f64; 2],
    /// Which part of that was seen, degrees.
    pub seen_arc_deg: [f64; 2],
    /// On which side the sensor was.
    pub seen_from: SeenFrom,
    /// Points that it was fitted to.
    pub points: usize,
    /// Root mean square distance of these to the surface.
    pub rms_m: f64,
    /// Which part of `from_m` to `to_m` was seen; the rest reaches to the surface that it ends at.
    pub seen_m: [f64; 2],
    /// How the ends are cut, meters along the axis for each meter towards `zero` and towards `quarter`: zeros
    /// where the end is square.
    pub cuts: [[f64; 2]; 2],
}

impl Cylinder {
    /// The direction from the axis in which angles are 0: the map's x axis for what stands, up for what lies.
    pub fn zero(&self) -> [f64; 3] {
        zero_of(self.axis_direction)
    }

    /// The direction in which the angle is a quarter of a turn.
    pub fn quarter(&self) -> [f64; 3] {
        cross(self.axis_direction, self.zero())
    }

    /// The point of the surface at an angle, at the low end (0) or the high one (1).
    pub(crate) fn corner_m(&self, angle_rad: f64, end: usize) -> [f64; 3] {
        let (sin, cos) = angle_rad.portable_sin_cos();
        let [x, y] = [self.radius_m * cos, self.radius_m * sin];
        let along = [self.from_m, self.to_m][end] + self.cuts[end][0] * x + self.cuts[end][1] * y;
        let out = plus(scaled(self.zero(), x), scaled(self.quarter(), y));
        plus(self.axis_point_m, plus(out, scaled(self.axis_direction, along)))
    }

    /// Whether it goes all the way round.
    pub(crate) fn is_whole(&self) -> bool {
        self.arc_deg[1] - self.arc_deg[0] >= 360.0 - 1e-9
    }

    /// The angles of the corners of the mesh, radians: both ends of the arc, and even steps between.
    pub(crate) fn angles_rad(&self) -> Vec<f64> {
        let [from, to] = self.arc_deg.map(f64::to_radians);
        let share = (1.0 - CHORD_ERROR_M / self.radius_m.max(CHORD_ERROR_M)).clamp(-1.0, 1.0);
        let step = (2.0 * share.portable_acos()).min(std::f64::consts::TAU / MIN_SIDES);
        let count = ((to - from) / step).ceil().clamp(1.0, 720.0);
        (0..=count as usize).map(|k| from + (to - from) * k as f64 / count).collect()
    }

    /// The outward direction at an angle, or the inward one for what is seen from inside.
    pub(crate) fn normal(&self, angle_rad: f64) -> [f64; 3] {
        let (sin, cos) = angle_rad.portable_sin_cos();
        let out = plus(scaled(self.zero(), cos), scaled(self.quarter(), sin));
        if self.seen_from == SeenFrom::Inside { scaled(out, -1.0) } else { out }
    }

    /// The flat strips of the mesh: four corners each, counter-clockwise seen from the sensor's side.
    pub(crate) fn strips_m(&self) -> Vec<[[f64; 3]; 4]> {
        let angles = self.angles_rad();
        let strip = |pair: &[f64]| {
            let [a, b] =
                if self.seen_from == SeenFrom::Inside { [pair[1], pair[0]] } else { [pair[0], pair[1]] };
            [self.corner_m(a, 0), self.corner_m(b, 0), self.corner_m(b, 1), self.corner_m(a, 1)]
        };
        angles.windows(2).map(strip).collect()
    }

    /// A mesh within [`CHORD_ERROR_M`] of the surface, wound to be seen from the sensor's side: a row of
    /// corners at each end.
    pub(crate) fn mesh(&self) -> Mesh {
        let angles = self.angles_rad();
        let mut vertices_m: Vec<[f32; 3]> = Vec::with_capacity(2 * angles.len());
        for angle in &angles {
            vertices_m.extend([0, 1].map(|end| self.corner_m(*angle, end).map(|v| v as f32)));
        }
        let mut triangles = Vec::with_capacity(2 * angles.len());
        for k in 1..angles.len() as u32 {
            let (a, b) = (2 * k - 2, 2 * k);
            let pair = match self.seen_from {
                SeenFrom::Outside => [[a, b, b + 1], [a, b + 1, a + 1]],
                SeenFrom::Inside => [[a, b + 1, b], [a, a + 1, b + 1]],
            };
            triangles.extend(pair);
        }
        Mesh { vertices_m, triangles }
    }

    /// The normals of the mesh's corners.
    pub(crate) fn normals(&self) -> Vec<[f32; 3]> {
        let of = |angle: &f64| [self.normal(*angle).map(|v| v as f32); 2];
        self.angles_rad().iter().flat_map(of).collect()
    }

    /// The angle about the axis, the distance from it and the place along it of a point; radians, meters.
    pub(crate) fn around(&self, point_m: [f64; 3]) -> (f64, f64, f64) {
        let off = minus(point_m, self.axis_point_m);
        let (x, y) = (dot(off, self.zero()), dot(off, self.quarter()));
        (y.portable_atan2(x), x.portable_hypot(y), dot(off, self.axis_direction))
    }
}

/// The direction from an axis in which angles are 0.
pub(crate) fn zero_of(axis_direction: [f64; 3]) -> [f64; 3] {
    let reference = if axis_direction[2].abs() > 0.9 { [1.0, 0.0, 0.0] } else { [0.0, 0.0, 1.0] };
    unit(minus(reference, scaled(axis_direction, dot(reference, axis_direction))))
}

#[cfg(test)]
mod tests {
    use super::CHORD_ERROR_M;
    use crate::model::sample;
    use biplane_geometry::vec3::{cross, dot, minus};

    #[test]
    fn the_mesh_lies_within_the_chord_error_and_faces_the_sensor() {
        for cylinder in [sample::column(), sample::apse()] {
            let mesh = cylinder.mesh();
            assert_eq!(mesh.vertices_m.len(), cylinder.normals().len());
            for triangle in &mesh.triangles {
                let [a, b, c] = triangle.map(|corner| mesh.vertices_m[corner as usize].map(f64::from));
                let middle = [0, 1, 2].map(|k| (a[k] + b[k] + c[k]) / 3.0);
                let (angle, distance_m, _) = cylinder.around(middle);
                assert!((0.0..=CHORD_ERROR_M).contains(&(cylinder.radius_m - distance_m)), "{distance_m}");
                assert!(dot(cross(minus(b, a), minus(c, a)), cylinder.normal(angle)) > 0.0);
            }
            for [a, b, c, _] in cylinder.strips_m() {
                let (angle, ..) = cylinder.around([0, 1, 2].map(|k| 0.5 * (a[k] + c[k])));
                assert!(dot(cross(minus(b, a), minus(c, b)), cylinder.normal(angle)) > 0.0);
            }
        }
    }

    #[test]
    fn a_slanted_cut_follows_its_plane() {
        let mut column = sample::column();
        column.cuts[1] = [0.5, 0.0];
        let high = column.corner_m(0.0, 1);
        assert!((high[2] - (column.axis_point_m[2] + column.to_m + 0.5 * column.radius_m)).abs() < 1e-12);
    }
}
