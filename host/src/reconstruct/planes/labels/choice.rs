//! How one point chooses: its own distance to each plane near it against what its neighbors chose. Meters.

use crate::reconstruct::planes::fit::noise::{DEVIATIONS, Noise};
use crate::reconstruct::planes::fit::scatter::Fit;
use biplane_geometry::PortableMath;
use biplane_geometry::vec3::dot;

/// Weight of the neighbors' choice against the point's own distance, in units of half a squared deviation.
const NEIGHBOR_WEIGHT: f64 = 6.0;
/// A point that is further than this many deviations from every plane near it is on none.
const NONE_DEVIATIONS: f64 = 3.0;

/// How many points chose a label; -1 is none of the planes.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub(crate) struct Vote {
    /// The label.
    pub label: i32,
    /// Points.
    pub count: u32,
}

/// A plane as a point sees it that chooses.
#[derive(Clone, Copy)]
pub(crate) struct Choice {
    normal: [f64; 3],
    offset_m: f64,
    /// Half the inverse variance.
    scale: f64,
    /// Cost of a wider noise.
    width: f64,
}

impl Choice {
    /// A plane with the noise that its points show.
    pub(crate) fn new(fit: &Fit, noise: Noise) -> Self {
        let variance_m2 = noise.variance_of(fit);
        let share = variance_m2 / (noise.sigma_m * noise.sigma_m);
        Self {
            normal: fit.normal,
            offset_m: fit.offset_m,
            scale: 0.5 / variance_m2,
            width: 0.5 * share.portable_ln(),
        }
    }
}

/// What each label around costs before a point's own distance, as (label, cost, plane); returns what no plane
/// costs.
pub(crate) fn costs_of(
    options: &[Option<Choice>],
    around: &[(i32, f64)],
    costs: &mut Vec<(i32, f64, Choice)>,
) -> f64 {
    let total: f64 = around.iter().map(|vote| vote.1).sum();
    let against = |votes: f64| NEIGHBOR_WEIGHT * (1.0 - votes / total);
    costs.clear();
    let mut none_share = 0.0;
    for &(label, votes) in around {
        match usize::try_from(label) {
            Ok(index) => {
                if let Some(choice) = options.get(index).copied().flatten() {
                    costs.push((label, choice.width + against(votes), choice));
                }
            }
            Err(_) => none_share = votes,
        }
    }
    0.5 * NONE_DEVIATIONS * NONE_DEVIATIONS + against(none_share)
}

/// The label that a point chooses, among those with costs and none of them.
pub(crate) fn best(costs: &[(i32, f64, Choice)], none: f64, point_m: [f32; 3]) -> i32 {
    let p = point_m.map(f64::from);
    let mut best = (none, -1);
    for (label, cost, choice) in costs {
        let off_m = dot(choice.normal, p) - choice.offset_m;
        let off = off_m * off_m * choice.scale;
        let cost = cost + off;
        let near = off <= 0.5 * DEVIATIONS * DEVIATIONS;
        if near && (cost < best.0 || (cost == best.0 && *label < best.1)) {
            best = (cost, *label);
        }
    }
    best.1
}

/// Adds votes of a cell, with a weight, to those gathered.
pub(crate) fn add_votes(votes: &mut Vec<(i32, f64)>, more: &[Vote], weight: f64) {
    for vote in more {
        let more = weight * f64::from(vote.count);
        match votes.iter_mut().find(|known| known.0 == vote.label) {
            Some(known) => known.1 += more,
            None => votes.push((vote.label, more)),
        }
    }
}
