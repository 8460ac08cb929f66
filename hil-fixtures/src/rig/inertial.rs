//! What an inertial unit on the robot measures: turn rates and accelerations in its own axes, with the errors
//! of a common MEMS unit.
//!
//! Each sample is the mean over its period, so that nothing between two samples is lost: a robot that passes
//! a bend of the ground turns within less than one.

use crate::rng::Rng;
use crate::world::pose::Pose;

/// Standard gravity, m/s^2.
const GRAVITY_M_S2: f64 = 9.806_65;
/// Time between two samples where nobody asks for another, nanoseconds.
pub const PERIOD_NS: i64 = 10_000_000;
/// Stream of the random numbers.
const STREAM: u64 = 0x1_4010;

/// How well it measures: an MPU-9250, a BMI088 and their like lie about here.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct InertialParams {
    /// Noise of the turn rates, degrees/s for the root of a hertz.
    pub turn_noise_deg_s: f64,
    /// What they show at rest, one standard deviation, degrees/s.
    pub turn_bias_deg_s: f64,
    /// Its random walk, degrees/s for the root of a second.
    pub turn_walk_deg_s: f64,
    /// Share by which turn rates are off, one standard deviation.
    pub turn_scale: f64,
    /// Noise of the accelerations, m/s^2 for the root of a hertz.
    pub force_noise_m_s2: f64,
    /// What is wrong with them at rest, one standard deviation, m/s^2: 20 mg.
    pub force_bias_m_s2: f64,
    /// Its random walk, m/s^2 for the root of a second.
    pub force_walk_m_s2: f64,
    /// Shaking of the chassis while it drives, one standard deviation of a sample, m/s^2.
    pub vibration_m_s2: f64,
}

impl Default for InertialParams {
    fn default() -> Self {
        Self {
            turn_noise_deg_s: 0.01,
            turn_bias_deg_s: 0.3,
            turn_walk_deg_s: 0.0005,
            turn_scale: 0.003,
            force_noise_m_s2: 0.002,
            force_bias_m_s2: 0.2,
            force_walk_m_s2: 0.0002,
            vibration_m_s2: 0.3,
        }
    }
}

/// One sample in the unit's own axes.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct InertialSample {
    /// The middle of its period, nanoseconds.
    pub time_ns: i64,
    /// Turn rates, rad/s.
    pub turn_rad_s: [f64; 3],
    /// Accelerations with gravity, m/s^2.
    pub force_m_s2: [f64; 3],
}

/// A unit that is read again and again.
pub struct SimulatedInertial<F> {
    map_from_unit: F,
    params: InertialParams,
    rng: Rng,
    turn_bias_rad_s: [f64; 3],
    turn_scale: [f64; 3],
    force_bias_m_s2: [f64; 3],
}

impl<F: Fn(i64) -> Pose> SimulatedInertial<F> {
    /// That is where `map_from_unit` says at each time, nanoseconds; its biases are drawn from the seed.
    #[must_use]
    pub fn new(map_from_unit: F, params: InertialParams, seed: u64) -> Self {
        let mut rng = Rng::new(seed, STREAM, 0);
        let mut three = |sigma: f64| [0; 3].map(|_| sigma * rng.normal());
        let turn_bias_rad_s = three(params.turn_bias_deg_s.to_radians());
        let (turn_scale, force_bias_m_s2) = (three(params.turn_scale), three(params.force_bias_m_s2));
        Self { map_from_unit, params, rng, turn_bias_rad_s, turn_scale, force_bias_m_s2 }
    }

    /// The sample about a time; samples are read in order.
    pub fn sample(&mut self, time_ns: i64) -> InertialSample {
        self.sample_over(time_ns, PERIOD_NS)
    }

    /// The same of a unit that is read each `period_ns`.
    pub fn sample_over(&mut self, time_ns: i64, period_ns: i64) -> InertialSample {
        let (turn_rad_s, force_m_s2, moves) = self.felt(time_ns, period_ns);
        let period_s = period_ns as f64 * 1e-9;
        let (InertialParams { vibration_m_s2, .. }, rate) = (self.params, (1.0 / period_s).sqrt());
        let turn_noise = self.params.turn_noise_deg_s.to_radians() * rate;
        let force_noise =
            (self.params.force_noise_m_s2 * rate).hypot(if moves { vibration_m_s2 } else { 0.0 });
        let walks = [self.params.turn_walk_deg_s.to_radians(), self.params.force_walk_m_s2]
            .map(|walk| walk * period_s.sqrt());
        for axis in 0..3 {
            self.turn_bias_rad_s[axis] += walks[0] * self.rng.normal();
            self.force_bias_m_s2[axis] += walks[1] * self.rng.normal();
        }
        let mut turn = |axis: usize| {
            turn_rad_s[axis] * (1.0 + self.turn_scale[axis])
                + self.turn_bias_rad_s[axis]
                + turn_noise * self.rng.normal()
        };
        let turn_rad_s = [turn(0), turn(1), turn(2)];
        let mut force =
            |axis: usize| force_m_s2[axis] + self.force_bias_m_s2[axis] + force_noise * self.rng.normal();
        InertialSample { time_ns, turn_rad_s, force_m_s2: [force(0), force(1), force(2)] }
    }

    /// Turn rates and accelerations without errors, and whether the robot moves.
    fn felt(&self, time_ns: i64, period_ns: i64) -> ([f64; 3], [f64; 3], bool) {
        let period_s = period_ns as f64 * 1e-9;
        let unit = &self.map_from_unit;
        let turned = unit(time_ns - period_ns / 2).inverse().then(&unit(time_ns + period_ns / 2)).rotation;
        let axis = |a: usize, b: usize| 0.5 * (turned[a][b] - turned[b][a]) / period_s;
        // Over twice the period, so that the weights of all samples add up to one at any time.
        let at = [-1, 0, 1].map(|step| unit(time_ns + step * period_ns));
        let mut force: [f64; 3] = std::array::from_fn(|axis| {
            let [before, now, after] = at.map(|pose| pose.translation_m[axis]);
            (after - 2.0 * now + before) / (period_s * period_s)
        });
        let moves = at[0] != at[2];
        force[2] += GRAVITY_M_S2;
        ([axis(2, 1), axis(0, 2), axis(1, 0)], at[1].inverse().rotate(force), moves)
    }
}

#[cfg(test)]
mod tests {
    use super::{GRAVITY_M_S2, InertialParams, PERIOD_NS, SimulatedInertial};
    use crate::rig::simulated::{SimulatedRig, SimulationParams, base_from_laser};
    use crate::world::World;
    use biplane_recording::Rig;
    use biplane_recording::rig::Mount;

    /// A unit without errors.
    const EXACT: InertialParams = InertialParams {
        turn_noise_deg_s: 0.0,
        turn_bias_deg_s: 0.0,
        turn_walk_deg_s: 0.0,
        turn_scale: 0.0,
        force_noise_m_s2: 0.0,
        force_bias_m_s2: 0.0,
        force_walk_m_s2: 0.0,
        vibration_m_s2: 0.0,
    };

    #[test]
    fn on_a_ramp_gravity_pulls_back_and_the_turns_of_the_drive_add_up_to_its_tilt() {
        let world = World::named("ramp-up").expect("built in");
        let path = world.path(Some("straight")).expect("has it").clone();
        let rig = SimulatedRig::new(&world, &path, &Rig::default(), &SimulationParams::default(), 1)
            .expect("drives");
        let mount = base_from_laser(&Mount { z: 0.3, yaw: 90.0, ..Mount::default() });
        let mut unit = SimulatedInertial::new(|time_ns| rig.map_from_base(time_ns).then(&mount), EXACT, 1);
        // In the middle of the ramp, at about 10 m: 6 degrees nose up.
        let (mut turned_rad, mut time_ns) = (0.0, 0);
        while rig.map_from_base(time_ns).translation_m[0] < 10.0 {
            // The unit looks to the left: its -x axis is the base's right.
            turned_rad += unit.sample(time_ns).turn_rad_s[0] * PERIOD_NS as f64 * 1e-9;
            time_ns += PERIOD_NS;
        }
        let sample = unit.sample(time_ns);
        let tilt_rad = (-sample.force_m_s2[1] / GRAVITY_M_S2).asin();
        assert!((tilt_rad.to_degrees() - 6.0).abs() < 0.1, "{}", tilt_rad.to_degrees());
        assert!((turned_rad.abs().to_degrees() - 6.0).abs() < 0.1, "{}", turned_rad.to_degrees());
    }

    #[test]
    fn a_unit_at_rest_shows_its_bias_and_gravity() {
        let world = World::named("ramp-up").expect("built in");
        let path = world.path(None).expect("has one").clone();
        let rig = SimulatedRig::new(&world, &path, &Rig::default(), &SimulationParams::default(), 1)
            .expect("drives");
        rig.start_drive_at(i64::MAX);
        let mean = |params: InertialParams| -> [f64; 2] {
            let mut unit = SimulatedInertial::new(|time_ns| rig.map_from_base(time_ns), params, 5);
            let samples: Vec<_> = (0..200).map(|n| unit.sample(n * PERIOD_NS)).collect();
            let mean = |part: &dyn Fn(usize) -> f64| (0..200).map(part).sum::<f64>() / 200.0;
            [mean(&|n| samples[n].turn_rad_s[1].to_degrees()), mean(&|n| samples[n].force_m_s2[2])]
        };
        let [turn, force] = mean(EXACT);
        assert!(turn.abs() < 1e-9 && (force - GRAVITY_M_S2).abs() < 1e-6, "{turn} {force}");
        let [turn, force] = mean(InertialParams::default());
        assert!(turn.abs() > 0.01 && turn.abs() < 1.0, "{turn}");
        assert!((force - GRAVITY_M_S2).abs() > 0.005 && (force - GRAVITY_M_S2).abs() < 0.8, "{force}");
    }
}
