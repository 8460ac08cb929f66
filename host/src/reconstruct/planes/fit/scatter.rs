//! The sums from which the best plane of a set of points follows, kept so that adding a point or a set takes
//! constant time.
//!
//! Meters. Source: the paper, equations 2 and 3: the plane goes through the center of mass, its normal is the
//! eigenvector of the smallest eigenvalue of the scatter matrix, and that eigenvalue is the sum of the
//! squared distances.

use biplane_geometry::{plane, vec3::dot};

use super::eigen::{Eigen, Symmetric, eigen};

/// Count, sum and sum of outer products of a set of points.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub(crate) struct Scatter {
    count: f64,
    sum: [f64; 3],
    outer: Symmetric,
}

/// The best plane of a set of points.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Fit {
    /// Unit normal; its sign is arbitrary.
    pub normal: [f64; 3],
    /// `normal . p = offset_m` on the plane.
    pub offset_m: f64,
    /// Mean squared distances along the three principal axes, ascending, square meters; the first is the mean
    /// squared error.
    pub variances_m2: [f64; 3],
    /// Number of points.
    pub count: f64,
    /// Whether the normal is that of another plane, because these points alone do not tell it well.
    pub held: bool,
}

impl Scatter {
    /// Adds one point.
    pub(crate) fn add(&mut self, p: [f64; 3]) {
        self.count += 1.0;
        for (slot, value) in self.sum.iter_mut().zip(p) {
            *slot += value;
        }
        let products = [p[0] * p[0], p[0] * p[1], p[0] * p[2], p[1] * p[1], p[1] * p[2], p[2] * p[2]];
        for (slot, value) in self.outer.iter_mut().zip(products) {
            *slot += value;
        }
    }

    /// Adds all points of another set.
    pub(crate) fn merge(&mut self, other: &Self) {
        self.combine(other, 1.0);
    }

    /// Takes all points of a subset away.
    pub(crate) fn remove(&mut self, other: &Self) {
        self.combine(other, -1.0);
    }

    fn combine(&mut self, other: &Self, sign: f64) {
        self.count += sign * other.count;
        for (slot, value) in self.sum.iter_mut().zip(other.sum) {
            *slot += sign * value;
        }
        for (slot, value) in self.outer.iter_mut().zip(other.outer) {
            *slot += sign * value;
        }
    }

    /// Number of points.
    pub(crate) fn count(&self) -> f64 {
        self.count
    }

    /// Center of mass; the origin for no points.
    pub(crate) fn mean(&self) -> [f64; 3] {
        let scale = self.count.max(1.0).recip();
        self.sum.map(|value| value * scale)
    }

    /// Covariance about the center of mass (divided by the count).
    fn covariance(&self) -> Symmetric {
        let [x, y, z] = self.mean();
        let scale = self.count.max(1.0).recip();
        let about = [x * x, x * y, x * z, y * y, y * z, z * z];
        std::array::from_fn(|k| self.outer[k] * scale - about[k])
    }

    /// The best plane; `None` for fewer than three points.
    pub(crate) fn fit(&self) -> Option<Fit> {
        if self.count < 3.0 {
            return None;
        }
        let Eigen { values, smallest_vector: normal } = eigen(&self.covariance());
        let offset_m = dot(normal, self.mean());
        Some(Fit {
            normal,
            offset_m,
            variances_m2: values.map(|v| v.max(0.0)),
            count: self.count,
            held: false,
        })
    }

    /// The best plane with a given normal; `None` for fewer than three points.
    pub(crate) fn fit_along(&self, normal: [f64; 3]) -> Option<Fit> {
        let free = self.fit()?;
        let offset_m = dot(normal, self.mean());
        let (_, error) = self.distance_to(normal, offset_m);
        let [_, width, length] = free.variances_m2;
        Some(Fit { normal, offset_m, variances_m2: [error, width, length], count: self.count, held: true })
    }

    /// The best plane of another's points after some have left or joined: its normal stays when it is held.
    pub(crate) fn fit_again(&self, before: Option<&Fit>) -> Option<Fit> {
        match before {
            Some(fit) if fit.held => self.fit_along(fit.normal),
            _ => self.fit(),
        }
    }

    /// Mean signed distance and mean squared distance of the set to a plane, meters and square meters.
    pub(crate) fn distance_to(&self, normal: [f64; 3], offset_m: f64) -> (f64, f64) {
        let [xx, xy, xz, yy, yz, zz] = self.covariance();
        let [a, b, c] = normal;
        let variance = a * a * xx + b * b * yy + c * c * zz + 2.0 * (a * b * xy + a * c * xz + b * c * yz);
        let mean = dot(normal, self.mean()) - offset_m;
        (mean, variance.max(0.0) + mean * mean)
    }
}

/// How far a normal that is held may be off, radians.
pub(crate) const HELD_DEVIATION_RAD: f64 = 0.0015;

impl Fit {
    /// Signed distance of a point, meters.
    pub(crate) fn distance_m(&self, p: [f64; 3]) -> f64 {
        plane::distance_m(self.normal, self.offset_m, p)
    }

    /// How far the normal may be off, radians, one standard deviation: the error's spread over the narrower
    /// width of the set. The error counts as `least_error_m` at least, so that a line that is straight by
    /// chance is no plane.
    pub(crate) fn normal_deviation_rad(&self, min_error_m: f64) -> f64 {
        if self.held {
            return HELD_DEVIATION_RAD;
        }
        let [error, width, _] = self.variances_m2;
        if width <= 0.0 {
            return f64::INFINITY;
        }
        (error.max(min_error_m * min_error_m) / (width * self.count)).sqrt()
    }
}

#[cfg(test)]
mod tests {
    use super::{Scatter, dot};
    use crate::reconstruct::planes::paper::random::Random;

    fn noisy_patch(seed: u64) -> Vec<[f64; 3]> {
        let mut random = Random::new(seed);
        (0..200)
            .map(|_| {
                let (u, v) = (random.unit(), random.unit());
                [3.0 + u, 5.0 + v, 1.0 + 0.5 * u - 0.25 * v + 0.01 * random.normal()]
            })
            .collect()
    }

    fn scatter_of(points: &[[f64; 3]]) -> Scatter {
        let mut scatter = Scatter::default();
        points.iter().for_each(|p| scatter.add(*p));
        scatter
    }

    #[test]
    fn the_smallest_eigenvalue_is_the_mean_squared_distance_to_the_plane() {
        let points = noisy_patch(1);
        let fit = scatter_of(&points).fit().unwrap();
        let direct = points.iter().map(|p| fit.distance_m(*p).powi(2)).sum::<f64>() / 200.0;
        assert!((direct - fit.variances_m2[0]).abs() < 1e-12);
        // No tilted or shifted plane is better.
        for (tilt, shift) in [(0.01, 0.0), (-0.01, 0.0), (0.0, 0.002), (0.0, -0.002)] {
            let mut other = fit;
            other.normal[0] += tilt;
            let length = dot(other.normal, other.normal).sqrt();
            other.normal = other.normal.map(|v| v / length);
            other.offset_m = dot(other.normal, scatter_of(&points).mean()) + shift;
            let worse = points.iter().map(|p| other.distance_m(*p).powi(2)).sum::<f64>() / 200.0;
            assert!(worse > direct);
        }
    }

    #[test]
    fn sets_add_up_and_come_apart_again() {
        let points = noisy_patch(2);
        let (first, second) = points.split_at(80);
        let mut sum = scatter_of(first);
        sum.merge(&scatter_of(second));
        let (whole, merged) = (scatter_of(&points).fit().unwrap(), sum.fit().unwrap());
        assert!((dot(whole.normal, merged.normal).abs() - 1.0).abs() < 1e-12);
        sum.remove(&scatter_of(second));
        assert!(
            (sum.fit().unwrap().offset_m.abs() - scatter_of(first).fit().unwrap().offset_m.abs()).abs()
                < 1e-9
        );
    }

    #[test]
    fn distances_of_a_set_are_those_of_its_points() {
        let points = noisy_patch(3);
        let (mean, squared) = scatter_of(&points).distance_to([0.6, 0.0, 0.8], 2.0);
        let each: Vec<f64> = points.iter().map(|p| dot([0.6, 0.0, 0.8], *p) - 2.0).collect();
        assert!((mean - each.iter().sum::<f64>() / 200.0).abs() < 1e-12);
        assert!((squared - each.iter().map(|d| d * d).sum::<f64>() / 200.0).abs() < 1e-12);
    }

    #[test]
    fn two_points_have_no_plane() {
        assert!(scatter_of(&[[0.0; 3], [1.0; 3]]).fit().is_none());
    }
}
