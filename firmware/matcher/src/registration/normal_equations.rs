//! Normal equations of many end points at once.
//!
//! What each end point meets is gathered into arrays first, where every entry waits for its own cells and
//! surfaces; the arithmetic then runs over the arrays in lanes, without a branch and with one division an end
//! point. Sums are taken lane by lane in a fixed order: the same on every machine. Units: meters, radians;
//! map's axes.

use nalgebra::{Matrix3, Vector3};

/// End points that are gathered at a time.
pub(crate) const BATCH: usize = 64;
/// Sums that run side by side.
const LANES: usize = 4;

/// Upper triangle of J^T W J, and J^T W r.
#[derive(Copy, Clone, Debug, Default)]
pub(crate) struct Normal {
    xx: f32,
    xy: f32,
    xt: f32,
    yy: f32,
    yt: f32,
    tt: f32,
    x: f32,
    y: f32,
    t: f32,
}

impl Normal {
    /// One residual `r` with gradient `(direction, turn)` and weight.
    #[inline]
    pub(crate) fn add(&mut self, direction: [f32; 2], turn: f32, residual: f32, weight: f32) {
        let [dx, dy] = direction;
        self.xx += weight * dx * dx;
        self.xy += weight * dx * dy;
        self.xt += weight * dx * turn;
        self.yy += weight * dy * dy;
        self.yt += weight * dy * turn;
        self.tt += weight * turn * turn;
        self.x += weight * dx * residual;
        self.y += weight * dy * residual;
        self.t += weight * turn * residual;
    }

    /// Both coordinates of an end point's offset from a place, of equal weight.
    #[inline(always)]
    pub(crate) fn add_both(&mut self, arm: [f32; 2], offset: [f32; 2], weight: f32) {
        let turns = [-arm[1], arm[0]];
        self.xx += weight;
        self.yy += weight;
        self.xt += weight * turns[0];
        self.yt += weight * turns[1];
        self.x += weight * offset[0];
        self.y += weight * offset[1];
        for axis in 0..2 {
            self.tt += weight * turns[axis] * turns[axis];
            self.t += weight * turns[axis] * offset[axis];
        }
    }

    /// The sums of both.
    pub(crate) fn plus(&self, other: &Self) -> Self {
        Self {
            xx: self.xx + other.xx,
            xy: self.xy + other.xy,
            xt: self.xt + other.xt,
            yy: self.yy + other.yy,
            yt: self.yt + other.yt,
            tt: self.tt + other.tt,
            x: self.x + other.x,
            y: self.y + other.y,
            t: self.t + other.t,
        }
    }

    /// J^T W J.
    pub(crate) fn matrix(&self) -> Matrix3<f64> {
        symmetric([self.xx, self.xy, self.xt, self.yy, self.yt, self.tt])
    }

    /// J^T W r.
    pub(crate) fn vector(&self) -> Vector3<f64> {
        Vector3::new(f64::from(self.x), f64::from(self.y), f64::from(self.t))
    }
}

/// The step that takes J^T W r to zero, given J^T W J, the prior's information and how far the pose is from
/// the prior's mean. `None` when neither knows enough, or a number is not finite.
pub(crate) fn step(
    information: &Matrix3<f64>,
    gradient: &Vector3<f64>,
    prior_information: &Matrix3<f64>,
    residual: &Vector3<f64>,
) -> Option<Vector3<f64>> {
    let factors = (information + prior_information).cholesky()?;
    let step = -factors.solve(&(gradient + prior_information * residual));
    step.iter().all(|value| value.is_finite()).then_some(step)
}

/// A matrix of its upper triangle, row by row.
fn symmetric(upper: [f32; 6]) -> Matrix3<f64> {
    let [xx, xy, xt, yy, yt, tt] = upper.map(f64::from);
    Matrix3::new(xx, xy, xt, xy, yy, yt, xt, yt, tt)
}

/// End points on lines of the map: a column a quantity.
#[derive(Clone, Debug)]
pub(crate) struct Batch {
    /// From the base to the end point, meters.
    pub arm: [[f32; BATCH]; 2],
    /// From the surface's mean to the end point, meters.
    pub offset: [[f32; BATCH]; 2],
    /// The surface's mean normal, not of unit length.
    pub normal: [[f32; BATCH]; 2],
    /// Weight of the end point before its residual is known; zero for an entry that counts nothing.
    pub weight: [f32; BATCH],
    /// Entries in use.
    pub len: usize,
}

impl Default for Batch {
    fn default() -> Self {
        let nothing = [[0.0; BATCH]; 2];
        Self { arm: nothing, offset: nothing, normal: [[1.0; BATCH]; 2], weight: [0.0; BATCH], len: 0 }
    }
}

/// Sums over the lines: J^T W J and J^T W r, and the part of the tangents' J^T W J that does not follow from
/// it.
#[derive(Copy, Clone, Debug, Default)]
pub(crate) struct LineSums {
    lanes: [[f32; LANES]; 12],
}

impl LineSums {
    /// Adds all of a batch under Cauchy weights of this scale (meters), and empties it.
    #[inline(never)] // four lanes are as wide as every processor has them, and inlined they are taken apart
    pub(crate) fn take(&mut self, batch: &mut Batch, scale_m: f32) {
        let used = batch.len.next_multiple_of(LANES).min(BATCH);
        batch.weight[batch.len..used].fill(0.0);
        let inverse = 1.0 / (scale_m * scale_m);
        let ([ax, ay], [ox, oy], [nx, ny]) = (&batch.arm, &batch.offset, &batch.normal);
        let mut sums = self.lanes;
        for first in (0..used).step_by(LANES) {
            let some = |column: &[f32; BATCH]| -> [f32; LANES] {
                std::array::from_fn(|lane| column[(first + lane) % BATCH])
            };
            let [ax, ay, ox, oy, nx, ny, weight] =
                [some(ax), some(ay), some(ox), some(oy), some(nx), some(ny), some(&batch.weight)];
            let zeros = [0.0; LANES];
            let [mut residual, mut turn, mut along] = [zeros; 3];
            let [mut wx, mut wy, mut wt, mut wa] = [zeros; 4];
            for i in 0..LANES {
                residual[i] = ox[i] * nx[i] + oy[i] * ny[i];
                turn[i] = ax[i] * ny[i] - ay[i] * nx[i];
                along[i] = ax[i] * nx[i] + ay[i] * ny[i];
                // With normals as they are, each product is `strength` too large: the weight takes it off.
                let strength = nx[i] * nx[i] + ny[i] * ny[i];
                let weight = weight[i] / (strength + residual[i] * residual[i] * inverse);
                [wx[i], wy[i], wt[i], wa[i]] =
                    [weight * nx[i], weight * ny[i], weight * turn[i], weight * along[i]];
            }
            let [xx, xy, xt, yy, yt, tt, x, y, t, ya, xa, aa] = &mut sums;
            add_products(xx, &wx, &nx);
            add_products(xy, &wx, &ny);
            add_products(xt, &wx, &turn);
            add_products(yy, &wy, &ny);
            add_products(yt, &wy, &turn);
            add_products(tt, &wt, &turn);
            add_products(x, &wx, &residual);
            add_products(y, &wy, &residual);
            add_products(t, &wt, &residual);
            add_products(ya, &wy, &along);
            add_products(xa, &wx, &along);
            add_products(aa, &wa, &along);
        }
        self.lanes = sums;
        batch.len = 0;
    }

    /// The residuals' normal equations with weights times `factor` (1 / variance), and J^T W J over the
    /// walls' tangents.
    pub(crate) fn finish(&self, factor: f32) -> (Normal, Matrix3<f64>) {
        let sums = self.lanes.map(|lanes| factor * ((lanes[0] + lanes[1]) + (lanes[2] + lanes[3])));
        let [xx, xy, xt, yy, yt, tt, x, y, t, ya, xa, aa] = sums;
        // A tangent is the normal turned by a right angle: (-y, x).
        (Normal { xx, xy, xt, yy, yt, tt, x, y, t }, symmetric([yy, -xy, -ya, xx, xa, aa]))
    }
}

/// Adds products lane by lane.
#[inline(always)]
fn add_products(sum: &mut [f32; LANES], a: &[f32; LANES], b: &[f32; LANES]) {
    for lane in 0..LANES {
        sum[lane] += a[lane] * b[lane];
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Numbers between -1 and 1 that look random.
    fn noise(i: usize, k: usize) -> f32 {
        ((i * 7919 + k * 104_729) % 1009) as f32 / 504.5 - 1.0
    }

    #[test]
    fn sums_of_a_batch_are_those_of_its_end_points_one_by_one() {
        let (mut batch, mut sums) = (Batch::default(), LineSums::default());
        let (mut normal, mut tangent) = (Normal::default(), Normal::default());
        let (scale_m, factor) = (0.3, 5.0);
        for i in 0..101 {
            let [arm, offset] = [[noise(i, 1), noise(i, 2)], [noise(i, 3), noise(i, 4)]];
            let (angle, length) = (3.0 * noise(i, 5), 0.9 + 0.1 * noise(i, 6));
            let weight = 1.0 + noise(i, 7);
            for axis in 0..2 {
                batch.arm[axis][batch.len] = arm[axis];
                batch.offset[axis][batch.len] = offset[axis];
                batch.normal[axis][batch.len] = length * [angle.cos(), angle.sin()][axis];
            }
            batch.weight[batch.len] = weight;
            batch.len += 1;
            if batch.len == BATCH || i == 100 {
                sums.take(&mut batch, scale_m);
            }
            let n = [angle.cos(), angle.sin()];
            let r = offset[0] * n[0] + offset[1] * n[1];
            let w = factor * weight / (1.0 + (r / scale_m).powi(2));
            normal.add(n, arm[0] * n[1] - arm[1] * n[0], r, w);
            tangent.add([-n[1], n[0]], arm[0] * n[0] + arm[1] * n[1], 0.0, w);
        }
        let (found, along) = sums.finish(factor);
        assert!((found.matrix() - normal.matrix()).norm() < 1e-4 * normal.matrix().norm(), "{found:?}");
        assert!((found.vector() - normal.vector()).norm() < 1e-4 * normal.matrix().norm(), "{found:?}");
        assert!((along - tangent.matrix()).norm() < 1e-4 * along.norm(), "{along}");
    }

    #[test]
    fn a_step_ends_between_the_prior_and_what_was_measured_by_what_each_knows() {
        // Measured: x = 1, three times as surely as the prior's 0; the other two only the prior knows.
        let known = Matrix3::from_diagonal(&Vector3::new(3.0, 0.0, 0.0));
        let (prior, gradient) = (Matrix3::identity(), Vector3::new(-3.0, 0.0, 0.0));
        let found = step(&known, &gradient, &prior, &Vector3::new(0.0, 0.2, -0.1)).unwrap();
        assert!((found - Vector3::new(0.75, -0.2, 0.1)).norm() < 1e-12, "{found}");
    }

    #[test]
    fn where_nothing_is_known_there_is_no_step() {
        let nothing = Matrix3::zeros();
        assert_eq!(step(&nothing, &Vector3::zeros(), &nothing, &Vector3::zeros()), None);
        let wild = Vector3::new(f64::NAN, 0.0, 0.0);
        assert_eq!(step(&Matrix3::identity(), &wild, &nothing, &Vector3::zeros()), None);
    }
}
