//! Circles through points of a plane that is crossed by an axis: through three, and the best of many. Meters.

use biplane_geometry::PortableMath;

/// A circle.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Circle {
    /// Its center.
    pub center_m: [f64; 2],
    /// Its radius.
    pub radius_m: f64,
}

impl Circle {
    /// How far a point lies outside.
    pub(crate) fn off_m(&self, p: [f64; 2]) -> f64 {
        (p[0] - self.center_m[0]).portable_hypot(p[1] - self.center_m[1]) - self.radius_m
    }
}

/// The circle through three points; `None` when they lie in a line.
pub(crate) fn through([a, b, c]: [[f64; 2]; 3]) -> Option<Circle> {
    let ([bx, by], [cx, cy]) = ([b[0] - a[0], b[1] - a[1]], [c[0] - a[0], c[1] - a[1]]);
    let twice = 2.0 * (bx * cy - by * cx);
    let (bb, cc) = (bx * bx + by * by, cx * cx + cy * cy);
    if twice.abs() <= 1e-9 * (bb + cc) {
        return None;
    }
    let [x, y] = [(cy * bb - by * cc) / twice, (bx * cc - cx * bb) / twice];
    Some(Circle { center_m: [a[0] + x, a[1] + y], radius_m: x.portable_hypot(y) })
}

/// The circle of least algebraic error (Kasa 1976); a start for the fit that weighs true distances.
pub(crate) fn algebraic(points: impl Iterator<Item = [f64; 2]> + Clone) -> Option<Circle> {
    let (mut n, mut mean) = (0.0, [0.0; 2]);
    for [x, y] in points.clone() {
        n += 1.0;
        mean[0] += x;
        mean[1] += y;
    }
    if n < 3.0 {
        return None;
    }
    mean = mean.map(|v| v / n);
    let (mut xx, mut xy, mut yy, mut xz, mut yz) = (0.0, 0.0, 0.0, 0.0, 0.0);
    for [x, y] in points {
        let [x, y] = [x - mean[0], y - mean[1]];
        let z = x * x + y * y;
        xx += x * x;
        xy += x * y;
        yy += y * y;
        xz += x * z;
        yz += y * z;
    }
    let determinant = xx * yy - xy * xy;
    if determinant <= 1e-9 * (xx + yy) * (xx + yy) {
        return None;
    }
    let x = 0.5 * (xz * yy - yz * xy) / determinant;
    let y = 0.5 * (yz * xx - xz * xy) / determinant;
    let radius_m = (x * x + y * y + (xx + yy) / n).sqrt();
    Some(Circle { center_m: [mean[0] + x, mean[1] + y], radius_m })
}

#[cfg(test)]
mod tests {
    use super::{algebraic, through};

    #[test]
    fn three_points_and_many_give_their_circle_and_a_line_gives_none() {
        let at = |angle: f64| [2.0 + 0.3 * angle.cos(), -1.0 + 0.3 * angle.sin()];
        let few = through([at(0.1), at(1.0), at(2.0)]).unwrap();
        let many = algebraic((0..20).map(|k| at(0.1 * f64::from(k)))).unwrap();
        for circle in [few, many] {
            assert!((circle.radius_m - 0.3).abs() < 1e-9, "{circle:?}");
            assert!((circle.center_m[0] - 2.0).abs() < 1e-9 && (circle.center_m[1] + 1.0).abs() < 1e-9);
        }
        let line = [[0.0, 0.0], [1.0, 1.0], [2.0, 2.0]];
        assert!(through(line).is_none() && algebraic(line.into_iter()).is_none());
    }
}
