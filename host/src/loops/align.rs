//! Points on surfaces: where a set of end points lies in another one, by Gauss-Newton steps on the distances to the lines of the
//! nearest surfaces, and what that knows (the Hessian).
//!
//! A pose here is that of the moving points in the frame of the surfaces; its error is (x, y) along that frame's axes and the turn.

use biplane_matcher::{Pose2, wrap_angle};
use nalgebra::{Matrix3, Vector3};

use super::surfaces::{Surfaces, placed};
use biplane_matcher::EndPoint;

/// Noise of an end point across its wall, metres.
const NOISE_M: f32 = 0.02;
/// Noise of an end point about one that lies on no line, metres.
const POINT_NOISE_M: f32 = 0.06;
/// So many beams together know what one would if their errors were independent.
const BEAMS_PER_INDEPENDENT_ONE: f64 = 5.0;
/// A point this close to a surface is explained, metres.
const EXPLAINED_M: f32 = 0.1;

/// Normal equations of all points at a pose.
#[derive(Clone, Copy, Debug)]
pub struct Sums {
    /// J^T W J: what the points know of x, y (1/m^2) and the turn.
    pub information: Matrix3<f64>,
    /// J^T W r.
    pub gradient: Vector3<f64>,
    /// Weight of the points that lie on a surface.
    pub explained: f64,
    /// Weight of all points.
    pub total: f64,
}

impl Sums {
    /// Share of the points that lie on a surface.
    pub fn share(&self) -> f64 {
        if self.total > 0.0 { self.explained / self.total } else { 0.0 }
    }
}

/// Sums up at a pose. Residuals beyond `scale_m` count less (Cauchy).
pub fn sum_up(surfaces: &Surfaces, points: &[EndPoint], pose: &Pose2, reach_m: f32, scale_m: f32) -> Sums {
    let (sin, cos) = pose.theta_rad.sin_cos();
    let (turn, shift_m) = ((sin as f32, cos as f32), [pose.x_m as f32, pose.y_m as f32]);
    let mut sums =
        Sums { information: Matrix3::zeros(), gradient: Vector3::zeros(), explained: 0.0, total: 0.0 };
    let mut upper = [0.0_f64; 9];
    for point in points {
        let moved = placed(point, turn, shift_m);
        sums.total += f64::from(point.weight);
        let Some(surface) = surfaces.nearest(&moved, reach_m) else { continue };
        let offset = [moved.at_m[0] - surface.at_m[0], moved.at_m[1] - surface.at_m[1]];
        let arm = [moved.at_m[0] - shift_m[0], moved.at_m[1] - shift_m[1]];
        let normal = if surface.has_normal() { surface.normal } else { moved.normal };
        let on_line = normal != [0.0; 2];
        let away_m = if on_line { dot(normal, offset).abs() } else { dot(offset, offset).sqrt() };
        if away_m < EXPLAINED_M {
            sums.explained += f64::from(point.weight);
        }
        let weight = point.weight / (1.0 + (away_m / scale_m).powi(2));
        if on_line {
            let weight = weight / (NOISE_M * NOISE_M);
            add(&mut upper, normal, dot(normal, [-arm[1], arm[0]]), dot(normal, offset), weight);
        } else {
            let weight = weight / (POINT_NOISE_M * POINT_NOISE_M);
            add(&mut upper, [1.0, 0.0], -arm[1], offset[0], weight);
            add(&mut upper, [0.0, 1.0], arm[0], offset[1], weight);
        }
    }
    let [xx, xy, xt, yy, yt, tt, x, y, t] = upper.map(|value| value / BEAMS_PER_INDEPENDENT_ONE);
    sums.information = Matrix3::new(xx, xy, xt, xy, yy, yt, xt, yt, tt);
    sums.gradient = Vector3::new(x, y, t);
    sums
}

fn add(sums: &mut [f64; 9], direction: [f32; 2], turn: f32, residual: f32, weight: f32) {
    let [x, y] = direction;
    let terms =
        [x * x, x * y, x * turn, y * y, y * turn, turn * turn, x * residual, y * residual, turn * residual];
    for (sum, term) in sums.iter_mut().zip(terms) {
        *sum += f64::from(weight * term);
    }
}

fn dot(a: [f32; 2], b: [f32; 2]) -> f32 {
    a[0] * b[0] + a[1] * b[1]
}

/// Where points came to lie.
#[derive(Clone, Copy, Debug)]
pub struct Aligned {
    /// The pose.
    pub pose: Pose2,
    /// The sums there.
    pub sums: Sums,
}

/// Aligns points with surfaces from `prior`, which holds the pose with `held` (information) where the surfaces say little.
pub fn align(
    surfaces: &Surfaces,
    points: &[EndPoint],
    prior: &Pose2,
    held: &Matrix3<f64>,
    scales_m: &[f32],
) -> Aligned {
    let mut pose = *prior;
    for &scale_m in scales_m {
        let sums = sum_up(surfaces, points, &pose, (3.0 * scale_m).min(super::surfaces::REACH_M), scale_m);
        let away = difference(&pose, prior);
        let Some(factors) = (sums.information + held).cholesky() else { break };
        let step = factors.solve(&(sums.gradient + held * away));
        if !step.iter().all(|value| value.is_finite()) {
            break;
        }
        pose = moved(&pose, &-step);
        if step[0].hypot(step[1]) < 5e-4 && step[2].abs() < 2e-4 && scale_m <= scales_m[scales_m.len() - 1] {
            break;
        }
    }
    let last_m = scales_m.last().copied().unwrap_or(0.05);
    let sums = sum_up(surfaces, points, &pose, (3.0 * last_m).min(super::surfaces::REACH_M), last_m);
    Aligned { pose, sums }
}

/// The error of `pose` against `other`: (x, y) along the outer frame's axes, and the turn.
pub fn difference(pose: &Pose2, other: &Pose2) -> Vector3<f64> {
    Vector3::new(pose.x_m - other.x_m, pose.y_m - other.y_m, wrap_angle(pose.theta_rad - other.theta_rad))
}

/// The pose with an error added; the inverse of [`difference`].
pub fn moved(pose: &Pose2, step: &Vector3<f64>) -> Pose2 {
    Pose2::new(pose.x_m + step[0], pose.y_m + step[1], wrap_angle(pose.theta_rad + step[2]))
}

#[cfg(test)]
mod tests {
    use super::align;
    use crate::loops::surfaces::Surfaces;
    use biplane_matcher::EndPoint;
    use biplane_matcher::Pose2;
    use nalgebra::Matrix3;

    /// Walls of a room 6 m by 4 m, or of a corridor without ends, seen from inside at a pose.
    fn walls(pose: Pose2, ends: bool) -> Vec<EndPoint> {
        let long = (-60..=60).flat_map(|at| {
            let x = f64::from(at) * 0.05;
            [([x, 2.0], [0.0, -1.0]), ([x, -2.0], [0.0, 1.0])]
        });
        let short = (-40..=40).filter(|_| ends).flat_map(|at| {
            let y = f64::from(at) * 0.05;
            [([3.0, y], [-1.0, 0.0]), ([-3.0, y], [1.0, 0.0])]
        });
        let inside = pose.inverse();
        let turn = Pose2::new(0.0, 0.0, inside.theta_rad);
        long.chain(short)
            .map(|(at, normal)| EndPoint {
                at_m: inside.transform(at).map(|value| value as f32),
                normal: turn.transform(normal).map(|value| value as f32),
                weight: 1.0,
                ..EndPoint::default()
            })
            .collect()
    }

    const SCALES_M: [f32; 8] = [0.3, 0.2, 0.1, 0.05, 0.05, 0.05, 0.05, 0.05];

    #[test]
    fn a_room_is_found_back_and_a_corridor_only_across() {
        let truth = Pose2::new(0.15, -0.1, 0.05);
        let held = Matrix3::identity();
        let room = Surfaces::new(&walls(Pose2::IDENTITY, true));
        let found = align(&room, &walls(truth, true), &Pose2::IDENTITY, &held, &SCALES_M);
        let off = super::difference(&found.pose, &truth);
        assert!(off.norm() < 5e-3, "{off}");
        assert!(found.sums.share() > 0.95);
        let corridor = Surfaces::new(&walls(Pose2::IDENTITY, false));
        let found = align(&corridor, &walls(truth, false), &Pose2::IDENTITY, &held, &SCALES_M);
        assert!((found.pose.y_m - truth.y_m).abs() < 5e-3, "{:?}", found.pose);
        let known = found.sums.information;
        assert!(known[(0, 0)] < 1e-3 * known[(1, 1)], "{known}");
    }
}
