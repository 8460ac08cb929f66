//! `biplane evaluate`: how good a trajectory or a map is, in figures that others publish.

mod map;
mod order;
mod relations;
mod trajectory;

use clap::Subcommand;

use crate::cli::terminal::console::Console;
use biplane_cli::Outcome;

/// Which measure.
#[derive(Debug, clap::Args)]
pub(crate) struct Args {
    #[command(subcommand)]
    measure: Measure,
}

#[derive(Debug, Subcommand)]
enum Measure {
    /// Mean error over relations between poses that people checked (Kümmerle et al. 2009)
    Relations(relations::Args),
    /// Absolute and relative pose errors against the truth, as evo computes them
    Trajectory(trajectory::Args),
    /// How sharp the map of a recording is, where no truth is known
    Map(map::Args),
}

/// Runs the command.
pub(crate) fn run(args: &Args, console: &Console) -> anyhow::Result<Outcome> {
    match &args.measure {
        Measure::Relations(args) => relations::run(args, console),
        Measure::Trajectory(args) => trajectory::run(args, console),
        Measure::Map(args) => map::run(args, console),
    }
}
