//! Which cells of the plan are which room: each as most of it was seen, with borders where walls are.

use super::arrangement::{Border, Cell, length_m};
use super::faces::Face;
use super::raster::{CELL_M, Grid};
use super::regions::Regions;
use biplane_geometry::vec2::dot;

/// What a meter of border between two rooms without a wall on it costs, square meters of floor.
const BORDER_COST_M: f64 = 0.15;
/// What a cell costs that no one saw, as part of a room: less than one that was seen to be elsewhere.
const UNSEEN_COST: f64 = 0.6;
/// What a cell under a wall or soffit costs as part of a room: it is the wall's.
const WALL_COST: f64 = 0.25;
/// Passes over all cells; it ends earlier when nothing changes.
const MAX_PASSES: usize = 50;

/// Faces this close to a border are on it, meters: noise of walls that were seen in pieces.
const BESIDE_M: f64 = 0.06;
/// Cosine between normals of faces of one direction.
const SAME_DIRECTION: f64 = 0.999;

/// The label of what is no room.
pub(crate) const OUTSIDE: usize = 0;

/// The floor and what is known of it.
#[derive(Clone, Copy)]
pub(crate) struct Ground<'a> {
    /// Its cells.
    pub grid: &'a Grid,
    /// What belongs together.
    pub regions: &'a Regions,
    /// What lies under soffits.
    pub is_soffit: &'a [bool],
}

/// A neighbor of a cell.
#[derive(Clone, Copy)]
struct Near {
    cell: usize,
    /// Length of the common border on which no wall was seen from the own side, and from the neighbor's.
    open_m: [f64; 2],
}

impl Near {
    /// What of the border is open between these labels: a room wants wall that was seen from inside.
    fn open_between_m(&self, own: usize, other: usize) -> f64 {
        match (own == other, own == OUTSIDE, other == OUTSIDE) {
            (true, ..) => 0.0,
            (false, true, _) => self.open_m[1],
            (false, _, true) => self.open_m[0],
            _ => self.open_m[0].max(self.open_m[1]),
        }
    }
}

/// What one cell costs under each label, square meters.
struct Costs {
    /// Area of each region in the cell, by label.
    seen_m2: Vec<(usize, f64)>,
    wall_m2: f64,
    unseen_m2: f64,
}

impl Costs {
    fn of(&self, label: usize) -> f64 {
        let elsewhere: f64 = self.seen_m2.iter().filter(|(of, _)| *of != label).map(|(_, m2)| m2).sum();
        if label == OUTSIDE {
            return elsewhere;
        }
        elsewhere + UNSEEN_COST * self.unseen_m2 + WALL_COST * self.wall_m2
    }
}

/// The label of each cell: 0 is outside, n + 1 is piece n.
pub(crate) fn assign(ground: &Ground<'_>, faces: &[Face], cells: &[Cell], borders: &[Border]) -> Vec<usize> {
    let costs: Vec<Costs> = cells.iter().map(|cell| costs(ground, cell)).collect();
    let mut near: Vec<Vec<Near>> = vec![Vec::new(); cells.len()];
    for border in borders {
        let open_m = open_lengths_m(ground, faces, border);
        let [a, b] = border.cells;
        near[a].push(Near { cell: b, open_m: [open_m[0], open_m[1]] });
        near[b].push(Near { cell: a, open_m: [open_m[1], open_m[0]] });
    }
    let mut labels: Vec<usize> = costs.iter().map(|costs| best(costs, &[], &[])).collect();
    for _ in 0..MAX_PASSES {
        let mut has_changed = false;
        for cell in 0..cells.len() {
            let label = best(&costs[cell], &near[cell], &labels);
            has_changed |= label != labels[cell];
            labels[cell] = label;
        }
        if !has_changed {
            break;
        }
    }
    labels
}

/// The cheapest label of a cell between its neighbors; the smallest of those that cost the same.
fn best(costs: &Costs, near: &[Near], labels: &[usize]) -> usize {
    let seen = costs.seen_m2.iter().map(|(label, _)| *label);
    let around = near.iter().map(|other| labels[other.cell]);
    let mut choices: Vec<usize> = seen.chain(around).chain([OUTSIDE]).collect();
    choices.sort_unstable();
    choices.dedup();
    let cost = |label: &usize| {
        let open_m: f64 = near.iter().map(|other| other.open_between_m(*label, labels[other.cell])).sum();
        costs.of(*label) + BORDER_COST_M * open_m
    };
    let found = choices.into_iter().map(|label| (cost(&label), label)).min_by(|a, b| a.0.total_cmp(&b.0));
    found.map_or(OUTSIDE, |(_, label)| label)
}

fn costs(ground: &Ground<'_>, cell: &Cell) -> Costs {
    let Ground { grid, regions, is_soffit } = *ground;
    let mut seen_m2: Vec<(usize, f64)> = Vec::new();
    let (mut wall_m2, mut unseen_m2) = (0.0, 0.0);
    let area_m2 = CELL_M * CELL_M;
    grid.fill(&std::iter::once(&cell.corners_m[..]), |at| match regions.piece_of[at] {
        Some(piece) => {
            let label = piece as usize + 1;
            match seen_m2.iter_mut().find(|(of, _)| *of == label) {
                Some((_, m2)) => *m2 += area_m2,
                None => seen_m2.push((label, area_m2)),
            }
        }
        None if regions.is_wall[at] || is_soffit[at] => wall_m2 += area_m2,
        None => unseen_m2 += area_m2,
    });
    seen_m2.sort_unstable_by_key(|(label, _)| *label);
    Costs { seen_m2, wall_m2, unseen_m2 }
}

/// Length of a border on which no wall was seen from the side of its first cell, and from that of its
/// second, meters.
fn open_lengths_m(ground: &Ground<'_>, faces: &[Face], border: &Border) -> [f64; 2] {
    let length = length_m(border.ends_m);
    let line = &faces[border.line];
    let [a, b] = border.ends_m;
    let places = |steps: usize| {
        (0..steps).map(move |step| {
            let share = (step as f64 + 0.5) / steps as f64;
            [0, 1].map(|axis| a[axis] + share * (b[axis] - a[axis]))
        })
    };
    let steps = (length / CELL_M).ceil().max(1.0) as usize;
    [1.0, -1.0].map(|side| {
        let on_it = faces.iter().filter(|face| {
            dot(face.normal, line.normal) * side > SAME_DIRECTION
                && face.before_m(a).abs() <= BESIDE_M
                && face.before_m(b).abs() <= BESIDE_M
        });
        let on_it: Vec<&Face> = on_it.collect();
        let is_open = |place: &[f64; 2]| {
            let is_wall = on_it.iter().any(|face| {
                let at = dot(face.along(), *place);
                face.upper_m.iter().any(|span| span[0] - CELL_M <= at && at <= span[1] + CELL_M)
            });
            !is_wall && !is_under_soffit(ground, *place)
        };
        length * places(steps).filter(is_open).count() as f64 / steps as f64
    })
}

/// Whether there is a soffit over a place or right beside it.
fn is_under_soffit(ground: &Ground<'_>, place: [f64; 2]) -> bool {
    let around = [[0.0, 0.0], [CELL_M, 0.0], [-CELL_M, 0.0], [0.0, CELL_M], [0.0, -CELL_M]];
    around.iter().any(|step| {
        let cell = ground.grid.cell([place[0] + step[0], place[1] + step[1]]);
        cell.is_some_and(|cell| ground.is_soffit[cell])
    })
}

/// Whether there is wall in a place's cell or beside it.
pub(crate) fn has_wall(grid: &Grid, regions: &Regions, is_soffit: &[bool], place: [f64; 2]) -> bool {
    let around = [[0.0, 0.0], [CELL_M, 0.0], [-CELL_M, 0.0], [0.0, CELL_M], [0.0, -CELL_M]];
    around.iter().any(|step| {
        let cell = grid.cell([place[0] + step[0], place[1] + step[1]]);
        cell.is_some_and(|cell| regions.is_wall[cell] || is_soffit[cell])
    })
}
