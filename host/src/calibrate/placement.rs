//! Where the vertical laser sits and how late it is: what the calibration moves.
//!
//! Seven parameters: x, y, z of the laser on the base (meters); a small turn about the base's x, y and z axes
//! through the laser's origin (radians); how much earlier than its stamp a scan was taken (seconds,
//! `delay_ms` of the rig). Turns about the base's axes and not roll, pitch and yaw: at the usual pitch of -90
//! degrees roll and yaw turn about the same axis.

use biplane_recording::rig::Mount;
use nalgebra::{Isometry3, Matrix3, SMatrix, SVector, Translation3, UnitQuaternion, Vector3};

use crate::recordings::deskew::StampedPose;
use crate::recordings::mounts::mount_of;

/// How many parameters.
pub(super) const PARAMETERS: usize = 7;
/// A step of all parameters.
pub(super) type Step = SVector<f64, PARAMETERS>;
/// How a point in `map` moves with each parameter.
pub(super) type PointJacobian = SMatrix<f64, 3, PARAMETERS>;
/// A matrix of parameters by parameters.
pub(super) type Square = SMatrix<f64, PARAMETERS, PARAMETERS>;

/// A laser's place and time.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Placement {
    /// `base_from_laser`.
    pub base_from_laser: Isometry3<f64>,
    /// How much earlier than its stamp a scan was taken, seconds; on top of what the recording's rig says.
    pub late_s: f64,
}

impl Placement {
    /// After a step.
    #[must_use]
    pub(super) fn stepped(&self, step: &Step) -> Self {
        let moved = Vector3::new(step[0], step[1], step[2]) + self.base_from_laser.translation.vector;
        let turn = UnitQuaternion::from_scaled_axis(Vector3::new(step[3], step[4], step[5]));
        Self {
            base_from_laser: Isometry3::from_parts(
                Translation3::from(moved),
                turn * self.base_from_laser.rotation,
            ),
            late_s: self.late_s + step[6],
        }
    }

    /// The step that leads from `start` here.
    #[must_use]
    pub(super) fn since(&self, start: &Self) -> Step {
        let moved = self.base_from_laser.translation.vector - start.base_from_laser.translation.vector;
        let turn = (self.base_from_laser.rotation * start.base_from_laser.rotation.inverse()).scaled_axis();
        Step::from([moved.x, moved.y, moved.z, turn.x, turn.y, turn.z, self.late_s - start.late_s])
    }

    /// How a point that the laser sees at `in_laser_m` moves in `map`, when the base is at `pose` and moves
    /// as `velocity` says (x and y of `map` in m/s, heading in rad/s).
    #[must_use]
    pub(super) fn jacobian(
        &self,
        in_laser_m: [f64; 2],
        pose: &StampedPose,
        velocity: Vector3<f64>,
    ) -> PointJacobian {
        let turn = UnitQuaternion::from_axis_angle(&Vector3::z_axis(), pose.theta_rad);
        let to_map: Matrix3<f64> = *turn.to_rotation_matrix().matrix();
        let arm = self.base_from_laser.rotation * Vector3::new(in_laser_m[0], in_laser_m[1], 0.0);
        let in_map = to_map * (arm + self.base_from_laser.translation.vector);
        let mut jacobian = PointJacobian::zeros();
        jacobian.fixed_columns_mut::<3>(0).copy_from(&to_map);
        jacobian.fixed_columns_mut::<3>(3).copy_from(&(to_map * -arm.cross_matrix()));
        let turning = Vector3::new(-in_map.y, in_map.x, 0.0) * velocity.z;
        jacobian.set_column(6, &-(Vector3::new(velocity.x, velocity.y, 0.0) + turning));
        jacobian
    }

    /// The mount that says the same: of the two ways to say an orientation the one nearer to `before`.
    #[must_use]
    pub(super) fn mount(&self, before: &Mount) -> Mount {
        let mount = mount_of(&self.base_from_laser);
        let one = [mount.roll, mount.pitch, mount.yaw];
        let other = [one[0] + 180.0, 180.0 - one[1], one[2] + 180.0];
        let was = [before.roll, before.pitch, before.yaw];
        let near = |angles: [f64; 3]| -> [f64; 3] {
            std::array::from_fn(|i| angles[i] - 360.0 * ((angles[i] - was[i]) / 360.0).round())
        };
        let off = |angles: &[f64; 3]| (0..3).map(|i| (angles[i] - was[i]).abs()).sum::<f64>();
        let (one, other) = (near(one), near(other));
        let [roll, pitch, yaw] = if off(&other) < off(&one) { other } else { one };
        Mount { roll, pitch, yaw, ..mount }
    }
}
