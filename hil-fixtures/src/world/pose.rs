//! Rigid motions in three dimensions: where one frame lies in another.
//!
//! `a_from_b.apply(p)` takes a point given in b to its coordinates in a; `a_from_b.then(b_from_c)` is
//! `a_from_c`. Meters, radians, axes of REP 103 (x forward, y left, z up). Angles are yaw, then pitch, then
//! roll (Z-Y-X), as in `rig.toml`.

use crate::world::vec3::{Vec3, add, scale, sub};

/// A rigid motion: rotation, then translation.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Pose {
    /// Where b's origin lies in a, meters.
    pub translation_m: Vec3,
    /// Columns are b's axes in a, stored by rows.
    pub rotation: [[f64; 3]; 3],
}

impl Default for Pose {
    fn default() -> Self {
        Self::from_angles([0.0; 3], [0.0; 3])
    }
}

impl Pose {
    /// From a translation and `[roll, pitch, yaw]` in radians: yaw then pitch then roll about the moving
    /// axes.
    #[must_use]
    pub fn from_angles(translation_m: Vec3, roll_pitch_yaw_rad: Vec3) -> Self {
        let [(sr, cr), (sp, cp), (sy, cy)] = roll_pitch_yaw_rad.map(f64::sin_cos);
        let rotation = [
            [cy * cp, cy * sp * sr - sy * cr, cy * sp * cr + sy * sr],
            [sy * cp, sy * sp * sr + cy * cr, sy * sp * cr - cy * sr],
            [-sp, cp * sr, cp * cr],
        ];
        Self { translation_m, rotation }
    }

    /// On the floor: `x`, `y` in meters and `yaw` in radians.
    #[must_use]
    pub fn planar(x_m: f64, y_m: f64, yaw_rad: f64) -> Self {
        Self::from_angles([x_m, y_m, 0.0], [0.0, 0.0, yaw_rad])
    }

    /// A direction of b, in a.
    #[must_use]
    pub fn rotate(&self, v: Vec3) -> Vec3 {
        self.rotation.map(|row| row[0] * v[0] + row[1] * v[1] + row[2] * v[2])
    }

    /// A point of b, in a.
    #[must_use]
    pub fn apply(&self, p: Vec3) -> Vec3 {
        add(self.rotate(p), self.translation_m)
    }

    /// `a_from_b.then(b_from_c)` is `a_from_c`.
    #[must_use]
    pub fn then(&self, b_from_c: &Self) -> Self {
        let [x, y, z] = [0, 1, 2].map(|c| self.rotate(b_from_c.rotation.map(|row| row[c])));
        Self {
            translation_m: self.apply(b_from_c.translation_m),
            rotation: [0, 1, 2].map(|r| [x[r], y[r], z[r]]),
        }
    }

    /// `b_from_a`.
    #[must_use]
    pub fn inverse(&self) -> Self {
        let r = &self.rotation;
        let rotation = [0, 1, 2].map(|c| [r[0][c], r[1][c], r[2][c]]);
        let back = Self { translation_m: [0.0; 3], rotation };
        Self { translation_m: sub([0.0; 3], back.rotate(self.translation_m)), rotation }
    }

    /// Heading: the direction of b's x axis seen from above, radians in -pi..=pi.
    #[must_use]
    pub fn yaw_rad(&self) -> f64 {
        self.rotation[1][0].atan2(self.rotation[0][0])
    }

    /// The rotation as a quaternion x, y, z, w with w >= 0.
    #[must_use]
    pub fn quaternion_xyzw(&self) -> [f64; 4] {
        let r = &self.rotation;
        // Four times the squares of w, x, y, z; the largest of them is safe to divide by.
        let squares = [
            1.0 + r[0][0] + r[1][1] + r[2][2],
            1.0 + r[0][0] - r[1][1] - r[2][2],
            1.0 - r[0][0] + r[1][1] - r[2][2],
            1.0 - r[0][0] - r[1][1] + r[2][2],
        ];
        let largest = (0..4).fold(0, |best, i| if squares[i] > squares[best] { i } else { best });
        let products = match largest {
            0 => [r[2][1] - r[1][2], r[0][2] - r[2][0], r[1][0] - r[0][1], squares[0]],
            1 => [squares[1], r[0][1] + r[1][0], r[0][2] + r[2][0], r[2][1] - r[1][2]],
            2 => [r[0][1] + r[1][0], squares[2], r[1][2] + r[2][1], r[0][2] - r[2][0]],
            _ => [r[0][2] + r[2][0], r[1][2] + r[2][1], squares[3], r[1][0] - r[0][1]],
        };
        let factor = 0.5 / squares[largest].sqrt();
        let sign = if products[3] < 0.0 { -factor } else { factor };
        products.map(|q| q * sign)
    }
}

/// A point of the beam from `origin` along `direction` at `range_m`.
#[must_use]
pub fn along(origin: Vec3, direction: Vec3, range_m: f64) -> Vec3 {
    add(origin, scale(direction, range_m))
}

#[cfg(test)]
mod tests {
    use super::Pose;
    use std::f64::consts::{FRAC_PI_2, PI};

    fn close(a: [f64; 3], b: [f64; 3]) {
        assert!((0..3).all(|i| (a[i] - b[i]).abs() < 1e-12), "{a:?} {b:?}");
    }

    #[test]
    fn a_laser_pitched_by_minus_90_degrees_looks_up() {
        let base_from_laser = Pose::from_angles([0.1, 0.0, 0.4], [0.0, -FRAC_PI_2, 0.0]);
        close(base_from_laser.rotate([1.0, 0.0, 0.0]), [0.0, 0.0, 1.0]);
        close(base_from_laser.rotate([0.0, 1.0, 0.0]), [0.0, 1.0, 0.0]);
        close(base_from_laser.apply([2.0, 0.0, 0.0]), [0.1, 0.0, 2.4]);
    }

    #[test]
    fn yaw_comes_before_pitch_before_roll() {
        let pose = Pose::from_angles([0.0; 3], [FRAC_PI_2, 0.0, FRAC_PI_2]);
        // Yawed, the laser's y points to -x; rolled about its own x (now y), it points up.
        close(pose.rotate([0.0, 1.0, 0.0]), [0.0, 0.0, 1.0]);
        close(pose.rotate([1.0, 0.0, 0.0]), [0.0, 1.0, 0.0]);
    }

    #[test]
    fn a_pose_then_its_inverse_is_nothing() {
        let pose = Pose::from_angles([1.0, -2.0, 3.0], [0.3, -1.1, 2.9]);
        let nothing = pose.then(&pose.inverse());
        close(nothing.apply([4.0, 5.0, 6.0]), [4.0, 5.0, 6.0]);
    }

    #[test]
    fn quaternions_of_half_turns_about_each_axis_are_unit_axes() {
        for (axis, expected) in [(0, [1.0, 0.0, 0.0]), (1, [0.0, 1.0, 0.0]), (2, [0.0, 0.0, 1.0])] {
            let mut angles = [0.0; 3];
            angles[axis] = PI;
            let q = Pose::from_angles([0.0; 3], angles).quaternion_xyzw();
            close([q[0].abs(), q[1].abs(), q[2].abs()], expected);
        }
        for yaw in [1.0_f64, -2.8] {
            let q = Pose::planar(0.0, 0.0, yaw).quaternion_xyzw();
            let expected = [(0.5 * yaw).sin(), (0.5 * yaw).cos()];
            assert!((q[2] - expected[0]).abs() < 1e-12 && (q[3] - expected[1]).abs() < 1e-12, "{q:?}");
        }
    }
}
