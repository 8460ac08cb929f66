//! `biplane recover`: what can be saved of a recording that was cut off.

use std::path::PathBuf;

use crate::formats::output::unfinished::Unfinished;
use biplane_recording::mcap::write::with_suffix;
use biplane_recording::{RecoverError, RecoverReport, WriteError};
use serde::Serialize;

use crate::cli::terminal::console::{Console, say};
use crate::cli::terminal::json::print_json;
use biplane_cli::{Outcome, counted};

/// Words of the command.
#[derive(Debug, clap::Args)]
#[command(after_help = "Example:\n  biplane recover run.mcap.active -o run.mcap")]
pub(crate) struct Args {
    /// The recording that was cut off; it is not touched
    broken: PathBuf,
    /// The recording to write
    #[arg(long, short, value_name = "FILE.mcap")]
    output: PathBuf,
    /// Replace the output if it exists
    #[arg(long)]
    force: bool,
    /// Print JSON
    #[arg(long)]
    json: bool,
}

/// What was kept and what was not.
#[derive(Debug, Serialize)]
struct Recovered {
    /// The recording that was written.
    output: String,
    /// Whether data was lost, or may have been; the exit code is 3 then.
    lost: bool,
    messages: u64,
    attachments: u64,
    metadata: u64,
    /// Messages known to be lost.
    lost_messages: u64,
    /// Bytes of the input that could not be used.
    lost_bytes: u64,
    /// Bytes that the input announces and does not have.
    missing_bytes: u64,
    /// Whether the index or the footer was missing or broken.
    index_missing: bool,
    /// What was found wrong, in the order of the file.
    findings: Vec<String>,
}

impl Recovered {
    fn new(report: &RecoverReport, args: &Args) -> Self {
        Self {
            output: args.output.display().to_string(),
            lost: report.lost(),
            messages: report.messages,
            attachments: report.attachments,
            metadata: report.metadata,
            lost_messages: report.lost_messages(),
            lost_bytes: report.lost_bytes(),
            missing_bytes: report.missing_bytes(),
            index_missing: report.index_missing(),
            findings: report.findings.iter().map(ToString::to_string).collect(),
        }
    }
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
    if args.json {
        print_json(&Recovered::new(&report, args))?;
    }
    Ok(print_result(&report, args, console))
}

fn print_result(report: &RecoverReport, args: &Args, console: &Console) -> Outcome {
    for finding in &report.findings {
        console.note(format!("{}: {finding}", args.broken.display()));
    }
    let kept = format!("{}: {} kept", args.output.display(), counted(report.messages, "message"));
    if report.lost() {
        // Said even when quiet: it is what the exit code stands for.
        say(&format!(
            "biplane: {kept}; lost: {} known of, {} unusable, {} missing",
            counted(report.lost_messages(), "message"),
            counted(report.lost_bytes(), "byte"),
            counted(report.missing_bytes(), "byte")
        ));
        return Outcome::Lossy;
    }
    console.note(match report.index_missing() {
        true => format!("{kept}, nothing lost: only the index or the footer was missing"),
        false => format!("{kept}, nothing was wrong"),
    });
    Outcome::Done
}
