//! A mount of the rig as a transform, and a transform as a mount.

use biplane_geometry::PortableMath;
use biplane_recording::rig::Mount;
use nalgebra::{Isometry3, Quaternion, Translation3, UnitQuaternion};

/// Below this cosine of the pitch, roll and yaw turn about one axis, and the difference of two digits' noise
/// would decide between them. It is an angle of 0.00006 degrees.
const UPRIGHT: f64 = 1e-6;
/// Numbers of a mount are written to so many parts of a degree or a meter: finer than anybody measures.
const PARTS: f64 = 1e9;

/// A transform with a rotation of length 1; `None` where it is none.
pub(crate) fn isometry(translation_m: [f64; 3], [x, y, z, w]: [f64; 4]) -> Option<Isometry3<f64>> {
    let rotation = UnitQuaternion::try_new(Quaternion::new(w, x, y, z), 1e-6)?;
    let is_finite = translation_m.iter().chain(rotation.coords.iter()).all(|value| value.is_finite());
    let [x, y, z] = translation_m;
    is_finite.then(|| Isometry3::from_parts(Translation3::new(x, y, z), rotation))
}

/// A transform as a mount: yaw, then pitch, then roll.
pub(crate) fn mount_of(base_from_laser: &Isometry3<f64>) -> Mount {
    let m = base_from_laser.rotation.to_rotation_matrix();
    let cos_pitch = m[(0, 0)].portable_hypot(m[(1, 0)]);
    let pitch = (-m[(2, 0)]).portable_atan2(cos_pitch);
    let yaw = if cos_pitch < UPRIGHT {
        (-m[(0, 1)]).portable_atan2(m[(1, 1)])
    } else {
        m[(1, 0)].portable_atan2(m[(0, 0)])
    };
    // What is left of the rotation behind yaw and pitch: exact also where these two are not.
    let (sin, cos) = yaw.portable_sin_cos();
    let roll = (sin * m[(0, 2)] - cos * m[(1, 2)]).portable_atan2(cos * m[(1, 1)] - sin * m[(0, 1)]);
    // Plus nothing: no -0.
    let rounded = |value: f64| (value * PARTS).round() / PARTS + 0.0;
    let degrees = |angle: f64| rounded(angle.to_degrees());
    let [x, y, z] = <[f64; 3]>::from(base_from_laser.translation.vector).map(rounded);
    Mount { x, y, z, roll: degrees(roll), pitch: degrees(pitch), yaw: degrees(yaw) }
}

/// A mount as a transform.
pub(crate) fn base_from_mount(mount: &Mount) -> Isometry3<f64> {
    isometry(mount.translation_m(), mount.rotation_xyzw()).unwrap_or_else(Isometry3::identity)
}

#[cfg(test)]
mod tests {
    use super::{base_from_mount, mount_of};
    use biplane_recording::rig::Mount;
    use nalgebra::UnitQuaternion;

    #[test]
    fn a_mount_gives_back_its_own_rotation_also_where_roll_and_yaw_are_one() {
        for (roll, pitch, yaw) in [
            (0.0, 0.0, 0.0),
            (180.0, 0.0, 12.0),
            (0.0, -90.0, 0.0),
            (0.0, -90.0, 180.0),
            (30.0, 90.0, -50.0),
            (1.0, -89.999_999, 2.0),
            (-170.0, 40.0, 100.0),
        ] {
            let mount = Mount { x: 0.1, y: -0.2, z: 0.3, roll, pitch, yaw };
            let transform = base_from_mount(&mount);
            let again = base_from_mount(&mount_of(&transform));
            assert!(transform.rotation.angle_to(&again.rotation) < 1e-7, "{mount:?}");
        }
        assert_eq!(mount_of(&base_from_mount(&Mount { pitch: -90.0, ..Mount::default() })).pitch, -90.0);
    }

    #[test]
    fn a_laser_that_points_up_and_looks_aside_has_a_yaw_and_no_roll() {
        let mut up = base_from_mount(&Mount { pitch: -90.0, ..Mount::default() });
        // The noise of a few multiplications beside the turn: it shall not decide between roll and yaw.
        let turn = UnitQuaternion::from_euler_angles(1e-8, 2e-8, (-0.165_f64).to_radians());
        up.rotation = turn * up.rotation;
        let Mount { roll, pitch, yaw, .. } = mount_of(&up);
        assert!(
            roll.abs() < 1e-6 && (pitch + 90.0).abs() < 1e-4 && (yaw + 0.165).abs() < 1e-6,
            "{roll} {pitch} {yaw}"
        );
    }
}
