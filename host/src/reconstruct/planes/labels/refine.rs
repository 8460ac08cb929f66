//! Borders between planes: every point chooses its plane by its own distance and by what its neighbors chose.
//!
//! One point cannot tell surfaces that are nearer to each other than its noise; its neighborhood can. Meters.

use super::choice::{Choice, Vote, add_votes, best, costs_of};
use crate::reconstruct::planes::fit::noise::Noise;
use crate::reconstruct::planes::fit::scatter::{Fit, Scatter};
use crate::reconstruct::planes::search::grid::{CELLS_PER_TASK, Grid, Neighbors};
use crate::reconstruct::planes::search::grow::Region;
use rayon::prelude::*;
use std::ops::Range;

/// How much more a point's own cell counts than each of its neighbors.
const OWN_CELL_WEIGHT: f64 = 4.0;
/// Points that one task adds up.
pub(crate) const POINTS_PER_PIECE: usize = 1 << 16;

/// Points with their cells, their labels, and the sums of each label.
///
/// Everything is kept in the order of the cells, so that a pass reads memory in one go; a pass visits only
/// cells in whose neighborhood the last one changed something.
pub(crate) struct Labeling<'a> {
    grid: &'a Grid,
    neighbors: &'a Neighbors,
    noise: Noise,
    points_m: Vec<[f32; 3]>,
    labels: Vec<i32>,
    /// What the points of each cell chose.
    polls: Vec<Poll>,
    /// How many points of a cell chose each label, from the cell's first place on, where they chose several;
    /// -1 is none of the planes.
    votes: Vec<Vote>,
    active: Vec<bool>,
    sums: Vec<Scatter>,
}

/// The choice of a cell's points: one label for all of them, as in most cells, or several, which the votes
/// tell.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
struct Poll {
    first: Vote,
    kinds: u32,
}

/// A run of cells with its part of what the points have.
type Run<'b, T> = (Range<usize>, &'b mut [T]);

/// A point that changed its label.
struct Change {
    cell: u32,
    place: u32,
    from: i32,
    to: i32,
}

impl<'a> Labeling<'a> {
    /// Labels by point become labels by cell, none when there are too few; `planes` is how many different
    /// ones there are.
    pub(crate) fn new(
        points_m: &[[f32; 3]],
        (grid, neighbors): (&'a Grid, &'a Neighbors),
        noise: Noise,
        (labels, planes): (&[i32], usize),
    ) -> Self {
        let order = &grid.order;
        let mut this = Self {
            grid,
            neighbors,
            noise,
            points_m: order
                .par_iter()
                .with_min_len(POINTS_PER_PIECE)
                .map(|point| points_m[*point as usize])
                .collect(),
            labels: order
                .par_iter()
                .with_min_len(POINTS_PER_PIECE)
                .map(|point| labels.get(*point as usize).copied().unwrap_or(-1))
                .collect(),
            polls: vec![Poll::default(); grid.len()],
            votes: vec![Vote::default(); order.len()],
            active: vec![true; grid.len()],
            sums: vec![Scatter::default(); planes],
        };
        this.relabel(|_, _, _| true);
        this
    }

    /// Labels in the order of the points; those that are in no cell have none.
    pub(crate) fn labels(&self, points: usize) -> Vec<i32> {
        self.grid.by_point(points, -1, |_, place| self.labels[place])
    }

    /// The sums of each label's points.
    pub(crate) fn sums(&self) -> &[Scatter] {
        &self.sums
    }

    /// The sums of the points of each cell that have no label.
    pub(crate) fn free(&self) -> Vec<Scatter> {
        let sum_of = |cell: usize| {
            let mut sum = Scatter::default();
            let places = self.places(cell);
            if self.polls[cell].kinds > 1 || self.polls[cell].first.label < 0 {
                let free = places.filter(|place| self.labels[*place] < 0);
                free.for_each(|place| sum.add(self.points_m[place].map(f64::from)));
            }
            sum
        };
        (0..self.grid.len()).into_par_iter().with_min_len(CELLS_PER_TASK).map(sum_of).collect()
    }

    /// Labels the free points of the cells of new regions that are near the region's plane. No cell is in two
    /// of them.
    pub(crate) fn take(&mut self, regions: &[Region], limit_m: f64) {
        let first = self.sums.len() as u32;
        let mut region_of = vec![u32::MAX; self.grid.len()];
        for (which, region) in regions.iter().enumerate() {
            region.cells.iter().for_each(|cell| region_of[*cell as usize] = which as u32);
        }
        self.sums.extend(regions.iter().map(|_| Scatter::default()));
        self.relabel(|cell, points_m, labels| {
            let which = region_of[cell];
            let Some(region) = regions.get(which as usize) else { return false };
            for (label, p) in labels.iter_mut().zip(points_m).filter(|(label, _)| **label < 0) {
                if region.fit.distance_m(p.map(f64::from)).abs() <= limit_m {
                    *label = (first + which) as i32;
                }
            }
            true
        });
    }

    /// Changes the labels of cells by a function that says whether it did, counts them anew and wakes those
    /// around.
    fn relabel(&mut self, change: impl Fn(usize, &[[f32; 3]], &mut [i32]) -> bool + Sync) {
        let (grid, points_m) = (self.grid, &self.points_m);
        let labels = runs(grid, &mut self.labels).into_par_iter();
        let votes = runs(grid, &mut self.votes).into_par_iter();
        let polls = self.polls.par_chunks_mut(CELLS_PER_TASK);
        let of_run =
            |(((cells, mut labels), (_, mut votes)), polls): ((Run<'_, i32>, Run<'_, Vote>), &mut [Poll])| {
                let mut changed = Vec::new();
                for (cell, poll) in cells.zip(polls) {
                    let places = grid.starts[cell] as usize..grid.starts[cell + 1] as usize;
                    let (own, others) = std::mem::take(&mut labels).split_at_mut(places.len());
                    let (own_votes, other_votes) = std::mem::take(&mut votes).split_at_mut(places.len());
                    if change(cell, &points_m[places], own) {
                        *poll = count(own, own_votes);
                        changed.push(cell as u32);
                    }
                    (labels, votes) = (others, other_votes);
                }
                changed
            };
        let changed: Vec<Vec<u32>> = labels.zip(votes).zip(polls).map(of_run).collect();
        changed.iter().flatten().for_each(|cell| self.wake(*cell as usize));
        self.sums = scatters(&self.points_m, &self.labels, self.sums.len());
    }

    /// Labels points with a new label; `places` are as in [`Labeling::in_cells`].
    pub(crate) fn put(&mut self, places: &[u32]) {
        let label = self.sums.len() as i32;
        self.sums.push(Scatter::default());
        for &place in places {
            let cell = self.grid.starts.partition_point(|start| *start <= place) - 1;
            let from = std::mem::replace(&mut self.labels[place as usize], label);
            self.shift(&Change { cell: cell as u32, place, from, to: label });
            self.count(cell);
            self.wake(cell);
        }
    }

    /// Renames labels.
    pub(crate) fn rename(&mut self, into: &[usize]) {
        if into.iter().enumerate().all(|(label, into)| label == *into) {
            return;
        }
        self.relabel(|_, _, labels| {
            let mut changed = false;
            for label in labels {
                let new = usize::try_from(*label).map_or(-1, |old| into[old] as i32);
                changed |= std::mem::replace(label, new) != new;
            }
            changed
        });
    }

    /// Position and label of every point, in the order of the cells.
    pub(crate) fn in_cells(&self) -> (&[[f32; 3]], &[i32]) {
        (&self.points_m, &self.labels)
    }

    /// One round: the points of cells that are awake choose among the labels found in and around their cell.
    /// Returns how many changed.
    pub(crate) fn choose(&mut self, fits: &[Option<Fit>]) -> usize {
        let options: Vec<Option<Choice>> =
            fits.iter().map(|fit| fit.as_ref().map(|fit| Choice::new(fit, self.noise))).collect();
        let mut labels = std::mem::take(&mut self.labels);
        let runs = runs(self.grid, &mut labels);
        let changes: Vec<Vec<Change>> =
            runs.into_par_iter().map(|(cells, labels)| self.choose_in(cells, labels, &options)).collect();
        self.labels = labels;
        self.active.fill(false);
        let mut last = u32::MAX;
        for change in changes.iter().flatten() {
            self.shift(change);
            if change.cell != last {
                last = change.cell;
                self.count(last as usize);
                self.wake(last as usize);
            }
        }
        changes.iter().map(Vec::len).sum()
    }

    /// The choices of a run of cells, whose labels these are.
    fn choose_in(&self, cells: Range<usize>, labels: &mut [i32], options: &[Option<Choice>]) -> Vec<Change> {
        let first = self.grid.starts[cells.start] as usize;
        let mut changes = Vec::new();
        let mut around: Vec<(i32, f64)> = Vec::new();
        let mut costs = Vec::new();
        for cell in cells.filter(|cell| self.active[*cell]) {
            around.clear();
            match self.alike(cell) {
                // Nothing to choose from.
                Some(label) if label < 0 => continue,
                Some(label) => around.push((label, 1.0)),
                None => {
                    add_votes(&mut around, self.votes_of(cell), OWN_CELL_WEIGHT);
                    for other in self.neighbors.of(cell) {
                        add_votes(&mut around, self.votes_of(*other as usize), 1.0);
                    }
                }
            }
            let none = costs_of(options, &around, &mut costs);
            for place in self.places(cell) {
                let label = best(&costs, none, self.points_m[place]);
                let slot = &mut labels[place - first];
                if *slot != label {
                    changes.push(Change { cell: cell as u32, place: place as u32, from: *slot, to: label });
                    *slot = label;
                }
            }
        }
        changes
    }

    /// The label of all points in and around a cell, if they have the same.
    fn alike(&self, cell: usize) -> Option<i32> {
        let label = self.polls[cell].first.label;
        let same = |poll: &Poll| poll.kinds == 1 && poll.first.label == label;
        let all = same(&self.polls[cell])
            && self.neighbors.of(cell).iter().all(|other| same(&self.polls[*other as usize]));
        all.then_some(label)
    }

    /// Counts for each label the points on no plane in and around its cells, on either side as `side` says.
    pub(crate) fn free_beside(
        &self,
        labels: usize,
        side: impl Fn(i32, [f64; 3]) -> Option<bool> + Sync,
    ) -> Vec<[u32; 2]> {
        let of_cell = |cell: usize| {
            let mut found: Vec<(i32, bool)> = Vec::new();
            if !self.votes_of(cell).iter().any(|vote| vote.label < 0) {
                return found;
            }
            let mut around: Vec<(i32, f64)> = Vec::new();
            add_votes(&mut around, self.votes_of(cell), 1.0);
            self.neighbors
                .of(cell)
                .iter()
                .for_each(|other| add_votes(&mut around, self.votes_of(*other as usize), 1.0));
            for place in self.places(cell).filter(|place| self.labels[*place] < 0) {
                let p = self.points_m[place].map(f64::from);
                let beside = around.iter().filter(|vote| vote.0 >= 0);
                found.extend(beside.filter_map(|vote| Some((vote.0, side(vote.0, p)?))));
            }
            found
        };
        let mut counts = vec![[0; 2]; labels];
        let cells = (0..self.grid.len()).into_par_iter().with_min_len(CELLS_PER_TASK);
        for (label, above) in cells.flat_map_iter(of_cell).collect::<Vec<_>>() {
            counts[label as usize][usize::from(above)] += 1;
        }
        counts
    }

    fn places(&self, cell: usize) -> Range<usize> {
        self.grid.starts[cell] as usize..self.grid.starts[cell + 1] as usize
    }

    fn votes_of(&self, cell: usize) -> &[Vote] {
        let poll = &self.polls[cell];
        if poll.kinds == 1 {
            return std::slice::from_ref(&poll.first);
        }
        let start = self.grid.starts[cell] as usize;
        &self.votes[start..start + poll.kinds as usize]
    }

    /// Counts the labels of a cell. A cell has no more of them than points, so its places hold them.
    fn count(&mut self, cell: usize) {
        let places = self.places(cell);
        self.polls[cell] = count(&self.labels[places.clone()], &mut self.votes[places]);
    }

    /// Has a cell and those near it choose in the next round.
    fn wake(&mut self, cell: usize) {
        self.active[cell] = true;
        self.neighbors.of(cell).iter().for_each(|other| self.active[*other as usize] = true);
    }

    /// Has all cells choose in the next round.
    pub(crate) fn wake_all(&mut self) {
        self.active.fill(true);
    }

    /// Moves a point from the sums of one label to those of another.
    fn shift(&mut self, change: &Change) {
        let mut point = Scatter::default();
        point.add(self.points_m[change.place as usize].map(f64::from));
        let at = |label: i32| usize::try_from(label).ok();
        if let Some(sum) = at(change.from).and_then(|from| self.sums.get_mut(from)) {
            sum.remove(&point);
        }
        if let Some(sum) = at(change.to).and_then(|to| self.sums.get_mut(to)) {
            sum.merge(&point);
        }
    }
}

/// Writes down how often each label occurs.
fn count(labels: &[i32], votes: &mut [Vote]) -> Poll {
    let mut kinds = 0;
    for &label in labels {
        match votes[..kinds].iter_mut().find(|vote| vote.label == label) {
            Some(vote) => vote.count += 1,
            None => {
                votes[kinds] = Vote { label, count: 1 };
                kinds += 1;
            }
        }
    }
    Poll { first: votes.first().copied().unwrap_or_default(), kinds: kinds as u32 }
}

/// Cells in runs of about the same number, each with its part of what the points have.
fn runs<'b, T>(grid: &Grid, mut of_points: &'b mut [T]) -> Vec<Run<'b, T>> {
    let mut runs = Vec::with_capacity(grid.len() / CELLS_PER_TASK + 1);
    for first in (0..grid.len()).step_by(CELLS_PER_TASK) {
        let end = (first + CELLS_PER_TASK).min(grid.len());
        let (own, rest) = of_points.split_at_mut((grid.starts[end] - grid.starts[first]) as usize);
        runs.push((first..end, own));
        of_points = rest;
    }
    runs
}

/// The best plane of each label's points, as free as it was before; `None` for a label with too few.
pub(crate) fn refit(sums: &[Scatter], before: &[Option<Fit>]) -> Vec<Option<Fit>> {
    sums.iter().zip(before).map(|(sum, fit)| sum.fit_again(fit.as_ref())).collect()
}

/// The sums of each label's points. The points are added up in pieces of a fixed size, so that threads make
/// no difference.
pub(crate) fn scatters(points_m: &[[f32; 3]], labels: &[i32], count: usize) -> Vec<Scatter> {
    let sums_of = |(points_m, labels): (&[[f32; 3]], &[i32])| {
        let mut sums = vec![Scatter::default(); count];
        for (p, label) in points_m.iter().zip(labels) {
            if let Some(sum) = usize::try_from(*label).ok().and_then(|index| sums.get_mut(index)) {
                sum.add(p.map(f64::from));
            }
        }
        sums
    };
    let pieces = points_m.par_chunks(POINTS_PER_PIECE).zip(labels.par_chunks(POINTS_PER_PIECE));
    let parts: Vec<Vec<Scatter>> = pieces.map(sums_of).collect();
    let mut sums = vec![Scatter::default(); count];
    for part in &parts {
        sums.iter_mut().zip(part).for_each(|(sum, part)| sum.merge(part));
    }
    sums
}
