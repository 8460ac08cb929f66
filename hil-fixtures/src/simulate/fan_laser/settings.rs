//! A laser that is set as the rig asks, as a session would have set it.

use crate::devices::cola::ColaParams;
use crate::devices::scip::ScipParams;
use crate::simulate::SimulateError;
use biplane_recording::rig::{ColaLaser, ScipLaser};
use biplane_wire::cola::Offer;
use biplane_wire::scip::{Delivery, ScanRequest};

/// Steps that differ by less are the same, 1/10000 degree: they are rounded.
const SAME_STEP_E4DEG: f64 = 4.0;
/// Straight ahead.
const AHEAD_E4DEG: i32 = 900_000;
/// A ratio that is this near to a whole number is that number: steps and rates are rounded.
const SAME_RATIO: f64 = 0.02;
/// Most steps that are joined to one value, and most turns of a scan.
const MAX_STEPS: f64 = 99.0;
const MAX_TURNS: f64 = 10.0;

fn refused(what: &'static str, found: String, expected: &'static str) -> SimulateError {
    SimulateError::Unsupported { what, found, expected }
}

/// A SICK laser with the rate, step, fan and remission of the rig.
///
/// # Errors
/// The device does not offer them.
pub(super) fn set_as_asked(params: &ColaParams, laser: &ColaLaser) -> Result<ColaParams, SimulateError> {
    let mut params = params.clone();
    let is_asked = |offer: &&Offer| {
        laser.scan_hz.is_none_or(|rate_hz| (rate_hz * 100.0 - f64::from(offer.rate_chz)).abs() < 1.0)
            && laser
                .resolution_deg
                .is_none_or(|step| (step * 1e4 - f64::from(offer.step_e4deg)).abs() < SAME_STEP_E4DEG)
    };
    let now = params.scan;
    let changed = |offer: &&Offer| {
        u8::from(offer.rate_chz != now.rate_chz) + u8::from(offer.step_e4deg != now.step_e4deg)
    };
    if laser.scan_hz.is_some() || laser.resolution_deg.is_some() {
        let offered = params.family.offers().iter().filter(is_asked).min_by_key(changed);
        let expected = "a rate and a step that the laser of --network-laser offers together";
        let found = || format!("{:?} and {:?}", laser.scan_hz, laser.resolution_deg);
        let offer = offered.ok_or_else(|| refused("scan_hz and resolution_deg", found(), expected))?;
        (params.scan.rate_chz, params.scan.step_e4deg) = (offer.rate_chz, offer.step_e4deg);
        params.range.step_e4deg = offer.step_e4deg;
    }
    if let Some(fov_deg) = laser.fov_deg {
        let half_e4deg = (fov_deg / 2.0 * 1e4).round() as i32;
        let [first, last] = params.family.fan_e4deg();
        if 2 * half_e4deg > last - first {
            let expected = "not more than the laser of --network-laser has";
            return Err(refused("fov_deg", fov_deg.to_string(), expected));
        }
        params.range.start_e4deg = AHEAD_E4DEG - half_e4deg;
        params.range.stop_e4deg = AHEAD_E4DEG + half_e4deg;
    }
    if let Some(remission) = laser.remission {
        params.data.remission = remission;
    }
    Ok(params)
}

/// The stream of a Hokuyo laser that the rig asks for.
///
/// # Errors
/// The device does not offer it.
pub(super) fn scan_request(params: &ScipParams, laser: &ScipLaser) -> Result<ScanRequest, SimulateError> {
    let of = &params.parameters;
    let step_deg = of.step_deg();
    let cluster =
        multiple(laser.resolution_deg.map(|wanted| wanted / step_deg), MAX_STEPS).ok_or_else(|| {
            let expected = "a multiple of the step of the laser of --hokuyo";
            refused("resolution_deg", laser.resolution_deg.unwrap_or_default().to_string(), expected)
        })?;
    let turns = multiple(laser.scan_hz.map(|wanted| f64::from(of.rpm) / 60.0 / wanted), MAX_TURNS)
        .ok_or_else(|| {
            let expected = "the turns of the laser of --hokuyo, or one of 2 to 10 of them";
            refused("scan_hz", laser.scan_hz.unwrap_or_default().to_string(), expected)
        })?;
    let with_intensity = laser.remission == Some(true);
    if with_intensity && !params.has_intensity {
        return Err(refused("remission", "true".to_owned(), "false: the laser of --hokuyo has none"));
    }
    let widest = (of.front_step - of.first_step).min(of.last_step - of.front_step);
    let half = laser.fov_deg.map(|fov_deg| (fov_deg / 2.0 / step_deg).round() as u16);
    if half.is_some_and(|half| half > widest) {
        let expected = "not more than the laser of --hokuyo has";
        return Err(refused("fov_deg", laser.fov_deg.unwrap_or_default().to_string(), expected));
    }
    let around = |half| [of.front_step - half, of.front_step + half];
    let [first_step, last_step] = half.map_or([of.first_step, of.last_step], around);
    let delivery = Delivery::Stream { skip: turns - 1, count: 0 };
    Ok(ScanRequest { delivery, all_echoes: false, with_intensity, first_step, last_step, cluster })
}

/// The whole number that a ratio is, 1 without one.
fn multiple(ratio: Option<f64>, max: f64) -> Option<u8> {
    let Some(ratio) = ratio else { return Some(1) };
    let whole = ratio.round();
    let is_near = (ratio - whole).abs() <= SAME_RATIO * whole;
    ((1.0..=max).contains(&whole) && is_near).then_some(whole as u8)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn cola(name: &str, scan_hz: Option<f64>, resolution_deg: Option<f64>, fov_deg: Option<f64>) -> String {
        let laser = ColaLaser { scan_hz, resolution_deg, fov_deg, ..ColaLaser::default() };
        let params = ColaParams::of_name(name).expect("a known laser");
        set_as_asked(&params, &laser).map_or_else(
            |error| error.to_string(),
            |set| format!("{} {} {}", set.scan.rate_chz, set.range.step_e4deg, set.range.start_e4deg),
        )
    }

    #[test]
    fn a_network_laser_is_set_as_the_rig_asks_or_refused_in_words() {
        assert_eq!(cola("LMS511", None, None, None), "2500 3333 -50000");
        assert_eq!(cola("LMS511", Some(50.0), Some(0.3333), Some(180.0)), "5000 3333 0");
        assert_eq!(cola("LMS511", Some(50.0), None, None), "5000 3333 -50000");
        assert_eq!(cola("LMS111", None, Some(0.25), None), "2500 2500 -450000");
        assert!(cola("LMS511", Some(50.0), Some(0.25), None).contains("offers together"));
        assert!(cola("LMS511", None, None, Some(270.0)).contains("fov_deg = 270"));
    }

    #[test]
    fn a_hokuyo_laser_is_asked_for_what_the_rig_says_or_refused_in_words() {
        let asked = |name: &str, laser: ScipLaser| {
            let params = ScipParams::of_name(name).expect("a known laser");
            scan_request(&params, &laser).map_or_else(
                |error| error.to_string(),
                |request| format!("{} {} {}", request.first_step, request.last_step, request.cluster),
            )
        };
        let all = ScipLaser::default;
        assert_eq!(asked("UST-20LX", all()), "0 1080 1");
        let half = ScipLaser { fov_deg: Some(180.0), resolution_deg: Some(0.5), ..all() };
        assert_eq!(asked("UST-20LX", half), "180 900 2");
        let bright = ScipLaser { remission: Some(true), ..all() };
        assert!(asked("URG-04LX", bright).contains("remission = true"));
        let slow = ScipLaser { scan_hz: Some(30.0), ..all() };
        assert!(asked("UST-20LX", slow).contains("scan_hz = 30"));
        let wide = ScipLaser { fov_deg: Some(300.0), ..all() };
        assert!(asked("UST-20LX", wide).contains("fov_deg = 300"));
    }
}
