//! The cylinder that lies nearest to points: Gauss-Newton over place, direction and radius, with points far
//! off left out. Meters.

use super::axis::{Axis, Tube};
use biplane_geometry::vec3::{plus, scaled};

/// Steps; each halves what is wrong at the very least, most do far better.
const STEPS: usize = 8;
/// A tilt of the axis counts when it is so many of its own deviations: short things do not tell theirs.
const TILT_DEVIATIONS: f64 = 4.0;
/// Share of a deviation of a range that is common to many points: poses.
const COMMON_SHARE: f64 = 0.35;

/// The parameters: two places across the axis, two tilts, the radius.
type Five = [f64; 5];

/// Fits a cylinder to points, those within `limit_m` of it; `None` when they do not fix one. With `fixed` the
/// direction stays.
pub(crate) fn fit(
    start: Tube,
    points: &[[f64; 3]],
    (sigma_m, limit_m): (f64, f64),
    fixed: bool,
) -> Option<Tube> {
    let mut tube = start;
    for step in 0..STEPS {
        // Farther off at first: a start through three points is no better than their noise.
        let reach_m = if step < 3 { 1.5 * limit_m } else { limit_m };
        let (moved, size_m) = advance(tube, points, (sigma_m, reach_m), fixed)?;
        tube = moved;
        if step >= 3 && size_m < 1e-6 {
            break;
        }
    }
    Some(tube)
}

/// A fit that keeps the direction of the start, unless the points say clearly that it is another.
pub(crate) fn fit_upright(start: Tube, points: &[[f64; 3]], limits: (f64, f64)) -> Option<Tube> {
    let straight = fit(start, points, limits, true)?;
    let Some(tilted) = fit(straight, points, limits, false) else { return Some(straight) };
    let (sigma_m, limit_m) = limits;
    let length_m = spread_m(&straight, points, limit_m);
    let count = points.iter().filter(|p| straight.off_m(**p).abs() <= limit_m).count().max(1) as f64;
    let deviation = sigma_m * (1.0 / count + COMMON_SHARE * COMMON_SHARE / 16.0).sqrt() / length_m.max(1e-3);
    let cosine: f64 = straight.axis.direction().iter().zip(tilted.axis.direction()).map(|(a, b)| a * b).sum();
    let tilt = (1.0 - cosine * cosine).max(0.0).sqrt();
    Some(if tilt > TILT_DEVIATIONS * deviation { tilted } else { straight })
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
fn advance(
    tube: Tube,
    points: &[[f64; 3]],
    (sigma_m, reach_m): (f64, f64),
    fixed: bool,
) -> Option<(Tube, f64)> {
    // Lengths along the axis count from the points' middle, so that place and tilt do not mix.
    let near = || {
        points
            .iter()
            .map(|p| tube.axis.local(*p))
            .filter(|[x, y, _]| (x.hypot(*y) - tube.radius_m).abs() <= reach_m)
    };
    let (count, sum) = near().fold((0.0, 0.0), |(n, sum), [.., along]| (n + 1.0, sum + along));
    if count < 6.0 {
        return None;
    }
    let middle = sum / count;
    let (mut normal, mut right) = ([[0.0; 5]; 5], [0.0; 5]);
    for [x, y, along] in near() {
        let distance = x.hypot(y).max(1e-9);
        let residual = distance - tube.radius_m;
        let share = residual / reach_m;
        let weight = (1.0 - share * share).powi(2);
        let (x, y, w) = (x / distance, y / distance, along - middle);
        let row: Five = [-x, -y, -w * x, -w * y, -1.0];
        for i in 0..5 {
            for j in 0..5 {
                normal[i][j] += weight * row[i] * row[j];
            }
            right[i] -= weight * row[i] * residual;
        }
    }
    if fixed {
        for tilt in [2, 3] {
            normal[tilt] = [0.0; 5];
            normal.iter_mut().for_each(|row| row[tilt] = 0.0);
            (normal[tilt][tilt], right[tilt]) = (1.0, 0.0);
        }
    } else {
        // A weak hold on the direction, as of one point a meter away.
        normal[2][2] += 1.0;
        normal[3][3] += 1.0;
    }
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

/// Solves five equations by elimination with pivots.
fn solve(mut m: [Five; 5], mut b: Five) -> Option<Five> {
    for column in 0..5 {
        let pivot = (column..5).max_by(|i, j| m[*i][column].abs().total_cmp(&m[*j][column].abs()))?;
        if m[pivot][column].abs() < 1e-9 {
            return None;
        }
        m.swap(column, pivot);
        b.swap(column, pivot);
        for row in column + 1..5 {
            let share = m[row][column] / m[column][column];
            let above = m[column];
            m[row].iter_mut().zip(above).for_each(|(v, a)| *v -= share * a);
            b[row] -= share * b[column];
        }
    }
    for row in (0..5).rev() {
        let known: f64 = (row + 1..5).map(|k| m[row][k] * b[k]).sum();
        b[row] = (b[row] - known) / m[row][row];
    }
    Some(b)
}

#[cfg(test)]
mod tests {
    use super::fit;
    use crate::reconstruct::planes::paper::random::Random;
    use crate::reconstruct::shapes::fit::axis::{Axis, Tube};
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
        let tube = fit(start, &points, (0.015, 0.06), false).unwrap();
        assert!((tube.radius_m - 0.25).abs() < 0.004, "{}", tube.radius_m);
        assert!(dot(tube.axis.direction(), truth.direction()) > 0.00001f64.cos() - 1e-4);
        let [x, y, _] = tube.axis.local(truth.point_m);
        assert!(x.hypot(y) < 0.006, "{x} {y}");
    }
}
