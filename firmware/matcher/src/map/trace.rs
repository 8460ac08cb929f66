//! The blocks that beams pass through, of many beams at a time.
//!
//! Frame: map. Units: meters. Each beam steps from block to block (Amanatides and Woo 1987). Where it goes
//! does not depend on what is mapped, so that many beams step side by side in lanes.

use crate::map::block_key::BlockKey;
use crate::map::grid::BLOCK;

/// Beams at a time.
pub(crate) const BEAMS: usize = 4;

/// Beams from one place, a column a quantity.
#[derive(Copy, Clone, Debug, Default)]
pub(crate) struct Beams {
    /// Unit vectors.
    pub direction: [[f32; BEAMS]; 2],
    /// As far as it is sure that nothing stood in the way, meters.
    pub clear_m: [f32; BEAMS],
    /// Beams in use.
    pub len: usize,
}

/// The blocks of some beams, in the order in which each meets them.
#[derive(Clone, Debug, Default)]
pub(crate) struct Trace {
    /// One step of all beams after the other.
    keys: Vec<[u32; BEAMS]>,
    steps: [usize; BEAMS],
}

impl Trace {
    /// With all the memory it will ever have: a beam crosses the directory once at the most.
    pub(crate) fn with_memory() -> Self {
        Self { keys: vec![[0; BEAMS]; BlockKey::MAX_ON_A_LINE], steps: [0; BEAMS] }
    }

    /// The blocks that a beam passes through.
    #[inline(always)]
    pub(crate) fn of(&self, beam: usize) -> impl Iterator<Item = BlockKey> {
        self.keys[..self.steps[beam]].iter().map(move |keys| BlockKey(keys[beam]))
    }

    /// Follows beams from a place.
    #[inline(never)] // as wide as every processor has lanes
    pub(crate) fn follow(&mut self, beams: &Beams, from_m: [f32; 2], cell_m: f32) {
        let block_m = cell_m * BLOCK as f32;
        let [x, y] = [0, 1].map(|axis| Axis::new(&beams.direction[axis], from_m[axis], block_m));
        let ([mut column, mut row], [mut next_x, mut next_y]) = ([x.block, y.block], [x.next_m, y.next_m]);
        let mut goes_on: [u32; BEAMS] =
            std::array::from_fn(|lane| u32::from(lane < beams.len).wrapping_neg());
        let mut steps = [0_u32; BEAMS];
        for keys in &mut self.keys {
            let mut across_x = [0_u32; BEAMS];
            for lane in 0..BEAMS {
                keys[lane] = BlockKey::new([column[lane], row[lane]]).0;
                steps[lane] = steps[lane].wrapping_sub(goes_on[lane]);
                across_x[lane] = u32::from(next_x[lane] <= next_y[lane]).wrapping_neg();
                let goes_on_x = u32::from(next_x[lane] < beams.clear_m[lane]).wrapping_neg();
                let goes_on_y = u32::from(next_y[lane] < beams.clear_m[lane]).wrapping_neg();
                goes_on[lane] &= goes_on_x | goes_on_y;
            }
            if goes_on == [0; BEAMS] {
                break;
            }
            // Both axes, without a branch: which one is next cannot be foreseen.
            for lane in 0..BEAMS {
                column[lane] += x.step[lane] & across_x[lane] as i32;
                row[lane] += y.step[lane] & !across_x[lane] as i32;
                next_x[lane] += f32::from_bits(x.per_block_m[lane].to_bits() & across_x[lane]);
                next_y[lane] += f32::from_bits(y.per_block_m[lane].to_bits() & !across_x[lane]);
            }
        }
        self.steps = steps.map(|steps| steps as usize);
    }
}

/// How beams go along one axis.
struct Axis {
    block: [i32; BEAMS],
    step: [i32; BEAMS],
    /// Way to the next border, and from border to border, meters.
    next_m: [f32; BEAMS],
    per_block_m: [f32; BEAMS],
}

impl Axis {
    #[inline(always)]
    fn new(direction: &[f32; BEAMS], from_m: f32, block_m: f32) -> Self {
        let block = (from_m / block_m).floor() as i32;
        let mut axis = Self {
            block: [block; BEAMS],
            step: [0; BEAMS],
            next_m: [f32::INFINITY; BEAMS],
            per_block_m: [f32::INFINITY; BEAMS],
        };
        for (lane, &direction) in direction.iter().enumerate() {
            let border = if direction > 0.0 { (block + 1) as f32 } else { block as f32 } * block_m;
            let is_along = direction != 0.0;
            axis.step[lane] = i32::from(direction > 0.0) - i32::from(direction < 0.0);
            axis.next_m[lane] = if is_along { (border - from_m) / direction } else { f32::INFINITY };
            axis.per_block_m[lane] = if is_along { block_m / direction.abs() } else { f32::INFINITY };
        }
        axis
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// The same blocks, of one beam alone.
    fn walk(direction: [f32; 2], clear_m: f32, from_m: [f32; 2], block_m: f32) -> Vec<[i32; 2]> {
        let mut block = from_m.map(|meters| (meters / block_m).floor() as i32);
        let (mut step, mut next_m, mut per_block_m) = ([0; 2], [f32::INFINITY; 2], [f32::INFINITY; 2]);
        for axis in 0..2 {
            if direction[axis] != 0.0 {
                step[axis] = if direction[axis] > 0.0 { 1 } else { -1 };
                let border = (block[axis] + i32::from(direction[axis] > 0.0)) as f32 * block_m;
                next_m[axis] = (border - from_m[axis]) / direction[axis];
                per_block_m[axis] = block_m / direction[axis].abs();
            }
        }
        let mut blocks = vec![block];
        loop {
            let axis = usize::from(next_m[0] > next_m[1]);
            if next_m[axis] >= clear_m {
                return blocks;
            }
            block[axis] += step[axis];
            next_m[axis] += per_block_m[axis];
            blocks.push(block);
        }
    }

    #[test]
    fn beams_side_by_side_pass_through_the_blocks_of_each() {
        let (mut trace, cell_m) = (Trace::with_memory(), 0.05);
        for from_m in [[0.0, 0.0], [3.21, -7.77], [-0.4, 0.2]] {
            for first in 0..40 {
                let mut beams = Beams { len: if first == 7 { 3 } else { BEAMS }, ..Beams::default() };
                for lane in 0..BEAMS {
                    let number = first * BEAMS + lane;
                    let (sin, cos) = (number as f32 * 0.0393).sin_cos();
                    let direction = if number == 5 { [0.0, -1.0] } else { [cos, sin] };
                    [beams.direction[0][lane], beams.direction[1][lane]] = direction;
                    beams.clear_m[lane] = (number * 37 % 101) as f32 * 0.3 + 0.01;
                }
                trace.follow(&beams, from_m, cell_m);
                for lane in 0..beams.len {
                    let direction = [beams.direction[0][lane], beams.direction[1][lane]];
                    let expected = walk(direction, beams.clear_m[lane], from_m, cell_m * BLOCK as f32);
                    assert!(trace.of(lane).map(BlockKey::block).eq(expected), "{first} {lane}");
                }
            }
        }
    }
}
