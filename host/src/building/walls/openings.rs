//! Doors and windows: where rays pass a wall, heads are seen from below, or the robot drove through.

use std::cmp::Ordering;

use super::jambs;
use super::rays::{STEP_M, Shown};
use super::sills::{Below, MAX_LEAF_M, MAX_THRESHOLD_M, MIN_DOOR_M};
use super::view::WallView;
use crate::building::elevation::{Span, extent};
use crate::building::spaces::evidence::Seen;
use crate::building::spaces::faces::joined;
use crate::building::spaces::raster::CELL_M;
use biplane_geometry::vec2::distance;

/// Narrower openings are slits, meters.
const MIN_WIDTH_M: f64 = 0.4;
/// Wider ones are missing walls, meters.
const MAX_WIDTH_M: f64 = 8.0;
/// Lower ones are slits, meters.
const MIN_HEIGHT_M: f64 = 0.3;
/// Fewer cells that rays pass are noise.
const MIN_CELLS: usize = 20;
/// Open cells with this many between them belong together: scans and beams are further apart than cells.
const GAP_CELLS: usize = 4;
/// The fan sees nothing lower of what is near, meters.
const MIN_SEEN_M: f64 = 0.3;
/// Wider doors are passages, meters.
const MAX_DOOR_M: f64 = 2.5;
/// How far before and behind a wall the floor of a door is free, meters.
const BESIDE_M: f64 = 0.15;
/// Poses further apart are not of one drive, meters.
const MAX_STEP_M: f64 = 1.0;
/// Candidates that overlap by this share of the shorter one are one opening.
const SAME_SHARE: f64 = 0.5;
/// An opening takes no more of its wall than this; where it would, there is no wall.
const MAX_SHARE: f64 = 0.92;
/// Openings without a head keep this from the ends of their wall, meters: faces at a corner differ in length.
const MIN_BESIDE_M: f64 = 0.05;
/// What is open up to the ceiling from so high on is over a wardrobe, meters.
const MAX_SILL_M: f64 = 1.4;
/// The head of an opening keeps at least this from the ceiling, or the wall ends there, meters.
const UNDER_CEILING_M: f64 = 0.04;

/// What shows that there is an opening.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub(crate) enum Shows {
    /// Only its frame: the soffit over it.
    Frame,
    /// Rays came behind the face of the wall and ended there: on a leaf.
    ClosedLeaf,
    /// Rays passed.
    SeenThrough,
    /// The robot passed.
    DrivenThrough,
}

/// An opening in a wall.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct Hole {
    /// From jamb to jamb, along the wall, meters.
    pub span: Span,
    /// Lower edge, meters.
    pub bottom_m: f64,
    /// Upper edge, meters.
    pub top_m: f64,
    /// Whether one walks through it.
    pub is_door: bool,
    /// What shows it.
    pub shows: Shows,
    /// Whether wall was seen under it, or the floor in it; else its lower edge is a guess.
    pub is_bottom_seen: bool,
}

impl Hole {
    /// Its width, meters.
    pub(crate) fn width_m(&self) -> f64 {
        self.span[1] - self.span[0]
    }

    /// Whether it is wider than any door.
    pub(crate) fn is_passage(&self) -> bool {
        self.is_door && self.width_m() > MAX_DOOR_M
    }
}

/// What may be an opening.
#[derive(Clone, Debug, Default, PartialEq)]
struct Candidate {
    span: Span,
    /// Height of its soffit, and from where to where it goes.
    head: Option<(f64, Span)>,
    /// Cells that rays passed: columns and rows from and to.
    seen: Option<[usize; 4]>,
    is_driven: bool,
}

impl WallView<'_> {
    /// All openings of the wall, along it.
    pub(crate) fn openings(&self) -> Vec<Hole> {
        let mut all = self.passed();
        all.extend(self.under_soffits());
        all.extend(self.driven());
        let mut holes: Vec<Hole> =
            grouped(all).iter().filter_map(|candidate| self.opening(candidate)).collect();
        holes.sort_by(|a, b| a.span[0].total_cmp(&b.span[0]));
        holes.dedup_by(|b, a| b.span[0] < a.span[1] - MIN_WIDTH_M / 2.0);
        holes
    }

    /// Pieces of the wall that rays pass.
    fn passed(&self) -> Vec<Candidate> {
        let [width, height] = self.elevation.size;
        let mut is_new: Vec<bool> = (0..width * height)
            .map(|cell| self.elevation.shown(cell % width, cell / width) == Shown::Open)
            .collect();
        let mut found = Vec::new();
        for start in 0..is_new.len() {
            if !is_new[start] {
                continue;
            }
            let (mut open, mut cells) = (vec![start], Vec::new());
            is_new[start] = false;
            while let Some(cell) = open.pop() {
                cells.push(cell);
                let (x, y) = (cell % width, cell / width);
                for (nx, ny) in (x.saturating_sub(GAP_CELLS)..(x + GAP_CELLS + 1).min(width)).flat_map(|nx| {
                    (y.saturating_sub(GAP_CELLS)..(y + GAP_CELLS + 1).min(height)).map(move |ny| (nx, ny))
                }) {
                    if std::mem::take(&mut is_new[ny * width + nx]) {
                        open.push(ny * width + nx);
                    }
                }
            }
            if cells.len() >= MIN_CELLS {
                found.extend(self.rectangle(&cells));
            }
        }
        found
    }

    /// The rectangle that most of the rows and columns of a piece have.
    fn rectangle(&self, cells: &[usize]) -> Option<Candidate> {
        let width = self.elevation.size[0];
        let rows = typical(cells.iter().map(|cell| (cell / width, cell % width)));
        let columns = typical(cells.iter().map(|cell| (cell % width, cell / width)));
        let ([left, right], [low, high]) = (rows?, columns?);
        let span = [left, right + 1].map(|column| self.elevation.origin_m[0] + column as f64 * STEP_M);
        Some(Candidate { span, seen: Some([left, right, low, high]), ..Candidate::default() })
    }

    /// Heads seen from below, where they lie in the wall.
    fn under_soffits(&self) -> Vec<Candidate> {
        let (slab, model) = (self.slab, self.evidence.model);
        let [low, high] = slab.faces_m;
        let candidates = self.overhead.soffits.iter().filter_map(|soffit| {
            let corners = model.polygons.get(soffit.polygon)?.outer_m.iter().map(|p| [p[0], p[1]]);
            let places: Vec<[f64; 2]> = corners.map(|p| slab.line.place(p)).collect();
            let across = extent(places.iter().map(|p| p[0]));
            let middle = (across[0] + across[1]) / 2.0;
            // A soffit deeper than the wall belongs to something else of the same height.
            let is_inside = middle > low - 0.05 && middle < high + 0.05 && across[1] - across[0] < 0.8;
            let span = extent(places.iter().filter(|p| p[0] > low - 0.1 && p[0] < high + 0.1).map(|p| p[1]));
            let is_along = span[1] - span[0] >= MIN_WIDTH_M - 0.1
                && span[0] > slab.span[0] - 0.1
                && span[1] < slab.span[1] + 0.1;
            (is_inside && is_along).then(|| Candidate {
                span,
                head: Some((soffit.height_m, span)),
                ..Candidate::default()
            })
        });
        candidates.collect()
    }

    /// Where the robot drove through the wall, as wide as the floor is free.
    fn driven(&self) -> Vec<Candidate> {
        let slab = self.slab;
        let middle_m = slab.middle_m();
        let mut found = Vec::new();
        for pair in self.evidence.path_m.windows(2) {
            let [a, b] = [pair[0], pair[1]].map(|p| slab.line.place(p)[0] - middle_m);
            // From the end of one recording to the beginning of the next nobody drove.
            if (a > 0.0) == (b > 0.0) || distance(pair[0], pair[1]) > MAX_STEP_M {
                continue;
            }
            let share = a / (a - b);
            let place = [0, 1].map(|axis| pair[0][axis] + share * (pair[1][axis] - pair[0][axis]));
            let at_m = slab.line.place(place)[1];
            if at_m > slab.span[0] && at_m < slab.span[1] {
                found.push(Candidate {
                    span: self.free_around(at_m),
                    is_driven: true,
                    ..Candidate::default()
                });
            }
        }
        found
    }

    fn seen_at(&self, at_m: f64, across_m: f64) -> Seen {
        let cell = self.evidence.area.grid.cell(self.slab.point(at_m, across_m));
        cell.map_or(Seen::Unknown, |cell| self.evidence.seen[cell])
    }

    /// How far the floor is free in the wall around a place.
    fn free_around(&self, at_m: f64) -> Span {
        let is_free = |at: f64| {
            let [low, high] = self.slab.faces_m;
            [low + 0.02, (low + high) / 2.0, high - 0.02]
                .iter()
                .filter(|across| self.seen_at(at, **across) == Seen::Free)
                .count()
                >= 2
        };
        let reach = |sign: f64| {
            let mut at = at_m;
            while (at - at_m).abs() < MAX_WIDTH_M && is_free(at + sign * 0.5 * CELL_M) {
                at += sign * 0.5 * CELL_M;
            }
            at
        };
        [reach(-1.0), reach(1.0)]
    }

    /// Whether the floor map shows a way through: free from before the wall to behind it at most places.
    fn has_way_through(&self, span: Span) -> bool {
        let [low, high] = self.slab.faces_m;
        let steps = ((high - low + 2.0 * BESIDE_M) / CELL_M).ceil() as usize;
        let is_through = |share: &f64| {
            let at_m = span[0] + share * (span[1] - span[0]);
            (0..=steps).all(|step| {
                let across = low - BESIDE_M + (high - low + 2.0 * BESIDE_M) * step as f64 / steps as f64;
                self.seen_at(at_m, across) == Seen::Free
            })
        };
        [0.2, 0.35, 0.5, 0.65, 0.8].iter().filter(|share| is_through(share)).count() >= 3
    }

    /// Counts of cells that show wall and of those that are open, in the middle of a span and between
    /// heights.
    fn middle(&self, span: Span, [low_m, high_m]: Span) -> (usize, usize) {
        let border_m = (span[1] - span[0]) / 8.0;
        let index = |value: f64, axis: usize| {
            let at = (value - self.elevation.origin_m[axis]) / STEP_M;
            at.clamp(0.0, self.elevation.size[axis] as f64) as usize
        };
        let columns = index(span[0] + border_m, 0)..index(span[1] - border_m, 0);
        let rows = index(low_m, 1)..index(high_m, 1);
        let cells = columns.flat_map(|column| rows.clone().map(move |row| (column, row)));
        cells.fold((0, 0), |(wall, open), (column, row)| match self.elevation.shown(column, row) {
            Shown::Wall => (wall + 1, open),
            Shown::Open => (wall, open + 1),
            Shown::Unseen => (wall, open),
        })
    }

    /// The opening that a candidate is, if it is one.
    fn opening(&self, candidate: &Candidate) -> Option<Hole> {
        let floor_m = self.evidence.floor_m;
        let [sill_m, seen_top_m] = match candidate.seen {
            Some([.., low, high]) => [low, high + 1].map(|row| floor_m + row as f64 * STEP_M),
            None => [floor_m, self.ceiling_m],
        };
        let head_m = candidate.head.map(|(height_m, _)| height_m);
        let top_m = head_m.unwrap_or_else(|| jambs::head_m(self, candidate.span, seen_top_m));
        let top_m = if top_m > self.ceiling_m - UNDER_CEILING_M { self.ceiling_m } else { top_m };
        let (wall_below, open_below) = self.middle(candidate.span, [floor_m, floor_m + MAX_THRESHOLD_M]);
        let is_walked = candidate.is_driven || self.has_way_through(candidate.span);
        let has_sill = wall_below > 2 * open_below;
        let is_open_low = open_below > 2 * wall_below;
        let may_be_door = (is_walked || is_open_low) && (candidate.is_driven || !has_sill);
        // What is closed and wider than a leaf is glazing down to the floor.
        let is_glazed = !is_walked
            && candidate.span[1] - candidate.span[0] > MAX_LEAF_M
            && self.is_filled(candidate.span);
        let below = self.below(candidate.span, [sill_m, top_m]);
        let is_door = may_be_door && !is_glazed || self.is_shut(candidate.span, [sill_m, top_m], below);
        if !is_door
            && !is_glazed
            && (candidate.seen.is_none() || !has_sill && wall_below == 0 && sill_m < floor_m + 0.6)
        {
            return None;
        }
        let bottom_m = if is_door { floor_m } else { jambs::sill_m(self, candidate.span, sill_m) };
        let rows = [bottom_m.max(floor_m + MIN_SEEN_M), top_m];
        let under = candidate.head.map(|(_, span)| span);
        let span = jambs::span(self, candidate.span, under, rows, candidate.is_driven);
        let shows = match (candidate.is_driven, candidate.seen) {
            (true, _) => Shows::DrivenThrough,
            (false, Some(_)) if is_door && !is_walked && self.has_leaf(candidate.span) => Shows::ClosedLeaf,
            (false, Some(_)) => Shows::SeenThrough,
            (false, None) if is_walked => Shows::SeenThrough,
            (false, None) => Shows::Frame,
        };
        let is_bottom_seen = if is_door { shows > Shows::ClosedLeaf } else { below == Below::Wall };
        let hole = Hole { span, bottom_m, top_m, is_door, shows, is_bottom_seen };
        let is_large = (MIN_WIDTH_M..=MAX_WIDTH_M).contains(&hole.width_m())
            && top_m - bottom_m >= if is_door { MIN_DOOR_M } else { MIN_HEIGHT_M };
        (is_large && self.has_wall_around(&hole) && self.is_clear(&hole)).then_some(hole)
    }

    /// Whether an opening is in a wall, and not where it ends, or over what stands before it.
    fn has_wall_around(&self, hole: &Hole) -> bool {
        let span = self.slab.span;
        if hole.width_m() > MAX_SHARE * self.slab.length_m() {
            return false;
        }
        let is_at_end = hole.span[0] < span[0] + MIN_BESIDE_M || hole.span[1] > span[1] - MIN_BESIDE_M;
        let has_head = hole.top_m < self.ceiling_m - UNDER_CEILING_M;
        let is_over_things = !has_head && hole.bottom_m > self.evidence.floor_m + MAX_SILL_M;
        hole.shows == Shows::DrivenThrough || has_head || !(is_at_end || is_over_things)
    }

    /// Whether not more rays end in the middle of an opening than pass it.
    fn is_clear(&self, hole: &Hole) -> bool {
        let (wall, open) = self.middle(hole.span, [hole.bottom_m + 0.1, hole.top_m - 0.1]);
        wall <= open || (hole.shows == Shows::DrivenThrough && wall < 2 * open + 10)
    }
}

/// The ends that most lines of a piece have: median of the first and last cells of its longer lines.
fn typical(cells: impl Iterator<Item = (usize, usize)>) -> Option<[usize; 2]> {
    let mut lines = std::collections::BTreeMap::<usize, [usize; 2]>::new();
    for (line, at) in cells {
        let ends = lines.entry(line).or_insert([at, at]);
        *ends = [ends[0].min(at), ends[1].max(at)];
    }
    let longest = lines.values().map(|[from, to]| to - from + 1).max()?;
    let long = lines.values().filter(|[from, to]| 2 * (to - from + 1) >= longest);
    let (mut from, mut to): (Vec<usize>, Vec<usize>) = long.map(|ends| (ends[0], ends[1])).unzip();
    from.sort_unstable();
    to.sort_unstable();
    Some([from[from.len() / 2], to[to.len() / 2]])
}

/// Candidates that overlap made one.
fn grouped(mut all: Vec<Candidate>) -> Vec<Candidate> {
    all.sort_by(|a, b| a.span[0].total_cmp(&b.span[0]).then(a.span[1].total_cmp(&b.span[1])));
    let mut out: Vec<Candidate> = Vec::new();
    for candidate in all {
        let is_same = |other: &&mut Candidate| {
            let shared = other.span[1].min(candidate.span[1]) - other.span[0].max(candidate.span[0]);
            let lengths = [&**other, &candidate].map(|one| one.span[1] - one.span[0]);
            shared > SAME_SHARE * lengths[0].min(lengths[1]).max(0.1)
        };
        match out.iter_mut().find(is_same) {
            Some(known) => known.take(&candidate),
            None => out.push(candidate),
        }
    }
    out
}

impl Candidate {
    /// Adds what another one shows of the same opening. What rays pass tells best where it is, then a soffit,
    /// then the floor.
    fn take(&mut self, other: &Self) {
        let rank = |one: &Self| (one.seen.is_some(), one.head.is_some());
        self.span = match rank(self).cmp(&rank(other)) {
            Ordering::Less => other.span,
            Ordering::Greater => self.span,
            Ordering::Equal => joined(vec![self.span, other.span], MAX_WIDTH_M)[0],
        };
        self.head = match (self.head, other.head) {
            (Some(a), Some(b)) => Some((a.0.max(b.0), joined(vec![a.1, b.1], MAX_WIDTH_M)[0])),
            (a, b) => a.or(b),
        };
        self.is_driven |= other.is_driven;
        self.seen = match (self.seen, other.seen) {
            (Some(a), Some(b)) => Some([a[0].min(b[0]), a[1].max(b[1]), a[2].min(b[2]), a[3].max(b[3])]),
            (a, b) => a.or(b),
        };
    }
}
