//! The command line: words become typed options, one file a subcommand.

mod encode;
mod extract;
mod serve;
mod simulate;
mod worlds;

use clap::{Parser, Subcommand};

/// Mock lasers and base for Biplane: devices on pseudo-terminals, simulated drives, serial captures.
///
/// Exit codes: 0 done; 1 failed; 2 bad arguments; 3 done, with loss.
#[derive(Debug, Parser)]
#[command(version, about, propagate_version = true)]
pub struct Cli {
    #[command(subcommand)]
    command: Command,
}

#[derive(Debug, Subcommand)]
enum Command {
    Serve(Box<serve::Serve>),
    Simulate(simulate::Simulate),
    Encode(encode::Encode),
    Extract(extract::Extract),
}

impl Cli {
    /// Carries the command out.
    pub fn run(&self) -> anyhow::Result<()> {
        match &self.command {
            Command::Serve(serve) => serve.run(),
            Command::Simulate(simulate) => simulate.run(),
            Command::Encode(encode) => encode.run(),
            Command::Extract(extract) => extract.run(),
        }
    }
}

/// An argument that is well formed but cannot be used; the program ends with code 2.
#[derive(Debug, thiserror::Error)]
#[error("{0}")]
pub struct BadArgument(pub String);
