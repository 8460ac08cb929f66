//! What a Pioneer-like base believes about its own way: it drifts.
//!
//! The base counts its wheels: every length is off by a constant share, the heading drifts with the way and
//! both wander at random. It reports x and y in its own ticks (15 bits, wrapping) and the heading in 4096
//! steps a turn (P2OS). Own frame: its pose at the start of the drive is zero.

use crate::rig::drive::Drive;
use crate::rig::source::OdometrySample;
use crate::rng::Rng;

/// How badly the base counts.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct OdometryParams {
    /// Share by which every length is too long (0.01: 1 % too long).
    pub scale_error: f64,
    /// Share by which every turn is too large.
    pub turn_error: f64,
    /// Drift of the heading, degrees a meter driven.
    pub drift_deg_per_m: f64,
    /// Random walk of the heading: standard deviation after a meter, degrees; grows with the root of the way.
    pub heading_noise_deg: f64,
    /// Random walk of the position along the way: standard deviation after a meter, meters.
    pub path_noise_m: f64,
    /// Distance between the wheels, meters: for their speeds only.
    pub track_m: f64,
}

impl Default for OdometryParams {
    fn default() -> Self {
        Self {
            scale_error: 0.01,
            turn_error: 0.01,
            drift_deg_per_m: 0.3,
            heading_noise_deg: 0.4,
            path_noise_m: 0.005,
            track_m: 0.33,
        }
    }
}

/// Step of the integration, seconds.
const STEP_S: f64 = 0.02;

/// A drive as its base counts it.
#[derive(Clone, Debug)]
pub struct Odometer {
    /// x, y in meters, heading in radians, way in meters, one a step.
    assumed: Vec<[f64; 4]>,
    params: OdometryParams,
}

impl Odometer {
    /// Counts the whole drive once.
    #[must_use]
    pub fn new(drive: &Drive, params: OdometryParams, seed: u64) -> Self {
        let steps = (drive.duration_s() / STEP_S).ceil() as usize + 1;
        let mut rng = Rng::new(seed, 0x0D0, 0);
        let mut at = [0.0_f64; 4];
        let mut assumed = vec![at];
        let mut before = drive.motion(0.0);
        for step in 1..=steps {
            let now = drive.motion(step as f64 * STEP_S);
            let way = now.along_m - before.along_m;
            let counted = way * (1.0 + params.scale_error) + rng.normal() * params.path_noise_m * way.sqrt();
            let wander = params.drift_deg_per_m * way + rng.normal() * params.heading_noise_deg * way.sqrt();
            let turned =
                (now.heading_rad - before.heading_rad) * (1.0 + params.turn_error) + wander.to_radians();
            let middle = at[2] + 0.5 * turned;
            at = [
                at[0] + counted * middle.cos(),
                at[1] + counted * middle.sin(),
                at[2] + turned,
                at[3] + counted,
            ];
            assumed.push(at);
            before = now;
        }
        Self { assumed, params }
    }

    /// Where the base believes to be `time_s` after the start: x, y in meters, heading in radians (not
    /// wrapped).
    #[must_use]
    pub fn assumed(&self, time_s: f64) -> [f64; 3] {
        let [x_m, y_m, heading_rad, _] = self.state(time_s);
        [x_m, y_m, heading_rad]
    }

    fn state(&self, time_s: f64) -> [f64; 4] {
        let last = self.assumed.len() - 1;
        let steps = (time_s / STEP_S).clamp(0.0, last as f64);
        let index = (steps as usize).min(last - 1);
        let (a, b) = (self.assumed[index], self.assumed[index + 1]);
        let u = steps - index as f64;
        [0, 1, 2, 3].map(|i| a[i] + u * (b[i] - a[i]))
    }

    /// What the base reports `time_s` after the start.
    #[must_use]
    pub fn sample(&self, drive: &Drive, time_s: f64, metres_per_tick: f64) -> OdometrySample {
        let [x_m, y_m, heading_rad, path_m] = self.state(time_s);
        let motion = drive.motion(time_s);
        let aside = 0.5 * self.params.track_m * motion.turn_rad_s;
        let mm_s = |speed_m_s: f64| (speed_m_s * 1000.0).round().clamp(-32768.0, 32767.0) as i16;
        OdometrySample {
            x_raw: ticks(x_m, metres_per_tick),
            y_raw: ticks(y_m, metres_per_tick),
            theta_raw: theta_steps(heading_rad),
            left_mm_s: mm_s(motion.speed_m_s - aside),
            right_mm_s: mm_s(motion.speed_m_s + aside),
            moving: motion.speed_m_s > 0.001,
            path_um: (path_m * 1e6).round() as i64,
            heading_urad: (heading_rad * 1e6).round() as i64,
        }
    }
}

/// Whole ticks in 15 bits.
#[must_use]
pub fn ticks(length_m: f64, metres_per_tick: f64) -> u16 {
    ((length_m / metres_per_tick).round() as i64).rem_euclid(0x8000) as u16
}

/// Heading in 4096 steps a turn, -2048..2048.
#[must_use]
pub fn theta_steps(heading_rad: f64) -> i16 {
    let steps = (heading_rad / std::f64::consts::TAU * 4096.0).round() as i64;
    ((steps + 2048).rem_euclid(4096) - 2048) as i16
}

#[cfg(test)]
mod tests {
    use super::{Odometer, OdometryParams, theta_steps, ticks};
    use crate::rig::drive::Drive;
    use crate::world::path::Path;

    fn drive(waypoints_m: &[[f64; 2]]) -> Drive {
        Drive::new(&Path { waypoints_m: waypoints_m.to_vec(), speed_m_s: 0.5, ..Path::default() }, 1)
            .expect("drives")
    }

    const PERFECT: OdometryParams = OdometryParams {
        scale_error: 0.0,
        turn_error: 0.0,
        drift_deg_per_m: 0.0,
        heading_noise_deg: 0.0,
        path_noise_m: 0.0,
        track_m: 0.4,
    };

    #[test]
    fn a_base_that_counts_perfectly_reports_the_truth() {
        let drive = drive(&[[0.0, 0.0], [8.0, 0.0], [8.0, 6.0], [2.0, 6.0]]);
        let odometer = Odometer::new(&drive, PERFECT, 1);
        for k in 0..50 {
            let time_s = drive.duration_s() * f64::from(k) / 49.0;
            let truth = drive.pose(time_s).translation_m;
            let [x, y, _] = odometer.assumed(time_s);
            assert!((x - truth[0]).hypot(y - truth[1]) < 2e-3, "{time_s}: {x} {y} {truth:?}");
        }
    }

    #[test]
    fn the_drift_is_the_one_asked_for() {
        let drive = drive(&[[0.0, 0.0], [10.0, 0.0]]);
        let params = OdometryParams { scale_error: 0.02, drift_deg_per_m: 0.5, ..PERFECT };
        let [x, y, heading] = Odometer::new(&drive, params, 1).assumed(1e9);
        assert!((heading.to_degrees() - 5.0).abs() < 1e-6);
        // A circle: chord and sagitta of 10.2 m of way through 5 degrees.
        let radius = 10.2 / 5.0_f64.to_radians();
        assert!(
            (x - radius * heading.sin()).abs() < 1e-3 && (y - radius * (1.0 - heading.cos())).abs() < 1e-3
        );
    }

    #[test]
    fn the_random_walk_grows_with_the_root_of_the_way() {
        let drive = drive(&[[0.0, 0.0], [16.0, 0.0]]);
        let params = OdometryParams { heading_noise_deg: 0.5, path_noise_m: 0.02, ..PERFECT };
        let n = 400;
        let mut sums = [0.0; 2];
        for seed in 0..n {
            let [x, _, heading] = Odometer::new(&drive, params, seed).assumed(1e9);
            sums[0] += heading.to_degrees().powi(2) / n as f64;
            sums[1] += (x - 16.0).powi(2) / n as f64;
        }
        // After 16 m: four times the deviation of a meter (x also loses a little to the wandering heading).
        assert!((sums[0].sqrt() - 2.0).abs() < 0.2, "{}", sums[0].sqrt());
        assert!((sums[1].sqrt() - 0.08).abs() < 0.01, "{}", sums[1].sqrt());
    }

    #[test]
    fn counts_wrap_as_on_the_wire() {
        assert_eq!([ticks(0.0, 0.001), ticks(32.768, 0.001), ticks(-0.001, 0.001)], [0, 0, 32767]);
        let half = std::f64::consts::PI;
        assert_eq!(
            [theta_steps(half / 2.0), theta_steps(half), theta_steps(-half), theta_steps(5.0 * half / 2.0)],
            [1024, -2048, -2048, 1024]
        );
    }

    #[test]
    fn wheels_turn_at_the_speed_of_the_base() {
        let drive = drive(&[[0.0, 0.0], [10.0, 0.0]]);
        let odometer = Odometer::new(&drive, PERFECT, 1);
        let rolling = odometer.sample(&drive, 10.0, 0.001);
        assert_eq!((rolling.left_mm_s, rolling.right_mm_s, rolling.moving), (500, 500, true));
        assert!(!odometer.sample(&drive, -1.0, 0.001).moving);
    }
}
