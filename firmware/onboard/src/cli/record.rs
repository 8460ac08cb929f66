//! `record`: the onboard process on a robot.

use std::path::{Path, PathBuf};
use std::time::Duration;

use biplane_matcher::Method;
use biplane_recording::Rig;

use crate::error::OnboardError;
use crate::provenance::iso_8601;
use crate::record::RecordOptions;

/// Sets up lasers and base, streams, matches, and records posed scans until SIGINT, SIGTERM or the duration.
#[derive(Debug, clap::Args)]
pub struct Args {
    /// The robot.
    #[arg(long)]
    rig: PathBuf,
    /// The recording to make; in an existing folder, one that is named after the time (UTC), as 2026-11-21T15-00-00Z.mcap.
    #[arg(long, short)]
    output: PathBuf,
    /// How long, for example 60s, 1.5m, 2h; without it, until a signal comes.
    #[arg(long, value_parser = super::words::duration)]
    duration: Option<Duration>,
    /// Record the serial bytes too, so that the run can be replayed.
    #[arg(long)]
    raw: bool,
    /// How scans are matched; `gradient` is the paper's.
    #[arg(long, default_value_t = Method::default())]
    matcher: Method,
    #[command(flatten)]
    rotation: super::rotation::RotationArgs,
    /// Wait for ports that are not there yet (for a service that starts with the machine).
    #[arg(long)]
    wait: bool,
    /// Real-time priority and locked memory; goes on without where the right is missing.
    #[arg(long)]
    realtime: bool,
    /// Replace the output if it exists.
    #[arg(long)]
    force: bool,
    /// The account as JSON on stdout.
    #[arg(long)]
    json: bool,
}

pub(super) fn run(args: &Args) -> Result<u8, OnboardError> {
    let options = RecordOptions {
        rig: Rig::load(&args.rig)?,
        output: named(&args.output, biplane_clock::utc_ns()),
        duration: args.duration,
        raw: args.raw,
        matcher: args.matcher,
        overwrite: args.force,
        rotation: args.rotation.rotation(),
        wait: args.wait,
        realtime: args.realtime,
    };
    let stop = super::stop_on_signals()?;
    let report = crate::record::record(&options, &stop)?;
    super::summary::print(&report, args.json);
    Ok(report.exit_code())
}

/// The output, named after the time where only its folder is given. Colons are not for every file system.
fn named(output: &Path, utc_ns: i64) -> PathBuf {
    if !output.is_dir() {
        return output.to_owned();
    }
    let time = iso_8601(utc_ns).replace(':', "-");
    output.join(format!("{}Z.mcap", time.split('.').next().unwrap_or_default()))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn in_a_folder_a_recording_is_named_after_the_time() {
        let folder = std::env::temp_dir();
        assert_eq!(named(&folder, 951_782_400_123_456_789), folder.join("2000-02-29T00-00-00Z.mcap"));
        assert_eq!(named(Path::new("run.mcap"), 0), Path::new("run.mcap"));
    }
}
