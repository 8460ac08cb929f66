//! The rig with what was observed put in.

use biplane_recording::Rig;
use biplane_recording::rig::BaseProtocol;

use super::odometry::Scales;
use super::placement::{PARAMETERS, Placement, Step};

/// Puts in the laser's place: the step's elements that are not zero, in as many digits as their standard
/// deviations, in units of the rig, allow.
pub(super) fn with_placement(rig: &mut Rig, start: &Placement, step: &Step, sigma: &[f64; PARAMETERS]) {
    let Some(laser) = &mut rig.vertical else { return };
    let found = start.stepped(step).mount(&laser.mount);
    let mount = &mut laser.mount;
    for (i, (key, found)) in
        [(&mut mount.x, found.x), (&mut mount.y, found.y), (&mut mount.z, found.z)].into_iter().enumerate()
    {
        if step[i] != 0.0 {
            *key = rounded(found, sigma[i]);
        }
    }
    // Three angles say one turn: each has the digits of the axis that is known best.
    let turned = (3..6).filter(|&i| step[i] != 0.0).map(|i| sigma[i]).reduce(f64::min);
    if let Some(sigma_deg) = turned {
        let angles = [found.roll, found.pitch, found.yaw].map(|angle_deg| rounded(angle_deg, sigma_deg));
        [mount.roll, mount.pitch, mount.yaw] = angles;
    }
    if step[6] != 0.0 {
        laser.delay_ms = rounded(laser.delay_ms + step[6] * 1e3, sigma[6]);
    }
}

/// The standard deviations of those of the odometry's scales that were observed.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Observed {
    /// That of the way.
    pub way: Option<f64>,
    /// That of turns.
    pub turn: Option<f64>,
    /// The drift with the way, radians per meter.
    pub drift: Option<f64>,
}

/// Puts in what a unit of a Pioneer was taken as, where the rig leaves that to the base.
pub(super) fn with_ticks(rig: &mut Rig, taken_m: Option<f64>) {
    if let BaseProtocol::P2os { metres_per_tick } = &mut rig.base.protocol {
        *metres_per_tick = metres_per_tick.or(taken_m);
    }
}

/// Puts in what the base's counts are worth, as far as its keys can say it; which of way, turn and drift they
/// can.
pub(super) fn with_scales(rig: &mut Rig, scales: &Scales, observed: Observed) -> [bool; 3] {
    let way = observed.way.map_or(1.0, |_| scales.way.value);
    let turn = observed.turn.map_or(1.0, |_| scales.turn.value);
    match &mut rig.base.protocol {
        BaseProtocol::P2os { metres_per_tick: Some(meters) } => {
            scale(meters, way, &[observed.way]);
            [true, false, false]
        }
        BaseProtocol::P2os { metres_per_tick: None } | BaseProtocol::None => [false; 3],
        BaseProtocol::RoboClaw { wheel_base_m, metres_per_count_left, metres_per_count_right, .. } => {
            // Way (l + r) / 2, turn (r - l) / wheel base: both must come out times `way`, times `turn` plus
            // the drift.
            scale(wheel_base_m, way / turn, &[observed.way, observed.turn]);
            let drift = observed.drift.map_or(0.0, |_| scales.drift_rad_per_m.value);
            let half_m = 0.5 * *wheel_base_m;
            let sigmas = [observed.way, observed.drift.map(|sigma| sigma * half_m)];
            scale(metres_per_count_left, way - drift * half_m, &sigmas);
            scale(metres_per_count_right, way + drift * half_m, &sigmas);
            [true; 3]
        }
        BaseProtocol::Rflex { counts_per_m, counts_per_rad } => {
            scale(counts_per_m, 1.0 / way, &[observed.way]);
            scale(counts_per_rad, 1.0 / turn, &[observed.turn]);
            [true, true, false]
        }
    }
}

/// What to enter by hand for the odometry's scale, where the rig leaves it to the base itself and the
/// recording, an older one, does not say what its counts are worth.
pub(super) fn way_by_hand(rig: &Rig, way: f64, sigma: f64) -> Option<String> {
    /// What most bases count, meters: those whose subclass ends in `-sh`, and those that nobody knows.
    const USUAL_M: f64 = 0.001;
    let BaseProtocol::P2os { metres_per_tick: None } = rig.base.protocol else { return None };
    Some(format!(
        "enter metres_per_tick = {} under [base] if it counts millimeters (subclass ..-sh), else {} times what \
         docs/bases.md has for its subclass",
        rounded(USUAL_M * way, USUAL_M * sigma),
        rounded(way, sigma)
    ))
}

/// Multiplies a value by a factor, in as many digits as the best known part of the factor allows; a factor
/// of which nothing was observed changes nothing.
fn scale(value: &mut f64, factor: f64, sigmas: &[Option<f64>]) {
    if let Some(sigma) = sigmas.iter().flatten().copied().reduce(f64::min) {
        *value = rounded(*value * factor, sigma * value.abs());
    }
}

/// A value in steps of a tenth to a hundredth of its standard deviation, and no minus before a zero.
fn rounded(value: f64, sigma: f64) -> f64 {
    // Finer than any value of a rig; a sigma of zero asks for more.
    const MAX_DECIMALS: usize = 12;
    let decimals = (0..MAX_DECIMALS).take_while(|&n| 10_f64.powi(-(n as i32)) > 0.1 * sigma).count();
    format!("{value:.decimals$}").parse::<f64>().unwrap_or(value) + 0.0
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::recordings::mounts::base_from_mount;

    const SIGMA: [f64; PARAMETERS] = [0.001_3, 0.001_3, 0.001_3, 0.064, 0.073, 0.096, 1.5];

    #[test]
    fn digits_are_those_that_the_standard_deviation_allows() {
        for (value, sigma, expected) in [
            (-90.000_001, 0.02, -90.0),
            (-0.165_432_1, 0.02, -0.165),
            (-0.165_432_1, 0.15, -0.17),
            (0.047_123_4, 0.000_5, 0.047_12),
            (0.047_123_4, 0.003_5, 0.047_1),
            (-0.000_001, 0.001, 0.0),
            (29.876, 1.5, 29.9),
            (103_456.789, 51.7, 103_457.0),
            (0.000_987_654_3, 5e-7, 0.000_987_65),
        ] {
            assert_eq!(rounded(value, sigma).to_string(), expected.to_string(), "{value} {sigma}");
        }
        assert!((rounded(0.1, 0.0) - 0.1).abs() < 1e-12);
    }

    #[test]
    fn what_is_not_corrected_stays_and_the_rest_has_no_digits_of_chance() {
        let mut rig = Rig::default();
        let laser = rig.vertical.as_mut().unwrap();
        (laser.mount.y, laser.delay_ms) = (0.012_345_678_9, 1.234_567);
        let before = laser.mount;
        let start = Placement { base_from_laser: base_from_mount(&before), late_s: 0.0 };
        let aside = Step::from([0.003_456, 0.0, 0.0, 0.0, 0.0, (-0.165_432_1_f64).to_radians(), 0.0]);
        with_placement(&mut rig, &start, &aside, &SIGMA);
        let found = rig.vertical.unwrap();
        let expected = biplane_recording::rig::Mount { x: 0.053_5, yaw: -0.165, ..before };
        assert_eq!((found.mount, found.delay_ms), (expected, 1.234_567));
    }
}
