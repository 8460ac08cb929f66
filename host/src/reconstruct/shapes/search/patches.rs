//! Planes in the pieces that hang together, and the points that may lie on something round: those on no
//! plane, and those on narrow pieces. Meters.
//!
//! A row of columns has its foremost strips in one plane, which is as wide as the row; its pieces are narrow.

use super::cells::{key_at, pairs};
use crate::model::Cloud;
use crate::model::voxels::Voxels;
use crate::reconstruct::planes::fit::scatter::{Fit, Scatter};
use crate::reconstruct::planes::labeled::Planes;
use biplane_geometry::UnionFind;

/// Edge of the cells over which pieces hang together.
const CELL_M: f64 = 0.2;
/// A piece of a plane that is at most so wide may be a strip of something round. A strip of a cylinder of
/// radius r is as wide as its sagitta stays within the noise.
const MAX_STRIP_M: f64 = 1.0;
/// Points on no plane this near to a wide piece, in deviations, are its own noise.
const NOISE_DEVIATIONS: f64 = 5.0;
/// Fewest points of a piece that has a direction.
const MIN_PATCH_POINTS: f64 = 20.0;
/// No slot, no piece.
const NONE: u32 = u32::MAX;

/// A piece of a plane that hangs together.
#[derive(Clone, Debug)]
pub(crate) struct Patch {
    /// Its own fit.
    pub fit: Fit,
    /// Where its middle is.
    pub center_m: [f64; 3],
    /// Its points.
    pub points: Vec<u32>,
}

/// A cloud divided into pieces.
#[derive(Debug, Default)]
pub(crate) struct Patches {
    /// The pieces that are large enough, in the order in which the cloud has them.
    pub patches: Vec<Patch>,
    /// Points that may be on something round, in their order.
    pub candidates: Vec<u32>,
    /// Pairs of pieces of different planes that come near each other.
    pub beside: Vec<(u32, u32)>,
}

/// How wide a piece is, as a rectangle that spreads as far.
pub(crate) fn width_m(fit: &Fit) -> f64 {
    (12.0 * fit.variances_m2[1]).sqrt()
}

/// Whether a piece is too wide for a strip of something round.
pub(crate) fn is_wide(fit: &Fit) -> bool {
    width_m(fit) > MAX_STRIP_M
}

/// Divides the planes of a cloud.
pub(crate) fn divide(cloud: &Cloud, found: &Planes) -> Patches {
    let slots = Slots::new(cloud, found);
    let (pieces, touching) = slots.pieces();
    let mut sums: Vec<Scatter> = Vec::new();
    for (slot, piece) in slots.slots.iter().zip(&pieces) {
        if *piece as usize == sums.len() {
            sums.push(Scatter::default());
        }
        sums[*piece as usize].merge(&slot.sum);
    }
    let fits: Vec<Option<Fit>> = sums.iter().map(Scatter::fit).collect();
    let wide: Vec<bool> = fits.iter().map(|fit| fit.as_ref().is_some_and(is_wide)).collect();
    let candidates = slots.candidates(cloud, found, |slot| wide[pieces[slot as usize] as usize]);
    let mut number = vec![NONE; sums.len()];
    let mut patches: Vec<Patch> = Vec::new();
    for piece in pieces.iter().map(|piece| *piece as usize) {
        let fit = fits[piece].filter(|fit| number[piece] == NONE && fit.count >= MIN_PATCH_POINTS);
        if let Some(fit) = fit {
            number[piece] = patches.len() as u32;
            patches.push(Patch { fit, center_m: sums[piece].mean(), points: Vec::new() });
        }
    }
    for (point, slot) in (0..).zip(&slots.slot_of) {
        let piece = pieces.get(*slot as usize).map_or(NONE, |piece| number[*piece as usize]);
        if let Some(patch) = patches.get_mut(piece as usize) {
            patch.points.push(point);
        }
    }
    let of = |slot: u32| number[pieces[slot as usize] as usize];
    let mut beside: Vec<(u32, u32)> = touching
        .into_iter()
        .map(|(a, b)| (of(a).min(of(b)), of(a).max(of(b))))
        .filter(|(a, b)| a != b && *b != NONE)
        .collect();
    beside.sort_unstable();
    beside.dedup();
    Patches { patches, candidates, beside }
}

/// A cell and a plane in it.
struct Slot {
    key: u64,
    plane: i32,
    /// The slot of another plane in the same cell, or [`NONE`].
    other: u32,
    sum: Scatter,
}

/// The points of planes in cells.
struct Slots {
    slots: Vec<Slot>,
    /// The slot of each point; [`NONE`] for those on no plane.
    slot_of: Vec<u32>,
    /// The slot of each cell that the others of it are told by.
    by_cell: Voxels<u32>,
}

impl Slots {
    fn new(cloud: &Cloud, found: &Planes) -> Self {
        let mut this =
            Self { slots: Vec::new(), slot_of: vec![NONE; cloud.len()], by_cell: Voxels::default() };
        let mut last = NONE;
        for (point, (p, label)) in cloud.points_m.iter().zip(&found.labels).enumerate() {
            if *label < 0 {
                continue;
            }
            let Some(key) = key_at(*p, CELL_M) else { continue };
            let is_same = |slot: &Slot| slot.key == key && slot.plane == *label;
            if !this.slots.get(last as usize).is_some_and(is_same) {
                last = this.slot(key, *label);
            }
            this.slots[last as usize].sum.add(p.map(f64::from));
            this.slot_of[point] = last;
        }
        this
    }

    /// The slot of a plane in a cell, a new one when there is none.
    fn slot(&mut self, key: u64, plane: i32) -> u32 {
        let first = self.by_cell.entry(key).or_insert(NONE);
        let mut slot = *first;
        while let Some(here) = self.slots.get(slot as usize) {
            if here.plane == plane {
                return slot;
            }
            slot = here.other;
        }
        let new = self.slots.len() as u32;
        self.slots.push(Slot { key, plane, other: *first, sum: Scatter::default() });
        *first = new;
        new
    }

    /// The number of each slot's piece, counted in the order of the slots, and the slots of different planes
    /// that are in the same cell or in neighbors.
    fn pieces(&self) -> (Vec<u32>, Vec<(u32, u32)>) {
        let mut sets = UnionFind::new(self.slots.len());
        let mut touching = Vec::new();
        let mut entries: Vec<(u64, u32)> =
            self.slots.iter().zip(0..).map(|(slot, index)| (slot.key, index)).collect();
        pairs(&mut entries, |a, b| {
            if self.slots[a as usize].plane == self.slots[b as usize].plane {
                sets.join(a, b);
            } else {
                touching.push((a, b));
            }
        });
        let mut number = vec![NONE; self.slots.len()];
        let mut count = 0;
        let mut pieces = Vec::with_capacity(self.slots.len());
        for index in 0..self.slots.len() as u32 {
            let root = sets.root(index) as usize;
            if number[root] == NONE {
                number[root] = count;
                count += 1;
            }
            pieces.push(number[root]);
        }
        (pieces, touching)
    }

    /// The points that may be on something round.
    fn candidates(&self, cloud: &Cloud, found: &Planes, is_wide: impl Fn(u32) -> bool) -> Vec<u32> {
        let limit_m = NOISE_DEVIATIONS * found.sigma_m;
        let is_noise = |p: [f32; 3]| {
            let first = key_at(p, CELL_M).and_then(|key| self.by_cell.get(&key)).copied();
            let next = |slot: &u32| Some(self.slots[*slot as usize].other).filter(|slot| *slot != NONE);
            std::iter::successors(first, next).any(|slot| {
                let plane = &found.planes[self.slots[slot as usize].plane as usize];
                is_wide(slot) && plane.distance_m(p.map(f64::from)).abs() < limit_m
            })
        };
        let is_candidate = |point: &u32| {
            let slot = self.slot_of[*point as usize];
            if slot == NONE { !is_noise(cloud.points_m[*point as usize]) } else { !is_wide(slot) }
        };
        (0..cloud.len() as u32).filter(is_candidate).collect()
    }
}
