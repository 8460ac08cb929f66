//! `check-config`: what a rig.toml stands for.

use std::path::PathBuf;

use crate::cli::rig;
use crate::types::error::OnboardError;

/// Reads a rig.toml, checks it, and prints it with all defaults filled in.
#[derive(Debug, clap::Args)]
pub(crate) struct Args {
    /// The robot.
    #[arg(long)]
    rig: PathBuf,
    /// As JSON instead of TOML.
    #[arg(long)]
    json: bool,
}

pub(crate) fn run(args: &Args) -> Result<u8, OnboardError> {
    let rig = rig::load(&args.rig)?;
    crate::io::port_check::check(&rig)?;
    crate::io::port_check::warn(&rig);
    let text = rig.to_toml();
    if args.json {
        print_json(&text);
    } else {
        crate::cli::print_result(&text);
    }
    Ok(0)
}

/// The resolved text is TOML of our own making, so that it reads back.
fn print_json(resolved: &str) {
    let value =
        resolved.parse::<toml::Table>().ok().and_then(|table| serde_json::to_string_pretty(&table).ok());
    crate::cli::print_result(&(value.unwrap_or_default() + "\n"));
}
