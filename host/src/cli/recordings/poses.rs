//! Where a trajectory to be judged comes from: a recording, or a text file of either form.

use std::fs::File;
use std::io::{self, BufReader, Read};
use std::path::Path;

use crate::formats::text::trajectory::read_poses;
use crate::recordings::deskew::StampedPose;
use crate::recordings::run::Run;
use anyhow::Context;

use crate::cli::terminal::console::Console;

/// How every MCAP file begins.
const MCAP: [u8; 5] = *b"\x89MCAP";

/// Reads the poses of a recording (one a horizontal scan), or of a text of lines `t x y theta` or `t x y z qx
/// qy qz qw`.
pub(crate) fn read(path: &Path, console: &Console) -> anyhow::Result<Vec<StampedPose>> {
    // A name that is no file may be that of a recording in parts.
    if path.exists() && !is_recording(path).with_context(|| format!("cannot read {}", path.display()))? {
        let file = File::open(path).with_context(|| format!("cannot read {}", path.display()))?;
        return read_poses(BufReader::new(file)).with_context(|| format!("cannot read {}", path.display()));
    }
    let run = Run::open(&[path.to_owned()])?;
    console.report_missing(run.recording());
    Ok(run.poses()?.at_scans().into_iter().flatten().collect())
}

/// Whether a file begins as a recording does.
pub(crate) fn is_recording(path: &Path) -> io::Result<bool> {
    let mut start = Vec::new();
    File::open(path)?.take(MCAP.len() as u64).read_to_end(&mut start)?;
    Ok(start == MCAP)
}
