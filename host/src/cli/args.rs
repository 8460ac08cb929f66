//! The command line as types. Each command's own words stand in its file.

use std::fmt::Display;
use std::path::PathBuf;

use biplane_cli::EVERYWHERE;
use clap::error::ErrorKind;
use clap::{Parser, Subcommand};

use crate::cli::build;
use crate::cli::config::parameters;
#[cfg(feature = "demo")]
use crate::cli::demo;
use crate::cli::measure::{compare, evaluate};
use crate::cli::models::{compact, export, planes};
use crate::cli::recordings::{calibrate, import, info, map, optimize, recover, traj};
use crate::cli::tiles;
use crate::cli::view::{plot, render};

/// Compact 3D building models from recordings of a robot with two laser scanners.
#[derive(Debug, Parser)]
#[command(name = "biplane", version, after_help = EXIT_CODES)]
pub(super) struct Cli {
    /// Say nothing but results and errors
    #[arg(long, short, global = true, help_heading = EVERYWHERE)]
    pub quiet: bool,
    /// Say more on stderr: processor time and memory of each stage, parameters, files with their sizes
    #[arg(long, short, global = true, conflicts_with = "quiet", help_heading = EVERYWHERE)]
    pub verbose: bool,
    /// Take flags from this TOML file too, a section a command: `biplane parameters` prints one. The command
    /// line wins
    #[arg(long, global = true, value_name = "FILE", help_heading = EVERYWHERE)]
    pub config: Option<PathBuf>,
    /// What to do.
    #[command(subcommand)]
    pub command: Command,
}

const EXIT_CODES: &str = "Exit codes: 0 done; 1 failed; 2 wrong arguments; 3 done, but data of the input was lost.\n\
    Lengths are meters, angles degrees; results go to stdout, everything else to stderr.";

/// The commands.
#[derive(Debug, Subcommand)]
pub(super) enum Command {
    /// The whole job with no hardware: mock devices, recording, model, pictures
    #[cfg(feature = "demo")]
    Demo(demo::Args),
    /// Say what a recording or capture holds
    Info(info::Args),
    /// Turn other people's recordings into ours
    Import(import::Args),
    /// Close loops and optimize the poses of recordings; put several into one frame
    Optimize(optimize::Args),
    /// Write the trajectory of a recording as text
    Traj(traj::Args),
    /// Draw the floor map of a recording
    Map(map::Args),
    /// Build the compact 3D model of a recording, and everything around it
    Build(build::Args),
    /// Build a large model in pieces: plan tiles, search each, merge them; a script for Slurm
    Tiles(tiles::Args),
    /// Find the planes of any point cloud
    Planes(planes::Args),
    /// Build the compact model of any triangle mesh
    Compact(compact::Args),
    /// Write further formats of a model that is built already
    Export(export::Args),
    /// Measure the raw mesh and the model of a build: sizes and distances
    Compare(compare::Args),
    /// Measure a trajectory against relations or the truth, or a map by itself
    Evaluate(evaluate::Args),
    /// Draw a figure: trajectories, basin of convergence, error along a run, iterations
    Plot(plot::Args),
    /// Draw a picture of a build: the raw mesh beside the model
    Render(render::Args),
    /// Salvage a recording that was cut off
    #[command(visible_alias = "salvage")]
    Recover(recover::Args),
    /// Refine the vertical laser's mount and delay and the odometry's scale from a recording
    Calibrate(calibrate::Args),
    /// Print the flags of commands with their defaults, as a file for --config
    Parameters(parameters::Args),
    /// Print the completions of this program for a shell
    ///
    /// For one user of bash: `biplane completions bash > ~/.local/share/bash-completion/completions/biplane`.
    Completions(biplane_cli::Completions),
    /// Write the manual pages of this program, one for each command, into a folder
    ///
    /// To read one: `biplane man pages`, then `man -l pages/biplane.1`.
    Man(biplane_cli::Man),
}

/// Ends the process as clap does where words of a command do not go with each other or with what they name.
pub(super) fn refuse(command: &str, kind: ErrorKind, why: impl Display) -> ! {
    biplane_cli::refusal::<Cli>(command, kind, why).exit()
}
