//! Where the beams of a scan end, many at a time.
//!
//! Frame: the base at the scan's stamp. Units: meters, radians. The same numbers as
//! [`Scan::end_in_base_m`], beam by beam; its divisions are done side by side.

use crate::scan::{Beam, SERIES_UP_TO_RAD, Scan, series};

/// Beams at a time.
pub(super) const MANY: usize = 32;

/// Ends of up to [`MANY`] beams; those of beams without a range are of no meaning.
#[inline(always)]
pub(super) fn ends_in_base_m(scan: &Scan, beams: impl Iterator<Item = Beam>) -> [[f32; MANY]; 2] {
    let zeros = [0.0_f64; MANY];
    let ([mut delay_s, mut range_m], mut direction, mut len) = ([zeros; 2], [zeros; 2], 0);
    for beam in beams.take(MANY) {
        delay_s[len] = f64::from(beam.delay_s);
        range_m[len] = f64::from(beam.range_m);
        direction[0][len] = f64::from(beam.direction_in_base[0]);
        direction[1][len] = f64::from(beam.direction_in_base[1]);
        len += 1;
    }
    let [ahead_m_s, left_m_s, turn_rad_s] = scan.twist_in_base;
    let ([mut sin, mut cos], mut is_large) = ([zeros; 2], 0_u64);
    for i in 0..MANY {
        let angle_rad = turn_rad_s * delay_s[i];
        is_large |= u64::from(angle_rad.abs() > SERIES_UP_TO_RAD);
        (sin[i], cos[i]) = series(angle_rad);
    }
    if is_large != 0 {
        for i in 0..len {
            (sin[i], cos[i]) = super::sin_cos(turn_rad_s * delay_s[i]);
        }
    }
    let [laser_x, laser_y] = scan.laser_in_base_m;
    let mut ends_m = [[0.0_f32; MANY]; 2];
    for i in 0..MANY {
        let end_x = laser_x + direction[0][i] * range_m[i];
        let end_y = laser_y + direction[1][i] * range_m[i];
        ends_m[0][i] = (ahead_m_s * delay_s[i] + cos[i] * end_x - sin[i] * end_y) as f32;
        ends_m[1][i] = (left_m_s * delay_s[i] + sin[i] * end_x + cos[i] * end_y) as f32;
    }
    ends_m
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn many_beams_at_a_time_end_where_each_does() {
        let beam = |i: usize| {
            let (sin, cos) = (i as f32 * 0.1).sin_cos();
            Beam { direction_in_base: [cos, sin], range_m: 1.0 + i as f32 * 0.3, delay_s: i as f32 * 1e-3 }
        };
        let beams: Vec<Beam> = (0..MANY - 3).map(beam).collect();
        for turn_rad_s in [0.0, 0.7, -2.9, 9.0] {
            let scan = Scan {
                stamp_ns: 0,
                laser_in_base_m: [0.2, -0.1],
                beams: &beams,
                twist_in_base: [0.8, -0.1, turn_rad_s],
            };
            let [x, y] = ends_in_base_m(&scan, beams.iter().copied());
            for (i, beam) in beams.iter().enumerate() {
                let end_m = scan.end_in_base_m(beam, f64::from(beam.range_m)).map(|meters| meters as f32);
                assert_eq!([x[i], y[i]], end_m, "{turn_rad_s} {i}");
            }
        }
    }
}
