//! Planes within clutter: slices through foliage that are flat by chance.
//!
//! A surface has nothing right behind it, and mostly nothing right in front. A slice through a tree has the
//! rest of the tree on both sides. Meters.

use crate::reconstruct::planes::fit::noise::{DEVIATIONS, Noise};
use crate::reconstruct::planes::fit::scatter::Fit;
use crate::reconstruct::planes::labels::refine::Labeling;

/// Planes of more points than this are not asked: clutter is not flat over so much.
const MAX_POINTS: f64 = 1000.0;
/// A plane is in clutter when on each of its sides there are at least this many points on no plane for each
/// of its own.
const SHARE: f64 = 0.05;
/// How far off such points lie at most, deviations; at least as far as those that the plane may have itself.
const FURTHEST_DEVIATIONS: f64 = 8.0;

/// Which planes are in clutter.
pub(crate) fn find(labeling: &Labeling<'_>, fits: &[Option<Fit>], noise: Noise) -> Vec<bool> {
    let asked = |label: i32| {
        let fit = fits.get(usize::try_from(label).ok()?)?.as_ref()?;
        (fit.count <= MAX_POINTS).then_some(*fit)
    };
    let counts = labeling.free_beside(fits.len(), |label, p| {
        let fit = asked(label)?;
        let off = fit.distance_m(p) / noise.variance_of(&fit).sqrt();
        (off.abs() > DEVIATIONS && off.abs() <= FURTHEST_DEVIATIONS).then_some(off > 0.0)
    });
    let both = |(fit, sides): (&Option<Fit>, [u32; 2])| {
        fit.is_some_and(|fit| {
            f64::from(sides[0].min(sides[1])) >= SHARE * fit.count && fit.count <= MAX_POINTS
        })
    };
    fits.iter().zip(counts).map(both).collect()
}

#[cfg(test)]
mod tests {
    use super::find;
    use crate::reconstruct::planes::fit::noise::Noise;
    use crate::reconstruct::planes::labels::refine::{Labeling, refit};
    use crate::reconstruct::planes::paper::random::Random;
    use crate::reconstruct::planes::search::grid::Grid;

    /// A slice of 300 points at a height, labeled, and free points beside it: 30 above and so many below.
    fn slice(random: &mut Random, (label, z_m): (i32, f64), below: usize, out: &mut Vec<([f32; 3], i32)>) {
        let mut add = |off_m: f64, label: i32, random: &mut Random| {
            out.push(([random.unit(), random.unit(), z_m + off_m].map(|v| v as f32), label));
        };
        for _ in 0..300 {
            let off_m = 0.02 * random.normal();
            add(off_m, label, random);
        }
        for k in 0..30 + below {
            let off_m = 0.08 + 0.05 * random.unit();
            add(if k < 30 { off_m } else { -off_m }, -1, random);
        }
    }

    #[test]
    fn a_slice_with_points_on_both_sides_is_clutter_and_a_shelf_with_things_on_it_is_none() {
        let mut random = Random::new(8);
        let mut all = Vec::new();
        slice(&mut random, (0, 1.0), 30, &mut all);
        slice(&mut random, (1, 3.0), 0, &mut all);
        let (points_m, labels): (Vec<[f32; 3]>, Vec<i32>) = all.into_iter().unzip();
        let grid = Grid::new(&points_m, 0.1);
        let (neighbors, noise) = (grid.neighbors(), Noise::new(0.02));
        let labeling = Labeling::new(&points_m, (&grid, &neighbors), noise, (&labels, 2));
        let fits = refit(labeling.sums(), &[None, None]);
        assert_eq!(find(&labeling, &fits, noise), [true, false]);
    }
}
