//! One turn of a laser as the tracker takes it: beams in the base's frame, each with its own time.
//!
//! Frame: `base_link` projected to the floor, x ahead, y to the left. Units: meters, radians, seconds; the
//! stamp is nanoseconds. The mount of the laser is already applied, so that a laser on its back or turned
//! round needs no special case here.

mod deskew;
pub(crate) mod end_point;
pub(crate) mod end_points;
mod isolated;
pub(crate) mod line_fit;
mod neighbors;

use biplane_geometry::PortableMath;
use biplane_geometry::Pose2;

/// One beam of a scan.
#[derive(Copy, Clone, PartialEq, Debug, Default)]
pub struct Beam {
    /// Unit vector of the beam in the base's frame, projected to the floor (shorter than 1 for an inclined
    /// beam).
    pub direction_in_base: [f32; 2],
    /// Measured range in meters: finite = hit, `+inf` = nothing in range, NaN = invalid.
    pub range_m: f32,
    /// When the beam was taken, seconds after the scan's stamp.
    pub delay_s: f32,
}

/// A scan of the localizing laser, borrowed for one call.
#[derive(Copy, Clone, PartialEq, Debug)]
pub struct Scan<'a> {
    /// Time of the first beam, nanoseconds. May repeat or step back.
    pub stamp_ns: i64,
    /// The laser's origin in the base's frame, meters.
    pub laser_in_base_m: [f64; 2],
    /// The beams, in any order.
    pub beams: &'a [Beam],
    /// The base's velocity during the scan in its own frame: forwards and to the left in m/s, turn in rad/s.
    /// Zeros when it is not known: then the beams are taken as simultaneous.
    pub twist_in_base: [f64; 3],
}

impl Scan<'_> {
    /// Where a beam of the given range ends, meters, in the frame the base had at the scan's stamp: the base
    /// has moved on by its twist when the beam is taken.
    #[must_use]
    pub fn end_in_base_m(&self, beam: &Beam, range_m: f64) -> [f64; 2] {
        let moved = self.moved_at(beam);
        let (sin, cos) = sin_cos(moved.theta_rad);
        let end_m = [
            self.laser_in_base_m[0] + f64::from(beam.direction_in_base[0]) * range_m,
            self.laser_in_base_m[1] + f64::from(beam.direction_in_base[1]) * range_m,
        ];
        [moved.x_m + cos * end_m[0] - sin * end_m[1], moved.y_m + sin * end_m[0] + cos * end_m[1]]
    }

    /// The base's pose when the beam was taken, seen from its pose at the scan's stamp (first order in the
    /// delay).
    #[must_use]
    pub fn moved_at(&self, beam: &Beam) -> Pose2 {
        let delay_s = f64::from(beam.delay_s);
        let [ahead_m_s, left_m_s, turn_rad_s] = self.twist_in_base;
        Pose2::new(ahead_m_s * delay_s, left_m_s * delay_s, turn_rad_s * delay_s)
    }
}

/// Sine and cosine of up to so large angles come from their series.
const SERIES_UP_TO_RAD: f64 = 0.1;

/// Sine and cosine; of the small angles that a base turns during a scan by their series: there is one a beam.
fn sin_cos(angle_rad: f64) -> (f64, f64) {
    if angle_rad.abs() > SERIES_UP_TO_RAD { angle_rad.portable_sin_cos() } else { series(angle_rad) }
}

/// Sine and cosine of a small angle, to 1e-10.
#[inline(always)]
fn series(angle_rad: f64) -> (f64, f64) {
    let squared = angle_rad * angle_rad;
    let sin = angle_rad * (1.0 - squared / 6.0 * (1.0 - squared / 20.0));
    let cos = 1.0 - 0.5 * squared * (1.0 - squared / 12.0 * (1.0 - squared / 30.0));
    (sin, cos)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_late_beam_of_a_driving_base_ends_ahead_by_the_distance_driven() {
        let beam = Beam { direction_in_base: [0.0, 1.0], range_m: 2.0, delay_s: 0.5 };
        let scan =
            Scan { stamp_ns: 0, laser_in_base_m: [0.2, 0.0], beams: &[beam], twist_in_base: [1.0, 0.0, 0.0] };
        assert_eq!(scan.end_in_base_m(&beam, 2.0), [0.7, 2.0]);
    }

    #[test]
    fn a_late_beam_of_a_turning_base_ends_turned() {
        let beam = Beam { direction_in_base: [1.0, 0.0], range_m: 2.0, delay_s: 1.0 };
        let scan = Scan {
            stamp_ns: 0,
            laser_in_base_m: [0.0, 0.0],
            beams: &[beam],
            twist_in_base: [0.0, 0.0, std::f64::consts::FRAC_PI_2],
        };
        let [x, y] = scan.end_in_base_m(&beam, 2.0);
        assert!(x.abs() < 1e-12 && (y - 2.0).abs() < 1e-12);
    }

    #[test]
    fn sine_and_cosine_of_small_angles_are_as_good_as_those_of_large_ones() {
        for i in -200..=200 {
            let angle_rad = f64::from(i) * 0.001;
            let ((sin, cos), (exact_sin, exact_cos)) = (sin_cos(angle_rad), angle_rad.sin_cos());
            assert!((sin - exact_sin).abs() < 1e-10 && (cos - exact_cos).abs() < 1e-10, "{angle_rad}");
        }
    }
}
