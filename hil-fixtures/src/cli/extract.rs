//! `extract`: a capture out of a recording.

use super::BadArgument;
use crate::capture::extract::{ExtractOptions, extract};
use biplane_cli::counted;
use std::path::PathBuf;

/// Take the serial bytes out of a recording made with --raw: a capture that can be served, replayed and kept
/// as a fixture.
///
/// Example: biplane-mock extract run.mcap -o start-up.mcap --to 3
#[derive(Debug, clap::Args)]
#[command(verbatim_doc_comment)]
pub(super) struct Extract {
    /// Recording or capture.
    #[arg(value_name = "RUN.mcap")]
    input: PathBuf,
    /// Capture to write.
    #[arg(short, long, value_name = "C.mcap")]
    output: PathBuf,
    /// Leave out what came earlier than this after the first serial byte, seconds.
    #[arg(long, value_name = "S", value_parser = super::zero_or_more)]
    from: Option<f64>,
    /// Leave out what came later, seconds.
    #[arg(long, value_name = "S", value_parser = super::zero_or_more)]
    to: Option<f64>,
    /// Replace an existing capture.
    #[arg(long, visible_alias = "overwrite")]
    force: bool,
}

impl Extract {
    /// Extracts and says what came of it.
    pub(super) fn run(&self) -> anyhow::Result<()> {
        if let (Some(from), Some(to)) = (self.from, self.to)
            && from > to
        {
            return Err(
                BadArgument(format!("--from {from} --to {to}: the stretch ends before it begins")).into()
            );
        }
        let options = ExtractOptions {
            input: self.input.clone(),
            output: self.output.clone(),
            from_s: self.from,
            to_s: self.to,
            overwrite: self.force,
        };
        let report = extract(&options)?;
        eprintln!(
            "{}: {}, {}",
            report.path.display(),
            counted(report.messages, "message"),
            counted(report.bytes, "byte")
        );
        Ok(())
    }
}
