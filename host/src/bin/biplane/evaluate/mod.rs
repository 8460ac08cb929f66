//! `biplane evaluate`: how good a trajectory or a map is, in figures that others publish.

mod map;
mod poses;
mod relations;
mod trajectory;

use clap::Subcommand;

use crate::Outcome;
use crate::console::Console;

/// Which measure.
#[derive(Debug, clap::Args)]
pub struct Args {
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
pub fn run(args: &Args, console: &Console) -> anyhow::Result<Outcome> {
    match &args.measure {
        Measure::Relations(args) => relations::run(args, console),
        Measure::Trajectory(args) => trajectory::run(args, console),
        Measure::Map(args) => map::run(args, console),
    }
}

/// A number that is not negative.
fn not_negative(text: &str) -> Result<f64, String> {
    match text.parse::<f64>() {
        Ok(value) if value >= 0.0 => Ok(value),
        _ => Err("expected a number that is not negative".to_owned()),
    }
}

/// Prints a value as JSON.
pub fn print_json(value: &impl serde::Serialize) -> anyhow::Result<()> {
    let mut out = std::io::stdout().lock();
    serde_json::to_writer_pretty(&mut out, value).map_err(std::io::Error::from)?;
    Ok(std::io::Write::write_all(&mut out, b"\n")?)
}
