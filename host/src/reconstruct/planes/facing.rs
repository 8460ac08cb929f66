//! Planes turned towards where most of their points were seen from.

use rayon::prelude::*;

use crate::reconstruct::planes::labeled::Planes;
use crate::reconstruct::planes::labels::refine::POINTS_PER_PIECE;

impl Planes {
    /// Turns the normal of each plane to the side from which most of its points were seen; `seen_from` says
    /// of a point from where that was, meters in the cloud's coordinates. Planes of which that is not known
    /// stay as they are.
    pub(crate) fn face(&mut self, seen_from: impl Fn(usize) -> Option<[f64; 3]> + Sync) {
        let planes = &self.planes;
        let none = || vec![0_i64; planes.len()];
        let counted = |mut in_front: Vec<i64>, (index, label): (usize, &i32)| {
            let at = usize::try_from(*label).ok().filter(|at| *at < planes.len());
            if let Some((at, place_m)) = at.zip(seen_from(index)) {
                in_front[at] += if planes[at].distance_m(place_m) >= 0.0 { 1 } else { -1 };
            }
            in_front
        };
        let added = |mut a: Vec<i64>, b: Vec<i64>| {
            a.iter_mut().zip(b).for_each(|(a, b)| *a += b);
            a
        };
        let labels = self.labels.par_iter().enumerate().with_min_len(POINTS_PER_PIECE);
        let in_front = labels.fold(none, counted).reduce(none, added);
        for (plane, in_front) in self.planes.iter_mut().zip(in_front) {
            if in_front < 0 {
                plane.normal = plane.normal.map(|v| -v);
                plane.offset_m = -plane.offset_m;
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::model::Plane;

    #[test]
    fn each_plane_looks_to_where_most_of_its_points_were_seen_from() {
        let plane = |normal, offset_m| Plane { normal, offset_m, points: 3, rms_m: 0.0 };
        let up = [0.0, 0.0, 1.0];
        let mut found = Planes {
            planes: vec![plane(up, 2.5), plane(up, 0.0), plane(up, -9.0), plane(up, 5.0)],
            labels: vec![0, 0, 0, 1, 2, -1, 7, 3],
            ..Planes::default()
        };
        // A ceiling seen from below twice and from above once, a floor from above, and one from nowhere.
        let places = [Some(1.5), Some(1.6), Some(3.0), Some(1.5), None, Some(0.0), Some(0.0), Some(5.0)];
        found.face(|index| places[index].map(|z_m| [4.0, -1.0, z_m]));
        let found: Vec<_> = found.planes.iter().map(|plane| (plane.normal[2], plane.offset_m)).collect();
        assert_eq!(found, [(-1.0, -2.5), (1.0, 0.0), (1.0, -9.0), (1.0, 5.0)]);
    }
}
