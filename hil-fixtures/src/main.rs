//! `biplane-mock`: mock lasers and base on pseudo-terminals, simulated drives, captures.
//!
//! Exit codes: 0 done, 1 failed, 2 bad arguments, 3 done with loss.

mod cli;

use clap::Parser;
use std::process::ExitCode;

fn main() -> ExitCode {
    let arguments = cli::Cli::parse();
    match arguments.run() {
        Ok(()) => ExitCode::SUCCESS,
        Err(error) => {
            // Messages name their causes themselves: the chain would say them twice.
            eprintln!("biplane-mock: {error}");
            ExitCode::from(if error.is::<cli::BadArgument>() { 2 } else { 1 })
        }
    }
}
