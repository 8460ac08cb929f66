//! `record`: the onboard process on a robot.

use std::path::PathBuf;
use std::time::Duration;

use biplane_matcher::Method;
use biplane_recording::Rig;

use crate::error::OnboardError;
use crate::record::RecordOptions;

/// Sets up lasers and base, streams, matches, and records posed scans until SIGINT, SIGTERM or the duration.
#[derive(Debug, clap::Args)]
pub struct Args {
    /// The robot.
    #[arg(long)]
    rig: PathBuf,
    /// The recording to make.
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
        output: args.output.clone(),
        duration: args.duration,
        raw: args.raw,
        matcher: args.matcher,
        overwrite: args.force,
    };
    let stop = super::stop_on_signals()?;
    let report = crate::record::record(&options, &stop)?;
    super::summary::print(&report, args.json);
    Ok(report.exit_code())
}
