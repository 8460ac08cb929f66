//! Which cells belong together as a room, before its walls are straight.
//!
//! What is under a ceiling is indoors. The walls over furniture and doors part it, and so do the soffits of
//! doors; a piece then grows into the free floor beside it, as far ends of rooms have no ceiling that was
//! seen.

use super::evidence::{Evidence, Seen};
use super::faces::Face;
use super::levels::Overhead;
use super::raster::{CELL_M, Grid};
use biplane_geometry::UnionFind;

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
        let grid = evidence.grid;
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

/// Lets pieces grow: under ceilings as far as these go, over free floor only a little.
fn grow(evidence: &Evidence<'_>, indoors: &[bool], is_closed: &[bool], piece_of: &mut [Option<u32>]) {
    let grid = evidence.grid;
    let max_steps = (REACH_M / CELL_M) as u32;
    let mut front: Vec<(usize, u32)> =
        piece_of.iter().enumerate().filter(|(_, piece)| piece.is_some()).map(|(cell, _)| (cell, 0)).collect();
    while !front.is_empty() {
        let mut next_front = Vec::new();
        for (cell, steps) in front {
            for next in grid.neighbors(cell) {
                let is_free = evidence.seen[next] == Seen::Free && !is_closed[next];
                let next_steps = if indoors[next] { 0 } else { steps + 1 };
                if piece_of[next].is_none() && (indoors[next] || is_free && next_steps <= max_steps) {
                    piece_of[next] = piece_of[cell];
                    next_front.push((next, next_steps));
                }
            }
        }
        front = next_front;
    }
}

/// Makes pieces one that meet over more than the width of a door.
fn unite(grid: &Grid, piece_of: &mut [Option<u32>], pieces: usize) {
    let mut contacts: Vec<(u32, u32)> = Vec::new();
    for (cell, piece) in piece_of.iter().enumerate() {
        for next in grid.neighbors(cell).filter(|next| *next > cell) {
            if let (Some(a), Some(b)) = (*piece, piece_of[next])
                && a != b
            {
                contacts.push((a.min(b), a.max(b)));
            }
        }
    }
    contacts.sort_unstable();
    let mut joined = UnionFind::new(pieces);
    for pair in contacts.chunk_by(|a, b| a == b) {
        if pair.len() as f64 * CELL_M > MIN_CONTACT_M {
            joined.join(pair[0].0, pair[0].1);
        }
    }
    for piece in piece_of.iter_mut().flatten() {
        *piece = joined.root(*piece);
    }
}
