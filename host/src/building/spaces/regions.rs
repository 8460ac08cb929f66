//! Which cells belong together as a room, before its walls are straight.
//!
//! What is under a ceiling is indoors. The walls over furniture and doors part it, and so do the soffits of
//! doors; a piece then grows into the free floor beside it, as far ends of rooms have no ceiling that was
//! seen.

use super::evidence::{Evidence, Seen};
use super::faces::Face;
use super::levels::Overhead;
use super::raster::{CELL_M, Grid};
use biplane_geometry::{PortableMath, UnionFind};

/// Necks narrower than twice this part two rooms, meters: less than any passage for people.
const NECK_M: f64 = 0.22;
/// Smaller pieces are no rooms, square meters.
const MIN_PIECE_M2: f64 = 1.0;
/// How far a room goes on where only its floor is known, meters.
const REACH_M: f64 = 4.0;
/// Two pieces whose floors meet over more than this are one room, meters: wider than a door.
const MIN_CONTACT_M: f64 = 1.2;

/// Cells and the pieces that they belong to.
#[derive(Clone, Debug, Default, PartialEq)]
pub(crate) struct Regions {
    /// The piece of each cell.
    pub piece_of: Vec<Option<u32>>,
    /// Cells with a wall over furniture and doors.
    pub is_wall: Vec<bool>,
    /// Whether the robot was in each piece.
    pub entered: Vec<bool>,
}

/// Cells of the walls over furniture and doors.
fn wall_cells(grid: &Grid, faces: &[Face]) -> Vec<bool> {
    let mut is_wall = vec![false; grid.len()];
    for face in faces {
        for [from, to] in &face.upper_m {
            let steps = ((to - from) / (0.4 * CELL_M)).ceil().max(1.0) as usize;
            for step in 0..=steps {
                let place = face.point(from + (to - from) * step as f64 / steps as f64);
                if let Some(cell) = grid.cell(place) {
                    is_wall[cell] = true;
                }
            }
        }
    }
    is_wall
}

impl Regions {
    /// Of a drive.
    pub(crate) fn find(evidence: &Evidence<'_>, overhead: &Overhead, faces: &[Face]) -> Self {
        let grid = &evidence.area.grid;
        let is_wall = wall_cells(grid, faces);
        let is_closed: Vec<bool> =
            is_wall.iter().zip(&overhead.is_soffit).map(|(wall, soffit)| *wall || *soffit).collect();
        let indoors: Vec<bool> = overhead
            .ceiling_m
            .iter()
            .zip(&is_closed)
            .map(|(ceiling, is_closed)| ceiling.is_some() && !is_closed)
            .collect();
        let (mut piece_of, sizes) = grid.pieces(&grid.opened(&indoors, NECK_M));
        let min_cells = (MIN_PIECE_M2 / CELL_M / CELL_M) as usize;
        for piece in &mut piece_of {
            *piece = piece.filter(|piece| sizes[*piece as usize] >= min_cells);
        }
        grow(evidence, &indoors, &is_closed, &mut piece_of);
        unite(grid, &mut piece_of, sizes.len());
        let mut entered = vec![false; sizes.len()];
        for place in evidence.path_m {
            if let Some(piece) = grid.cell(*place).and_then(|cell| piece_of[cell]) {
                entered[piece as usize] = true;
            }
        }
        Self { piece_of, is_wall, entered }
    }
}

/// A step to a neighbor, and to one beyond a corner, in fifths of a cell: reach is about the same however a
/// building stands on the cells.
const STRAIGHT: u32 = 5;
const DIAGONAL: u32 = 7;

/// A cell that a piece comes to.
#[derive(Clone, Copy)]
struct Arrival {
    cell: usize,
    piece: u32,
    /// How far it is from the last ceiling, in fifths of a cell.
    away: u32,
}

/// Lets pieces grow: under ceilings as far as these go, over free floor only a little. The first one to come
/// to a cell has it.
fn grow(evidence: &Evidence<'_>, indoors: &[bool], is_closed: &[bool], piece_of: &mut [Option<u32>]) {
    let grid = &evidence.area.grid;
    let max_away = (REACH_M / CELL_M) as u32 * STRAIGHT;
    let is_open = |cell: usize| indoors[cell] || evidence.seen[cell] == Seen::Free && !is_closed[cell];
    // Who comes next, after one fifth of a cell more, after two, and so on, in a ring.
    let mut waves: [Vec<Arrival>; DIAGONAL as usize + 1] = Default::default();
    let known = piece_of.iter().enumerate();
    waves[0].extend(known.filter_map(|(cell, piece)| Some(Arrival { cell, piece: (*piece)?, away: 0 })));
    let mut wave = 0;
    let mut begins = true;
    while waves.iter().any(|wave| !wave.is_empty()) {
        for Arrival { cell, piece, away } in std::mem::take(&mut waves[wave]) {
            if !begins && piece_of[cell].is_some() {
                continue;
            }
            piece_of[cell] = Some(piece);
            let straight = grid.neighbors(cell).map(|next| (next, STRAIGHT));
            // Between two cells that are closed nobody passes.
            let diagonal = grid.diagonals(cell).filter(|(_, sides)| sides.iter().all(|side| is_open(*side)));
            for (next, cost) in straight.chain(diagonal.map(|(next, _)| (next, DIAGONAL))) {
                let away = if indoors[next] { 0 } else { away + cost };
                if piece_of[next].is_none() && is_open(next) && away <= max_away {
                    waves[(wave + cost as usize) % waves.len()].push(Arrival { cell: next, piece, away });
                }
            }
        }
        begins = false;
        wave = (wave + 1) % waves.len();
    }
}

/// Makes pieces one that meet over more than the width of a door.
fn unite(grid: &Grid, piece_of: &mut [Option<u32>], pieces: usize) {
    let mut contacts: Vec<([u32; 2], bool)> = Vec::new();
    for (cell, piece) in piece_of.iter().enumerate() {
        for next in grid.neighbors(cell).filter(|next| *next > cell) {
            if let (Some(a), Some(b)) = (*piece, piece_of[next])
                && a != b
            {
                contacts.push(([a.min(b), a.max(b)], next == cell + 1));
            }
        }
    }
    contacts.sort_unstable();
    let mut joined = UnionFind::new(pieces);
    for pair in contacts.chunk_by(|(a, _), (b, _)| a == b) {
        let beside = pair.iter().filter(|(_, is_beside)| *is_beside).count();
        // So long is a straight line with so many steps right and up.
        let length_m = (beside as f64).portable_hypot((pair.len() - beside) as f64) * CELL_M;
        let [a, b] = pair[0].0;
        if length_m > MIN_CONTACT_M {
            joined.join(a, b);
        }
    }
    for piece in piece_of.iter_mut().flatten() {
        *piece = joined.root(*piece);
    }
}
