//! `biplane tiles`: a build in pieces, for many machines or little memory (`docs/cluster.md`).

mod folder;
mod merge;
mod plan;
mod run;
mod script;

use clap::Subcommand;

use crate::cli::terminal::console::Console;
use biplane_cli::Outcome;

/// Which part of the work.
#[derive(Debug, clap::Args)]
pub(super) struct Args {
    #[command(subcommand)]
    part: Part,
}

#[derive(Debug, Subcommand)]
enum Part {
    /// Pose a drive and divide it into tiles
    ///
    /// The tiles are those in which `biplane build` searches a large drive, or several of them, so that the
    /// model is the same, byte for byte.
    Plan(Box<plan::Args>),
    /// Search the planes of one tile
    ///
    /// It reads nothing but the folder of tiles, and skips a tile that is finished. Tiles may be run in any
    /// order, at the same time, on any machine that sees the folder, and again after a run was killed.
    Run(run::Args),
    /// Build the model when all tiles are finished
    ///
    /// It reads the recordings once more. Missing tiles are refused, and named as Slurm's `--array` takes
    /// them.
    Merge(Box<merge::Args>),
    /// Print a batch script for Slurm: all tiles, then the model
    Script(script::Args),
}

impl Args {
    /// Why these words make no sense together, where they do not.
    pub(super) fn conflict(&self) -> Option<String> {
        match &self.part {
            Part::Run(args) => args.conflict(),
            _ => None,
        }
    }
}

/// Runs the command.
pub(super) fn run(args: &Args, console: &Console) -> anyhow::Result<Outcome> {
    match &args.part {
        Part::Plan(args) => plan::run(args, console),
        Part::Run(args) => run::run(args, console),
        Part::Merge(args) => merge::run(args, console),
        Part::Script(args) => script::run(args),
    }
}
