//! From the counts of two wheels to meters and radians.

use crate::session::base::motion::Motion;

/// The two driven wheels.
#[derive(Copy, Clone, PartialEq, Debug)]
pub(crate) struct Wheels {
    /// Between the wheels' tracks, meters. Too large makes the robot seem to turn too little.
    pub wheel_base_m: f64,
    /// Way of one count of the left wheel, meters; negative when it counts backwards.
    pub metres_per_count_left: f64,
    /// The same of the right wheel.
    pub metres_per_count_right: f64,
}

impl Wheels {
    /// What these counts of the left and the right wheel are as a motion.
    pub(crate) fn motion(&self, [left, right]: [i32; 2]) -> Motion {
        let left_m = f64::from(left) * self.metres_per_count_left;
        let right_m = f64::from(right) * self.metres_per_count_right;
        Motion { path_m: 0.5 * (left_m + right_m), turn_rad: (right_m - left_m) / self.wheel_base_m }
    }
}
