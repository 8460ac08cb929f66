//! How far the neighbors of end points reach, for many end points at a time.
//!
//! Units: meters. A step away all of some end points are compared with their neighbors in lanes; that ends
//! when the last of them has met one out of reach.

/// Neighbors that are looked at on either side.
const NEIGHBORS: usize = 32;
/// End points at a time.
pub(super) const LANES: usize = 8;
/// Empty places before and after the end points.
const PAD: usize = NEIGHBORS + LANES;

/// Places of end points in the order of their beams; those of which nothing is to be made are no numbers.
#[derive(Clone, Debug)]
pub(super) struct Neighbors {
    x_m: Vec<f32>,
    y_m: Vec<f32>,
    len: usize,
}

impl Neighbors {
    /// Memory for so many end points.
    pub(super) fn with_capacity(points: usize) -> Self {
        let room = points.next_multiple_of(LANES) + 2 * PAD;
        Self { x_m: Vec::with_capacity(room), y_m: Vec::with_capacity(room), len: 0 }
    }

    /// Takes over the places of end points, `None` for one of which nothing is to be made.
    #[inline(always)]
    pub(super) fn fill(&mut self, places: impl ExactSizeIterator<Item = Option<[f32; 2]>>) {
        const NOWHERE: [f32; 2] = [f32::NAN; 2];
        self.len = places.len();
        for axis in [&mut self.x_m, &mut self.y_m] {
            axis.clear();
            axis.resize(PAD, f32::NAN);
        }
        for [x, y] in places.map(|place| place.unwrap_or(NOWHERE)) {
            self.x_m.push(x);
            self.y_m.push(y);
        }
        for axis in [&mut self.x_m, &mut self.y_m] {
            axis.resize(self.len.next_multiple_of(LANES) + 2 * PAD, f32::NAN);
        }
    }

    /// How many places away the last neighbor is that is needed, the first one out of reach included: before
    /// and after each of [`LANES`] end points from `first` on.
    #[inline(always)]
    pub(super) fn reaches(&self, first: usize, reach_m: f32) -> [[usize; LANES]; 2] {
        let some = |axis: &[f32], from: usize| -> [f32; LANES] {
            axis[from..].first_chunk().copied().unwrap_or([f32::NAN; LANES])
        };
        let at = PAD + first;
        let ([x, y], squared) = ([some(&self.x_m, at), some(&self.y_m, at)], reach_m * reach_m);
        let (mut reaches, mut goes_on) = ([[0_u32; LANES]; 2], [[u32::MAX; LANES]; 2]);
        let max = (first + LANES - 1).max(self.len - first).min(NEIGHBORS);
        // Both sides at once: what has no neighbor left is compared with no numbers.
        for away in 1..=max {
            let mut any = 0;
            for (side, from) in [at - away, at + away].into_iter().enumerate() {
                let [other_x, other_y] = [some(&self.x_m, from), some(&self.y_m, from)];
                let (reaches, goes_on) = (&mut reaches[side], &mut goes_on[side]);
                for lane in 0..LANES {
                    let (dx, dy) = (other_x[lane] - x[lane], other_y[lane] - y[lane]);
                    let away_squared = dx * dx + dy * dy;
                    let is_far = u32::from(away_squared > squared).wrapping_neg();
                    let is_near = u32::from(away_squared <= squared).wrapping_neg();
                    let counts = goes_on[lane] & (is_far | is_near);
                    reaches[lane] = (reaches[lane] & !counts) | (away as u32 & counts);
                    goes_on[lane] &= !is_far;
                    any |= goes_on[lane];
                }
            }
            if any == 0 {
                break;
            }
        }
        reaches.map(|reaches| reaches.map(|reach| reach as usize))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// The same, neighbor by neighbor.
    fn reach<'a>(here: [f32; 2], others: impl Iterator<Item = &'a Option<[f32; 2]>>, reach_m: f32) -> usize {
        let mut last = 0;
        for (before, other) in others.take(NEIGHBORS).enumerate() {
            let Some([x, y]) = other else { continue };
            last = before + 1;
            if (x - here[0]).powi(2) + (y - here[1]).powi(2) > reach_m * reach_m {
                break;
            }
        }
        last
    }

    #[test]
    fn many_reaches_at_a_time_are_those_one_by_one() {
        // Along a wall that comes closer, with jumps, and gaps of which nothing is to be made.
        for count in [0, 1, 2, 7, 8, 9, 75, 200] {
            let places: Vec<Option<[f32; 2]>> = (0..count)
                .map(|i| {
                    let noise = (i * 7919 % 1009) as f32 / 1009.0;
                    let jump = if i % 23 == 5 { 1.0 } else { 0.0 };
                    (i % 6 != 3).then_some([i as f32 * 0.06 * (i as f32 / 100.0), noise * 0.02 + jump])
                })
                .collect();
            let mut neighbors = Neighbors::with_capacity(200);
            neighbors.fill(places.iter().copied());
            for first in (0..count).step_by(LANES) {
                let [before, after] = neighbors.reaches(first, 0.2);
                for index in first..count.min(first + LANES) {
                    let Some(here) = places[index] else { continue };
                    let (left, right) = (places[..index].iter().rev(), places[index + 1..].iter());
                    let expected = [reach(here, left, 0.2), reach(here, right, 0.2)];
                    assert_eq!([before[index - first], after[index - first]], expected, "{count} {index}");
                }
            }
        }
    }
}
