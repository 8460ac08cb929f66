//! The command line of `biplane-onboard`: words to typed options, one file a subcommand.
//!
//! Results go to stdout, everything else to stderr. Exit codes: 0 done; 1 failed; 2 bad arguments; 3 done,
//! but something intact was not kept.

pub(crate) mod args;
pub(crate) mod devices;
pub(crate) mod measure;
pub(crate) mod rig;
pub(crate) mod runs;
pub(crate) mod signals;
#[cfg(test)]
mod tests;

use std::ffi::OsString;
use std::io::IsTerminal;

use biplane_cli::{BAD_ARGUMENTS, Completions, FAILED, Man, Outcome, plain_error};
pub(crate) use biplane_cli::{print_result, say};
use biplane_recording::WriteError;
use clap::{CommandFactory, Parser, Subcommand};
use tracing::Level;
use tracing_subscriber::filter::Targets;
use tracing_subscriber::prelude::*;

use crate::types::error::OnboardError;

/// Acquisition on the robot: two laser scanners and a base, matched in real time, recorded to MCAP.
#[derive(Debug, Parser)]
#[command(name = "biplane-onboard", version, after_help = EXIT_CODES)]
struct Cli {
    #[command(subcommand)]
    command: Command,
    /// Say more on stderr: what each session does.
    #[arg(long, short, global = true, help_heading = biplane_cli::EVERYWHERE)]
    verbose: bool,
    /// Say less on stderr: errors only.
    #[arg(long, short, global = true, conflicts_with = "verbose", help_heading = biplane_cli::EVERYWHERE)]
    quiet: bool,
}

const EXIT_CODES: &str = "Exit codes: 0 done; 1 failed; 2 wrong arguments; 3 done, but something intact was not kept.\n\
    Results go to stdout, everything else to stderr.";

#[derive(Debug, Subcommand)]
enum Command {
    Probe(devices::probe::Args),
    Record(runs::record::Args),
    Replay(runs::replay::Args),
    Basin(measure::basin::Args),
    Bench(measure::bench::Args),
    CheckConfig(devices::check_config::Args),
    Parameters(measure::parameters::Args),
    #[command(visible_alias = "recover")]
    Salvage(runs::salvage::Args),
    Ports(devices::ports::Args),
    UdevRule(devices::udev_rule::Args),
    /// Prints the completions of this program for a shell.
    ///
    /// For one user of bash: `biplane-onboard completions bash >
    /// ~/.local/share/bash-completion/completions/biplane-onboard`.
    Completions(Completions),
    /// Writes the manual pages of this program, one for each command, into a folder.
    ///
    /// To read one: `biplane-onboard man pages`, then `man -l pages/biplane-onboard.1`.
    Man(Man),
}

/// Runs the program and returns its exit code.
pub fn run(words: impl IntoIterator<Item = OsString>) -> u8 {
    let cli = match biplane_cli::try_parse::<Cli>(words) {
        Ok(cli) => cli,
        Err(error) => {
            // Help and version are no errors: clap knows where they go.
            let _ = error.print();
            return refusal_code(&error);
        }
    };
    start_log(cli.verbose, cli.quiet);
    biplane_cli::clean_up_by("biplane-onboard", signals::clean_up);
    cli.command.carry_out(cli.quiet).unwrap_or_else(|error| {
        if let OnboardError::StoppedWaiting { .. } | OnboardError::StoppedWaitingForRoom { .. } = error {
            // Asked to stop, and nothing was under way.
            tracing::info!("{error}");
            return 0;
        }
        say(&format!("biplane-onboard: {}", sentence(&error)));
        FAILED
    })
}

impl Command {
    /// Does it, and returns the exit code.
    fn carry_out(&self, quiet: bool) -> Result<u8, OnboardError> {
        match self {
            Self::Probe(args) => devices::probe::run(args),
            Self::Record(args) => runs::record::run(args, quiet),
            Self::Replay(args) => runs::replay::run(args),
            Self::Basin(args) => measure::basin::run(args),
            Self::Bench(args) => measure::bench::run(args),
            Self::CheckConfig(args) => devices::check_config::run(args),
            Self::Parameters(args) => Ok(measure::parameters::run(args)),
            Self::Salvage(args) => runs::salvage::run(args),
            Self::Ports(args) => devices::ports::run(args),
            Self::UdevRule(args) => devices::udev_rule::run(args),
            Self::Completions(args) => {
                print_result(&String::from_utf8_lossy(&args.text(Cli::command())));
                Ok(Outcome::Done.code())
            }
            Self::Man(args) => {
                let failed = |source| OnboardError::System { what: "write the manual pages", source };
                args.write(Cli::command()).map(|()| Outcome::Done.code()).map_err(failed)
            }
        }
    }
}

/// The exit code when words are no command, or ask for help or the version.
fn refusal_code(error: &clap::Error) -> u8 {
    if error.use_stderr() { BAD_ARGUMENTS } else { Outcome::Done.code() }
}

/// The error in words of this program.
fn sentence(error: &OnboardError) -> String {
    match error {
        OnboardError::Write(WriteError::Unfinished { .. }) => format!("{error} (--force replaces it)"),
        _ => plain_error(&error.to_string()),
    }
}

fn start_log(verbose: bool, quiet: bool) {
    let level = match (verbose, quiet) {
        (true, _) => Targets::new().with_target("biplane_onboard", Level::DEBUG),
        (_, true) => Targets::new().with_default(Level::ERROR),
        _ => Targets::new().with_target("biplane_onboard", Level::INFO),
    };
    let asked = std::env::var("BIPLANE_LOG").ok().and_then(|words| words.parse().ok());
    let log = tracing_subscriber::fmt::layer().with_writer(std::io::stderr).with_target(false);
    let log = log.with_ansi(std::io::stderr().is_terminal() && std::env::var_os("NO_COLOR").is_none());
    // A terminal that has gone is no reason to fail.
    let log = log.log_internal_errors(false);
    // Whoever runs this twice in one process (a test) keeps the first log.
    let _ = tracing_subscriber::registry().with(log.with_filter(asked.unwrap_or(level))).try_init();
}
