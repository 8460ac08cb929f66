//! Where a laser sits: translation, then yaw about z, pitch about the new y, roll about the new x (Z-Y-X).

use biplane_geometry::{Pose3, RollPitchYaw};

/// `base_from_laser`: turns points of the laser's own frame (x along the middle beam, y to the left) into
/// `base_link`.
#[derive(Copy, Clone, PartialEq, Debug, Default)]
pub struct Mount {
    /// Forward of the base's origin, in m.
    pub x: f64,
    /// Left of it, in m.
    pub y: f64,
    /// Above the floor, in m.
    pub z: f64,
    /// About the laser's x axis, in degrees: right side down is positive.
    pub roll: f64,
    /// About its y axis, in degrees: nose down is positive, so -90 points the middle beam up.
    pub pitch: f64,
    /// About the vertical, in degrees: to the left is positive.
    pub yaw: f64,
}

impl Mount {
    /// The laser's origin in the base, in m.
    #[must_use]
    pub const fn translation_m(&self) -> [f64; 3] {
        [self.x, self.y, self.z]
    }

    /// The rotation `base_from_laser`, rows first: p_base = matrix * p_laser + translation.
    #[must_use]
    pub fn matrix(&self) -> [[f64; 3]; 3] {
        self.roll_pitch_yaw().matrix()
    }

    /// The same rotation as a unit quaternion.
    #[must_use]
    pub fn rotation_xyzw(&self) -> [f64; 4] {
        self.roll_pitch_yaw().quaternion_xyzw()
    }

    fn roll_pitch_yaw(&self) -> RollPitchYaw {
        RollPitchYaw { roll_deg: self.roll, pitch_deg: self.pitch, yaw_deg: self.yaw }
    }

    /// A point of the laser's frame in the base, in m.
    #[must_use]
    pub fn base_from_laser(&self, point_in_laser_m: [f64; 3]) -> [f64; 3] {
        Pose3 { rotation: self.matrix(), translation_m: self.translation_m() }.transform(point_in_laser_m)
    }
}

#[cfg(test)]
mod tests {
    use super::Mount;

    const X: [f64; 3] = [1.0, 0.0, 0.0];
    const Y: [f64; 3] = [0.0, 1.0, 0.0];
    const Z: [f64; 3] = [0.0, 0.0, 1.0];

    fn mount(roll: f64, pitch: f64, yaw: f64) -> Mount {
        Mount { roll, pitch, yaw, ..Mount::default() }
    }

    fn rotate(quaternion: [f64; 4], v: [f64; 3]) -> [f64; 3] {
        // v + 2 w (u x v) + 2 u x (u x v)
        let cross = |a: [f64; 3], b: [f64; 3]| {
            [a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]]
        };
        let [x, y, z, w] = quaternion;
        let t = cross([x, y, z], v).map(|value| 2.0 * value);
        let s = cross([x, y, z], t);
        [v[0] + w * t[0] + s[0], v[1] + w * t[1] + s[1], v[2] + w * t[2] + s[2]]
    }

    #[test]
    fn quarter_turns_send_the_axes_where_a_hand_would() {
        // (roll, pitch, yaw) -> where the laser's x (middle beam), y (left) and z point in the base.
        let minus = |v: [f64; 3]| v.map(|value| 0.0 - value);
        let table = [
            ((0.0, 0.0, 0.0), X, Y, Z),
            ((0.0, -90.0, 0.0), Z, Y, minus(X)),
            ((0.0, 90.0, 0.0), minus(Z), Y, X),
            ((0.0, 0.0, 90.0), Y, minus(X), Z),
            ((90.0, 0.0, 0.0), X, Z, minus(Y)),
            ((180.0, 0.0, 0.0), X, minus(Y), minus(Z)),
            // Yaw 90 first: x to the left; then pitch -90 lifts it up; y keeps pointing back.
            ((0.0, -90.0, 90.0), Z, minus(X), minus(Y)),
        ];
        for ((roll, pitch, yaw), x, y, z) in table {
            let mount = mount(roll, pitch, yaw);
            for (axis, expected) in [(X, x), (Y, y), (Z, z)] {
                assert_eq!(mount.base_from_laser(axis), expected, "{mount:?} {axis:?}");
                let turned = rotate(mount.rotation_xyzw(), axis);
                let off = (0..3).map(|i| (turned[i] - expected[i]).abs()).fold(0.0, f64::max);
                assert!(off < 1e-12, "{mount:?} {axis:?}: {turned:?}");
            }
        }
    }

    #[test]
    fn matrix_and_quaternion_agree_for_odd_angles() {
        for (roll, pitch, yaw) in
            [(10.0, 20.0, 30.0), (-170.0, 85.0, 300.0), (1.0, -91.0, 181.0), (720.5, 0.0, -45.0)]
        {
            let mount = mount(roll, pitch, yaw);
            let norm: f64 = mount.rotation_xyzw().iter().map(|value| value * value).sum();
            assert!((norm - 1.0).abs() < 1e-12);
            for axis in [X, Y, Z] {
                let (a, b) = (mount.base_from_laser(axis), rotate(mount.rotation_xyzw(), axis));
                assert!((0..3).all(|i| (a[i] - b[i]).abs() < 1e-12), "{mount:?}: {a:?} {b:?}");
            }
        }
    }

    #[test]
    fn a_point_is_rotated_then_moved() {
        // The template's vertical laser: 2 m along its middle beam is 2 m above its place.
        let mount = Mount { x: 0.05, y: 0.0, z: 0.45, roll: 0.0, pitch: -90.0, yaw: 0.0 };
        assert_eq!(mount.base_from_laser([2.0, 0.0, 0.0]), [0.05, 0.0, 2.45]);
        // Its first beam (on the right, -y) stays on the right.
        assert_eq!(mount.base_from_laser([0.0, -2.0, 0.0]), [0.05, -2.0, 0.45]);
        // Yaw 30: cos 30 = 0.8660254, sin 30 = 0.5.
        let [x, y, z] = Mount { yaw: 30.0, ..Mount::default() }.base_from_laser([2.0, 0.0, 0.0]);
        assert!((x - 1.732_050_8).abs() < 1e-7 && (y - 1.0).abs() < 1e-12 && z == 0.0);
    }
}
