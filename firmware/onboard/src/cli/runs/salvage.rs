//! `salvage`: recordings that a power cut left unfinished.

use std::io::Write as _;
use std::path::{Path, PathBuf};

use crate::output::salvage::{Leftover, Salvaged};
use crate::types::error::OnboardError;
use biplane_cli::counted;

/// Makes the unfinished recordings (NAME.mcap.active) in a folder whole, as after a power cut.
///
/// Each becomes NAME.mcap with everything that is intact in it. A file that was only cut short is then
/// removed: nothing else was in it. One that is damaged elsewhere is kept as NAME.mcap.damaged. One that is
/// being written is left alone.
#[derive(Debug, clap::Args)]
#[command(after_help = "Example:\n  biplane-onboard salvage recordings")]
pub(crate) struct Args {
    /// The folder with the recordings.
    #[arg(value_name = "DIR")]
    folder: PathBuf,
    /// As JSON on stdout: what became of each.
    #[arg(long)]
    json: bool,
}

pub(crate) fn run(args: &Args) -> Result<u8, OnboardError> {
    let listed = crate::output::salvage::salvage(&args.folder);
    let leftovers = listed.map_err(|source| OnboardError::Place { path: args.folder.clone(), source })?;
    for line in lines(&leftovers, &args.folder) {
        // A log that is full stops no salvage.
        let _ = writeln!(std::io::stderr(), "{line}");
    }
    let code = leftovers.iter().map(|leftover| exit_code(&leftover.outcome)).max().unwrap_or(0);
    if args.json {
        let list: Vec<_> = leftovers.iter().map(json).collect();
        crate::cli::print_result(&format!("{:#}\n", serde_json::Value::from(list)));
    }
    // A failure says more than a loss.
    Ok(if leftovers.iter().any(|leftover| matches!(leftover.outcome, Salvaged::Failed(_))) {
        1
    } else {
        code
    })
}

/// What became of each; a folder without any is said to be one.
fn lines(leftovers: &[Leftover], folder: &Path) -> Vec<String> {
    if leftovers.is_empty() {
        let folder = folder.display();
        return vec![format!("{folder}: no unfinished recording (NAME.mcap.active), nothing to salvage")];
    }
    leftovers.iter().map(line).collect()
}

fn exit_code(outcome: &Salvaged) -> u8 {
    match outcome {
        Salvaged::Whole | Salvaged::Empty | Salvaged::BeingWritten => 0,
        Salvaged::Cut { .. } | Salvaged::Damaged(_) | Salvaged::NotOurs(_) | Salvaged::NameTaken => 3,
        Salvaged::Failed(_) => 1,
    }
}

fn json(leftover: &Leftover) -> serde_json::Value {
    let outcome = match &leftover.outcome {
        Salvaged::Whole => "whole",
        Salvaged::Cut { .. } => "cut",
        Salvaged::Damaged(_) => "damaged",
        Salvaged::Empty => "empty",
        Salvaged::NotOurs(_) => "no recording",
        Salvaged::BeingWritten => "being written",
        Salvaged::NameTaken => "name taken",
        Salvaged::Failed(_) => "failed",
    };
    serde_json::json!({
        "unfinished": leftover.unfinished.display().to_string(),
        "recording": leftover.recording.display().to_string(),
        "messages": leftover.messages,
        "outcome": outcome,
        "said": line(leftover),
    })
}

fn line(leftover: &Leftover) -> String {
    let (from, to) = (leftover.unfinished.display(), leftover.recording.display());
    let kept = counted(leftover.messages, "message");
    match &leftover.outcome {
        Salvaged::Whole => format!(
            "{to}: {kept} of an unfinished recording, all that is in it; what had not reached the disk is lost"
        ),
        Salvaged::Cut { unusable_bytes, missing_bytes } => format!(
            "{to}: {kept} of an unfinished recording, all that was whole; its end was cut short and is lost: {} unusable, {} missing",
            counted(*unusable_bytes, "byte"),
            counted(*missing_bytes, "byte")
        ),
        Salvaged::Damaged(aside) => {
            format!("{to}: {kept} of an unfinished recording; damaged parts stay in {}", aside.display())
        }
        Salvaged::Empty => format!("{from}: was empty, removed"),
        Salvaged::NotOurs(aside) => format!("{from}: is no recording, now {}", aside.display()),
        Salvaged::BeingWritten => format!("{from}: is being written, left alone"),
        Salvaged::NameTaken => format!("{from}: left alone, because {to} is there already"),
        Salvaged::Failed(error) => format!("{from}: {error}"),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_folder_that_needs_nothing_is_answered_with_a_line() {
        let words = ["recordings: no unfinished recording (NAME.mcap.active), nothing to salvage"];
        assert_eq!(lines(&[], Path::new("recordings")), words);
        let (unfinished, recording) = ("a.mcap.active".into(), "a.mcap".into());
        let leftover = Leftover { unfinished, recording, messages: 0, outcome: Salvaged::Empty };
        assert_eq!(lines(&[leftover], Path::new("recordings")), ["a.mcap.active: was empty, removed"]);
    }
}
