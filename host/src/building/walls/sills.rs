//! Whether the wall under an opening was seen, or its lower edge is only where the beams end.
//!
//! The fan looks up from the height of its laser, so that the leaf of a shut door, seen from there on, looks
//! like a window with a low sill. A sill is wall that lies on the face, under something that lies behind it.

use super::view::WallView;
use crate::building::elements::NARROWEST_DOOR_M;
use crate::building::elevation::Span;
use biplane_geometry::quantile::upper_median;

/// A door is at least this high, meters.
pub(super) const MIN_DOOR_M: f64 = 1.75;
/// What rays hit under this height is a sill, meters.
pub(super) const MAX_THRESHOLD_M: f64 = 0.75;
/// Closed openings that are wider have panes, meters; two leaves are narrower.
pub(super) const MAX_LEAF_M: f64 = 1.6;
/// Wall is seen under an opening when beams came this much lower than its lower edge, meters: two cells.
const MIN_BELOW_M: f64 = 0.1;
/// Fewer rays tell of no depth.
const MIN_RAYS: usize = 8;
/// Edges of openings are kept out of what is looked at, meters.
const EDGE_M: f64 = 0.05;
/// How far beside an opening its wall is looked at, meters.
const BESIDE_M: f64 = 0.5;
/// Panes and leaves lie no deeper in a wall, meters.
const MAX_REVEAL_M: f64 = 0.5;
/// Points on a shut leaf are as deep in the wall as each other, but for noise, handles and panels, meters.
const LEAF_M: f64 = 0.05;
/// An opening is closed when more of the rays that come into it end there.
const MIN_FILLED: f64 = 0.7;

/// What is known of the lower edge of an opening.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Below {
    /// Wall was seen under it.
    Wall,
    /// Nothing was seen under it, or what was seen lies as deep as the opening: the beams begin there.
    BeamsBegin,
    /// Something stands before it.
    Hidden,
}

/// The median of some values; `None` of too few.
fn median(mut values: Vec<f64>) -> Option<f64> {
    values.sort_by(f64::total_cmp);
    upper_median(&values).filter(|_| values.len() >= MIN_RAYS)
}

impl WallView<'_> {
    /// What is under an opening, from where it begins to where it ends.
    pub(super) fn below(&self, [from, to]: Span, [bottom_m, top_m]: Span) -> Below {
        let border_m = (to - from) / 8.0;
        let middle = [from + border_m, to - border_m];
        let lowest_m = self.lowest_m(middle);
        let is_hidden = lowest_m > self.evidence.laser_m() + MIN_BELOW_M;
        let low = self.depths_m(middle, [lowest_m, bottom_m - EDGE_M]);
        if bottom_m - lowest_m >= MIN_BELOW_M
            && let (Some(low_m), Some(open_m)) =
                (median(low), median(self.depths_m(middle, [bottom_m + EDGE_M, top_m - EDGE_M])))
        {
            let face_m = self.face_beside_m([from, to], [lowest_m, top_m]);
            if low_m - face_m < open_m - low_m {
                return Below::Wall;
            }
        }
        if is_hidden { Below::Hidden } else { Below::BeamsBegin }
    }

    /// Whether an opening of which nothing was seen under it has the width of a door, and its head.
    pub(super) fn is_shut(&self, [from, to]: Span, [bottom_m, top_m]: Span, below: Below) -> bool {
        let floor_m = self.evidence.floor_m;
        below == Below::BeamsBegin
            && (NARROWEST_DOOR_M..=MAX_LEAF_M).contains(&(to - from))
            && bottom_m < floor_m + MAX_THRESHOLD_M
            && top_m - floor_m >= MIN_DOOR_M
            && top_m < self.ceiling_m
    }

    /// How far behind the face of the wall rays end that come into an opening.
    fn beyond_m(&self, [from, to]: Span) -> Vec<f64> {
        let ends = self.elevation.rays.iter().filter_map(|(place, beyond_m)| {
            let at = f64::from(place[0]);
            beyond_m.filter(|_| at > from && at < to).map(f64::from)
        });
        ends.collect()
    }

    /// Whether most rays that come into an opening end within it: on a pane, on a leaf.
    pub(super) fn is_filled(&self, span: Span) -> bool {
        let depths_m = self.beyond_m(span);
        let filled = depths_m.iter().filter(|depth_m| **depth_m < MAX_REVEAL_M).count();
        !depths_m.is_empty() && filled as f64 > MIN_FILLED * depths_m.len() as f64
    }

    /// Whether what fills an opening is as deep everywhere: a leaf that is shut. One that stands ajar is not.
    pub(super) fn has_leaf(&self, span: Span) -> bool {
        let depths_m = self.beyond_m(span);
        let Some(leaf_m) = median(depths_m.clone()) else { return false };
        let on_leaf = depths_m.iter().filter(|depth_m| (**depth_m - leaf_m).abs() < LEAF_M).count();
        leaf_m < MAX_REVEAL_M && on_leaf as f64 > MIN_FILLED * depths_m.len() as f64
    }

    /// Where each ray ended or came to the wall, and how far behind the face it ended.
    fn ends(&self) -> impl Iterator<Item = [f64; 3]> {
        let passed = self.elevation.rays.iter();
        let passed = passed.filter_map(|([at, z], beyond_m)| beyond_m.map(|beyond_m| [*at, *z, beyond_m]));
        passed.chain(self.elevation.on_face_m.iter().copied()).map(|ray| ray.map(f64::from))
    }

    /// The lowest place within a span to which a ray came, meters.
    fn lowest_m(&self, [from, to]: Span) -> f64 {
        let within = self.ends().filter(|[at, ..]| from < *at && *at < to);
        within.map(|[_, z, _]| z).fold(f64::INFINITY, f64::min)
    }

    /// How far behind the face the rays within a rectangle ended.
    fn depths_m(&self, [from, to]: Span, [low_m, high_m]: Span) -> Vec<f64> {
        let is_within = |at: f64, z: f64| from < at && at < to && low_m <= z && z < high_m;
        self.ends().filter(|[at, z, _]| is_within(*at, *z)).map(|[_, _, depth_m]| depth_m).collect()
    }

    /// How far behind its face the wall lies on both sides of an opening: faces are a mean of their pieces.
    fn face_beside_m(&self, [from, to]: Span, [low_m, high_m]: Span) -> f64 {
        let beside =
            self.elevation.on_face_m.iter().map(|point| point.map(f64::from)).filter(|[at, z, _]| {
                let off_m = (from - at).max(at - to);
                off_m > EDGE_M && off_m < BESIDE_M && low_m <= *z && *z < high_m
            });
        median(beside.map(|[_, _, depth_m]| depth_m).collect()).unwrap_or(0.0)
    }
}
