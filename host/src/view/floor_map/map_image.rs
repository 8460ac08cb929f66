//! An occupancy grid cut to what was seen, and what it shows at each cell.
//!
//! A picture is a rectangle, so its size follows how far places lie apart, not the area seen. Its rows are
//! made one by one, and one that would be larger than anybody can open has larger cells.

use std::borrow::Cow;
use std::collections::BTreeMap;

use crate::formats::output::error::OutputError;
use crate::recordings::deskew::StampedPose;
use crate::slam::occupancy::{CellBounds, OccupancyGrid};

/// A cell counts as a wall above this probability.
pub(crate) const OCCUPIED: f64 = 0.65;

/// A cell counts as free below this probability. map_server's own 0.196 keeps the gray 205 of unknown cells
/// (p = 0.19608) apart.
pub(crate) const FREE: f64 = 0.196;

/// An image of more cells is drawn coarser: it takes a quarter of a gigabyte as PGM, and viewers open no
/// larger one.
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
    grid: Cow<'a, OccupancyGrid>,
    bounds: CellBounds,
    columns: u32,
    rows: u32,
}

/// That a map is drawn with larger cells than those of its grid.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Coarsened {
    /// Columns and rows that it would have had.
    pub size: [u64; 2],
    /// Side of those cells, meters.
    pub asked_m: f64,
    /// Side of the cells that it has, meters.
    pub drawn_m: f64,
}

impl<'a> MapImage<'a> {
    /// Cuts a grid to what was seen and where the robot was. A grid whose rectangle is too large for an image
    /// is drawn with larger cells, and that is told.
    ///
    /// # Errors
    /// When the grid is empty.
    pub(crate) fn new(
        grid: &'a OccupancyGrid,
        poses: &[StampedPose],
    ) -> Result<(Self, Option<Coarsened>), MapError> {
        let bounds = bounds_of(grid, poses)?;
        let Some(times) = coarser(&bounds) else { return Ok((Self::of(Cow::Borrowed(grid), bounds), None)) };
        let coarse = grid.coarsened(times);
        let coarsened = Coarsened {
            size: bounds.size(),
            asked_m: grid.params().resolution_m,
            drawn_m: coarse.params().resolution_m,
        };
        let bounds = bounds_of(&coarse, poses)?;
        Ok((Self::of(Cow::Owned(coarse), bounds), Some(coarsened)))
    }

    fn of(grid: Cow<'a, OccupancyGrid>, bounds: CellBounds) -> Self {
        let [columns, rows] = bounds.size().map(|side| u32::try_from(side).unwrap_or(u32::MAX));
        Self { grid, bounds, columns, rows }
    }

    /// The same map without the thin spokes around it, of beams that left through windows: the few outermost
    /// of its decided cells along each axis are cut off. Where the robot was stays in.
    #[must_use]
    pub(crate) fn without_spokes(&self, poses: &[StampedPose]) -> MapImage<'_> {
        let mut counts = [BTreeMap::new(), BTreeMap::new()];
        self.grid.for_each_seen(|cell, probability| {
            if state_of(Some(probability)) != CellState::Unknown {
                for (counts, place) in counts.iter_mut().zip(cell) {
                    *counts.entry(place).or_insert(0_u64) += 1;
                }
            }
        });
        let mut bounds = self.bounds;
        if let [Some((left, right)), Some((bottom, top))] = counts.map(|counts| bulk_of(&counts)) {
            bounds = CellBounds { min: [left, bottom], max: [right, top] };
        }
        include(&mut bounds, &self.grid, poses);
        for axis in [0, 1] {
            bounds.min[axis] = (bounds.min[axis] - BORDER_CELLS).max(self.bounds.min[axis]);
            bounds.max[axis] = (bounds.max[axis] + BORDER_CELLS).min(self.bounds.max[axis]);
        }
        MapImage::of(Cow::Borrowed(&self.grid), bounds)
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

    /// Probabilities that the cells of a row, counted from the top, are occupied.
    pub(crate) fn fill_row(&self, row: u32, probabilities: &mut Vec<Option<f64>>) {
        probabilities.resize(self.columns as usize, None);
        let y = self.bounds.max[1].saturating_sub_unsigned(row);
        self.grid.fill_row([self.bounds.min[0], y], probabilities);
    }
}

/// What a map shows at a cell that is occupied with this probability.
pub(crate) fn state_of(probability: Option<f64>) -> CellState {
    match probability {
        Some(probability) if probability > OCCUPIED => CellState::Occupied,
        Some(probability) if probability < FREE => CellState::Free,
        _ => CellState::Unknown,
    }
}

fn bounds_of(grid: &OccupancyGrid, poses: &[StampedPose]) -> Result<CellBounds, MapError> {
    let mut bounds = grid.bounds().ok_or(MapError::Empty)?;
    include(&mut bounds, grid, poses);
    Ok(bounds)
}

fn include(bounds: &mut CellBounds, grid: &OccupancyGrid, poses: &[StampedPose]) {
    poses.iter().filter_map(|pose| grid.cell_of([pose.x_m, pose.y_m])).for_each(|cell| bounds.include(cell));
}

/// How many times as large cells must be that an image holds them; `None` where they may stay.
fn coarser(bounds: &CellBounds) -> Option<i32> {
    // One cell more each way: where larger cells begin is not where these do.
    let cells = |times: u64| bounds.size().map(|side| side / times + 2).iter().product::<u64>();
    let fits = bounds.size().iter().product::<u64>() <= MAX_CELLS;
    if fits { None } else { (2..i32::MAX).find(|times| cells(times.unsigned_abs().into()) <= MAX_CELLS) }
}

/// The first and the last place between which most of the counts lie; `None` without any.
fn bulk_of(counts: &BTreeMap<i32, u64>) -> Option<(i32, i32)> {
    let maximum = (counts.values().sum::<u64>() as f64 * SPOKES) as u64;
    let (first, last) = (beyond(maximum, counts.iter())?, beyond(maximum, counts.iter().rev())?);
    Some((first, last.max(first)))
}

/// The first place up to which there are more than so many.
fn beyond<'a>(maximum: u64, mut counts: impl Iterator<Item = (&'a i32, &'a u64)>) -> Option<i32> {
    let mut seen = 0;
    counts
        .find(|(_, count)| {
            seen += **count;
            seen > maximum
        })
        .map(|(place, _)| *place)
}
