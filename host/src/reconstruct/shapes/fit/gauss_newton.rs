//! The cylinder that lies nearest to points: Gauss-Newton over place, direction and radius, with points far
//! off left out. Where beams are known, each point counts by how squarely it was seen: what a beam
//! grazes is smeared along it, between the thing and what is behind it. Meters.

use super::axis::{Axis, Tube};
use super::circle_fit;
use super::sample::Sample;
use super::steps::{STEPS, WIDE_STEPS, solve};
use biplane_geometry::PortableMath;
use biplane_geometry::vec3::{dot, minus, norm, plus, scaled};

/// A step of so little, meters and radians, is the last.
const SETTLED: f64 = 1e-5;
/// A tilt of the axis counts when it is so many of its own deviations: short things do not tell theirs.
const TILT_DEVIATIONS: f64 = 4.0;
/// A tilt may come to count when its first step is so many.
const MAY_TILT_DEVIATIONS: f64 = 2.0;
/// Share of a deviation of a range that is common to many points: poses.
const COMMON_SHARE: f64 = 0.35;

/// The parameters: two places across the axis, two tilts, the radius.
type Five = [f64; 5];

/// A point near a tube.
struct Near {
    /// In the tube's own coordinates.
    local: [f64; 3],
    /// Distance from the axis.
    distance_m: f64,
    /// Cosine between the beam and the surface there, positive from outside; 1 where nobody knows.
    cosine: f64,
}

impl Sample<'_> {
    /// How long each beam is.
    fn lengths_m(&self) -> Vec<f64> {
        self.points_m.iter().zip(self.origins_m).map(|(p, origin)| norm(minus(*p, *origin))).collect()
    }

    /// Finds the points within a distance of a tube's surface.
    fn near(&self, lengths_m: &[f64], tube: &Tube, reach_m: f64, near: &mut Vec<Near>) {
        let [zero, quarter, _] = tube.axis.frame;
        near.clear();
        for (index, p) in self.points_m.iter().enumerate() {
            let local = tube.axis.local(*p);
            let [x, y, _] = local;
            let distance_m = x.portable_hypot(y);
            if (distance_m - tube.radius_m).abs() > reach_m {
                continue;
            }
            let cosine = lengths_m.get(index).map_or(1.0, |length_m| {
                let beam = minus(*p, self.origins_m[index]);
                -(x * dot(zero, beam) + y * dot(quarter, beam)) / (distance_m * length_m).max(1e-9)
            });
            near.push(Near { local, distance_m, cosine });
        }
    }
}

/// Fits a cylinder of any direction to points, those within `limit_m` of it; `None` when they do not fix one.
fn fit(start: Tube, points: Sample<'_>, (sigma_m, limit_m): (f64, f64)) -> Option<Tube> {
    let mut tube = start;
    let lengths_m = points.lengths_m();
    let mut near = Vec::with_capacity(points.points_m.len());
    for step in 0..STEPS {
        let reach_m = if step < WIDE_STEPS { 1.5 * limit_m } else { limit_m };
        points.near(&lengths_m, &tube, reach_m, &mut near);
        let (moved, size_m) = advance(tube, &near, (sigma_m, reach_m))?;
        tube = moved;
        if step >= WIDE_STEPS && size_m < SETTLED {
            break;
        }
    }
    Some(tube)
}

/// A fit that keeps the direction of the start, unless the points say clearly that it is another.
pub(crate) fn fit_upright(start: Tube, points: Sample<'_>, limits: (f64, f64)) -> Option<Tube> {
    let straight = circle_fit::fit(start, points, limits)?;
    if !may_lean(&straight, points, limits) {
        return Some(straight);
    }
    let Some(tilted) = fit(straight, points, limits) else { return Some(straight) };
    let is_clear = tilt_deviations(&straight, &tilted, points, limits) > TILT_DEVIATIONS;
    Some(if is_clear { tilted } else { straight })
}

/// Whether points may say that the axis of a fit without tilt runs otherwise: the first step tells most.
pub(crate) fn may_lean(straight: &Tube, points: Sample<'_>, limits: (f64, f64)) -> bool {
    let (sigma_m, limit_m) = limits;
    let mut near = Vec::with_capacity(points.points_m.len());
    points.near(&points.lengths_m(), straight, limit_m, &mut near);
    let first = advance(*straight, &near, (sigma_m, limit_m));
    first.is_some_and(|(tilted, _)| tilt_deviations(straight, &tilted, points, limits) > MAY_TILT_DEVIATIONS)
}

/// The tilt between two fits, in the deviations that the noise makes of none.
fn tilt_deviations(
    straight: &Tube,
    tilted: &Tube,
    points: Sample<'_>,
    (sigma_m, limit_m): (f64, f64),
) -> f64 {
    let length_m = spread_m(straight, points.points_m, limit_m);
    let count = points.points_m.iter().filter(|p| straight.off_m(**p).abs() <= limit_m).count().max(1) as f64;
    let deviation = sigma_m * (1.0 / count + COMMON_SHARE * COMMON_SHARE / 16.0).sqrt() / length_m.max(1e-3);
    let cosine: f64 = straight.axis.direction().iter().zip(tilted.axis.direction()).map(|(a, b)| a * b).sum();
    let tilt = (1.0 - cosine * cosine).max(0.0).sqrt();
    tilt / deviation
}

/// Deviation of the points along the axis.
fn spread_m(tube: &Tube, points: &[[f64; 3]], limit_m: f64) -> f64 {
    let (mut n, mut sum, mut squares) = (0.0, 0.0, 0.0);
    for p in points.iter().filter(|p| tube.off_m(**p).abs() <= limit_m) {
        let along = tube.axis.local(*p)[2];
        n += 1.0;
        sum += along;
        squares += along * along;
    }
    if n < 2.0 { 0.0 } else { (squares / n - (sum / n) * (sum / n)).max(0.0).sqrt() }
}

/// One step, and how far it went.
fn advance(tube: Tube, near: &[Near], (sigma_m, reach_m): (f64, f64)) -> Option<(Tube, f64)> {
    if near.len() < 6 {
        return None;
    }
    // Lengths along the axis count from the points' middle, so that place and tilt do not mix.
    let middle = near.iter().map(|point| point.local[2]).sum::<f64>() / near.len() as f64;
    let (mut normal, right) = equations(&tube, near, reach_m, middle);
    // A weak hold on the direction, as of one point a meter away.
    [2, 3].into_iter().for_each(|tilt| normal[tilt][tilt] += 1.0);
    let step = solve(normal, right)?;
    let [zero, quarter, along] = tube.axis.frame;
    let center = plus(tube.axis.point_m, scaled(along, middle));
    let center = plus(center, plus(scaled(zero, step[0]), scaled(quarter, step[1])));
    let direction = plus(along, plus(scaled(zero, step[2]), scaled(quarter, step[3])));
    let radius_m = tube.radius_m + step[4];
    let sane = step.iter().all(|v| v.is_finite()) && radius_m > 0.2 * sigma_m && radius_m < 100.0;
    let size_m = step.iter().map(|v| v.abs()).fold(0.0, f64::max);
    sane.then(|| (Tube { axis: Axis::new(center, direction), radius_m }, size_m))
}

/// The normal equations.
fn equations(tube: &Tube, near: &[Near], reach_m: f64, middle: f64) -> ([Five; 5], Five) {
    let side = near.iter().map(|point| point.cosine).sum::<f64>().signum();
    let (mut normal, mut right) = ([[0.0; 5]; 5], [0.0; 5]);
    for Near { local: [x, y, along], distance_m, cosine } in near {
        let distance = distance_m.max(1e-9);
        let residual = distance - tube.radius_m;
        let share = residual / reach_m;
        // What seems to be seen from the other side is a smear beyond an edge.
        let square = (side * cosine).max(0.0);
        let weight = (1.0 - share * share).powi(2) * square * square;
        let (x, y, w) = (x / distance, y / distance, along - middle);
        let row: Five = [-x, -y, -w * x, -w * y, -1.0];
        for i in 0..5 {
            for j in 0..5 {
                normal[i][j] += weight * row[i] * row[j];
            }
            right[i] -= weight * row[i] * residual;
        }
    }
    (normal, right)
}

#[cfg(test)]
mod tests {
    use super::fit;
    use crate::reconstruct::planes::paper::random::Random;
    use crate::reconstruct::shapes::fit::axis::{Axis, Tube};
    use crate::reconstruct::shapes::fit::sample::Sample;
    use biplane_geometry::vec3::{dot, plus, scaled};

    #[test]
    fn half_a_noisy_column_that_leans_gives_its_axis_and_radius() {
        let mut random = Random::new(3);
        let truth = Axis::new([2.0, -1.0, 0.5], [0.05, 0.02, 1.0]);
        let point = |random: &mut Random| {
            let (angle, along) = (3.0 * random.unit(), 3.0 * random.unit());
            let r = 0.25 + 0.015 * random.normal();
            let [zero, quarter, up] = truth.frame;
            let out = plus(scaled(zero, r * angle.cos()), scaled(quarter, r * angle.sin()));
            plus(truth.point_m, plus(out, scaled(up, along)))
        };
        let points: Vec<[f64; 3]> = (0..2000).map(|_| point(&mut random)).collect();
        let start = Tube { axis: Axis::new([2.05, -1.03, 2.0], [0.0, 0.0, 1.0]), radius_m: 0.3 };
        let tube = fit(start, Sample::blind(&points), (0.015, 0.06)).unwrap();
        assert!((tube.radius_m - 0.25).abs() < 0.004, "{}", tube.radius_m);
        assert!(dot(tube.axis.direction(), truth.direction()) > 0.00001f64.cos() - 1e-4);
        let [x, y, _] = tube.axis.local(truth.point_m);
        assert!(x.hypot(y) < 0.006, "{x} {y}");
    }
}
