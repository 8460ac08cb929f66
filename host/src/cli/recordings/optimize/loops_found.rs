//! The loops found as a table (CSV): which scans, the second one's pose in the first one's frame (meters,
//! radians), its information (inverse covariance, upper triangle), how widely was searched, how well it fits,
//! and whether it was believed.

use std::io::Write;
use std::path::Path;

use crate::slam::LoopFound;
use crate::slam::keyframes::Keyframes;

/// Writes the table.
///
/// # Errors
/// When the file cannot be written.
pub(super) fn write(path: &Path, all_keyframes: &[Keyframes], loops: &[LoopFound]) -> std::io::Result<()> {
    let mut file = std::io::BufWriter::new(std::fs::File::create(path)?);
    writeln!(
        file,
        "recording1,t1,recording2,t2,x,y,theta,ixx,ixy,ixt,iyy,iyt,itt,searched_m,share,along,along_points,overlap,believed"
    )?;
    let nodes: Vec<(usize, i64)> =
        all_keyframes.iter().enumerate().flat_map(|(number, keyframes)| stamps(number, keyframes)).collect();
    for found in loops {
        let [(one, t1), (other, t2)] = found.nodes.map(|node| nodes[node]);
        let (pose, known, fits) = (&found.pose, &found.information, &found.agreement);
        write!(file, "{},{:.6},{},{:.6},", one + 1, seconds(t1), other + 1, seconds(t2))?;
        write!(file, "{:.4},{:.4},{:.5},", pose.x_m, pose.y_m, pose.theta_rad)?;
        for (row, column) in [(0, 0), (0, 1), (0, 2), (1, 1), (1, 2), (2, 2)] {
            write!(file, "{:.1},", known[(row, column)])?;
        }
        write!(file, "{:.2},{:.3},{:.3},", found.half_m, fits.share, fits.along)?;
        writeln!(file, "{},{:.3},{}", fits.along_points, fits.overlap, u8::from(found.inlier))?;
    }
    file.flush()
}

fn stamps(number: usize, keyframes: &Keyframes) -> impl Iterator<Item = (usize, i64)> {
    let stamp = |scan: usize| keyframes.scans.get(scan).copied().flatten().map_or(0, |pose| pose.stamp_ns);
    keyframes.nodes.iter().map(move |node| (number, stamp(node.scan)))
}

fn seconds(stamp_ns: i64) -> f64 {
    stamp_ns as f64 * 1e-9
}
