//! Odometry of a bag as our recordings have it: from `odom` to `base_link`, whichever frames it came in, also
//! where it comes in transforms only.

use biplane_recording::messages::{Odometry, TransformStamped};
use biplane_recording::topics::{FRAME_BASE, FRAME_ODOM};
use nalgebra::{Isometry3, Vector3};

use crate::recordings::mounts::isometry;

/// A speed is told between two poses that are nearer than this, in ns.
const LONGEST_STEP_NS: i64 = 1_000_000_000;

/// Makes odometry of the base out of that of another frame on it.
#[derive(Debug)]
pub(crate) struct OdometryMaker {
    /// Takes points of the base into the frame whose odometry it is.
    child_from_base: Isometry3<f64>,
    last: Option<(i64, Isometry3<f64>)>,
}

impl OdometryMaker {
    /// For a frame that sits so on the base.
    pub(crate) fn new(child_from_base: Isometry3<f64>) -> Self {
        Self { child_from_base, last: None }
    }

    /// A message of the bag; `None` when its pose is none.
    pub(crate) fn of_message(&self, message: &Odometry) -> Option<Odometry> {
        let odom_from_child = isometry(message.position_m, message.orientation_xyzw)?;
        if self.child_from_base == Isometry3::identity() {
            // What the bag says, to the bit.
            let (frame_id, child_frame_id) = (FRAME_ODOM.to_owned(), FRAME_BASE.to_owned());
            return Some(Odometry { frame_id, child_frame_id, ..message.clone() });
        }
        let to_base = self.child_from_base.inverse();
        let turn = Vector3::from(message.angular_rad_s);
        // A point of a body moves with it and around it.
        let speed = Vector3::from(message.linear_m_s) + turn.cross(&self.child_from_base.translation.vector);
        let mut made = odometry(message.stamp_ns, &(odom_from_child * self.child_from_base));
        made.linear_m_s = (to_base.rotation * speed).into();
        made.angular_rad_s = (to_base.rotation * turn).into();
        made.pose_covariance = message.pose_covariance;
        made.twist_covariance = message.twist_covariance;
        Some(made)
    }

    /// A transform of the bag; speeds by difference from the one before.
    pub(crate) fn of_transform(&mut self, transform: &TransformStamped) -> Option<Odometry> {
        let odom_from_child = isometry(transform.translation_m, transform.rotation_xyzw)?;
        let odom_from_base = odom_from_child * self.child_from_base;
        let mut made = odometry(transform.stamp_ns, &odom_from_base);
        if let Some((stamp_ns, before)) = self.last.replace((transform.stamp_ns, odom_from_base)) {
            let step_ns = transform.stamp_ns.saturating_sub(stamp_ns);
            if (1..=LONGEST_STEP_NS).contains(&step_ns) {
                let (step, step_s) = (before.inverse() * odom_from_base, step_ns as f64 * 1e-9);
                made.linear_m_s = (step.translation.vector / step_s).into();
                made.angular_rad_s = (step.rotation.scaled_axis() / step_s).into();
            }
        }
        Some(made)
    }
}

fn odometry(stamp_ns: i64, odom_from_base: &Isometry3<f64>) -> Odometry {
    Odometry {
        stamp_ns,
        frame_id: FRAME_ODOM.to_owned(),
        child_frame_id: FRAME_BASE.to_owned(),
        position_m: odom_from_base.translation.vector.into(),
        orientation_xyzw: odom_from_base.rotation.coords.into(),
        ..Odometry::default()
    }
}

#[cfg(test)]
mod tests {
    use super::{Odometry, OdometryMaker, TransformStamped};
    use nalgebra::Isometry3;

    #[test]
    fn the_base_beside_the_frame_moves_around_it() {
        // The frame sits 1 m ahead of the base and turns on the spot to the left: the base goes right.
        let maker = OdometryMaker::new(Isometry3::translation(-1.0, 0.0, 0.0));
        let message =
            Odometry { position_m: [5.0, 0.0, 0.0], angular_rad_s: [0.0, 0.0, 0.5], ..Odometry::default() };
        let made = maker.of_message(&message).unwrap();
        assert_eq!((made.position_m, made.linear_m_s), ([4.0, 0.0, 0.0], [0.0, -0.5, 0.0]));
        assert_eq!((made.frame_id.as_str(), made.child_frame_id.as_str()), ("odom", "base_link"));
    }

    #[test]
    fn transforms_tell_speeds_by_their_difference() {
        let mut maker = OdometryMaker::new(Isometry3::identity());
        let at = |stamp_ns, x_m| TransformStamped {
            stamp_ns,
            translation_m: [x_m, 0.0, 0.0],
            ..TransformStamped::default()
        };
        let speeds: Vec<f64> =
            [at(0, 1.0), at(500_000_000, 1.25), at(500_000_000, 2.0), at(9_000_000_000, 3.0)]
                .iter()
                .map(|transform| maker.of_transform(transform).unwrap().linear_m_s[0])
                .collect();
        assert_eq!(speeds, [0.0, 0.5, 0.0, 0.0]);
        let none = TransformStamped { rotation_xyzw: [0.0; 4], ..at(1, 1.0) };
        assert!(maker.of_transform(&none).is_none());
    }
}
