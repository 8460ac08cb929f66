//! The trajectory as knots: a state of the base every so often, straight lines in between.
//!
//! Frame `map`, meters, radians, nanoseconds. Headings are not wrapped, so that they can be interpolated.

use biplane_geometry::PortableMath;
use biplane_geometry::vec3::cross;
use biplane_geometry::{StampedPose, Trajectory, wrap_angle};

/// x, y, z (meters), roll, pitch, heading (radians) of `base_link` in `map`.
pub(crate) type State = [f64; 6];

/// Knots that follow each other in equal times.
#[derive(Clone, Debug, Default, PartialEq)]
pub(crate) struct Knots {
    /// Time of the first, nanoseconds.
    pub start_ns: i64,
    /// Time from one to the next, nanoseconds.
    pub step_ns: i64,
    /// At least two.
    pub states: Vec<State>,
}

impl Knots {
    /// Along a trajectory from its first to its last pose; `None` where it has gaps longer than `gap_ns`, or
    /// is shorter than two knots.
    pub(crate) fn of(trajectory: &Trajectory, step_ns: i64, gap_ns: i64) -> Option<Self> {
        let poses = trajectory.poses();
        let (start_ns, end_ns) = (poses.first()?.stamp_ns, poses.last()?.stamp_ns);
        let count = (end_ns - start_ns) / step_ns + 2;
        let mut states: Vec<State> = Vec::with_capacity(usize::try_from(count).ok()?);
        for number in 0..count {
            let pose = trajectory.at((start_ns + number * step_ns).min(end_ns), gap_ns)?;
            let before_rad = states.last().map_or(pose.theta_rad, |state| state[5]);
            let yaw_rad = before_rad + wrap_angle(pose.theta_rad - before_rad);
            states.push([pose.x_m, pose.y_m, pose.z_m, pose.roll_rad, pose.pitch_rad, yaw_rad]);
        }
        (states.len() > 2).then_some(Self { start_ns, step_ns, states })
    }

    /// The knot before a time, and the share of the way to the next one; `None` outside.
    pub(crate) fn place(&self, stamp_ns: i64) -> Option<(usize, f64)> {
        let since_ns = stamp_ns.checked_sub(self.start_ns).filter(|since_ns| *since_ns >= 0)?;
        let knot = usize::try_from(since_ns / self.step_ns).ok()?;
        let share = (since_ns % self.step_ns) as f64 / self.step_ns as f64;
        (knot + 1 < self.states.len()).then_some((knot, share))
    }

    /// The state between a knot and the next.
    pub(crate) fn between(&self, knot: usize, share: f64) -> State {
        let (a, b) = (&self.states[knot], &self.states[knot + 1]);
        std::array::from_fn(|part| a[part] + share * (b[part] - a[part]))
    }

    /// The pose at a time; outside of the knots that of the nearest end.
    pub(crate) fn pose(&self, stamp_ns: i64) -> StampedPose {
        let last = self.states.len() - 2;
        let (knot, share) =
            self.place(stamp_ns).unwrap_or(if stamp_ns < self.start_ns { (0, 0.0) } else { (last, 1.0) });
        let [x_m, y_m, z_m, roll_rad, pitch_rad, yaw_rad] = self.between(knot, share);
        let theta_rad = wrap_angle(yaw_rad);
        StampedPose { stamp_ns, x_m, y_m, theta_rad, z_m, roll_rad, pitch_rad }
    }

    /// Seconds from knot to knot.
    pub(crate) fn step_s(&self) -> f64 {
        self.step_ns as f64 * 1e-9
    }
}

/// The rotation of a state, and the axes about which its angles turn what is rotated.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Attitude {
    /// Rows first.
    pub matrix: [[f64; 3]; 3],
    roll_axis: [f64; 3],
    pitch_axis: [f64; 3],
}

impl Attitude {
    /// Of a state.
    pub(crate) fn of(state: &State) -> Self {
        let [(sr, cr), (sp, cp), (sy, cy)] = [state[3], state[4], state[5]].map(f64::portable_sin_cos);
        let matrix = [
            [cy * cp, cy * sp * sr - sy * cr, cy * sp * cr + sy * sr],
            [sy * cp, sy * sp * sr + cy * cr, sy * sp * cr - cy * sr],
            [-sp, cp * sr, cp * cr],
        ];
        Self { matrix, roll_axis: [cy * cp, sy * cp, -sp], pitch_axis: [-sy, cy, 0.0] }
    }

    /// A direction of the base, in `map`.
    pub(crate) fn rotate(&self, [x, y, z]: [f64; 3]) -> [f64; 3] {
        self.matrix.map(|[a, b, c]| a * x + b * y + c * z)
    }

    /// How a rotated direction moves with roll, pitch and heading.
    pub(crate) fn derivatives(&self, rotated: [f64; 3]) -> [[f64; 3]; 3] {
        [cross(self.roll_axis, rotated), cross(self.pitch_axis, rotated), [-rotated[1], rotated[0], 0.0]]
    }
}

/// Where a point of the base is in `map`.
pub(crate) fn placed(state: &State, at: [f64; 3]) -> [f64; 3] {
    let turned = Attitude::of(state).rotate(at);
    std::array::from_fn(|axis| turned[axis] + state[axis])
}

#[cfg(test)]
mod tests {
    use super::{Attitude, Knots, State, placed};
    use biplane_geometry::{StampedPose, Trajectory};

    #[test]
    fn derivatives_are_those_of_small_steps() {
        let state: State = [1.0, 2.0, 3.0, 0.2, -0.3, 2.0];
        let (attitude, direction) = (Attitude::of(&state), [0.5, -1.0, 2.0]);
        let rotated = attitude.rotate(direction);
        for (angle, derivative) in attitude.derivatives(rotated).into_iter().enumerate() {
            let mut stepped = state;
            stepped[3 + angle] += 1e-6;
            let moved = Attitude::of(&stepped).rotate(direction);
            for axis in 0..3 {
                let found = (moved[axis] - rotated[axis]) / 1e-6;
                assert!((found - derivative[axis]).abs() < 1e-5, "{angle} {axis}: {found}");
            }
        }
    }

    #[test]
    fn knots_go_through_the_trajectory_and_their_poses_place_points_as_it_does() {
        let pose = |k: i64| StampedPose {
            stamp_ns: k * 100,
            x_m: 0.1 * k as f64,
            theta_rad: biplane_geometry::wrap_angle(3.0 + 0.1 * k as f64),
            pitch_rad: -0.01 * k as f64,
            ..StampedPose::default()
        };
        let trajectory = Trajectory::new((0..11).map(pose).collect());
        let knots = Knots::of(&trajectory, 100, 1000).expect("long enough");
        for stamp_ns in [0, 50, 333, 1000] {
            let (found, expected) = (knots.pose(stamp_ns), trajectory.at(stamp_ns, 1000).expect("inside"));
            assert!((found.x_m - expected.x_m).abs() < 1e-12 && found.turn_rad(&expected).abs() < 1e-12);
            let (knot, share) = knots.place(stamp_ns).expect("inside");
            let at = placed(&knots.between(knot, share), [1.0, 2.0, 3.0]);
            let same = expected.transform([1.0, 2.0, 3.0]);
            assert!(at.iter().zip(same).all(|(a, b)| (a - b).abs() < 1e-9), "{at:?} {same:?}");
        }
        assert!(knots.place(-1).is_none() && knots.place(10_000).is_none());
    }
}
