//! The sparse system of one step: what beams say of knots and planes, and rows of any other kind.
//!
//! Of a knot's state the parts that a floor plan shows (x, y, heading) are one variable of the system,
//! those of tilt (z, roll, pitch) the next; a plane is one (two turns and an offset). Every sum is made in
//! the order of knots and planes, whatever the number of threads.

pub(crate) mod groups;
pub(crate) mod priors;
pub(crate) mod rows;

use crate::slam::pose_graph::solver::{Block, Slot, Structure, System};
use crate::slam::refinement::spatial::knots::{Attitude, State};
use crate::slam::refinement::spatial::normal_equations::groups::Group;
use crate::slam::refinement::spatial::normal_equations::rows::{Part, Rows};
use rayon::prelude::*;

/// The kernel of a point on its plane, in standard deviations.
pub(crate) const KERNEL: f64 = 2.5;

/// The share of a residual's weight that a robust kernel leaves (Geman and McClure).
pub(crate) fn robust(residual: f64, scale: f64) -> f64 {
    let by = 1.0 + (residual / scale).powi(2);
    1.0 / (by * by)
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
    /// By variable: 1 for each part that may move, 0 for others.
    free: Vec<[f64; 3]>,
    structure: Structure,
}

/// Pairs of the variables of a group's two knots.
const KNOT_PAIRS: [(usize, usize); 6] = [(1, 0), (2, 0), (2, 1), (3, 0), (3, 1), (3, 2)];

impl Assembly {
    /// Of variables that these groups and rows join.
    pub(crate) fn new(layout: Layout, is_line: &[bool], groups: &[Group], rows: &Rows) -> Self {
        let of_knots = (0..layout.knots).map(|knot| (layout.flat(knot), layout.tilt(knot)));
        let of_groups = groups.iter().flat_map(|group| {
            let five = variables(layout, group);
            (0..5).flat_map(move |i| (0..i).map(move |j| (five[i], five[j])))
        });
        let of_rows = rows.iter().flat_map(|(parts, ..)| {
            let before = parts.iter().enumerate().map(move |(i, (one, _))| (one, &parts[..i]));
            before.flat_map(|(one, before)| before.iter().map(move |(other, _)| (*one, *other)))
        });
        let structure = Structure::new(layout.count(), of_knots.chain(of_groups).chain(of_rows));
        let is_free = |variable: usize| layout.free(variable, is_line).map(|free| f64::from(u8::from(free)));
        Self { layout, free: (0..layout.count()).map(is_free).collect(), structure }
    }

    /// The filled system.
    fn system(&self, groups: &[Group], rows: &Rows) -> System<'_> {
        let mut system = System::new(&self.structure);
        // Groups of the same knots follow each other, and their blocks lie at the same places.
        let (mut last, mut slots) = (usize::MAX, [None; 6]);
        for group in groups {
            if !group.is_fixed && group.knot != last {
                let five = variables(self.layout, group);
                slots = KNOT_PAIRS.map(|(i, j)| system.slot(five[i], five[j]));
                last = group.knot;
            }
            self.add_group(&mut system, group, &slots);
        }
        let mut parts = Vec::new();
        for (of_row, residual, weight) in rows.iter() {
            self.add_row(&mut system, of_row, residual, weight, &mut parts);
        }
        for (variable, free) in self.free.iter().enumerate() {
            // What may not move gets no step; what nothing holds gets a small one.
            let mut block = [0.0; 9];
            (0..3).for_each(|axis| block[4 * axis] = if free[axis] == 0.0 { 1.0 } else { 1e-3 });
            system.add(variable, &block, [0.0; 3]);
        }
        system
    }

    fn add_group(&self, system: &mut System<'_>, group: &Group, slots: &[Option<Slot>; 6]) {
        let five = variables(self.layout, group);
        let add_own = |system: &mut System<'_>, i: usize| {
            let free = &self.free[five[i]];
            let block = masked(&group.blocks[i * (i + 3) / 2], free, free);
            system.add(five[i], &block, times(group.right[i], *free));
        };
        if group.is_fixed {
            return add_own(system, 4);
        }
        (0..5).for_each(|i| add_own(system, i));
        let block = |i: usize, j: usize| {
            masked(&group.blocks[i * (i + 1) / 2 + j], &self.free[five[i]], &self.free[five[j]])
        };
        for ((i, j), slot) in KNOT_PAIRS.into_iter().zip(slots) {
            system.add_at(*slot, &block(i, j));
        }
        (0..4).for_each(|j| system.add_pair(five[4], five[j], &block(4, j)));
    }

    /// Adds a row; `parts` is memory for it.
    fn add_row(
        &self,
        system: &mut System<'_>,
        of_row: &[Part],
        residual: f64,
        weight: f64,
        parts: &mut Vec<Part>,
    ) {
        if of_row.iter().all(|(variable, _)| self.free[*variable] == [0.0; 3]) {
            return;
        }
        // A variable may stand in a row twice: its parts add up.
        parts.clear();
        for (variable, part) in of_row {
            let at = parts.binary_search_by_key(variable, |(known, _)| *known).unwrap_or_else(|at| {
                parts.insert(at, (*variable, [0.0; 3]));
                at
            });
            let part = times(*part, self.free[*variable]);
            (0..3).for_each(|axis| parts[at].1[axis] += part[axis]);
        }
        for (i, (one, a)) in parts.iter().enumerate() {
            for (other, b) in &parts[..=i] {
                let block = std::array::from_fn(|at| weight * a[at / 3] * b[at % 3]);
                if one == other {
                    system.add(*one, &block, a.map(|v| -weight * v * residual));
                } else {
                    system.add_pair(*one, *other, &block);
                }
            }
        }
    }

    /// Solves for the steps; `None` when the system tells nothing.
    pub(crate) fn solve(&self, groups: &[Group], rows: &Rows) -> Option<Steps> {
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
        rows: &Rows,
        knots: &[usize],
    ) -> Option<Vec<[[f64; 6]; 6]>> {
        let factor = self.system(groups, rows).factor().ok()?;
        let of_knot = |&knot: &usize| {
            let shared = factor.inverse_of([2 * knot, 2 * knot + 1]);
            let number = |(half, axis): (usize, usize)| 3 * half + axis;
            PLACES.map(|column| PLACES.map(|row| shared[number(column)][number(row)]))
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

fn times(a: [f64; 3], b: [f64; 3]) -> [f64; 3] {
    std::array::from_fn(|axis| a[axis] * b[axis])
}

fn masked(block: &Block, rows: &[f64; 3], columns: &[f64; 3]) -> Block {
    if [rows, columns] == [&[1.0; 3]; 2] {
        return *block;
    }
    std::array::from_fn(|at| block[at] * rows[at / 3] * columns[at % 3])
}
