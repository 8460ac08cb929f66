//! `biplane recover`: what can be saved of a recording that was cut off.

use std::path::PathBuf;

use crate::Outcome;
use crate::console::Console;

/// Words of the command.
#[derive(Debug, clap::Args)]
pub struct Args {
    /// The recording that was cut off; it is not touched
    broken: PathBuf,
    /// The recording to write
    #[arg(long, short, value_name = "FILE.mcap")]
    output: PathBuf,
}

/// Runs the command.
pub fn run(args: &Args, console: &Console) -> anyhow::Result<Outcome> {
    let report = biplane_recording::recover(&args.broken, &args.output)?;
    console.note(format!("{}: {} messages", args.output.display(), report.messages));
    Ok(Outcome::Done)
}
