//! A cylinder without ends, and points as it sees them. Meters, radians.

use crate::model::cylinder::zero_of;
use biplane_geometry::PortableMath;
use biplane_geometry::vec3::{cross, dot, minus, plus, scaled, unit};

/// An axis with the two directions across it.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Axis {
    /// A point of the axis.
    pub point_m: [f64; 3],
    /// Directions: at angle 0, a quarter of a turn on, along the axis.
    pub frame: [[f64; 3]; 3],
}

impl Axis {
    /// An axis through a point. Upright ones point up, others to the map's x, or y.
    pub(crate) fn new(point_m: [f64; 3], direction: [f64; 3]) -> Self {
        let along = unit(direction);
        let leading = if along[2].abs() > 0.5 {
            along[2]
        } else if along[0].abs() > 0.1 {
            along[0]
        } else {
            along[1]
        };
        let along = if leading < 0.0 { scaled(along, -1.0) } else { along };
        let zero = zero_of(along);
        Self { point_m, frame: [zero, cross(along, zero), along] }
    }

    /// Its direction.
    pub(crate) fn direction(&self) -> [f64; 3] {
        self.frame[2]
    }

    /// A point in the axis's own coordinates: two across it, one along it.
    pub(crate) fn local(&self, point_m: [f64; 3]) -> [f64; 3] {
        let off = minus(point_m, self.point_m);
        self.frame.map(|direction| dot(direction, off))
    }

    /// The axis through another point of its own coordinates.
    pub(crate) fn through(&self, [x, y]: [f64; 2]) -> Self {
        let point_m = plus(self.point_m, plus(scaled(self.frame[0], x), scaled(self.frame[1], y)));
        Self { point_m, ..*self }
    }
}

/// An axis with a radius.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Tube {
    /// Its axis.
    pub axis: Axis,
    /// Its radius.
    pub radius_m: f64,
}

impl Tube {
    /// How far a point lies outside the surface.
    pub(crate) fn off_m(&self, point_m: [f64; 3]) -> f64 {
        let [x, y, _] = self.axis.local(point_m);
        x.portable_hypot(y) - self.radius_m
    }
}
