//! Angles: radians unless a name says degrees, counter-clockwise.

use crate::elementary::PortableMath;
use std::f64::consts::{PI, TAU};

/// The same angle in (-pi, pi]. Not finite in, not finite out.
#[must_use]
pub fn wrap_angle(angle_rad: f64) -> f64 {
    if angle_rad > -PI && angle_rad <= PI {
        return angle_rad;
    }
    let wrapped = angle_rad.rem_euclid(TAU);
    if wrapped > PI { wrapped - TAU } else { wrapped }
}

/// Sine and cosine of an angle in degrees, exact at multiples of 90.
#[must_use]
pub fn sin_cos_deg(angle_deg: f64) -> (f64, f64) {
    let quarter = (angle_deg / 90.0).round();
    let (sin, cos) = (angle_deg - quarter * 90.0).to_radians().portable_sin_cos();
    match quarter.rem_euclid(4.0) as u8 {
        0 => (sin, cos),
        1 => (cos, -sin),
        2 => (-sin, -cos),
        _ => (-cos, sin),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn wrapped_angles_lie_above_minus_pi_and_up_to_pi() {
        for (angle, wrapped) in
            [(0.0, 0.0), (PI, PI), (-PI, PI), (3.0 * PI, PI), (7.0, 7.0 - TAU), (-7.0, TAU - 7.0)]
        {
            assert!((wrap_angle(angle) - wrapped).abs() < 1e-12, "{angle}");
        }
        assert!(wrap_angle(f64::NAN).is_nan());
    }

    #[test]
    fn a_wrapped_angle_points_where_the_angle_points() {
        for step in -2000..=2000 {
            let angle_rad = f64::from(step) * 0.0173;
            let wrapped_rad = wrap_angle(angle_rad);
            assert!(wrapped_rad > -PI && wrapped_rad <= PI, "{angle_rad}");
            let ((sin, cos), (wrapped_sin, wrapped_cos)) = (angle_rad.sin_cos(), wrapped_rad.sin_cos());
            assert!((sin - wrapped_sin).abs() < 1e-13 && (cos - wrapped_cos).abs() < 1e-13, "{angle_rad}");
        }
    }

    #[test]
    fn sine_and_cosine_of_degrees_are_exact_at_quarter_turns_and_near_elsewhere() {
        for (angle_deg, expected) in [
            (0.0, (0.0, 1.0)),
            (90.0, (1.0, 0.0)),
            (-90.0, (-1.0, 0.0)),
            (180.0, (0.0, -1.0)),
            (450.0, (1.0, 0.0)),
        ] {
            assert_eq!(sin_cos_deg(angle_deg), expected, "{angle_deg}");
        }
        for step in -720..=720 {
            let angle_deg = f64::from(step) * 0.73;
            let ((sin, cos), (s, c)) = (sin_cos_deg(angle_deg), angle_deg.to_radians().sin_cos());
            assert!((sin - s).abs() < 1e-14 && (cos - c).abs() < 1e-14, "{angle_deg}");
        }
    }
}
