//! `biplane import`: other people's recordings.

mod bag;
mod carmen;

use clap::Subcommand;

use crate::cli::terminal::console::Console;
use biplane_cli::Outcome;

/// Which kind.
#[derive(Debug, clap::Args)]
pub(crate) struct Args {
    #[command(subcommand)]
    format: Format,
}

#[derive(Debug, Subcommand)]
enum Format {
    /// A CARMEN log (FLASER, ROBOTLASER1, RAWLASER1 and ODOM lines)
    ///
    /// Stamps are the lines' own, unchanged. `biplane-onboard replay` then makes a posed recording of it.
    Carmen(carmen::Args),
    /// Bags of ROS 1 or ROS 2: scans of one or two lasers, odometry, an inertial unit
    ///
    /// A .bag (also of a recorder that was killed), a ROS 2 folder, a .db3 or .mcap file; several of one
    /// drive are taken one after the other. Lasers, odometry and mounts are found by themselves where only
    /// one choice makes sense; otherwise the choices are listed (exit code 2). `biplane-onboard replay` then
    /// makes a posed recording of it.
    Bag(Box<bag::Args>),
}

/// Runs the command.
pub(crate) fn run(args: &Args, console: &Console) -> anyhow::Result<Outcome> {
    match &args.format {
        Format::Carmen(args) => carmen::run(args, console),
        Format::Bag(args) => bag::run(args, console),
    }
}
