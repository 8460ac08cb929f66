//! Which points of a drive show something new.
//!
//! Earlier passes are counted in cells of space, in larger ones where points are far apart. A point shows
//! nothing new where earlier passes have left points enough in its cell and in those before and behind it:
//! noise runs along the beam. In a neighborhood that earlier passes knew, new points must come many at once:
//! single ones are mixed pixels at edges, which each pass has in other places. Points next to something new
//! are kept as well, so that triangles reach over the border of what was covered. Scans come one by one and
//! leave a little later. Meters, seconds.

use super::params::RevisitParams;
use crate::model::voxels::{Voxels, key};
use crate::reconstruct::cloud::PosedScan;
use std::collections::VecDeque;

/// Sizes of cells; each is twice the one before.
const LEVELS: usize = 4;
/// Seconds per step of the times that cells keep.
const STEP_S: f64 = 0.1;

/// What a cell of one level has seen.
#[derive(Clone, Copy, Debug, Default)]
struct Seen {
    /// When the pass began that its points are counted for now, in steps.
    pass_began: u32,
    /// When the neighborhood of this cell was marked last as never seen before, in steps; 0 is never.
    marked: u32,
    /// Points of passes before this one.
    before: u8,
    /// Points of this pass.
    now: u8,
}

impl Seen {
    /// Points of passes that are over.
    fn before_at(&self, time: u32, pass_steps: u32) -> u32 {
        let is_over = time.abs_diff(self.pass_began) >= pass_steps;
        u32::from(self.before) + if is_over { u32::from(self.now) } else { 0 }
    }

    fn add(&mut self, time: u32, pass_steps: u32) {
        if self.now == 0 || time.abs_diff(self.pass_began) >= pass_steps {
            self.before = self.before.saturating_add(self.now);
            (self.now, self.pass_began) = (0, time);
        }
        self.now = self.now.saturating_add(1);
    }
}

/// What is new in and next to a cell twice as large as those of its level.
#[derive(Clone, Copy, Debug, Default)]
struct Fresh {
    /// When points were last seen here whose neighborhood nobody knew, in steps; 0 is never.
    unknown: u32,
    /// When new points were last seen here in a neighborhood that was known, in steps.
    counted: u32,
    /// How many, in this pass.
    count: u32,
}

/// Cells of one size.
#[derive(Debug, Default)]
struct Level {
    cell_m: f64,
    seen: Voxels<Seen>,
    fresh: Voxels<Fresh>,
}

impl Level {
    /// Changes what is noted of the neighborhood of a point, a cell's side to all sides.
    fn note(&mut self, p: [f64; 3], mut change: impl FnMut(&mut Fresh)) {
        let per_m = 0.5 / self.cell_m;
        for corner in 0..8 {
            let side = |axis: usize| if corner >> axis & 1 == 0 { -self.cell_m } else { self.cell_m };
            if let Some(key) = key([0, 1, 2].map(|axis| p[axis] + side(axis)), per_m) {
                change(self.fresh.entry(key).or_default());
            }
        }
    }

    /// Whether something new was seen round a point at about this time.
    fn is_fresh(&self, p: [f64; 3], time: u32, margin_steps: u32, min_together: u32) -> bool {
        let near = |when: u32| when > 0 && when.abs_diff(time) <= margin_steps;
        let fresh = key(p, 0.5 / self.cell_m).and_then(|key| self.fresh.get(&key));
        fresh.is_some_and(|f| near(f.unknown) || f.count >= min_together && near(f.counted))
    }
}

/// A scan of which is not known yet what is next to its points.
#[derive(Debug, Default)]
struct Waiting {
    row: PosedScan,
    time: u32,
    /// Nothing moved since the last scan that was kept.
    is_thinned: bool,
    /// The level of each point that may show nothing new; [`NEW`] for those that do.
    levels: Vec<u8>,
}

/// In place of a level: the point shows something new.
const NEW: u8 = u8::MAX;

/// Sorts the points of a drive, scan by scan.
#[derive(Debug)]
pub(crate) struct FirstViews<'a> {
    params: &'a RevisitParams,
    /// Angle between neighboring beams, radians.
    beam_step_rad: f64,
    levels: Vec<Level>,
    /// Where the laser was at the last scan that was not thinned out, and the base's heading.
    last: Option<([f64; 3], f64)>,
    first_stamp_ns: Option<i64>,
    waiting: VecDeque<Waiting>,
    /// Scans that have left: their memory is used again.
    spare: Vec<Waiting>,
}

impl<'a> FirstViews<'a> {
    /// Before the first scan of a laser whose beams are so far apart.
    pub(crate) fn new(params: &'a RevisitParams, beam_step_rad: f64) -> Self {
        let level = |k: usize| Level { cell_m: params.cell_m * (1 << k) as f64, ..Level::default() };
        Self {
            params,
            beam_step_rad,
            levels: (0..LEVELS).map(level).collect(),
            last: None,
            first_stamp_ns: None,
            waiting: VecDeque::new(),
            spare: Vec::new(),
        }
    }

    /// Takes the next scan; `notify` hears of scans that leave, in order, with which of their points to
    /// keep, or nothing of a scan that is as good as the one before.
    pub(crate) fn push(&mut self, row: &PosedScan, notify: &mut dyn FnMut(&PosedScan, Option<&[bool]>)) {
        let first_ns = *self.first_stamp_ns.get_or_insert(row.stamp_ns);
        let since_s = row.stamp_ns.saturating_sub(first_ns) as f64 / 1e9;
        // Zero stands for never.
        let time = ((since_s / STEP_S) as u32).saturating_add(1);
        let mut waiting = self.spare.pop().unwrap_or_default();
        waiting.row.clone_from(row);
        waiting.time = time;
        let origin = row.origin_m.map(f64::from);
        let step_m = self.last.map_or(f64::INFINITY, |(last, theta_rad)| {
            let turn_rad = biplane_geometry::wrap_angle(row.theta_rad - theta_rad);
            biplane_geometry::vec3::distance(last, origin) + self.params.turn_m * turn_rad.abs()
        });
        waiting.is_thinned = step_m < self.params.min_step_m && !row.points_m.is_empty();
        if !waiting.is_thinned {
            self.last = Some((origin, row.theta_rad));
            self.sort(&mut waiting, if step_m.is_finite() { step_m } else { 0.0 });
        }
        self.waiting.push_back(waiting);
        let margin_steps = self.steps(self.params.margin_s);
        while self.waiting.front().is_some_and(|oldest| oldest.time.abs_diff(time) > margin_steps) {
            self.release(notify);
        }
    }

    /// Lets all scans go that still wait.
    pub(crate) fn finish(&mut self, notify: &mut dyn FnMut(&PosedScan, Option<&[bool]>)) {
        while !self.waiting.is_empty() {
            self.release(notify);
        }
    }

    fn steps(&self, seconds: f64) -> u32 {
        (seconds / STEP_S).ceil() as u32
    }

    /// Tells new points of a scan from others, and counts the new ones.
    fn sort(&mut self, waiting: &mut Waiting, step_m: f64) {
        let Waiting { row, time, levels, .. } = waiting;
        let origin = row.origin_m.map(f64::from);
        let pass_steps = self.steps(self.params.pass_s);
        levels.clear();
        for p in &row.points_m {
            let p = p.map(f64::from);
            let beam: [f64; 3] = std::array::from_fn(|k| p[k] - origin[k]);
            let range_m = biplane_geometry::vec3::norm(beam);
            let level = self.level_of((range_m * self.beam_step_rad).max(step_m));
            let ahead = beam.map(|v| v * self.levels[level].cell_m / range_m.max(1e-6));
            let is_certain = !self.is_covered(level, p, ahead, *time, pass_steps)
                && !self.add(level, p, *time, pass_steps);
            levels.push(if is_certain { NEW } else { level as u8 });
        }
    }

    /// The level whose cells suit points that are so far apart.
    fn level_of(&self, spacing_m: f64) -> usize {
        let wanted_m = self.params.spacings * spacing_m;
        self.levels.iter().position(|level| level.cell_m >= wanted_m).unwrap_or(LEVELS - 1)
    }

    fn is_covered(&self, level: usize, p: [f64; 3], ahead: [f64; 3], time: u32, pass_steps: u32) -> bool {
        let Level { cell_m, seen, .. } = &self.levels[level];
        let mut found: [Option<u64>; 3] = [None; 3];
        let mut count = 0;
        for (slot, side) in [0.0, 1.0, -1.0].into_iter().enumerate() {
            let at = std::array::from_fn(|k| p[k] + side * ahead[k]);
            let key = key(at, cell_m.recip());
            if key.is_none() || found.contains(&key) {
                continue;
            }
            found[slot] = key;
            let cell = key.and_then(|key| seen.get(&key));
            count += cell.map_or(0, |cell| cell.before_at(time, pass_steps));
            if count >= self.params.min_points {
                return true;
            }
        }
        false
    }

    /// Counts a new point in cells of its level, and in larger ones: what was seen from near need not be
    /// seen from far. Returns whether its neighborhood was known before.
    fn add(&mut self, level: usize, p: [f64; 3], time: u32, pass_steps: u32) -> bool {
        let mut is_known = false;
        let mut is_marked = false;
        for (which, of_level) in self.levels.iter_mut().enumerate().skip(level) {
            let Some(key) = key(p, of_level.cell_m.recip()) else { return false };
            let cell = of_level.seen.entry(key).or_default();
            is_known = cell.before_at(time, pass_steps) > 0;
            // Points of one cell mark nearly the same.
            is_marked |= which == level && cell.marked == time;
            cell.add(time, pass_steps);
            if which == level {
                cell.marked = time;
            }
        }
        if is_known {
            self.levels[level].note(p, |fresh| {
                let is_over = time.abs_diff(fresh.counted) >= pass_steps;
                fresh.count = 1 + if is_over { 0 } else { fresh.count };
                fresh.counted = time;
            });
        } else if !is_marked {
            self.levels[level].note(p, |fresh| fresh.unknown = time);
        }
        is_known
    }

    /// Lets the oldest scan go.
    fn release(&mut self, notify: &mut dyn FnMut(&PosedScan, Option<&[bool]>)) {
        let Some(waiting) = self.waiting.pop_front() else { return };
        if waiting.is_thinned {
            notify(&waiting.row, None);
            self.spare.push(waiting);
            return;
        }
        let margin_steps = self.steps(self.params.margin_s);
        let is_kept = |(p, level): (&[f32; 3], &u8)| {
            let p = p.map(f64::from);
            let level = usize::from(*level);
            // Neighbors may be a little farther away or nearer, and so of the next level.
            let near = level.saturating_sub(1)..=(level + 1).min(LEVELS - 1);
            let min_together = self.params.min_together;
            let is_fresh = |k: usize| self.levels[k].is_fresh(p, waiting.time, margin_steps, min_together);
            level >= LEVELS || near.into_iter().any(is_fresh)
        };
        let kept: Vec<bool> = waiting.row.points_m.iter().zip(&waiting.levels).map(is_kept).collect();
        notify(&waiting.row, Some(&kept));
        self.spare.push(waiting);
    }
}
