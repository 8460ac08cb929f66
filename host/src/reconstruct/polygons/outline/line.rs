//! Lines in a plane, and the line of least squares through a border.
//!
//! Plane coordinates in steps ([`crate::reconstruct::polygons::plane_frame`]).

use biplane_geometry::PortableMath;

/// A line without ends.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Line {
    /// A point of it.
    pub at: [f64; 2],
    /// Unit direction.
    pub direction: [f64; 2],
}

impl Line {
    /// The line through two points; of one and the same point, some line through it.
    pub(crate) fn through(a: [f64; 2], b: [f64; 2]) -> Self {
        let (x, y) = (b[0] - a[0], b[1] - a[1]);
        let length = x.portable_hypot(y);
        let direction = if length > 0.0 { [x / length, y / length] } else { [1.0, 0.0] };
        Self { at: a, direction }
    }

    /// Signed distance of a point, positive on the left.
    pub(crate) fn off(&self, p: [f64; 2]) -> f64 {
        self.direction[0] * (p[1] - self.at[1]) - self.direction[1] * (p[0] - self.at[0])
    }

    /// Where along the line a point lies.
    pub(crate) fn along(&self, p: [f64; 2]) -> f64 {
        self.direction[0] * (p[0] - self.at[0]) + self.direction[1] * (p[1] - self.at[1])
    }

    /// The point of the line nearest to another.
    pub(crate) fn foot(&self, p: [f64; 2]) -> [f64; 2] {
        let along = self.along(p);
        [self.at[0] + along * self.direction[0], self.at[1] + along * self.direction[1]]
    }

    /// Sine of the angle between two lines.
    pub(crate) fn sine(&self, other: &Self) -> f64 {
        self.direction[0] * other.direction[1] - self.direction[1] * other.direction[0]
    }

    /// Where two lines cross, if they do at an angle with at least this sine.
    pub(crate) fn crossing(&self, other: &Self, min_sine: f64) -> Option<[f64; 2]> {
        let sine = self.sine(other);
        if sine.abs() < min_sine {
            return None;
        }
        let along = -other.off(self.at) / -sine;
        Some([self.at[0] + along * self.direction[0], self.at[1] + along * self.direction[1]])
    }
}

/// Moments of edges, each with the weight of its length: they add up, and give the line of least squares.
/// Coordinates count from an origin that the caller keeps.
#[derive(Clone, Copy, Debug, Default)]
pub(crate) struct Moments {
    length: f64,
    first: [f64; 2],
    xx: f64,
    xy: f64,
    yy: f64,
}

impl Moments {
    /// Those of one edge.
    pub(crate) fn of_edge(origin: [f64; 2], a: [f64; 2], b: [f64; 2]) -> Self {
        let length = (b[0] - a[0]).portable_hypot(b[1] - a[1]);
        let (middle, half) =
            ([0, 1].map(|k| 0.5 * (a[k] + b[k]) - origin[k]), [0, 1].map(|k| 0.5 * (b[k] - a[k])));
        let second = |i: usize, k: usize| length * (middle[i] * middle[k] + half[i] * half[k] / 3.0);
        Self {
            length,
            first: middle.map(|v| length * v),
            xx: second(0, 0),
            xy: second(0, 1),
            yy: second(1, 1),
        }
    }

    /// Those of two borders together.
    pub(crate) fn plus(&self, other: &Self) -> Self {
        Self {
            length: self.length + other.length,
            first: [self.first[0] + other.first[0], self.first[1] + other.first[1]],
            xx: self.xx + other.xx,
            xy: self.xy + other.xy,
            yy: self.yy + other.yy,
        }
    }

    /// The middle of the border.
    pub(crate) fn middle(&self, origin: [f64; 2]) -> [f64; 2] {
        if self.length > 0.0 { [0, 1].map(|k| origin[k] + self.first[k] / self.length) } else { origin }
    }

    /// The second moments about the middle: xx, xy, yy.
    fn central(&self) -> [f64; 3] {
        if self.length <= 0.0 {
            return [0.0; 3];
        }
        let [x, y] = self.first;
        [self.xx - x * x / self.length, self.xy - x * y / self.length, self.yy - y * y / self.length]
    }

    /// The line of least squares.
    pub(crate) fn line(&self, origin: [f64; 2]) -> Line {
        let [xx, xy, yy] = self.central();
        let angle = 0.5 * (2.0 * xy).portable_atan2(xx - yy);
        Line { at: self.middle(origin), direction: [angle.portable_cos(), angle.portable_sin()] }
    }

    /// The squared distances to a line, summed along the border.
    pub(crate) fn about(&self, line: &Line, origin: [f64; 2]) -> f64 {
        let [xx, xy, yy] = self.central();
        let [c, s] = line.direction;
        let off = line.off(self.middle(origin));
        (s * s * xx - 2.0 * s * c * xy + c * c * yy).max(0.0) + self.length * off * off
    }
}

#[cfg(test)]
mod tests {
    use super::{Line, Moments};

    #[test]
    fn lines_cross_where_both_pass() {
        let (a, b) = (Line::through([0.0, 1.0], [4.0, 3.0]), Line::through([5.0, 0.0], [3.0, 4.0]));
        let crossing = a.crossing(&b, 0.1).unwrap();
        assert!(a.off(crossing).abs() < 1e-12 && b.off(crossing).abs() < 1e-12, "{crossing:?}");
        assert_eq!(a.crossing(&Line::through([0.0, 0.0], [2.0, 1.0]), 0.1), None);
        assert!((a.off([0.0, 2.0]) - 2.0 / 5.0_f64.sqrt()).abs() < 1e-12, "left is positive");
        assert!(Line::through([1.0, 1.0], [1.0, 1.0]).foot([3.0, 4.0]).iter().all(|v| v.is_finite()));
    }

    #[test]
    fn moments_are_those_of_many_points_along_the_edges() {
        let corners = [[2.0, 1.0], [5.0, 2.0], [6.0, 5.0], [9.0, 5.5]];
        let origin = [1.0, -2.0];
        let sum = corners
            .windows(2)
            .fold(Moments::default(), |sum, edge| sum.plus(&Moments::of_edge(origin, edge[0], edge[1])));
        let line = sum.line(origin);
        // By brute force: a thousand points an edge.
        let about = |line: &Line| -> f64 {
            let edge = |pair: &[[f64; 2]]| {
                let length = (pair[1][0] - pair[0][0]).hypot(pair[1][1] - pair[0][1]);
                let at = |k: usize| (k as f64 + 0.5) / 1000.0;
                let point = |t: f64| [0, 1].map(|i| pair[0][i] + t * (pair[1][i] - pair[0][i]));
                (0..1000).map(|k| line.off(point(at(k))).powi(2)).sum::<f64>() * length / 1000.0
            };
            corners.windows(2).map(edge).sum()
        };
        assert!((sum.about(&line, origin) - about(&line)).abs() < 1e-4);
        for turn in [-0.01, 0.01_f64] {
            let [c, s] = line.direction;
            let direction = [c * turn.cos() - s * turn.sin(), s * turn.cos() + c * turn.sin()];
            assert!(about(&Line { direction, ..line }) > about(&line));
        }
    }
}
