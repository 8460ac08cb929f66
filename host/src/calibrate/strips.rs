//! The vertical laser's scans cut into short straight strips: what one scan saw of one surface.
//!
//! A strip stands for its points: their mean, their direction and their mean time, all in the laser's own
//! frame, so that it is cut once and posed again for every guess of the laser's place. Meters, nanoseconds.

use crate::recordings::scan_geometry::RangeScan;
use crate::recordings::scan_geometry::ScanGeometry;
use biplane_geometry::PortableMath;

/// A strip is at most this long, and longer with the range: beams lie farther apart there.
const LENGTH_M: f64 = 0.3;
const LENGTH_PER_RANGE: f64 = 0.04;
/// Neighboring beams whose ranges differ by more are on two surfaces; the share of the range allows for
/// slant.
const JUMP_M: f64 = 0.1;
const JUMP_PER_RANGE: f64 = 0.06;
/// Points of a strip at least.
const FEWEST: usize = 3;
/// A strip whose points lie farther than this from its line, root mean square, is no surface.
const ROUGH_M: f64 = 0.05;
/// Ranges that are looked at.
pub(super) const RANGES_M: (f32, f32) = (0.3, 15.0);

/// What one scan saw of one surface.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Strip {
    /// Mean time of its beams, nanoseconds, as the recording stamps them.
    pub stamp_ns: i64,
    /// Mean of its points.
    pub center_m: [f64; 2],
    /// Its direction, unit length.
    pub along: [f64; 2],
    /// Variance of its points along it, square meters.
    pub spread_m2: f64,
    /// Its points.
    pub points: usize,
}

impl Strip {
    /// How far from the laser it is.
    pub(super) fn range_m(&self) -> f64 {
        self.center_m[0].portable_hypot(self.center_m[1])
    }
}

/// Appends the strips of a scan.
pub(super) fn cut(geometry: &ScanGeometry, range_scan: &RangeScan, strips: &mut Vec<Strip>) {
    let mut open: Vec<([f64; 2], f64, i64)> = Vec::new();
    for (beam, &range_m) in geometry.beams.iter().zip(&range_scan.ranges_m) {
        if !(range_m >= RANGES_M.0 && range_m <= RANGES_M.1) {
            close(range_scan.stamp_ns, &mut open, strips);
            continue;
        }
        let range = f64::from(range_m);
        let (sin, cos) = beam.angle_rad.portable_sin_cos();
        let point = [range * cos, range * sin];
        if let (Some(first), Some(last)) = (open.first(), open.last()) {
            let long = (point[0] - first.0[0]).portable_hypot(point[1] - first.0[1]);
            if long > LENGTH_M + LENGTH_PER_RANGE * range
                || (range - last.1).abs() > JUMP_M + JUMP_PER_RANGE * range
            {
                close(range_scan.stamp_ns, &mut open, strips);
            }
        }
        open.push((point, range, beam.delay_ns));
    }
    close(range_scan.stamp_ns, &mut open, strips);
}

fn close(stamp_ns: i64, open: &mut Vec<([f64; 2], f64, i64)>, strips: &mut Vec<Strip>) {
    let points = open.len();
    if points >= FEWEST {
        let count = points as f64;
        let mean = |axis: usize| open.iter().map(|(point, ..)| point[axis]).sum::<f64>() / count;
        let center_m = [mean(0), mean(1)];
        let scatter = scatter(open.iter().map(|(point, ..)| *point), center_m);
        let (along, [rough_m2, spread_m2]) = principal(scatter.map(|sum| sum / count));
        let delay_ns = open.iter().map(|(.., delay_ns)| *delay_ns).sum::<i64>() / points as i64;
        if rough_m2 <= ROUGH_M * ROUGH_M {
            strips.push(Strip {
                stamp_ns: stamp_ns.saturating_add(delay_ns),
                center_m,
                along,
                spread_m2,
                points,
            });
        }
    }
    open.clear();
}

/// Sums of squares about a center: xx, xy, yy.
pub(super) fn scatter(points: impl Iterator<Item = [f64; 2]>, center: [f64; 2]) -> [f64; 3] {
    points.fold([0.0; 3], |[xx, xy, yy], point| {
        let (x, y) = (point[0] - center[0], point[1] - center[1]);
        [xx + x * x, xy + x * y, yy + y * y]
    })
}

/// The long axis of a 2x2 covariance, and its variances across and along it.
pub(super) fn principal([xx, xy, yy]: [f64; 3]) -> ([f64; 2], [f64; 2]) {
    let middle = 0.5 * (xx + yy);
    let half = (0.25 * (xx - yy) * (xx - yy) + xy * xy).sqrt();
    let (sin, cos) = (0.5 * (2.0 * xy).portable_atan2(xx - yy)).portable_sin_cos();
    ([cos, sin], [(middle - half).max(0.0), middle + half])
}
