//! End points that stand alone off what their neighbors on both sides lie on.
//!
//! They say nothing of the surface that their neighbors lie on. A few are legs before walls; where they are
//! many, beams fall short (dust, rain, glare), and these also end close to what they should have met. Units:
//! meters.

use crate::scan::end_point::EndPoint;
use biplane_geometry::vec2::distance;

/// So many neighbors on either side tell whether a point stands alone.
const ASIDE: usize = 3;
/// A point stands alone when the way by it is so many times as long as the way past it.
const DETOUR: f32 = 4.0;
/// Where few points stand alone, one closer than this to the one before or after it does not, meters.
const APART_M: f32 = 1.0;
/// More than this share of the points is many.
const MANY: f32 = 0.1;

/// Marks those that stand alone. `gaps_m` has the way from the point before to each one, and one more after
/// the last. What is closer than `reach_m` to a neighbor has company.
#[inline(always)]
pub(super) fn mark(points: &mut [EndPoint], gaps_m: &[f32], reach_m: f32) {
    let many = points.len() as f32 * MANY;
    let mut count = 0;
    for index in 1..points.len().saturating_sub(1) {
        let is_apart = gaps_m[index] > reach_m && gaps_m[index + 1] > reach_m;
        if is_apart && stands_alone(points, index) {
            points[index].alone = true;
            count += 1;
        }
    }
    if count as f32 <= many {
        for (point, gaps_m) in points.iter_mut().zip(gaps_m.windows(2)) {
            point.alone &= gaps_m[0] > APART_M && gaps_m[1] > APART_M;
        }
    }
}

/// Whether two neighbors, one on either side, are far closer to each other than by way of this point.
#[inline(always)]
fn stands_alone(points: &[EndPoint], index: usize) -> bool {
    let here = points[index].at_m;
    let (before, rest) = points.split_at(index);
    before.iter().rev().take(ASIDE).any(|a| {
        let to_a_m = distance(a.at_m, here);
        rest[1..].iter().take(ASIDE).any(|b| {
            let detour_m = to_a_m + distance(here, b.at_m);
            detour_m > DETOUR * distance(a.at_m, b.at_m)
        })
    })
}
