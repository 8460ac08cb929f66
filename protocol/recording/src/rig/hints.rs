//! What of a rig is allowed and hardly meant: angles that look like radians, lengths in other units, and
//! lasers that look where the other one should.

use super::{BaseProtocol, Laser, Mount};
use crate::rig::robot::Rig;
use biplane_geometry::PortableMath;
use std::f64::consts::FRAC_PI_4;

/// People write radians with two digits behind the point and more: so near is such a value to a multiple of
/// an eighth of a turn.
const ROUNDED_RAD: f64 = 0.002;
/// The largest multiple of an eighth of a turn that is looked for.
const EIGHTHS: u32 = 8;
/// No device sits farther from the middle of a robot, along any axis, in m.
const FARTHEST_M: f64 = 5.0;
/// Steeper than this, in degrees, no laser localizes: it hardly sees a wall of the plan.
const STEEPEST_DEG: f64 = 45.0;
/// Two lasers whose planes are this near to each other, in degrees, see the same.
const PARALLEL_DEG: f64 = 15.0;
/// The odometry unit of a Pioneer is near this, in m.
const PIONEER_TICK_M: f64 = 0.001;
/// Those of its kin differ by less than this factor.
const TICK_FACTOR: f64 = 20.0;

impl Rig {
    /// What of this rig is hardly meant, a sentence each. Nothing of it is an error.
    #[must_use]
    pub fn hints(&self) -> Vec<String> {
        let lasers = [("horizontal", Some(&self.horizontal)), ("vertical", self.vertical.as_ref())];
        let lasers = lasers.into_iter().filter_map(|(name, laser)| Some((name, laser?)));
        let mut hints = Vec::new();
        for (name, Laser { mount, .. }) in lasers {
            let angles = [("roll", mount.roll), ("pitch", mount.pitch), ("yaw", mount.yaw)];
            hints.extend(angles.into_iter().filter_map(|(key, value)| radians_hint(name, key, value)));
            let place = [("x", mount.x), ("y", mount.y), ("z", mount.z)];
            hints.extend(place.into_iter().filter_map(|(key, value)| far_hint(name, key, value)));
        }
        hints.extend(steep_hint(&self.horizontal.mount));
        hints.extend(self.vertical.as_ref().and_then(|it| parallel_hint(&self.horizontal.mount, &it.mount)));
        hints.extend(tick_hint(self.base.protocol));
        hints
    }
}

fn radians_hint(laser: &str, key: &str, value: f64) -> Option<String> {
    let eighths = (1..=EIGHTHS).find(|&n| (value.abs() - f64::from(n) * FRAC_PI_4).abs() <= ROUNDED_RAD)?;
    let meant_deg = f64::from(eighths) * 45.0 * value.signum();
    Some(format!(
        "rig.toml: {key} = {value} of the {laser} laser is taken as degrees; if these are radians, write {key} = {meant_deg:.1}"
    ))
}

fn far_hint(laser: &str, key: &str, value: f64) -> Option<String> {
    (value.abs() > FARTHEST_M).then(|| {
        format!(
            "rig.toml: {key} = {value} of the {laser} laser is taken as meters; if these are centimeters, write {key} = {}",
            (value * 1e4).round() / 1e6
        )
    })
}

fn steep_hint(horizontal: &Mount) -> Option<String> {
    let lean_deg = between_planes_deg(horizontal, &Mount::default());
    (lean_deg > STEEPEST_DEG + 1e-6).then(|| {
        format!(
            "rig.toml: the plane of the horizontal laser stands {lean_deg:.0} degrees from level, and it is the one that localizes: \
             are both lasers exchanged?"
        )
    })
}

fn parallel_hint(horizontal: &Mount, vertical: &Mount) -> Option<String> {
    let apart_deg = between_planes_deg(horizontal, vertical);
    (apart_deg < PARALLEL_DEG).then(|| {
        format!(
            "rig.toml: the plane of the vertical laser is {apart_deg:.0} degrees from that of the horizontal one, so that it sees no \
             walls in their height; pitch = -90 points its middle beam up"
        )
    })
}

/// The angle between the planes of two lasers, 0 to 90 degrees.
fn between_planes_deg(one: &Mount, other: &Mount) -> f64 {
    let normal = |mount: &Mount| mount.matrix().map(|row| row[2]);
    let cosine: f64 = normal(one).iter().zip(normal(other)).map(|(a, b)| a * b).sum();
    cosine.abs().min(1.0).portable_acos().to_degrees()
}

fn tick_hint(protocol: BaseProtocol) -> Option<String> {
    let BaseProtocol::P2os { metres_per_tick: Some(tick_m) } = protocol else { return None };
    let (times, how) = match tick_m / PIONEER_TICK_M {
        ratio if ratio >= 1.0 => (ratio, "larger"),
        ratio => (1.0 / ratio, "smaller"),
    };
    (times > TICK_FACTOR).then(|| {
        format!(
            "rig.toml: metres_per_tick = {tick_m} of the base is {times:.0} times {how} than that of a Pioneer, {PIONEER_TICK_M}: odometry \
             will hardly be right"
        )
    })
}

#[cfg(test)]
mod tests {
    use super::radians_hint;
    use crate::Rig;
    use crate::rig::{BaseProtocol, Mount};

    #[test]
    fn an_angle_in_radians_is_pointed_out_and_degrees_are_not() {
        let hint = |pitch: f64| radians_hint("horizontal", "pitch", pitch);
        for (text, meant) in [
            ("-1.57", "-90.0"),
            ("1.5708", "90.0"),
            ("3.14", "180.0"),
            ("3.14159265", "180.0"),
            ("-0.785", "-45.0"),
        ] {
            let found = hint(text.parse().unwrap()).unwrap();
            assert!(found.ends_with(&format!("pitch = {meant}")), "{found}");
        }
        for pitch in [0.0, -90.0, 1.0, 1.5, 2.0, 3.0, 45.0, 180.0, -0.5, 1.6] {
            assert_eq!(hint(pitch), None, "{pitch}");
        }
        let mut rig = Rig::default();
        rig.horizontal.mount.yaw = -1.57;
        assert_eq!(rig.hints().len(), 1);
    }

    /// The one hint of a rig whose lasers sit like this.
    fn of_mounts(horizontal: Mount, vertical: Mount) -> Vec<String> {
        let mut rig = Rig::default();
        rig.horizontal.mount = horizontal;
        rig.vertical.as_mut().unwrap().mount = vertical;
        rig.hints()
    }

    #[test]
    fn lasers_that_look_where_the_other_one_should_are_pointed_out() {
        let level = Mount::default();
        let upright = Mount { pitch: -90.0, ..level };
        for vertical in [
            upright,
            Mount { roll: 90.0, ..level },
            Mount { pitch: -90.0, yaw: 30.0, ..level },
            Mount { pitch: 45.0, ..level },
        ] {
            assert_eq!(of_mounts(level, vertical), [""; 0], "{vertical:?}");
        }
        let upside_down = Mount { roll: 180.0, pitch: 3.0, ..level };
        assert_eq!(of_mounts(upside_down, upright), [""; 0]);
        for vertical in [level, upside_down, Mount { yaw: 90.0, ..level }] {
            let found = of_mounts(level, vertical);
            assert!(
                matches!(&found[..], [words] if words.contains("sees no walls in their height")),
                "{found:?}"
            );
        }
        let exchanged = of_mounts(upright, level);
        assert!(matches!(&exchanged[..], [words] if words.contains("exchanged")), "{exchanged:?}");
        assert!(exchanged[0].contains("90 degrees from level"), "{exchanged:?}");
    }

    #[test]
    fn a_mount_above_the_roof_and_a_wheel_of_miles_are_pointed_out() {
        let vertical = Rig::default().vertical.unwrap().mount;
        let found = of_mounts(Mount { z: 45.0, ..Mount::default() }, vertical);
        assert!(matches!(&found[..], [words] if words.ends_with("write z = 0.45")), "{found:?}");
        let tall = of_mounts(Mount { z: 4.5, x: -3.0, ..Mount::default() }, vertical);
        assert_eq!(tall, [""; 0]);
        let of_tick = |tick_m| {
            let mut rig = Rig::default();
            rig.base.protocol = BaseProtocol::P2os { metres_per_tick: Some(tick_m) };
            rig.hints()
        };
        for tick_m in [1.0, 1e-6] {
            let found = of_tick(tick_m);
            assert!(matches!(&found[..], [words] if words.contains("than that of a Pioneer")), "{found:?}");
        }
        assert!(of_tick(1.0)[0].contains("is 1000 times larger than"), "{:?}", of_tick(1.0));
        assert_eq!([of_tick(0.001), of_tick(0.000_485)].concat(), [""; 0]);
    }
}
