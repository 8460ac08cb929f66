//! `replay`: the onboard process fed from a file.

use std::path::PathBuf;

use crate::cli::rig;
use crate::cli::signals::{self, Remains};
use crate::replay::{ReplayOptions, Speed};
use crate::types::error::OnboardError;

/// Runs the onboard process on a capture's bytes, or on the scans and odometry of a recording or import.
///
/// Deterministic: the same input gives the same bytes.
#[derive(Debug, clap::Args)]
#[command(after_help = "Examples:\n  biplane-onboard replay bytes.mcap -o office.mcap\n  \
    biplane-onboard replay office.mcap --rig better.toml -o better.mcap")]
pub(crate) struct Args {
    /// A capture (serial bytes), an import, or a recording whose poses are to be found anew. Of a recording
    /// in parts name all of them, in any order, or its name without the number.
    #[arg(required = true, value_name = "INPUT.mcap")]
    inputs: Vec<PathBuf>,
    /// The recording to make.
    #[arg(long, short)]
    output: PathBuf,
    /// The rig; without it, the input's own.
    #[arg(long)]
    rig: Option<PathBuf>,
    /// `max`, or how many times as fast as it was recorded. [default: max; 1 with --live]
    #[arg(long)]
    speed: Option<Speed>,
    #[command(flatten)]
    live: crate::cli::args::live::LiveArgs,
    #[command(flatten)]
    matcher: crate::cli::args::matcher::MatcherArgs,
    /// A table of what each iteration of each match did (CSV), to be written besides.
    #[arg(long, value_name = "JOURNAL.csv")]
    journal: Option<PathBuf>,
    #[command(flatten)]
    rotation: crate::cli::args::rotation::RotationArgs,
    /// Replace outputs that exist.
    #[arg(long)]
    force: bool,
    /// The account as JSON on stdout.
    #[arg(long)]
    json: bool,
}

pub(crate) fn run(args: &Args) -> Result<u8, OnboardError> {
    super::check(&args.output, args.journal.as_deref(), args.rig.as_slice(), args.force)?;
    let rig = args.rig.as_deref().map(rig::load).transpose()?;
    let options = ReplayOptions {
        inputs: args.inputs.clone(),
        output: args.output.clone(),
        rig,
        // Nobody can look at all of it at once.
        speed: args.speed.unwrap_or(if args.live.live.is_some() { Speed::Times(1.0) } else { Speed::Max }),
        live: args.live.live,
        allowed_origins: args.live.allow_origin.clone(),
        matcher: args.matcher.params(),
        journal: args.journal.clone(),
        overwrite: args.force,
        rotation: args.rotation.rotation(),
    };
    let stop = signals::stop(&options.output, Remains::Removed)?;
    let report = crate::replay::replay(&options, &stop)?;
    super::summary::print(&report, args.json);
    Ok(report.exit_code())
}
