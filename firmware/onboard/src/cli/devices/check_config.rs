//! `check-config`: what a rig.toml stands for.

use std::path::{Path, PathBuf};

use crate::cli::rig;
use crate::types::error::OnboardError;

/// Reads a rig.toml, names all its faults with their lines, or prints it with all defaults filled in.
#[derive(Debug, clap::Args)]
#[command(after_help = "Example:\n  biplane-onboard check-config rig.toml")]
pub(crate) struct Args {
    /// The robot.
    #[arg(value_name = "RIG", required_unless_present = "rig")]
    file: Option<PathBuf>,
    /// The robot, as other commands take it.
    #[arg(long, conflicts_with = "file")]
    rig: Option<PathBuf>,
    /// As JSON instead of TOML.
    #[arg(long)]
    json: bool,
}

pub(crate) fn run(args: &Args) -> Result<u8, OnboardError> {
    // One of both is there: the command line asks for it.
    let path = args.file.as_deref().or(args.rig.as_deref()).unwrap_or(Path::new("rig.toml"));
    let rig = rig::load(path)?;
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
