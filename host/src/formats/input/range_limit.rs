//! Points that lie too far from where their scan was taken from: noise and pointing errors grow with the
//! range, and what lies beyond a window or a street is another building.

use crate::formats::input::cloud_file::CloudFile;
use crate::model::Cloud;

/// Why no range of a point is known.
#[derive(Clone, Copy, Debug, PartialEq, Eq, thiserror::Error)]
pub(crate) enum RangeError {
    /// The file has no scans, or not one says where it was taken from.
    #[error(
        "ranges are not known: the file does not say where points were seen from \
         (PTX, E57 with poses, PCD with a viewpoint, and PLY with scan, beam and origins do)"
    )]
    NoPositions,
    /// A scan does not say so.
    #[error("ranges are not known: scan {scan} does not say where it was taken from, as others do")]
    NoPosition {
        /// Its place among the file's scans.
        scan: usize,
    },
}

impl CloudFile {
    /// Leaves out the points that are farther than that from their scan's position: they stay in their place
    /// as points that are nowhere. Says how many these are.
    pub(crate) fn leave_out_beyond(&mut self, range_m: f64) -> Result<usize, RangeError> {
        if self.scans.is_empty() {
            return self.leave_out_of_organized(range_m);
        }
        if self.scans.iter().all(|scan| scan.position_m.is_none()) {
            return Err(RangeError::NoPositions);
        }
        let mut count = 0;
        let mut rest = self.cloud.points_m.as_mut_slice();
        // From the last scan to the first: each is what stands behind its start.
        for (scan, start) in self.scans.iter().enumerate().rev() {
            let position_m = start.position_m.ok_or(RangeError::NoPosition { scan })?;
            let near_m = std::array::from_fn(|k| position_m[k] - self.shift_m[k]);
            let (before, points_m) = rest.split_at_mut(start.first_point.min(rest.len()));
            count += points_m.iter_mut().map(|point_m| leave_out(point_m, near_m, range_m)).sum::<usize>();
            rest = before;
        }
        Ok(count)
    }

    fn leave_out_of_organized(&mut self, range_m: f64) -> Result<usize, RangeError> {
        let Cloud { points_m, scan, origins_m, .. } = &mut self.cloud;
        if origins_m.is_empty() {
            return Err(RangeError::NoPositions);
        }
        let mut count = 0;
        for (point_m, scan) in points_m.iter_mut().zip(scan) {
            let origin_m = origins_m.get(*scan as usize).ok_or(RangeError::NoPositions)?;
            count += leave_out(point_m, origin_m.map(f64::from), range_m);
        }
        Ok(count)
    }
}

/// Makes a point nowhere if it is that far away. How many that are, one or none: one that is nowhere already
/// does not count.
fn leave_out(point_m: &mut [f32; 3], position_m: [f64; 3], range_m: f64) -> usize {
    let away_m: [f64; 3] = std::array::from_fn(|k| f64::from(point_m[k]) - position_m[k]);
    let square_m2: f64 = away_m.iter().map(|v| v * v).sum();
    let is_beyond = square_m2 > range_m * range_m;
    if is_beyond {
        *point_m = [f32::NAN; 3];
    }
    usize::from(is_beyond)
}

#[cfg(test)]
mod tests {
    use super::RangeError;
    use crate::formats::input::cloud_file::{CloudFile, ScanStart};
    use crate::model::Cloud;

    fn start(first_point: usize, position_m: Option<[f64; 3]>) -> ScanStart {
        ScanStart { first_point, position_m }
    }

    #[test]
    fn each_point_is_measured_from_its_own_scan_far_from_zero_too() {
        let mut file = CloudFile::of_positions(&[
            [500_001.0, 0.0, 0.0],
            [500_006.0, 0.0, 0.0],
            [f64::NAN; 3],
            [500_001.0, 0.0, 0.0],
            [500_006.0, 0.0, 0.0],
        ]);
        file.scans = vec![start(0, Some([500_000.0, 0.0, 0.0])), start(3, Some([500_007.0, 0.0, 0.0]))];
        assert_eq!(file.leave_out_beyond(5.0), Ok(2));
        let is_left: Vec<bool> = file.cloud.points_m.iter().map(|p| p[0].is_finite()).collect();
        assert_eq!(is_left, [true, false, false, false, true]);
    }

    #[test]
    fn organized_clouds_have_the_origins_of_their_scans() {
        let cloud = Cloud {
            points_m: vec![[2.0, 0.0, 0.0], [7.0, 0.0, 0.0], [7.0, 0.0, 0.0]],
            scan: vec![0, 0, 1],
            beam: vec![0, 1, 0],
            origins_m: vec![[0.0; 3], [5.0, 0.0, 0.0]],
            beams_per_scan: 2,
            ..Cloud::default()
        };
        let mut file = CloudFile { cloud, ..CloudFile::default() };
        assert_eq!(file.leave_out_beyond(3.0), Ok(1));
        assert!(file.cloud.points_m[1][0].is_nan() && file.cloud.points_m[2][0] == 7.0);
    }

    #[test]
    fn without_positions_there_is_no_range() {
        let mut file = CloudFile::of_positions(&[[1.0; 3], [2.0; 3]]);
        assert_eq!(file.leave_out_beyond(1.0), Err(RangeError::NoPositions));
        file.scans = vec![start(0, None)];
        assert_eq!(file.leave_out_beyond(1.0), Err(RangeError::NoPositions));
        file.scans = vec![start(0, Some([0.0; 3])), start(1, None)];
        assert_eq!(file.leave_out_beyond(1.0), Err(RangeError::NoPosition { scan: 1 }));
        assert!(file.cloud.points_m.iter().flatten().all(|v| v.is_finite()));
    }
}
