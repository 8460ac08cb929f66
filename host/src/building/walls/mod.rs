//! Walls between rooms, and their openings.
//!
//! Two faces that look away from each other are a wall (Ochmann et al. 2016); rays that ended on a wall,
//! passed it or never came tell an opening from what is hidden (Adan and Huber 2011). Frame `map`, meters.

mod jambs;
pub(crate) mod openings;
pub(crate) mod overlaps;
pub(crate) mod rays;
pub(crate) mod sides;
mod sills;
pub(crate) mod slabs;
mod view;

use rayon::prelude::*;

use self::openings::Hole;
use self::rays::Elevation;
use self::slabs::Slab;
use self::view::WallView;
use crate::building::spaces::Plan;
use crate::building::spaces::evidence::Evidence;

/// A wall with its openings.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct OpenWall {
    /// The wall.
    pub slab: Slab,
    /// Its openings, along it.
    pub holes: Vec<Hole>,
    /// Its upper edge: the highest ceiling beside it, meters.
    pub top_m: f64,
    /// Share of its elevation on which rays ended, openings left out.
    pub seen_share: f64,
}

/// Height of a room whose ceiling nobody saw, meters.
pub(crate) const USUAL_HEIGHT_M: f64 = 2.5;

/// All walls of a plan.
pub(crate) fn find(evidence: &Evidence<'_>, plan: &Plan) -> Vec<OpenWall> {
    let sides = sides::find(plan);
    let slabs = overlaps::cut(slabs::find(evidence, &sides, &plan.faces));
    let usual_m = plan.overhead.usual_m.unwrap_or(evidence.floor_m + USUAL_HEIGHT_M);
    let open = |slab: Slab| {
        let ceilings = slab.spaces.iter().filter_map(|space| plan.spaces.get(*space)?.ceiling_m);
        let heights: Vec<f64> = ceilings.collect();
        let top_m = heights.iter().copied().reduce(f64::max).unwrap_or(usual_m);
        let ceiling_m = heights.iter().copied().reduce(f64::min).unwrap_or(usual_m);
        let elevation = Elevation::of(evidence, &slab, top_m);
        let view = WallView { evidence, overhead: &plan.overhead, slab: &slab, elevation, ceiling_m };
        let holes = view.openings();
        let seen_share = seen_share(&view, &holes);
        OpenWall { holes, top_m, seen_share, slab }
    };
    slabs.into_par_iter().map(open).collect()
}

/// Share of a wall's elevation, but for its openings, on which rays ended.
fn seen_share(view: &WallView<'_>, holes: &[Hole]) -> f64 {
    let elevation = &view.elevation;
    let (mut wall, mut all) = (0, 0);
    for row in 0..elevation.size[1] {
        for column in 0..elevation.size[0] {
            let at = elevation.origin_m[0] + (column as f64 + 0.5) * rays::STEP_M;
            let z_m = elevation.origin_m[1] + (row as f64 + 0.5) * rays::STEP_M;
            let is_open = holes.iter().any(|hole| {
                hole.span[0] < at && at < hole.span[1] && hole.bottom_m < z_m && z_m < hole.top_m
            });
            if !is_open {
                all += 1;
                wall += usize::from(elevation.shown(column, row) == rays::Shown::Wall);
            }
        }
    }
    if all == 0 { 0.0 } else { f64::from(wall as u32) / f64::from(all as u32) }
}
