//! Rigid motions of space, and how headings, quaternions and roll, pitch and yaw become rotations.
//!
//! A rotation is a matrix of rows; a quaternion is (x, y, z, w), as messages carry it.

use crate::angle::sin_cos_deg;
use crate::elementary::PortableMath;

/// A pose in space: `a_from_b` takes a point's coordinates in frame b to those in frame a.
#[derive(Copy, Clone, PartialEq, Debug)]
pub struct Pose3 {
    /// The rotation, rows first.
    pub rotation: [[f64; 3]; 3],
    /// The origin of b in a, meters.
    pub translation_m: [f64; 3],
}

impl Pose3 {
    /// A point's coordinates in the outer frame, meters.
    #[must_use]
    pub fn transform(&self, point_m: [f64; 3]) -> [f64; 3] {
        let [x, y, z] = point_m;
        let rotated = self.rotation.map(|[a, b, c]| a * x + b * y + c * z);
        crate::vec3::plus(rotated, self.translation_m)
    }
}

/// A rotation in degrees: yaw about z, then pitch about the new y, then roll about the new x (Z-Y-X). Exact
/// at quarter turns.
#[derive(Copy, Clone, PartialEq, Debug, Default)]
pub struct RollPitchYaw {
    /// About x, degrees: right side down is positive.
    pub roll_deg: f64,
    /// About y, degrees: nose down is positive.
    pub pitch_deg: f64,
    /// About z, degrees: to the left is positive.
    pub yaw_deg: f64,
}

impl RollPitchYaw {
    /// The rotation as a matrix, rows first.
    #[must_use]
    pub fn matrix(&self) -> [[f64; 3]; 3] {
        let (sr, cr) = sin_cos_deg(self.roll_deg);
        let (sp, cp) = sin_cos_deg(self.pitch_deg);
        let (sy, cy) = sin_cos_deg(self.yaw_deg);
        [
            [cy * cp, cy * sp * sr - sy * cr, cy * sp * cr + sy * sr],
            [sy * cp, sy * sp * sr + cy * cr, sy * sp * cr - cy * sr],
            [-sp, cp * sr, cp * cr],
        ]
    }

    /// The same rotation as a unit quaternion (x, y, z, w).
    #[must_use]
    pub fn quaternion_xyzw(&self) -> [f64; 4] {
        let (sr, cr) = sin_cos_deg(self.roll_deg / 2.0);
        let (sp, cp) = sin_cos_deg(self.pitch_deg / 2.0);
        let (sy, cy) = sin_cos_deg(self.yaw_deg / 2.0);
        [
            cy * cp * sr - sy * sp * cr,
            cy * sp * cr + sy * cp * sr,
            sy * cp * cr - cy * sp * sr,
            cy * cp * cr + sy * sp * sr,
        ]
    }
}

/// The unit quaternion (x, y, z, w) of a heading, radians.
#[must_use]
pub fn quaternion_of_heading_xyzw(theta_rad: f64) -> [f64; 4] {
    let (sin, cos) = (theta_rad / 2.0).portable_sin_cos();
    [0.0, 0.0, sin, cos]
}

/// The heading of a unit quaternion (x, y, z, w), radians; other parts of the rotation are left out.
#[must_use]
pub fn heading_of_quaternion_rad([x, y, z, w]: [f64; 4]) -> f64 {
    (2.0 * (w * z + x * y)).portable_atan2(1.0 - 2.0 * (y * y + z * z))
}

#[cfg(test)]
mod tests {
    use nalgebra::{Quaternion, Rotation3, UnitQuaternion, Vector3};

    use super::*;

    #[test]
    fn matrix_and_quaternion_agree_with_nalgebra_on_a_grid_of_rotations() {
        for step in 0..1000 {
            let [roll_deg, pitch_deg, yaw_deg] =
                [10, 100, 1].map(|by| f64::from(step / by % 10) * 36.0 - 170.0);
            let ours = RollPitchYaw { roll_deg, pitch_deg, yaw_deg };
            let [roll, pitch, yaw] = [roll_deg, pitch_deg, yaw_deg].map(f64::to_radians);
            let theirs = Rotation3::from_euler_angles(roll, pitch, yaw);
            let pose = Pose3 { rotation: ours.matrix(), translation_m: [4.0, 5.0, 6.0] };
            let point = Vector3::new(1.0, -2.0, 3.0);
            let expected = theirs * point + Vector3::new(4.0, 5.0, 6.0);
            let found = Vector3::from(pose.transform(point.into()));
            assert!((found - expected).norm() < 1e-12, "{ours:?}");
            let [x, y, z, w] = ours.quaternion_xyzw();
            let turned = UnitQuaternion::from_quaternion(Quaternion::new(w, x, y, z)) * point;
            assert!((turned - theirs * point).norm() < 1e-12, "{ours:?}");
        }
    }

    #[test]
    fn a_heading_comes_back_from_its_quaternion() {
        for step in -314..=314 {
            let theta_rad = f64::from(step) * 0.01;
            let found_rad = heading_of_quaternion_rad(quaternion_of_heading_xyzw(theta_rad));
            assert!((found_rad - theta_rad).abs() < 1e-12, "{theta_rad}");
        }
        let tilted = RollPitchYaw { roll_deg: 20.0, pitch_deg: -30.0, yaw_deg: 110.0 };
        let heading_rad = heading_of_quaternion_rad(tilted.quaternion_xyzw());
        assert!((heading_rad - 110.0_f64.to_radians()).abs() < 1e-12);
    }
}
