//! Coordinates far from zero: national grids and UTM put a building thousands of kilometers from the origin,
//! where 32-bit coordinates step by half a meter. Such clouds are moved close to zero while they are worked
//! on, and back when they are written. Meters.

/// How the coordinates of a file are moved closer to zero.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub enum Shift {
    /// Not at all.
    #[default]
    None,
    /// By what `find` says.
    Find,
    /// By this: it is taken off every coordinate.
    Given([f64; 3]),
}

impl Shift {
    /// What to take off these coordinates.
    pub fn of(self, points_m: &[[f64; 3]]) -> [f64; 3] {
        match self {
            Self::None => [0.0; 3],
            Self::Find => find(points_m),
            Self::Given(shift_m) => shift_m,
        }
    }
}

use biplane_geometry::quantile::upper_median;

/// Clouds nearer to zero than this stay where they are: 32-bit coordinates still step by a tenth of a
/// millimeter there.
const NEAR_M: f64 = 1000.0;
/// Shifts are multiples of this, so that they are easy to see and to write.
const MULTIPLE_M: f64 = 100.0;
/// Points that are looked at: stray ones must not decide, and a sample tells the middle as well as all.
const SAMPLE: usize = 4096;

/// What to take off the coordinates of points so that most lie near zero, axis by axis; 0 where they do
/// already.
pub(crate) fn find(points_m: &[[f64; 3]]) -> [f64; 3] {
    let step = points_m.len().div_ceil(SAMPLE).max(1);
    std::array::from_fn(|axis| {
        let sample = points_m.iter().step_by(step).map(|p| p[axis]);
        let mut values: Vec<f64> = sample.filter(|v| v.is_finite()).collect();
        values.sort_unstable_by(f64::total_cmp);
        match upper_median(&values) {
            Some(middle) if middle.abs() > NEAR_M => (middle / MULTIPLE_M).round() * MULTIPLE_M,
            _ => 0.0,
        }
    })
}

/// Points without the shift.
pub(crate) fn moved(points_m: &[[f64; 3]], shift_m: [f64; 3]) -> Vec<[f32; 3]> {
    let one = |p: &[f64; 3]| std::array::from_fn(|k| (p[k] - shift_m[k]) as f32);
    points_m.iter().map(one).collect()
}

/// A point with the shift again.
pub(crate) fn restored(point_m: [f64; 3], shift_m: [f64; 3]) -> [f64; 3] {
    std::array::from_fn(|k| point_m[k] + shift_m[k])
}

#[cfg(test)]
mod tests {
    use super::{find, moved, restored};

    #[test]
    fn a_building_on_a_grid_moves_and_stray_points_do_not_decide() {
        let mut points: Vec<[f64; 3]> =
            (0..99).map(|k| [3_456_789.0 + 0.01 * f64::from(k), 5_400_000.0, 180.0]).collect();
        points.push([1e30, f64::NAN, f64::NEG_INFINITY]);
        let shift = find(&points);
        assert_eq!(shift, [3_456_800.0, 5_400_000.0, 0.0]);
        let near = moved(&points, shift)[50].map(f64::from);
        assert!((restored(near, shift)[0] - points[50][0]).abs() < 1e-5);
        assert_eq!(find(&[[900.0, -900.0, 0.0]]), [0.0; 3]);
        assert_eq!(find(&[]), [0.0; 3]);
        assert_eq!(find(&[[f64::NAN; 3]]), [0.0; 3]);
    }
}
