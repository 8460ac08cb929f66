//! The command line of `biplane-onboard`: words to typed options, one file a subcommand.
//!
//! Results go to stdout, everything else to stderr. Exit codes: 0 done; 1 failed; 2 bad arguments; 3 done, but something
//! intact was not kept.

mod basin;
mod bench;
mod check_config;
mod matcher;
mod papers;
mod parameters;
mod ports;
mod probe;
mod record;
mod replay;
mod rotation;
mod salvage;
mod signals;
mod summary;
mod udev_rule;
mod words;

use std::ffi::OsString;
use std::io::{IsTerminal, Write};

use biplane_recording::WriteError;
use clap::{Parser, Subcommand};
use tracing_subscriber::EnvFilter;

use crate::error::OnboardError;

/// Acquisition on the robot: two SICK LMS 2xx lasers and a base, matched in real time, recorded to MCAP.
#[derive(Debug, Parser)]
#[command(name = "biplane-onboard", version, after_help = EXIT_CODES)]
struct Cli {
    #[command(subcommand)]
    command: Command,
    /// Say more on stderr: what each session does.
    #[arg(long, short, global = true)]
    verbose: bool,
    /// Say less on stderr: errors only.
    #[arg(long, short, global = true, conflicts_with = "verbose")]
    quiet: bool,
}

const EXIT_CODES: &str = "Exit codes: 0 done; 1 failed; 2 wrong arguments; 3 done, but something intact was not kept.\n\
    Results go to stdout, everything else to stderr.";

#[derive(Debug, Subcommand)]
enum Command {
    Probe(probe::Args),
    Record(record::Args),
    Replay(replay::Args),
    Basin(basin::Args),
    Bench(bench::Args),
    CheckConfig(check_config::Args),
    Parameters(parameters::Args),
    Salvage(salvage::Args),
    Ports(ports::Args),
    UdevRule(udev_rule::Args),
    Completions(papers::Completions),
    Man(papers::Man),
}

/// Runs the program and returns its exit code.
pub fn run(words: impl IntoIterator<Item = OsString>) -> u8 {
    let cli = match Cli::try_parse_from(words) {
        Ok(cli) => cli,
        Err(error) => {
            // Help and version are no errors: clap knows where they go.
            let _ = error.print();
            return if error.use_stderr() { 2 } else { 0 };
        }
    };
    start_log(cli.verbose, cli.quiet);
    let result = match &cli.command {
        Command::Probe(args) => probe::run(args),
        Command::Record(args) => record::run(args, cli.quiet),
        Command::Replay(args) => replay::run(args),
        Command::Basin(args) => basin::run(args),
        Command::Bench(args) => bench::run(args),
        Command::CheckConfig(args) => check_config::run(args),
        Command::Parameters(args) => Ok(parameters::run(args)),
        Command::Salvage(args) => salvage::run(args),
        Command::Ports(args) => ports::run(args),
        Command::UdevRule(args) => udev_rule::run(args),
        Command::Completions(args) => Ok(papers::completions(args)),
        Command::Man(args) => papers::man(args),
    };
    result.unwrap_or_else(|error| {
        if let OnboardError::StoppedWaiting { .. } | OnboardError::StoppedWaitingForRoom { .. } = error {
            // Asked to stop, and nothing was under way.
            tracing::info!("{error}");
            return 0;
        }
        say(&format!("biplane-onboard: {}", sentence(&error)));
        1
    })
}

/// The error in words of this program.
fn sentence(error: &OnboardError) -> String {
    match error {
        OnboardError::Write(WriteError::Exists { .. } | WriteError::Unfinished { .. }) => {
            format!("{error} (--force replaces it)")
        }
        _ => error.to_string(),
    }
}

fn start_log(verbose: bool, quiet: bool) {
    let level = match (verbose, quiet) {
        (true, _) => "biplane_onboard=debug",
        (_, true) => "error",
        _ => "biplane_onboard=info",
    };
    let filter = EnvFilter::try_from_env("BIPLANE_LOG").unwrap_or_else(|_| EnvFilter::new(level));
    let log =
        tracing_subscriber::fmt().with_env_filter(filter).with_writer(std::io::stderr).with_target(false);
    let log = log.with_ansi(std::io::stderr().is_terminal() && std::env::var_os("NO_COLOR").is_none());
    // A terminal that has gone is no reason to fail.
    let log = log.log_internal_errors(false);
    // Whoever runs this twice in one process (a test) keeps the first log.
    let _ = log.try_init();
}

/// Writes a line to stderr, whoever reads it or not.
fn say(line: &str) {
    let _ = writeln!(std::io::stderr().lock(), "{line}");
}

/// Writes a result to stdout. A reader that has gone is no failure of ours.
fn print_result(text: &str) {
    let _ = std::io::stdout().lock().write_all(text.as_bytes());
}

#[cfg(test)]
mod tests;
