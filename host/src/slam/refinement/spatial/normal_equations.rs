//! The sparse system of one step: what beams say of knots and planes, and rows of any other kind.
//!
//! Of a knot's state the parts that a floor plan shows (x, y, heading) are one variable of the system,
//! those of tilt (z, roll, pitch) the next; a plane is one (two turns and an offset). Every sum is made in
//! the order of knots and planes, whatever the number of threads.

use std::collections::BTreeMap;

use crate::slam::pose_graph::solver::{Block, Structure, System};
use crate::slam::refinement::spatial::knots::{Attitude, State};
use rayon::prelude::*;

/// A linearized residual over some variables, scaled by `weight` = 1 / variance.
#[derive(Clone, Debug)]
pub(crate) struct Row {
    pub parts: Vec<(usize, [f64; 3])>,
    pub residual: f64,
    pub weight: f64,
}

/// The share of a residual's weight that a robust kernel leaves (Geman and McClure).
pub(crate) fn robust(residual: f64, scale: f64) -> f64 {
    let by = 1.0 + (residual / scale).powi(2);
    1.0 / (by * by)
}

/// What all beams between two knots say of one plane: blocks of (knot, tilt, next knot, its tilt, plane),
/// lower triangle row by row, and the right hand side.
#[derive(Clone, Debug)]
pub(crate) struct Group {
    pub knot: usize,
    pub plane: usize,
    blocks: [Block; 15],
    right: [[f64; 3]; 5],
    /// Sums of weights, and of weighted residuals.
    weight: f64,
    weighted: f64,
}

impl Group {
    /// Nothing yet.
    pub(crate) fn new(knot: usize, plane: usize) -> Self {
        Self { knot, plane, blocks: [[0.0; 9]; 15], right: [[0.0; 3]; 5], weight: 0.0, weighted: 0.0 }
    }

    /// Adds a residual.
    pub(crate) fn add(&mut self, row: &[[f64; 3]; 5], residual: f64, weight: f64) {
        self.weight += weight;
        self.weighted += weight * residual;
        let mut at = 0;
        for i in 0..5 {
            let scaled = row[i].map(|v| v * weight);
            for other in &row[..=i] {
                let block = &mut self.blocks[at];
                for (r, scaled) in scaled.iter().enumerate() {
                    for (c, other) in other.iter().enumerate() {
                        block[3 * r + c] += scaled * other;
                    }
                }
                at += 1;
            }
            for (sum, scaled) in self.right[i].iter_mut().zip(scaled) {
                *sum -= scaled * residual;
            }
        }
    }
}

/// Planes are asked for the error that their beams share as if they were seen from so many knots at least: a
/// mean of few squares tells little.
const FEW_KNOTS: f64 = 4.0;

/// Beams that meet a plane from one place share an error where it is not quite what stands there: a curved
/// wall, frames. Their means tell how large: they are off by more than the beams' own noise. However many the
/// beams are, together they count as surely as that error leaves it.
pub(crate) fn let_share_errors(groups: &mut [Group], planes: usize) {
    let mut sums = vec![[0.0; 2]; planes];
    for group in groups.iter().filter(|group| group.weight > 0.0) {
        let mean = group.weighted / group.weight;
        let [squares, count] = &mut sums[group.plane];
        *squares += mean * mean - 1.0 / group.weight;
        *count += 1.0;
    }
    for group in groups {
        let [squares, count] = sums[group.plane];
        let shared = f64::max(squares / f64::max(count, FEW_KNOTS), 0.0);
        let by = 1.0 / (1.0 + shared * group.weight);
        group.blocks.iter_mut().flatten().for_each(|part| *part *= by);
        group.right.iter_mut().flatten().for_each(|part| *part *= by);
    }
}

/// The derivative of `normal . placed(state, at)` by a state, as (x, y, heading) and (z, roll, pitch).
pub(crate) fn by_state(attitude: &Attitude, turned: [f64; 3], normal: [f64; 3]) -> [[f64; 3]; 2] {
    let [roll, pitch, yaw] =
        attitude.derivatives(turned).map(|moved| biplane_geometry::vec3::dot(normal, moved));
    [[normal[0], normal[1], yaw], [normal[2], roll, pitch]]
}

/// Where variables are: two of each knot, then one of each plane.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Layout {
    pub knots: usize,
    pub planes: usize,
    /// Variables after those of planes.
    pub extras: usize,
    /// Knots before this one stay.
    pub first_free: usize,
}

impl Layout {
    /// (x, y, heading) of a knot.
    pub(crate) fn flat(self, knot: usize) -> usize {
        2 * knot
    }

    /// (z, roll, pitch) of a knot.
    pub(crate) fn tilt(self, knot: usize) -> usize {
        2 * knot + 1
    }

    /// A plane.
    pub(crate) fn plane(self, plane: usize) -> usize {
        2 * self.knots + plane
    }

    /// One that belongs to no knot and no plane: it is free.
    pub(crate) fn extra(self, extra: usize) -> usize {
        2 * self.knots + self.planes + extra
    }

    fn count(self) -> usize {
        2 * self.knots + self.planes + self.extras
    }

    /// Which parts of a variable may move.
    fn free(self, variable: usize, is_line: &[bool]) -> [bool; 3] {
        if variable >= 2 * self.knots {
            let is_line = is_line.get(variable - 2 * self.knots).copied().unwrap_or_default();
            return [true, !is_line, true];
        }
        [variable / 2 >= self.first_free; 3]
    }
}

/// The steps of a solved system.
#[derive(Clone, Debug)]
pub(crate) struct Steps {
    /// Of states.
    pub knots: Vec<State>,
    /// Of planes: two turns, an offset.
    pub planes: Vec<[f64; 3]>,
    pub extras: Vec<[f64; 3]>,
}

/// Places of a state's parts in the two variables of its knot.
const PLACES: [(usize, usize); 6] = [(0, 0), (0, 1), (1, 0), (1, 1), (1, 2), (0, 2)];

/// Puts a system together.
pub(crate) struct Assembly {
    layout: Layout,
    is_line: Vec<bool>,
    structure: Structure,
}

impl Assembly {
    /// Of variables that these groups and rows join.
    pub(crate) fn new(layout: Layout, is_line: Vec<bool>, groups: &[Group], rows: &[Row]) -> Self {
        let mut pairs: Vec<(usize, usize)> = Vec::new();
        for knot in 0..layout.knots {
            pairs.push((layout.flat(knot), layout.tilt(knot)));
        }
        for group in groups {
            let five = variables(layout, group);
            pairs.extend((0..5).flat_map(|i| (0..i).map(move |j| (five[i], five[j]))));
        }
        for row in rows {
            for (i, (one, _)) in row.parts.iter().enumerate() {
                pairs.extend(row.parts[..i].iter().map(|(other, _)| (*one, *other)));
            }
        }
        pairs.sort_unstable();
        pairs.dedup();
        let structure = Structure::new(layout.count(), pairs.into_iter());
        Self { layout, is_line, structure }
    }

    /// The filled system.
    fn system(&self, groups: &[Group], rows: &[Row]) -> System<'_> {
        let mut system = System::new(&self.structure);
        let free: Vec<[f64; 3]> = (0..self.layout.count())
            .map(|at| self.layout.free(at, &self.is_line).map(|free| f64::from(u8::from(free))))
            .collect();
        for group in groups {
            let five = variables(self.layout, group);
            let mut at = 0;
            for i in 0..5 {
                for j in 0..=i {
                    let block = masked(&group.blocks[at], &free[five[i]], &free[five[j]]);
                    at += 1;
                    if i == j {
                        let right = times(group.right[i], free[five[i]]);
                        system.add(five[i], &block, right);
                    } else {
                        system.add_pair(five[i], five[j], &block);
                    }
                }
            }
        }
        for row in rows {
            add_row(&mut system, row, &free);
        }
        for (variable, free) in free.iter().enumerate() {
            // What may not move gets no step; what nothing holds gets a small one.
            let mut block = [0.0; 9];
            (0..3).for_each(|axis| block[4 * axis] = if free[axis] == 0.0 { 1.0 } else { 1e-3 });
            system.add(variable, &block, [0.0; 3]);
        }
        system
    }

    /// Solves for the steps; `None` when the system tells nothing.
    pub(crate) fn solve(&self, groups: &[Group], rows: &[Row]) -> Option<Steps> {
        let found = self.system(groups, rows).solve().ok()?;
        let (of_knots, others) = found.split_at(2 * self.layout.knots);
        let (of_planes, extras) = others.split_at(self.layout.planes);
        let join = |pair: &[[f64; 3]]| {
            let ([x, y, yaw], [z, roll, pitch]) = (pair[0], pair[1]);
            [x, y, z, roll, pitch, yaw]
        };
        let is_finite = found.iter().flatten().all(|value| value.is_finite());
        is_finite.then(|| Steps {
            knots: of_knots.chunks(2).map(join).collect(),
            planes: of_planes.to_vec(),
            extras: extras.to_vec(),
        })
    }

    /// The covariance of the states of some knots: of (x, y, z, roll, pitch, heading).
    pub(crate) fn covariances(
        &self,
        groups: &[Group],
        rows: &[Row],
        knots: &[usize],
    ) -> Option<Vec<[[f64; 6]; 6]>> {
        let factor = self.system(groups, rows).factor().ok()?;
        let of_knot = |&knot: &usize| {
            let column = |part: usize| {
                let (half, axis) = PLACES[part];
                let mut right = vec![[0.0; 3]; self.layout.count()];
                right[2 * knot + half][axis] = 1.0;
                let solved = factor.solve(&right);
                PLACES.map(|(half, axis)| solved[2 * knot + half][axis])
            };
            std::array::from_fn(column)
        };
        Some(knots.par_iter().map(of_knot).collect())
    }
}

fn variables(layout: Layout, group: &Group) -> [usize; 5] {
    let knot = group.knot;
    [
        layout.flat(knot),
        layout.tilt(knot),
        layout.flat(knot + 1),
        layout.tilt(knot + 1),
        layout.plane(group.plane),
    ]
}

fn add_row(system: &mut System<'_>, row: &Row, free: &[[f64; 3]]) {
    // A variable may stand in a row twice: its parts add up.
    let mut parts: BTreeMap<usize, [f64; 3]> = BTreeMap::new();
    for (variable, part) in &row.parts {
        let sum = parts.entry(*variable).or_default();
        let part = times(*part, free[*variable]);
        (0..3).for_each(|axis| sum[axis] += part[axis]);
    }
    let parts: Vec<(usize, [f64; 3])> = parts.into_iter().collect();
    for (i, (one, a)) in parts.iter().enumerate() {
        for (other, b) in &parts[..=i] {
            let block = std::array::from_fn(|at| row.weight * a[at / 3] * b[at % 3]);
            if one == other {
                system.add(*one, &block, a.map(|v| -row.weight * v * row.residual));
            } else {
                system.add_pair(*one, *other, &block);
            }
        }
    }
}

fn times(a: [f64; 3], b: [f64; 3]) -> [f64; 3] {
    std::array::from_fn(|axis| a[axis] * b[axis])
}

fn masked(block: &Block, rows: &[f64; 3], columns: &[f64; 3]) -> Block {
    std::array::from_fn(|at| block[at] * rows[at / 3] * columns[at % 3])
}

#[cfg(test)]
mod tests {
    use super::{Group, let_share_errors};

    /// Seen from 40 knots, 50 beams each, with noise of 1 cm that the beams do not share and what they share.
    fn weights(shared_m: f64) -> Vec<f64> {
        let row = [[1.0, 0.0, 0.0]; 5];
        let mut groups: Vec<Group> = (0..40)
            .map(|knot| {
                let mut group = Group::new(knot, 0);
                for beam in 0..50 {
                    let noise_m = if beam % 2 == 0 { 0.01 } else { -0.01 };
                    let sign = if knot % 2 == 0 { 1.0 } else { -1.0 };
                    group.add(&row, noise_m + sign * shared_m, 1e4);
                }
                group
            })
            .collect();
        let_share_errors(&mut groups, 1);
        groups.iter().map(|group| group.blocks[0][0]).collect()
    }

    #[test]
    fn beams_that_share_an_error_count_as_surely_as_it_leaves_it() {
        assert!(weights(0.0).iter().all(|weight| (weight - 50.0 * 1e4).abs() < 1e-3), "{:?}", weights(0.0));
        // 2 cm shared by all that a place sees: no more is known than that.
        for weight in weights(0.02) {
            assert!((weight * 0.02 * 0.02 - 1.0).abs() < 0.02, "{weight}");
        }
    }
}
