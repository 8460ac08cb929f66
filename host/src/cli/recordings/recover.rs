//! `biplane recover`: what can be saved of a recording that was cut off.

use std::path::PathBuf;

use crate::formats::output::unfinished::Unfinished;
use crate::formats::output::with_suffix;
use biplane_recording::{RecoverError, RecoverReport, WriteError};

use crate::cli::terminal::console::{Console, say};
use biplane_cli::Outcome;

/// Words of the command.
#[derive(Debug, clap::Args)]
pub(crate) struct Args {
    /// The recording that was cut off; it is not touched
    broken: PathBuf,
    /// The recording to write
    #[arg(long, short, value_name = "FILE.mcap")]
    output: PathBuf,
    /// Replace the output if it exists
    #[arg(long)]
    force: bool,
}

/// Runs the command.
pub(crate) fn run(args: &Args, console: &Console) -> anyhow::Result<Outcome> {
    let spinner = console.spinner(format!("reading {}", args.broken.display()));
    let begun = with_suffix(&args.output, ".recovering");
    let _begun = (!begun.exists()).then(|| Unfinished::new(&begun));
    let report = biplane_recording::recover_over(&args.broken, &args.output, args.force).map_err(
        |error| match error {
            RecoverError::Write(WriteError::Exists { .. }) => {
                anyhow::anyhow!(
                    "{} exists already; it is not overwritten without --force",
                    args.output.display()
                )
            }
            other => other.into(),
        },
    )?;
    drop(spinner);
    Ok(print_result(&report, args, console))
}

fn print_result(report: &RecoverReport, args: &Args, console: &Console) -> Outcome {
    for finding in &report.findings {
        console.note(format!("{}: {finding}", args.broken.display()));
    }
    let kept = format!("{}: {} messages kept", args.output.display(), report.messages);
    if report.lost() {
        // Said even when quiet: it is what the exit code stands for.
        say(&format!(
            "biplane: {kept}; lost: {} messages known of, {} bytes unusable, {} bytes missing",
            report.lost_messages(),
            report.lost_bytes(),
            report.missing_bytes()
        ));
        return Outcome::Lossy;
    }
    console.note(match report.index_missing() {
        true => format!("{kept}, nothing lost: only the index or the footer was missing"),
        false => format!("{kept}, nothing was wrong"),
    });
    Outcome::Done
}
