//! `check-config`: what a rig.toml stands for.

use std::path::{Path, PathBuf};

use biplane_recording::Rig;
use biplane_recording::rig::Laser;

use crate::cli::rig;
use crate::session::cola::hints;
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
    let rig = rig::load_to_open(path)?;
    crate::io::port_check::warn(&rig);
    say_hints(&rig);
    let text = rig.to_toml();
    if args.json {
        print_json(&text);
    } else {
        crate::cli::print_result(&text);
    }
    Ok(0)
}

/// What of a laser on a network can be said without asking it. While recording, the laser itself says more.
fn say_hints(rig: &Rig) {
    for (name, laser) in [("horizontal", Some(&rig.horizontal)), ("vertical", rig.vertical.as_ref())] {
        let Some(cola) = laser.and_then(Laser::cola) else { continue };
        hints::warnings(cola).iter().for_each(|hint| tracing::warn!("{name}: {hint}"));
        hints::note(cola).iter().for_each(|hint| tracing::info!("{name}: {hint}"));
    }
}

/// The resolved text is TOML of our own making, so that it reads back.
fn print_json(resolved: &str) {
    let value =
        resolved.parse::<toml::Table>().ok().and_then(|table| serde_json::to_string_pretty(&table).ok());
    crate::cli::print_result(&(value.unwrap_or_default() + "\n"));
}
