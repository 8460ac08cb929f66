//! What a rig asks of a laser on a network and hardly gets: said before there is any device to ask.

use biplane_recording::rig::ColaLaser;
use biplane_wire::cola::Family;

use super::settings::{ColaConfig, ColaSettings};

/// What the rig asks for and does not get, a sentence each.
#[must_use]
pub(crate) fn warnings(laser: &ColaLaser) -> Vec<String> {
    [nobody_hint(laser), login_hint(laser)].into_iter().flatten().collect()
}

/// Which lasers offer what the rig asks for, where some do and others do not: the rig does not say which one
/// it has.
#[must_use]
pub(crate) fn note(laser: &ColaLaser) -> Option<String> {
    let (some, others) = offered_by(laser);
    let names = |families: &[Family]| families.iter().map(|f| f.name()).collect::<Vec<_>>().join(", ");
    (!some.is_empty() && !others.is_empty()).then(|| {
        format!(
            "{}: offered by {} only; {} would stay as it is set (docs/lasers.md has the table)",
            asked(laser),
            names(&some),
            names(&others)
        )
    })
}

/// Families that offer what the rig asks for, and those that do not.
fn offered_by(laser: &ColaLaser) -> (Vec<Family>, Vec<Family>) {
    let settings = ColaSettings::from(laser);
    let is_offered = |family: &Family| settings.change(Some(*family), &ColaConfig::default()).is_ok();
    Family::ALL.into_iter().partition(is_offered)
}

fn nobody_hint(laser: &ColaLaser) -> Option<String> {
    offered_by(laser).0.is_empty().then(|| {
        let asked = asked(laser);
        format!(
            "{asked}: no SICK laser offers this; it would stay as it is set (docs/lasers.md has the table)"
        )
    })
}

fn asked(laser: &ColaLaser) -> String {
    let keys =
        [("scan_hz", laser.scan_hz), ("resolution_deg", laser.resolution_deg), ("fov_deg", laser.fov_deg)];
    let given = keys.into_iter().filter_map(|(key, value)| Some(format!("{key} = {}", value?)));
    given.collect::<Vec<_>>().join(", ")
}

fn login_hint(laser: &ColaLaser) -> Option<String> {
    let remission = laser.remission.map(|remission| format!("remission = {remission}"));
    let numbers = Some(asked(laser)).filter(|asked| !asked.is_empty());
    let asked: Vec<String> = numbers.into_iter().chain(remission).collect();
    (!laser.login && !asked.is_empty()).then(|| {
        format!(
            "{}: compared with how the laser is set, and not written to it; that needs login = true",
            asked.join(", ")
        )
    })
}

#[cfg(test)]
mod tests {
    use super::{note, warnings};
    use biplane_recording::rig::ColaLaser;

    fn asking(scan_hz: f64, resolution_deg: f64, fov_deg: Option<f64>) -> ColaLaser {
        let (scan_hz, resolution_deg) = (Some(scan_hz), Some(resolution_deg));
        ColaLaser { scan_hz, resolution_deg, fov_deg, login: true, ..ColaLaser::default() }
    }

    #[test]
    fn what_only_some_lasers_offer_is_said_and_what_none_does() {
        assert_eq!(note(&ColaLaser::default()), None);
        assert_eq!(
            note(&asking(25.0, 0.5, None)).unwrap(),
            "scan_hz = 25, resolution_deg = 0.5: offered by LMS5xx only; LMS1xx, TiM5xx, TiM7xx would stay as it is \
             set (docs/lasers.md has the table)"
        );
        for none in [asking(15.0, 0.25, None), asking(35.0, 0.5, Some(270.0))] {
            let words = warnings(&none).join("; ");
            assert!(words.contains(": no SICK laser offers this") && note(&none).is_none(), "{words}");
        }
        for some in [asking(50.0, 0.5, None), asking(15.0, 0.333, Some(270.0))] {
            assert_eq!(warnings(&some), [""; 0]);
        }
    }

    #[test]
    fn what_is_asked_without_login_is_not_written() {
        let laser = ColaLaser { remission: Some(true), ..ColaLaser::default() };
        let words = "remission = true: compared with how the laser is set, and not written to it; that needs login = true";
        assert_eq!(warnings(&laser), [words]);
        assert_eq!(warnings(&ColaLaser { login: true, ..laser }), [""; 0]);
    }
}
