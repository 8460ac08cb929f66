//! What the end points of a scan find on the map, summed up for many places of the scan at once: shifts by
//! whole cells, all alike in heading.
//!
//! Units: cells, unless a name says otherwise.

use crate::map::LocalMap;
use crate::map::grid::TILE;
use crate::registration::search::likelihood;

/// Width of the likelihood about a surface, meters: the lattice step. Less, and the right place falls between
/// two steps; more, and places look alike. Starts found 95.6 % halved, 96.0 % doubled.
pub(super) const BLUR_M: f64 = 0.1;
/// What an end point in free space costs, in end points on a surface. Larger: moved things and people mislead
/// more; smaller: walls beyond reach of the right place do not count against a wrong one. Starts found 95.4 %
/// halved, 95.6 % doubled.
pub(super) const FREE_SPACE_COST: f32 = 0.3;

/// Where in the likelihoods that of the unknown stands.
const UNKNOWN: usize = 256;

/// Sums of likelihoods of end points, one a shift, row by row.
#[derive(Clone, Debug)]
pub(super) struct ShiftSums {
    /// Likelihood of an end point by the squared distance of the nearest surface, then without one: in the
    /// unknown and in free space.
    likelihood: [f32; UNKNOWN + 2],
    /// From one shift to the next.
    step: i32,
    /// Steps to either side.
    reach: i32,
    sums: Vec<f32>,
}

impl ShiftSums {
    /// Memory for up to so many steps to either side, over a map with cells of this size.
    pub(super) fn new(max_reach: usize, step: i32, cell_m: f64) -> Self {
        let likelihood = std::array::from_fn(|index| match index {
            ..UNKNOWN => likelihood(index as f64 * cell_m * cell_m, BLUR_M) as f32,
            UNKNOWN => 0.0,
            _ => -FREE_SPACE_COST,
        });
        Self { likelihood, step, reach: 0, sums: Vec::with_capacity((2 * max_reach + 1).pow(2)) }
    }

    /// Begins anew, for shifts of up to so many steps to either side.
    #[inline(always)]
    pub(super) fn clear(&mut self, reach: i32) {
        self.reach = reach;
        self.sums.clear();
        self.sums.resize(self.side() * self.side(), 0.0);
    }

    /// The sums, from the lowest row up, each from left to right.
    pub(super) fn as_slice(&self) -> &[f32] {
        &self.sums
    }

    /// The largest sum.
    #[inline(always)]
    pub(super) fn best(&self) -> f32 {
        self.sums.iter().fold(f32::NEG_INFINITY, |best, sum| if *sum > best { *sum } else { best })
    }

    /// Adds what an end point finds that lies in this cell when it is not shifted.
    #[inline(always)]
    pub(super) fn add(&mut self, map: &LocalMap, [x, y]: [i32; 2]) {
        let (side, reach) = (self.side(), self.reach * self.step);
        for (sums, row) in self.sums.chunks_exact_mut(side).zip(0..) {
            let first = [x.wrapping_sub(reach), y.wrapping_add(row * self.step - reach)];
            add_row(map, first, self.step, &self.likelihood, sums);
        }
    }

    #[inline(always)]
    fn side(&self) -> usize {
        (2 * self.reach + 1) as usize
    }
}

/// Adds what an end point finds in the cells of a row, so many apart, to the sums of their shifts. Such a row
/// lies in one tile or in a few: each is looked for once.
#[inline(always)]
fn add_row(
    map: &LocalMap,
    [mut x, y]: [i32; 2],
    step: i32,
    likelihood: &[f32; UNKNOWN + 2],
    mut sums: &mut [f32],
) {
    while !sums.is_empty() {
        let column = x & (TILE - 1);
        // One place alone needs no division.
        let inside = if sums.len() == 1 { 1 } else { ((TILE - 1 - column) / step) as usize + 1 };
        let (here, others) = sums.split_at_mut(inside.min(sums.len()));
        if let Some(row) = map.tile_row([x, y]) {
            for (sum, column) in here.iter_mut().zip((column..).step_by(step as usize)) {
                let (cell, seen_through) = row.look(column);
                // Without a branch: what an end point finds cannot be foreseen.
                let nothing = UNKNOWN + usize::from(seen_through);
                let index = if cell.surfel().is_some() { usize::from(cell.squared()) } else { nothing };
                *sum += likelihood[index];
            }
        }
        x = x.wrapping_add(here.len() as i32 * step);
        sums = others;
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::map::MapParams;
    use crate::scan::end_points::tests::seen;
    use biplane_geometry::Pose2;

    #[test]
    fn every_shift_has_what_an_end_point_finds_there_also_across_tiles_and_beyond_the_map() {
        let mut map = LocalMap::new(MapParams::default());
        map.learn(&Pose2::IDENTITY, &seen(90, |degree| 1.0 + 0.02 * f64::from(degree.abs())));
        let worth = |[x, y]: [i32; 2]| {
            let at_m = [(x as f32 + 0.5) * 0.05, (y as f32 + 0.5) * 0.05];
            match (map.nearest(at_m), map.seen_through(at_m)) {
                (Some(surfel), _) => {
                    let [dx, dy] = [x - i32::from(surfel.home[0]), y - i32::from(surfel.home[1])];
                    (-0.5 * 0.0025 * f64::from(dx * dx + dy * dy) / BLUR_M.powi(2)).exp() as f32
                }
                (None, true) => -FREE_SPACE_COST,
                (None, false) => 0.0,
            }
        };
        let mut sums = ShiftSums::new(10, 2, 0.05);
        for (reach, cells) in
            [(0, [[20, 0], [31, -1]]), (2, [[33, 1], [-1, 30]]), (10, [[5, 31], [16_390, -40]])]
        {
            sums.clear(reach);
            cells.iter().for_each(|cell| sums.add(&map, *cell));
            let shifts = (-reach..=reach).flat_map(|y| (-reach..=reach).map(move |x| [x, y]));
            let mut best = f32::NEG_INFINITY;
            for (sum, [x, y]) in sums.as_slice().iter().zip(shifts) {
                let expected: f32 = cells.iter().map(|cell| worth([cell[0] + 2 * x, cell[1] + 2 * y])).sum();
                assert!((sum - expected).abs() < 1e-5, "{reach} {x} {y}: {sum} {expected}");
                best = best.max(expected);
            }
            assert!((sums.best() - best).abs() < 1e-5 && best > 0.0, "{reach}: {best}");
        }
    }
}
