//! A floor map for viewers: what the horizontal laser's beams passed through and where they ended, in memory
//! that is bounded whatever the building.
//!
//! It is not the map that scans are matched against: that one is the loop's own, and nobody else reads it
//! while it works. Frame: map. Cell (0, 0) has its lower corner at the map's origin. Units: meters.

use biplane_recording::messages::shown::FloorMap;

/// Side of a cell at first, meters. Smaller: finer, and wider cells sooner.
const CELL_M: f64 = 0.1;
/// The most cells; with more they get twice as wide.
const MAX_CELLS: i64 = 1 << 21;
/// Edges are multiples of this many cells, so that the map does not grow at every scan.
const MARGIN: i32 = 32;
/// Cells so far from the origin are none: a pose that has run away, cells.
const FARTHEST: i32 = 1 << 24;
/// What a beam that ended in a cell says for it, and one that passed through against it.
const HIT: i8 = 20;
const PASSED: i8 = -4;
/// The most that is said for or against a cell: so quickly it changes its mind.
const SURE: i8 = 60;

/// The map. In each cell evidence: above 0 occupied, below 0 free, 0 unknown.
#[derive(Clone, Debug)]
pub(crate) struct FloorGrid {
    cell_m: f64,
    max_cells: i64,
    /// The lower left cell, and cells along x and y.
    low: [i32; 2],
    size: [i32; 2],
    evidence: Vec<i8>,
    version: u64,
}

impl Default for FloorGrid {
    fn default() -> Self {
        Self::with_bounds(CELL_M, MAX_CELLS)
    }
}

impl FloorGrid {
    fn with_bounds(cell_m: f64, max_cells: i64) -> Self {
        Self { cell_m, max_cells, low: [0; 2], size: [0; 2], evidence: Vec::new(), version: 0 }
    }

    /// How often it has changed.
    pub(crate) fn version(&self) -> u64 {
        self.version
    }

    /// Cells.
    pub(crate) fn cells(&self) -> usize {
        self.evidence.len()
    }

    /// Adds a scan: where its laser was, and where each beam went to, with whether it ended there.
    pub(crate) fn add(&mut self, laser_m: [f64; 2], ends_m: &[([f64; 2], bool)]) {
        if !self.make_room(laser_m, ends_m) {
            return;
        }
        self.version += 1;
        let from = self.cell(laser_m);
        for (end_m, _) in ends_m {
            let to = self.cell(*end_m);
            let steps = (to[0] - from[0]).abs().max((to[1] - from[1]).abs());
            for step in 0..steps {
                let share = f64::from(step) / f64::from(steps);
                let along =
                    |axis: usize| from[axis] + (f64::from(to[axis] - from[axis]) * share).round() as i32;
                self.say([along(0), along(1)], PASSED);
            }
        }
        // Afterwards, so that neighboring beams do not take it back.
        for (end_m, _) in ends_m.iter().filter(|(_, is_end)| *is_end) {
            self.say(self.cell(*end_m), HIT);
        }
    }

    /// As it is sent.
    pub(crate) fn message(&self) -> FloorMap {
        let share = |evidence: i8| match evidence {
            0 => -1,
            _ => (50 + i32::from(evidence) * 50 / i32::from(SURE)).clamp(0, 100) as i8,
        };
        FloorMap {
            cell_m: self.cell_m as f32,
            size: self.size.map(i32::cast_unsigned),
            origin_m: self.low.map(|cell| f64::from(cell) * self.cell_m),
            cells: self.evidence.iter().copied().map(share).collect(),
        }
    }

    fn cell(&self, point_m: [f64; 2]) -> [i32; 2] {
        point_m.map(|meters| (meters / self.cell_m).floor() as i32)
    }

    fn say(&mut self, [x, y]: [i32; 2], what: i8) {
        let (x, y) = (x - self.low[0], y - self.low[1]);
        if x < 0 || y < 0 || x >= self.size[0] || y >= self.size[1] {
            return;
        }
        let place = y as usize * self.size[0] as usize + x as usize;
        let evidence = &mut self.evidence[place];
        *evidence = (*evidence + what).clamp(-SURE, SURE);
        if *evidence == 0 {
            // Heard of, and undecided: not unknown again.
            *evidence = what.signum();
        }
    }

    /// Makes the map as large as a scan needs it; whether that can be done.
    fn make_room(&mut self, laser_m: [f64; 2], ends_m: &[([f64; 2], bool)]) -> bool {
        let far_m = f64::from(FARTHEST) * CELL_M;
        let points = || ends_m.iter().map(|(end_m, _)| *end_m).chain([laser_m]);
        // Also false for NaN.
        if !points().flatten().all(|meters| meters.abs() < far_m) {
            return false;
        }
        loop {
            let (low, high) = self.edges(points().map(|point_m| self.cell(point_m)));
            let size = [high[0] - low[0], high[1] - low[1]];
            if i64::from(size[0]) * i64::from(size[1]) <= self.max_cells {
                self.reframe(low, size);
                return true;
            }
            self.widen();
        }
    }

    /// The lower left cell and the one beyond the upper right, of a map that holds these cells too.
    fn edges(&self, cells: impl Iterator<Item = [i32; 2]>) -> ([i32; 2], [i32; 2]) {
        let now = (!self.evidence.is_empty())
            .then(|| (self.low, [self.low[0] + self.size[0], self.low[1] + self.size[1]]));
        let needed = cells.map(|cell| {
            let low = cell.map(|place| place.div_euclid(MARGIN) * MARGIN);
            (low, low.map(|place| place + MARGIN))
        });
        let join = |(low, high): ([i32; 2], [i32; 2]), (other_low, other_high): ([i32; 2], [i32; 2])| {
            (
                [0, 1].map(|axis| low[axis].min(other_low[axis])),
                [0, 1].map(|axis| high[axis].max(other_high[axis])),
            )
        };
        now.into_iter().chain(needed).reduce(join).unwrap_or_default()
    }

    /// Other edges, farther out; the same cells.
    fn reframe(&mut self, low: [i32; 2], size: [i32; 2]) {
        if (low, size) == (self.low, self.size) {
            return;
        }
        let wide = size[0] as usize;
        let mut evidence = vec![0; wide * size[1] as usize];
        for (y, row) in (self.low[1]..).zip(self.evidence.chunks_exact(self.size[0].max(1) as usize)) {
            let start = (y - low[1]) as usize * wide + (self.low[0] - low[0]) as usize;
            evidence[start..start + row.len()].copy_from_slice(row);
        }
        (self.low, self.size, self.evidence) = (low, size, evidence);
    }

    /// Cells twice as wide; of four, what says most for being occupied counts, or else what says most for
    /// being free.
    fn widen(&mut self) {
        self.cell_m *= 2.0;
        let [old_low, old_size] = [self.low, self.size];
        let old = std::mem::take(&mut self.evidence);
        if old.is_empty() {
            return;
        }
        let high = [0, 1].map(|axis| (old_low[axis] + old_size[axis] + 1).div_euclid(2));
        self.low = old_low.map(|cell| cell.div_euclid(2));
        self.size = [high[0] - self.low[0], high[1] - self.low[1]];
        self.evidence = vec![0; self.size[0] as usize * self.size[1] as usize];
        for (y, row) in (old_low[1]..).zip(old.chunks_exact(old_size[0] as usize)) {
            for (x, &evidence) in (old_low[0]..).zip(row) {
                let (x, y) = (x.div_euclid(2) - self.low[0], y.div_euclid(2) - self.low[1]);
                let wide = &mut self.evidence[y as usize * self.size[0] as usize + x as usize];
                let maximum = (*wide).max(evidence);
                *wide = if maximum > 0 { maximum } else { (*wide).min(evidence) };
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// What a viewer sees at a point: -1 unknown, 0 to 100.
    fn seen(grid: &FloorGrid, point_m: [f64; 2]) -> i8 {
        let message = grid.message();
        let cell =
            |axis: usize| ((point_m[axis] - message.origin_m[axis]) / f64::from(message.cell_m)).floor();
        let (x, y) = (cell(0), cell(1));
        assert!(x >= 0.0 && y >= 0.0 && (x as u32) < message.size[0] && (y as u32) < message.size[1]);
        message.cells[y as usize * message.size[0] as usize + x as usize]
    }

    #[test]
    fn beams_leave_free_space_and_a_wall_and_nothing_behind_it() {
        let mut grid = FloorGrid::default();
        for _ in 0..5 {
            grid.add([0.05, 0.05], &[([3.05, 0.05], true), ([0.05, -4.05], true), ([-2.05, 0.05], false)]);
        }
        assert_eq!((seen(&grid, [3.05, 0.05]), seen(&grid, [0.05, -4.05])), (100, 100));
        for free in [[0.05, 0.05], [2.95, 0.05], [0.05, -3.95], [-1.95, 0.05]] {
            assert!((0..50).contains(&seen(&grid, free)), "{free:?}: {}", seen(&grid, free));
        }
        for unknown in [[3.15, 0.05], [-2.05, 0.05], [1.0, 1.0]] {
            assert_eq!(seen(&grid, unknown), -1, "{unknown:?}");
        }
        assert_eq!(grid.version(), 5);
    }

    #[test]
    fn a_map_that_outgrows_its_memory_gets_wider_cells_and_keeps_its_walls() {
        let mut grid = FloorGrid::with_bounds(0.1, 64 * 64);
        for x in [-1.95, 1.05, 2.55, 4.05, 12.05, 40.05] {
            for _ in 0..5 {
                grid.add([x, 0.0], &[([x, 1.45], true)]);
            }
            assert!(grid.cells() <= 64 * 64);
        }
        assert!(grid.message().cell_m > 0.5, "{}", grid.message().cell_m);
        assert_eq!(grid.message().cells.len(), grid.cells());
        for x in [-1.95, 1.05, 2.55, 4.05, 12.05, 40.05] {
            assert!(seen(&grid, [x, 1.45]) > 90, "{x}: {}", seen(&grid, [x, 1.45]));
        }
        assert_eq!(seen(&grid, [25.0, 5.0]), -1);
    }

    #[test]
    fn a_pose_that_has_run_away_adds_nothing() {
        let mut grid = FloorGrid::default();
        for far in [1e9, f64::NAN, f64::NEG_INFINITY] {
            grid.add([far, 0.0], &[([0.0, 0.0], true)]);
            grid.add([0.0, 0.0], &[([0.0, far], true)]);
        }
        assert_eq!((grid.version(), grid.cells()), (0, 0));
        assert_eq!(grid.message().cells.len(), 0);
    }
}
