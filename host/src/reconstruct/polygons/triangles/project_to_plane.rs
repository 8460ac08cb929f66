//! Moves points onto their planes ("our approach maps the corresponding 3D points on this planar surface").
//!
//! A range is noisy along its beam, not across it: a point moves along its beam to the plane, so borders keep
//! their place. Only where the beam grazes the plane does it take the shortest way. Frame `map`, meters.
//! Source: the paper, section 3.

use crate::model::{Cloud, Plane};
use crate::reconstruct::polygons::plane_frame::foot;
use biplane_geometry::vec3::dot;

/// Beams flatter to the plane than this (sine of the angle; 45 degrees) would carry a point too far.
const MIN_SINE: f64 = 0.7;

/// Every point on its plane, in the order of the cloud; points on no plane stay where they are.
pub(crate) fn onto_planes(cloud: &Cloud, labels: &[i32], planes: &[Plane]) -> Vec<[f64; 3]> {
    let moved = cloud.points_m.iter().enumerate().map(|(index, p)| {
        let p = p.map(f64::from);
        match labels.get(index).and_then(|label| planes.get(usize::try_from(*label).ok()?)) {
            Some(plane) => along_beam(plane, p, cloud.origin_of(index).map(|o| o.map(f64::from))),
            None => p,
        }
    });
    moved.collect()
}

fn along_beam(plane: &Plane, p_m: [f64; 3], origin_m: Option<[f64; 3]>) -> [f64; 3] {
    let Some(origin_m) = origin_m else { return foot(plane, p_m) };
    let beam: [f64; 3] = std::array::from_fn(|k| p_m[k] - origin_m[k]);
    let length = dot(beam, beam).sqrt();
    let approach = dot(beam, plane.normal);
    if approach.abs() < MIN_SINE * length || length == 0.0 {
        return foot(plane, p_m);
    }
    let step = plane.distance_m(p_m) / approach;
    std::array::from_fn(|k| p_m[k] - step * beam[k])
}

#[cfg(test)]
mod tests {
    use super::onto_planes;
    use crate::model::{Cloud, Plane};

    #[test]
    fn a_point_moves_along_its_beam_unless_the_beam_grazes() {
        let wall = Plane { normal: [0.0, -1.0, 0.0], offset_m: -1.0, points: 3, rms_m: 0.0 };
        let cloud = Cloud {
            points_m: vec![[1.1, 1.1, 0.0], [8.0, 1.1, 0.0], [3.0, 3.0, 3.0]],
            scan: vec![0, 0, 0],
            beam: vec![0, 1, 2],
            origins_m: vec![[0.0; 3]],
            beams_per_scan: 3,
            ..Cloud::default()
        };
        let laid = onto_planes(&cloud, &[0, 0, -1], &[wall]);
        let expected = [[1.0, 1.0, 0.0], [8.0, 1.0, 0.0], [3.0, 3.0, 3.0]];
        for (p, want) in laid.iter().zip(expected) {
            assert!((0..3).all(|k| (p[k] - want[k]).abs() < 1e-6), "{p:?} is not {want:?}");
        }
    }
}
