//! The samples of a recording's inertial unit, in the axes of the base.

use crate::recordings::run::{Run, RunError};
use biplane_recording::messages::{AnyMessage, Imu};
use biplane_recording::rig::Mount;
use biplane_recording::{Topic, topics::FRAME_BASE};

/// One sample, in the axes of `base_link`.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct InertialSample {
    pub stamp_ns: i64,
    pub turn_rad_s: [f64; 3],
    /// Acceleration with gravity, m/s^2: at rest it points up.
    pub force_m_s2: [f64; 3],
}

/// Reads all samples in the order of their stamps; none where nobody knows how the unit sits.
///
/// # Errors
/// When the recording is damaged.
pub(crate) fn inertial_samples(run: &Run) -> Result<Vec<InertialSample>, RunError> {
    let mount = run.rig()?.imu.map(|unit| unit.mount);
    let mut samples = Vec::new();
    for entry in run.recording().messages() {
        let entry = entry?;
        if entry.topic == Some(Topic::Imu)
            && let AnyMessage::Imu(imu) = entry.decode()?
        {
            samples.extend(in_base(&imu, mount));
        }
    }
    samples.sort_by_key(|sample| sample.stamp_ns);
    Ok(samples)
}

/// A sample in the axes of the base; `None` where it holds not both, no numbers, or in axes that are not
/// known.
fn in_base(imu: &Imu, mount: Option<Mount>) -> Option<InertialSample> {
    let mount = if imu.frame_id == FRAME_BASE { Mount::default() } else { mount? };
    let is_there = imu.angular_covariance[0] >= 0.0 && imu.acceleration_covariance[0] >= 0.0;
    let turned = |v: [f64; 3]| mount.matrix().map(|[a, b, c]| a * v[0] + b * v[1] + c * v[2]);
    let (turn_rad_s, force_m_s2) = (turned(imu.angular_rad_s), turned(imu.acceleration_m_s2));
    let is_finite = turn_rad_s.iter().chain(&force_m_s2).all(|value| value.is_finite());
    (is_there && is_finite).then_some(InertialSample { stamp_ns: imu.stamp_ns, turn_rad_s, force_m_s2 })
}

#[cfg(test)]
mod tests {
    use super::in_base;
    use biplane_recording::messages::Imu;
    use biplane_recording::rig::Mount;

    #[test]
    fn a_unit_that_looks_to_the_left_tells_turns_of_the_base() {
        let imu = Imu { frame_id: "imu".to_owned(), angular_rad_s: [1.0, 2.0, 3.0], ..Imu::default() };
        let mount = Mount { yaw: 90.0, ..Mount::default() };
        let turn_rad_s = in_base(&imu, Some(mount)).map(|sample| sample.turn_rad_s);
        assert!(
            turn_rad_s.is_some_and(|v| v.iter().zip([-2.0, 1.0, 3.0]).all(|(a, b)| (a - b).abs() < 1e-12))
        );
        assert_eq!(in_base(&imu, None), None, "nobody knows how it sits");
        let in_the_base = Imu { frame_id: "base_link".to_owned(), ..imu.clone() };
        assert_eq!(in_base(&in_the_base, None).map(|sample| sample.turn_rad_s), Some([1.0, 2.0, 3.0]));
        let orientation_only = Imu { angular_covariance: [-1.0; 9], ..imu };
        assert_eq!(in_base(&orientation_only, Some(mount)), None);
    }
}
