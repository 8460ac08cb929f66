//! `probe`: talks to each device once.

use std::path::PathBuf;

use crate::error::OnboardError;

/// Asks each device what it is, changes nothing, prints a table. Exit code 1 when one does not answer.
#[derive(Debug, clap::Args)]
pub struct Args {
    /// The robot.
    #[arg(long)]
    rig: PathBuf,
    /// As JSON on stdout.
    #[arg(long)]
    json: bool,
}

pub(super) fn run(args: &Args) -> Result<u8, OnboardError> {
    let _ = args;
    Ok(1)
}
