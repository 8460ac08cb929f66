//! Which plane a point lies on that was seen again: the nearest of those that first views round it are on.
//! Meters.

use crate::model::voxels::{Voxels, key};
use crate::model::{Cloud, Plane};

/// Side of the cells that know which planes pass through them, meters.
const CELL_M: f64 = 0.15;
/// Planes that a cell remembers; more do not meet in one place.
const PER_CELL: usize = 6;
/// No plane.
const NONE: i32 = -1;

/// Tells the planes of points.
#[derive(Clone, Debug, Default, PartialEq)]
pub(crate) struct PlanesNear {
    cells: Voxels<[i32; PER_CELL]>,
    limit_m: f64,
}

impl PlanesNear {
    /// Remembers where the points of each plane are; `limit_m` is how far a point may be from its plane.
    pub(crate) fn new(cloud: &Cloud, labels: &[i32], limit_m: f64) -> Self {
        let mut cells: Voxels<[i32; PER_CELL]> = Voxels::default();
        let mut last = None;
        for (p, label) in cloud.points_m.iter().zip(labels).filter(|(_, label)| **label >= 0) {
            let Some(key) = key(p.map(f64::from), CELL_M.recip()) else { continue };
            if last.replace((key, *label)) == Some((key, *label)) {
                continue;
            }
            let known = cells.entry(key).or_insert([NONE; PER_CELL]);
            if !known.contains(label)
                && let Some(free) = known.iter_mut().find(|slot| **slot == NONE)
            {
                *free = *label;
            }
        }
        Self { cells, limit_m }
    }

    /// The plane of a point, or -1.
    pub(crate) fn label(&self, planes: &[Plane], point_m: [f32; 3]) -> i32 {
        let p = point_m.map(f64::from);
        if let Some((_, label)) = self.nearest(planes, p, p) {
            return label;
        }
        let steps = [-CELL_M, 0.0, CELL_M];
        let mut best: Option<(f64, i32)> = None;
        for (x, y, z) in steps.iter().flat_map(|x| steps.iter().flat_map(move |y| steps.map(|z| (x, y, z)))) {
            let found = self.nearest(planes, [p[0] + x, p[1] + y, p[2] + z], p);
            best = match (best, found) {
                (Some(best), Some(found)) if found >= best => Some(best),
                (best, found) => found.or(best),
            };
        }
        best.map_or(NONE, |(_, label)| label)
    }

    /// The nearest plane of a cell and its distance; of two as near the one with the smaller index.
    fn nearest(&self, planes: &[Plane], at: [f64; 3], p: [f64; 3]) -> Option<(f64, i32)> {
        let known = self.cells.get(&key(at, CELL_M.recip())?)?;
        let off = |label: &i32| {
            let plane = planes.get(usize::try_from(*label).ok()?)?;
            let off_m = plane.distance_m(p).abs();
            (off_m <= self.limit_m).then_some((off_m, *label))
        };
        known.iter().filter_map(off).min_by(|a, b| a.0.total_cmp(&b.0).then(a.1.cmp(&b.1)))
    }

    /// Gives planes other numbers.
    pub(super) fn rename(&mut self, new_label: &[i32]) {
        let rename = |label: &mut i32| {
            *label = usize::try_from(*label).ok().and_then(|old| new_label.get(old)).map_or(NONE, |new| *new);
        };
        self.cells.values_mut().flatten().for_each(rename);
    }
}

#[cfg(test)]
mod tests {
    use super::PlanesNear;
    use crate::model::{Cloud, Plane};

    #[test]
    fn a_point_is_on_the_nearest_plane_round_it_or_on_none() {
        let plane = |normal, offset_m| Plane { normal, offset_m, points: 3, rms_m: 0.0 };
        let planes = [plane([0.0, 0.0, 1.0], 0.0), plane([1.0, 0.0, 0.0], 0.0)];
        let points_m = vec![[0.1, 0.1, 0.0], [0.5, 0.1, 0.0], [0.0, 0.1, 0.5]];
        let cloud = Cloud { points_m, ..Cloud::default() };
        let mut near = PlanesNear::new(&cloud, &[0, 0, 1], 0.05);
        let labels = |near: &PlanesNear| {
            [[0.1, 0.1, 0.03], [0.01, 0.1, 0.4], [0.5, 0.1, -0.03], [0.5, 0.1, 0.1], [9.0, 0.0, 0.0]]
                .map(|p| near.label(&planes, p))
        };
        assert_eq!(labels(&near), [0, 1, 0, -1, -1]);
        near.rename(&[1, 0]);
        let turned = [planes[1], planes[0]];
        assert_eq!(near.label(&turned, [0.1, 0.1, 0.03]), 1);
    }
}
