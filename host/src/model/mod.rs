//! The border types between modeling, exports and the command line.
//!
//! Everything here is in the `map` frame (z up), in meters. Points are `f32`, because they carry centimeters
//! of noise; planes and polygons are `f64`, because they are averages over many points. Source: the paper,
//! sections 2.3 and 3.

pub(crate) mod area;
pub(crate) mod cylinder;
pub(crate) mod inferred;
pub(crate) mod palette;
pub(crate) mod part;
#[cfg(test)]
pub(crate) mod sample;
pub(crate) mod turn;
pub(crate) mod voxels;

use serde::{Deserialize, Serialize};

/// The end points of all vertical beams that saw something: the raw 3D points, in the order scan, then beam.
///
/// A cloud of a rig is organized: point `i` is beam `beam[i]` of scan `scan[i]`, beams that saw nothing are
/// holes.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Cloud {
    /// Point positions in `map`, meters.
    pub points_m: Vec<[f32; 3]>,
    /// Index of each point's scan, into `origins_m`; never decreasing.
    pub scan: Vec<u32>,
    /// Index of each point's beam in its scan, below `beams_per_scan`; increasing within a scan.
    pub beam: Vec<u16>,
    /// Position of the laser for each scan in `map`, meters (at the scan's middle beam).
    pub origins_m: Vec<[f32; 3]>,
    /// Beams of one scan, seen or not; 0 when the cloud is not organized.
    pub beams_per_scan: usize,
    /// Stamp of each scan, nanoseconds of Unix time; empty when the times are not known.
    pub stamps_ns: Vec<i64>,
    /// Time of each beam after its scan's stamp, nanoseconds.
    pub delays_ns: Vec<i64>,
}

impl Cloud {
    /// Number of points.
    pub fn len(&self) -> usize {
        self.points_m.len()
    }

    /// Whether the cloud has no point.
    pub fn is_empty(&self) -> bool {
        self.points_m.is_empty()
    }

    /// Where point `index` was seen from, meters in `map`; `None` when the cloud does not say.
    pub fn origin_of(&self, index: usize) -> Option<[f32; 3]> {
        let scan = *self.scan.get(index)?;
        self.origins_m.get(scan as usize).copied()
    }

    /// When point `index` was measured, nanoseconds of Unix time; `None` when the cloud does not say.
    pub fn stamp_of(&self, index: usize) -> Option<i64> {
        let stamp_ns = *self.stamps_ns.get(*self.scan.get(index)? as usize)?;
        Some(stamp_ns.saturating_add(*self.delays_ns.get(usize::from(*self.beam.get(index)?))?))
    }
}

/// A triangle mesh in `map`.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Mesh {
    /// Vertex positions, meters.
    pub vertices_m: Vec<[f32; 3]>,
    /// Three vertex indices a triangle, counter-clockwise seen from the side that the sensor was on.
    pub triangles: Vec<[u32; 3]>,
}

/// A plane fitted to points: `normal . p = offset_m`.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Plane {
    /// Unit normal in `map`; points towards the sensors that saw the plane.
    pub normal: [f64; 3],
    /// Distance of the plane from the origin of `map` along the normal, meters.
    pub offset_m: f64,
    /// How many points were fitted.
    pub points: usize,
    /// Root mean square distance of those points to the plane, meters.
    pub rms_m: f64,
}

impl Plane {
    /// Signed distance of a point to the plane, meters; positive on the sensor's side.
    pub fn distance_m(&self, point_m: [f64; 3]) -> f64 {
        biplane_geometry::plane::distance_m(self.normal, self.offset_m, point_m)
    }
}

/// A flat surface with holes, lying in one plane of a [`Model`].
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct PlanarPolygon {
    /// Index of the plane in [`Model::planes`].
    pub plane: usize,
    /// Outer ring in `map`, meters, counter-clockwise seen from the normal's tip, first vertex not repeated.
    pub outer_m: Vec<[f64; 3]>,
    /// Rings of the openings, clockwise seen from the normal's tip, first vertex not repeated.
    pub holes_m: Vec<Vec<[f64; 3]>>,
}

/// The compact model: flat surfaces, and the fine structure that is on no plane.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Model {
    /// The planes that polygons lie in, largest first.
    pub planes: Vec<Plane>,
    /// The flat surfaces.
    pub polygons: Vec<PlanarPolygon>,
    /// Triangles of the raw mesh that no polygon stands for.
    pub leftovers: Mesh,
    /// The round surfaces. A file of a model without any does not name them.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub cylinders: Vec<cylinder::Cylinder>,
    /// Surfaces that nobody measured: they count nowhere as measured ones do. A file of a model without any
    /// does not name them.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub inferred: Vec<inferred::InferredSurface>,
}

#[cfg(test)]
mod tests {
    use super::{Cloud, Plane};

    #[test]
    fn a_point_on_the_sensor_side_has_a_positive_distance() {
        let floor = Plane { normal: [0.0, 0.0, 1.0], offset_m: -0.25, points: 3, rms_m: 0.0 };
        assert_eq!(floor.distance_m([4.0, 5.0, 0.5]), 0.75);
    }

    #[test]
    fn a_point_knows_the_laser_that_saw_it() {
        let cloud = Cloud {
            points_m: vec![[0.0; 3]; 2],
            scan: vec![0, 1],
            beam: vec![3, 3],
            origins_m: vec![[1.0; 3], [2.0; 3]],
            beams_per_scan: 181,
            stamps_ns: vec![5_000, 6_000],
            delays_ns: vec![0, 1, 2, 30],
        };
        assert_eq!((cloud.stamp_of(1), cloud.stamp_of(2)), (Some(6_030), None));
        assert_eq!(cloud.origin_of(1), Some([2.0; 3]));
        assert_eq!(cloud.origin_of(2), None);
        assert_eq!(cloud.len(), 2);
        assert!(!cloud.is_empty());
    }
}
