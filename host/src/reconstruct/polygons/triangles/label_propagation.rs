//! Points on no plane that are part of one all the same: noise beyond what a plane takes in, small things on
//! a wall.
//!
//! Poses err by an angle, so far points scatter by more than the sensor's noise. Left alone each would be a
//! crumple of triangles in the middle of a wall. A point joins the plane of a neighbor in the raw mesh when
//! it is near that plane. Frame `map`, meters.

use crate::model::{Cloud, Mesh, Plane};

/// Rounds at most; each takes in one more row of points.
const ROUNDS: usize = 16;

/// The plane of each point, those included that join a neighbor's plane because they are within `step_m` of
/// it.
pub(crate) fn propagate_labels(
    cloud: &Cloud,
    mesh: &Mesh,
    labels: &[i32],
    planes: &[Plane],
    step_m: f64,
) -> Vec<i32> {
    let mut labels = labels.to_vec();
    let free = |labels: &[i32], corner: u32| labels.get(corner as usize).is_some_and(|label| *label < 0);
    let is_open = |triangle: &&[u32; 3]| triangle.iter().any(|corner| free(&labels, *corner));
    let mut open: Vec<[u32; 3]> = mesh.triangles.iter().filter(is_open).copied().collect();
    for _ in 0..ROUNDS {
        open.retain(|triangle| triangle.iter().any(|corner| free(&labels, *corner)));
        let mut joining: Vec<(u32, f64, i32)> = Vec::new();
        for triangle in &open {
            for (point, neighbor) in
                [(0, 1), (1, 2), (2, 0), (1, 0), (2, 1), (0, 2)].map(|(i, j)| (triangle[i], triangle[j]))
            {
                let Some(&label) = labels.get(neighbor as usize) else { continue };
                let Some(plane) = usize::try_from(label).ok().and_then(|label| planes.get(label)) else {
                    continue;
                };
                if !free(&labels, point) {
                    continue;
                }
                let off_m = plane.distance_m(cloud.points_m[point as usize].map(f64::from)).abs();
                if off_m <= step_m {
                    joining.push((point, off_m, label));
                }
            }
        }
        if joining.is_empty() {
            break;
        }
        // The nearest plane wins; of two as near the larger one, whose index is smaller.
        joining.sort_unstable_by(|a, b| a.0.cmp(&b.0).then(a.1.total_cmp(&b.1)).then(a.2.cmp(&b.2)));
        joining.dedup_by_key(|found| found.0);
        joining.iter().for_each(|(point, _, label)| labels[*point as usize] = *label);
    }
    labels
}

#[cfg(test)]
mod tests {
    use super::propagate_labels;
    use crate::model::{Cloud, Mesh, Plane};

    #[test]
    fn stray_points_join_the_wall_row_by_row_and_things_before_it_do_not() {
        // A strip along x: two points on the wall y = 1, then strays off it by these distances.
        let off_m = [0.0, 0.0, 0.06, 0.09, -0.02, 0.3, 0.01, 0.0];
        let points_m =
            off_m.iter().enumerate().map(|(k, off)| [k as f32, 1.0 + off, (k % 2) as f32]).collect();
        let cloud = Cloud { points_m, ..Cloud::default() };
        let triangles = (0..5).map(|k| [k, k + 1, k + 2]).chain([[5, 6, 99]]).collect();
        let mesh = Mesh { vertices_m: cloud.points_m.clone(), triangles };
        let wall = Plane { normal: [0.0, -1.0, 0.0], offset_m: -1.0, points: 2, rms_m: 0.0 };
        let labels = [0, 0, -1, -1, -1, -1, -1, -1];
        // The sixth is too far off, the seventh a neighbor of the fifth, the last of nothing.
        assert_eq!(propagate_labels(&cloud, &mesh, &labels, &[wall], 0.1), [0, 0, 0, 0, 0, -1, 0, -1]);
        assert_eq!(propagate_labels(&cloud, &mesh, &labels, &[wall], 0.05), labels);
        assert_eq!(propagate_labels(&cloud, &mesh, &labels, &[], 0.1), labels);
    }
}
