//! What the tracker was given, kept so that it can be given to another one: `bench` matches a log again
//! without what is around.
//!
//! Directions and times of beams are kept once a layout, ranges once a scan: 4 bytes a beam.

use biplane_matcher::{Beam, Pose2, Scan};

/// A scan as the tracker saw it.
#[derive(Clone, PartialEq, Debug)]
struct Kept {
    stamp_ns: i64,
    laser_in_base_m: [f64; 2],
    twist_in_base: [f64; 3],
    odom_from_base: Option<Pose2>,
    layout: usize,
    first_range: usize,
}

/// All scans that a tracker was given, in order, with the odometry's pose.
#[derive(Clone, PartialEq, Debug, Default)]
pub struct KeptScans {
    scans: Vec<Kept>,
    layouts: Vec<Vec<Beam>>,
    ranges_m: Vec<f32>,
}

impl KeptScans {
    /// How many.
    #[must_use]
    pub fn len(&self) -> usize {
        self.scans.len()
    }

    /// Whether there is none.
    #[must_use]
    pub fn is_empty(&self) -> bool {
        self.scans.is_empty()
    }

    /// Keeps one more.
    pub fn push(&mut self, scan: &Scan, odom_from_base: Option<Pose2>) {
        let fits = |layout: &Vec<Beam>| {
            layout.len() == scan.beams.len() && layout.iter().zip(scan.beams).all(|(a, b)| same_ray(a, b))
        };
        let layout = self.layouts.iter().rposition(fits).unwrap_or_else(|| {
            self.layouts.push(scan.beams.to_vec());
            self.layouts.len() - 1
        });
        self.scans.push(Kept {
            stamp_ns: scan.stamp_ns,
            laser_in_base_m: scan.laser_in_base_m,
            twist_in_base: scan.twist_in_base,
            odom_from_base,
            layout,
            first_range: self.ranges_m.len(),
        });
        self.ranges_m.extend(scan.beams.iter().map(|beam| beam.range_m));
    }

    /// Their stamps in order, nanoseconds.
    pub fn stamps_ns(&self) -> impl Iterator<Item = i64> + '_ {
        self.scans.iter().map(|kept| kept.stamp_ns)
    }

    /// One of them, for [`Tracker::track`](biplane_matcher::Tracker::track); `beams` is the memory for it.
    pub fn get<'a>(&self, index: usize, beams: &'a mut Vec<Beam>) -> Option<(Scan<'a>, Option<Pose2>)> {
        let kept = self.scans.get(index)?;
        beams.clear();
        beams.extend_from_slice(&self.layouts[kept.layout]);
        for (beam, &range_m) in beams.iter_mut().zip(&self.ranges_m[kept.first_range..]) {
            beam.range_m = range_m;
        }
        let scan = Scan {
            stamp_ns: kept.stamp_ns,
            laser_in_base_m: kept.laser_in_base_m,
            beams,
            twist_in_base: kept.twist_in_base,
        };
        Some((scan, kept.odom_from_base))
    }
}

fn same_ray(a: &Beam, b: &Beam) -> bool {
    a.direction_in_base == b.direction_in_base && a.delay_s == b.delay_s
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_was_kept_comes_back_as_it_was_and_layouts_are_kept_once() {
        let geometry = |count: usize, range_m: f32| -> Vec<Beam> {
            let ray = |i: usize| Beam { direction_in_base: [1.0, i as f32], range_m, delay_s: i as f32 };
            (0..count).map(ray).collect()
        };
        let fans = [geometry(3, 1.0), geometry(2, f32::INFINITY), geometry(3, 2.0)];
        let mut kept = KeptScans::default();
        for (beams, stamp_ns) in fans.iter().zip(10..) {
            let scan = Scan { stamp_ns, laser_in_base_m: [0.1, 0.2], beams, twist_in_base: [1.0, 2.0, 3.0] };
            kept.push(&scan, Some(Pose2::new(stamp_ns as f64, 0.0, 0.0)));
        }
        assert_eq!((kept.len(), kept.layouts.len(), kept.ranges_m.len()), (3, 2, 8));
        let mut memory = Vec::new();
        for (index, beams) in fans.iter().enumerate() {
            let (scan, odom) = kept.get(index, &mut memory).unwrap();
            assert_eq!((scan.beams, scan.stamp_ns), (&beams[..], index as i64 + 10));
            assert_eq!((scan.laser_in_base_m, scan.twist_in_base), ([0.1, 0.2], [1.0, 2.0, 3.0]));
            assert_eq!(odom.map(|pose| pose.x_m), Some(scan.stamp_ns as f64));
        }
        assert!(kept.get(3, &mut memory).is_none());
    }
}
