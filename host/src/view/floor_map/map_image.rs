//! An occupancy grid cut to what was seen, and what it shows at each cell.

use crate::formats::output::error::OutputError;
use crate::recordings::deskew::StampedPose;
use crate::slam::occupancy::{CellBounds, OccupancyGrid};

/// A cell counts as a wall above this probability.
pub(crate) const OCCUPIED: f64 = 0.65;

/// A cell counts as free below this probability. map_server's own 0.196 keeps the gray 205 of unknown cells
/// (p = 0.19608) apart.
pub(crate) const FREE: f64 = 0.196;

/// An image of more cells is refused: some pose or range is wild, or the resolution too fine.
const MAX_CELLS: u64 = 1 << 28;

/// Part of the decided cells that spokes may be, on each side.
const SPOKES: f64 = 0.0015;

/// Cells kept around what is left, so that walls at its edge stay whole.
const BORDER_CELLS: i32 = 8;

/// Why there is no map.
#[derive(Debug, thiserror::Error)]
pub(crate) enum MapError {
    /// No beam touched a cell.
    #[error("no posed beam to draw a map from")]
    Empty,
    /// The image would be too large.
    #[error(
        "the map would have {columns} x {rows} cells at {resolution_m} m: a pose is wild, or take a coarser --resolution"
    )]
    TooLarge {
        /// Cells along x.
        columns: u64,
        /// Cells along y.
        rows: u64,
        /// Side of a cell, meters.
        resolution_m: f64,
    },
    /// A file could not be written.
    #[error(transparent)]
    Output(#[from] OutputError),
}

/// What a map shows at one cell.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum CellState {
    /// Never seen, or undecided.
    Unknown,
    /// Beams pass.
    Free,
    /// Beams end.
    Occupied,
}

/// A grid cut to the rectangle that was seen and driven.
pub(crate) struct MapImage<'a> {
    grid: &'a OccupancyGrid,
    bounds: CellBounds,
    columns: u32,
    rows: u32,
}

impl<'a> MapImage<'a> {
    /// Cuts a grid to what was seen and where the robot was.
    ///
    /// # Errors
    /// When the grid is empty, or its rectangle too large for an image.
    pub(crate) fn new(grid: &'a OccupancyGrid, poses: &[StampedPose]) -> Result<Self, MapError> {
        let mut bounds = grid.bounds().ok_or(MapError::Empty)?;
        let cells = poses.iter().filter_map(|pose| grid.cell_of([pose.x_m, pose.y_m]));
        cells.for_each(|cell| bounds.include(cell));
        let [columns, rows] = bounds.size();
        match (u32::try_from(columns), u32::try_from(rows)) {
            (Ok(width), Ok(height)) if columns.saturating_mul(rows) <= MAX_CELLS => {
                Ok(Self { grid, bounds, columns: width, rows: height })
            }
            _ => Err(MapError::TooLarge { columns, rows, resolution_m: grid.params().resolution_m }),
        }
    }

    /// The same map without the thin spokes around it, of beams that left through windows: the few outermost
    /// of its decided cells along each axis are cut off. Where the robot was stays in.
    #[must_use]
    pub(crate) fn without_spokes(&self, poses: &[StampedPose]) -> Self {
        let mut counts = [vec![0_u64; self.columns as usize], vec![0_u64; self.rows as usize]];
        for row in 0..self.rows {
            for column in (0..self.columns).filter(|&column| self.state(column, row) != CellState::Unknown) {
                counts[0][column as usize] += 1;
                counts[1][row as usize] += 1;
            }
        }
        let [(left, right), (top, bottom)] = counts.map(|counts| bulk_of(&counts));
        let cell = |column: usize, row: usize| {
            [self.bounds.min[0].saturating_add(column as i32), self.bounds.max[1].saturating_sub(row as i32)]
        };
        let mut bounds = CellBounds { min: cell(left, bottom), max: cell(right, top) };
        let cells = poses.iter().filter_map(|pose| self.grid.cell_of([pose.x_m, pose.y_m]));
        cells.for_each(|cell| bounds.include(cell));
        for axis in [0, 1] {
            bounds.min[axis] = (bounds.min[axis] - BORDER_CELLS).max(self.bounds.min[axis]);
            bounds.max[axis] = (bounds.max[axis] + BORDER_CELLS).min(self.bounds.max[axis]);
        }
        let [columns, rows] = bounds.size().map(|side| u32::try_from(side).unwrap_or(u32::MAX));
        Self { grid: self.grid, bounds, columns, rows }
    }

    /// Columns and rows.
    pub(crate) fn size(&self) -> [u32; 2] {
        [self.columns, self.rows]
    }

    /// Side of a cell, meters.
    pub(crate) fn resolution_m(&self) -> f64 {
        self.grid.params().resolution_m
    }

    /// Lower left corner of the lower left cell in `map`, meters.
    pub(crate) fn origin_m(&self) -> [f64; 2] {
        self.bounds.min.map(|cell| f64::from(cell) * self.resolution_m())
    }

    /// Probability that the cell at a column and a row, counted from the top left, is occupied.
    pub(crate) fn probability(&self, column: u32, row: u32) -> Option<f64> {
        let x = i64::from(self.bounds.min[0]) + i64::from(column);
        let y = i64::from(self.bounds.max[1]) - i64::from(row);
        self.grid.probability([i32::try_from(x).ok()?, i32::try_from(y).ok()?])
    }

    /// What a map shows there.
    pub(crate) fn state(&self, column: u32, row: u32) -> CellState {
        match self.probability(column, row) {
            Some(probability) if probability > OCCUPIED => CellState::Occupied,
            Some(probability) if probability < FREE => CellState::Free,
            _ => CellState::Unknown,
        }
    }
}

/// The first and the last index between which most of the counts lie.
fn bulk_of(counts: &[u64]) -> (usize, usize) {
    let maximum = (counts.iter().sum::<u64>() as f64 * SPOKES) as u64;
    let outermost = |counts: &mut dyn Iterator<Item = &u64>| {
        let mut seen = 0;
        counts
            .take_while(|count| {
                seen += **count;
                seen <= maximum
            })
            .count()
    };
    let (first, last) = (outermost(&mut counts.iter()), outermost(&mut counts.iter().rev()));
    (first, counts.len().saturating_sub(1 + last).max(first))
}
