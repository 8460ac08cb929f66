//! What lengths along a wall and across it are counted on: a straight line of the plan, or a circle.

use biplane_geometry::PortableMath;
use biplane_geometry::vec2::{dot, minus};
use std::f64::consts::{PI, TAU};

/// Cosine between the normals of lines that are parallel.
const PARALLEL: f64 = 1.0 - 1e-6;

/// A circle of the plan, and where on it lengths are 0. Frame `map`, meters.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Curve {
    /// Its center.
    pub center_m: [f64; 2],
    /// The radius at which lengths along it are measured.
    pub radius_m: f64,
    /// The direction from the center in which lengths begin, radians; it is in the middle of the wall, and
    /// they end half a turn from it.
    pub zero_rad: f64,
}

impl Curve {
    /// An angle, radians, as the length to it.
    pub(crate) fn at_m(&self, angle_rad: f64) -> f64 {
        self.radius_m * ((angle_rad - self.zero_rad + PI).rem_euclid(TAU) - PI)
    }

    /// The direction from the center at a length.
    pub(crate) fn normal(&self, at_m: f64) -> [f64; 2] {
        let (sin, cos) = (self.zero_rad + at_m / self.radius_m).portable_sin_cos();
        [cos, sin]
    }
}

/// How many chords are nowhere further from an arc of a radius and a length than a distance, meters.
pub(crate) fn chords(radius_m: f64, length_m: f64, away_m: f64) -> usize {
    let step = 2.0 * (1.0 - away_m / radius_m).max(-1.0).portable_acos();
    (length_m / radius_m / step).ceil().max(1.0) as usize
}

/// The line of a wall. Lengths along it run to the left of its normal: around a circle counter-clockwise.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) enum Line {
    /// All places across the normal; distances count along it from the origin.
    Straight {
        /// Unit vector.
        normal: [f64; 2],
    },
    /// A circle; distances count from its center.
    Curved(Curve),
}

impl Line {
    /// Where a place is: across and along, meters.
    pub(crate) fn place(&self, point: [f64; 2]) -> [f64; 2] {
        match self {
            Self::Straight { normal } => [dot(*normal, point), dot([-normal[1], normal[0]], point)],
            Self::Curved(curve) => {
                let [x, y] = minus(point, curve.center_m);
                [x.portable_hypot(y), curve.at_m(y.portable_atan2(x))]
            }
        }
    }

    /// The place at a length along and a distance across.
    pub(crate) fn point(&self, at_m: f64, across_m: f64) -> [f64; 2] {
        match self {
            Self::Straight { normal } => {
                [across_m * normal[0] - at_m * normal[1], across_m * normal[1] + at_m * normal[0]]
            }
            Self::Curved(curve) => {
                let normal = curve.normal(at_m);
                [0, 1].map(|axis| curve.center_m[axis] + across_m * normal[axis])
            }
        }
    }

    /// The direction across at a length.
    pub(crate) fn normal(&self, at_m: f64) -> [f64; 2] {
        match self {
            Self::Straight { normal } => *normal,
            Self::Curved(curve) => curve.normal(at_m),
        }
    }

    /// The circle of a curved one.
    pub(crate) fn curve(&self) -> Option<&Curve> {
        match self {
            Self::Straight { .. } => None,
            Self::Curved(curve) => Some(curve),
        }
    }

    /// Whether distances across both say the same.
    pub(crate) fn is_parallel(&self, other: &Self) -> bool {
        match (self, other) {
            (Self::Straight { normal }, Self::Straight { normal: other }) => dot(*normal, *other) > PARALLEL,
            (one, other) => one == other,
        }
    }

    /// Where a way between two places comes to a distance across: its share of the way, and the length along.
    /// On a straight line the way may be longer than that; into a circle and out of it, it comes once, and
    /// `None` where it does not reach it.
    pub(crate) fn crossing(&self, [from, to]: [[f64; 2]; 2], across_m: f64) -> Option<[f64; 2]> {
        let Self::Curved(curve) = self else {
            let [from, to] = [self.place(from), self.place(to)];
            let share = (across_m - from[0]) / (to[0] - from[0]);
            return Some([share, from[1] + share * (to[1] - from[1])]);
        };
        let (way, start) = (minus(to, from), minus(from, curve.center_m));
        let (a, half_b) = (dot(way, way), dot(way, start));
        let c = dot(start, start) - across_m * across_m;
        let under = half_b * half_b - a * c;
        if under < 0.0 || a <= 0.0 {
            return None;
        }
        // From outside the first of the two places, from inside the only one ahead.
        let root = if c > 0.0 { -under.sqrt() } else { under.sqrt() };
        let share = Some((root - half_b) / a).filter(|share| (0.0..=1.0).contains(share))?;
        let at_m = self.place([0, 1].map(|axis| from[axis] + share * way[axis]))[1];
        Some([share, at_m])
    }
}

#[cfg(test)]
mod tests {
    use super::{Curve, Line};

    fn near(found: [f64; 2], expected: [f64; 2]) {
        assert!((0..2).all(|k| (found[k] - expected[k]).abs() < 1e-9), "{found:?} {expected:?}");
    }

    #[test]
    fn places_on_a_circle_are_arcs_and_radii() {
        let curve = Curve { center_m: [1.0, 2.0], radius_m: 5.0, zero_rad: std::f64::consts::PI };
        let line = Line::Curved(curve);
        near(line.place([-4.0, 2.0]), [5.0, 0.0]);
        // Counter-clockwise from the west is south.
        near(line.place([1.0, -4.0]), [6.0, 5.0 * std::f64::consts::FRAC_PI_2]);
        near(line.point(-5.0 * std::f64::consts::FRAC_PI_2, 4.0), [1.0, 6.0]);
        near(line.normal(0.0), [-1.0, 0.0]);
    }

    #[test]
    fn a_way_comes_into_a_circle_once_and_out_of_it_once() {
        let line = Line::Curved(Curve { center_m: [0.0, 0.0], radius_m: 2.0, zero_rad: 0.0 });
        let crossing = |from, to| line.crossing([from, to], 2.0);
        near(crossing([-4.0, 0.0], [4.0, 0.0]).unwrap(), [0.25, -2.0 * std::f64::consts::PI]);
        near(crossing([0.0, 0.0], [4.0, 0.0]).unwrap(), [0.5, 0.0]);
        assert_eq!(crossing([-4.0, 3.0], [4.0, 3.0]), None);
        assert_eq!(crossing([0.0, 0.0], [1.0, 0.0]), None);
    }

    #[test]
    fn straight_places_come_back() {
        let line = Line::Straight { normal: [0.6, 0.8] };
        near(line.place(line.point(3.0, -1.5)), [-1.5, 3.0]);
        near(line.crossing([line.point(0.0, 0.0), line.point(2.0, 4.0)], 1.0).unwrap(), [0.25, 0.5]);
    }
}
