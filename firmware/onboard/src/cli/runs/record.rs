//! `record`: the onboard process on a robot.

use std::path::PathBuf;
use std::time::Duration;

use crate::cli::rig;
use crate::cli::signals::{self, Remains};
use crate::record::acquisition::Controls;
use crate::record::status::notifier::StatusMode;
use crate::record::{RecordOptions, record_with};
use crate::types::error::OnboardError;
use biplane_recording::WriteError;

/// Sets up lasers and base, streams, matches, and records posed scans until SIGINT, SIGTERM or the duration.
///
/// A second signal ends the process at once (exit code 1); `biplane recover` then saves what was recorded.
/// SIGUSR1 begins the next part of a recording in parts. A terminal that goes away does not end the run.
#[derive(Debug, clap::Args)]
#[command(after_help = "Examples:\n  biplane-onboard record --rig rig.toml -o office.mcap\n  \
    biplane-onboard record --rig rig.toml -o recordings/ --duration 30m --live 127.0.0.1:8765")]
pub(crate) struct Args {
    /// The robot.
    #[arg(long)]
    rig: PathBuf,
    /// The recording to make. A folder (or a path that ends in `/`): a new name in it, such as
    /// run-0007-20261121T150403Z.mcap.
    #[arg(long, short)]
    output: PathBuf,
    /// How long, for example 60s, 1.5m, 2h; without it, until a signal comes.
    #[arg(long, value_parser = crate::cli::args::values::duration)]
    duration: Option<Duration>,
    /// Record the serial bytes too, so that the run can be replayed.
    #[arg(long)]
    raw: bool,
    #[command(flatten)]
    matcher: crate::cli::args::matcher::MatcherArgs,
    /// A table of what each iteration of each match did (CSV), to be written besides.
    #[arg(long, value_name = "JOURNAL.csv")]
    journal: Option<PathBuf>,
    #[command(flatten)]
    rotation: crate::cli::args::rotation::RotationArgs,
    /// Wait for ports that are not there yet, and for room on the disk (for a service that starts with the
    /// machine).
    #[arg(long)]
    wait: bool,
    /// Real-time priority and locked memory; goes on without where the right is missing.
    #[arg(long)]
    realtime: bool,
    #[command(flatten)]
    live: crate::cli::args::live::LiveArgs,
    /// Replace outputs that exist.
    #[arg(long)]
    force: bool,
    /// The account as JSON on stdout.
    #[arg(long)]
    json: bool,
    /// The state as one JSON object a line and second on stdout, then the account; instead of the status
    /// line.
    #[arg(long)]
    json_status: bool,
}

pub(crate) fn run(args: &Args, quiet: bool) -> Result<u8, OnboardError> {
    let output = crate::output::run_name::output(&args.output, biplane_clock::utc_ns()).map_err(
        |source| match source.kind() {
            std::io::ErrorKind::NotFound => OnboardError::NoFolder { folder: args.output.clone() },
            _ => OnboardError::Place { path: args.output.clone(), source },
        },
    )?;
    super::check(&output, args.journal.as_deref(), std::slice::from_ref(&args.rig), args.force)?;
    let options = RecordOptions {
        duration: args.duration,
        raw: args.raw,
        matcher: args.matcher.params(),
        journal: args.journal.clone(),
        overwrite: args.force,
        rotation: args.rotation.rotation(),
        wait: args.wait,
        realtime: args.realtime,
        live: args.live.live,
        allowed_origins: args.live.allow_origin.clone(),
        status: match (args.json_status, quiet) {
            (true, _) => StatusMode::Json,
            (false, false) => StatusMode::Line,
            (false, true) => StatusMode::Silent,
        },
        ..RecordOptions::new(rig::load_to_open(&args.rig)?, output)
    };
    let stop = signals::stop(&options.output, Remains::Kept)?;
    let rotate = signals::rotate()?;
    signals::outlive_terminal()?;
    let report = record_with(&options, Controls { stop: &stop, rotate: &rotate }).map_err(kept)?;
    match (args.json_status, args.json) {
        (true, _) => super::summary::print_line(&report),
        (false, json) => super::summary::print(&report, json),
    }
    Ok(report.exit_code())
}

/// A recording stays on a disk that is full; other commands remove what they began.
pub(crate) fn kept(error: OnboardError) -> OnboardError {
    match error {
        OnboardError::Write(WriteError::DiskFull { path }) => OnboardError::DiskFull { path },
        other => other,
    }
}
