//! What of a rig is allowed and hardly meant: angles that look like radians.

use crate::rig::robot::Rig;
use std::f64::consts::FRAC_PI_4;

/// People write radians with two digits behind the point and more: so near is such a value to a multiple of
/// an eighth of a turn.
const ROUNDED_RAD: f64 = 0.002;
/// The largest multiple of an eighth of a turn that is looked for.
const EIGHTHS: u32 = 8;

impl Rig {
    /// What of this rig is hardly meant, a sentence each. Nothing of it is an error.
    #[must_use]
    pub fn hints(&self) -> Vec<String> {
        let lasers = [("horizontal", Some(&self.horizontal)), ("vertical", self.vertical.as_ref())];
        let mounts = lasers.into_iter().filter_map(|(name, laser)| Some((name, laser?.mount)));
        let angles = mounts.flat_map(|(name, mount)| {
            [("roll", mount.roll), ("pitch", mount.pitch), ("yaw", mount.yaw)]
                .map(|(key, value)| (name, key, value))
        });
        angles.filter_map(|(name, key, value)| radians_hint(name, key, value)).collect()
    }
}

fn radians_hint(laser: &str, key: &str, value: f64) -> Option<String> {
    let eighths = (1..=EIGHTHS).find(|&n| (value.abs() - f64::from(n) * FRAC_PI_4).abs() <= ROUNDED_RAD)?;
    let meant_deg = f64::from(eighths) * 45.0 * value.signum();
    Some(format!(
        "rig.toml: {key} = {value} of the {laser} laser is taken as degrees; if these are radians, write {key} = {meant_deg:.1}"
    ))
}

#[cfg(test)]
mod tests {
    use crate::Rig;

    #[test]
    fn an_angle_in_radians_is_pointed_out_and_degrees_are_not() {
        let hints = |pitch: f64| {
            let mut rig = Rig::default();
            rig.horizontal.mount.pitch = pitch;
            rig.hints()
        };
        for (text, meant) in [
            ("-1.57", "-90.0"),
            ("1.5708", "90.0"),
            ("3.14", "180.0"),
            ("3.14159265", "180.0"),
            ("-0.785", "-45.0"),
        ] {
            let found = hints(text.parse().unwrap());
            assert!(
                matches!(&found[..], [words] if words.ends_with(&format!("pitch = {meant}"))),
                "{found:?}"
            );
        }
        for pitch in [0.0, -90.0, 1.0, 1.5, 2.0, 3.0, 45.0, 180.0, -0.5, 1.6] {
            assert_eq!(hints(pitch), [""; 0], "{pitch}");
        }
    }
}
