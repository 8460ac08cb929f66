//! `biplane`: recordings in, compact models out. Words to typed options ([`cli`]), one file a command, one place for exit codes.

mod build;
mod calibrate;
mod cli;
mod compact;
mod compare;
mod config;
mod console;
#[cfg(feature = "demo")]
mod demo;
mod doubt;
mod evaluate;
mod import;
mod info;
mod map;
mod moment;
mod optimize;
mod papers;
mod parameters;
mod plan;
mod planes;
mod plot;
mod recover;
mod render;
mod replace;
mod report;
mod shaping;
mod threads;
mod traj;

use std::io;
use std::process::ExitCode;

use clap::Parser;

use cli::{Cli, Command};
use console::{Console, say};

/// How a command ended that did not fail.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Outcome {
    /// All done.
    Done,
    /// Done, but data of the input was lost.
    Lossy,
}

fn main() -> ExitCode {
    let words = match config::words(std::env::args_os().collect()) {
        Ok(words) => words,
        Err(error) => {
            say(&format!("biplane: {}", sentence(&error)));
            return ExitCode::from(2);
        }
    };
    let cli = Cli::parse_from(words); // wrong arguments: clap says what, and ends with 2
    let console = Console::new(cli.quiet);
    match run(cli.command, &console) {
        Ok(Outcome::Done) => ExitCode::SUCCESS,
        Ok(Outcome::Lossy) => ExitCode::from(3),
        // Whoever read our output has seen enough of it.
        Err(error) if is_broken_pipe(&error) => ExitCode::SUCCESS,
        Err(error) => {
            say(&format!("biplane: {}", sentence(&error)));
            ExitCode::FAILURE
        }
    }
}

fn run(command: Command, console: &Console) -> anyhow::Result<Outcome> {
    match command {
        #[cfg(feature = "demo")]
        Command::Demo(args) => demo::run(&args, console),
        Command::Info(args) => info::run(&args),
        Command::Import(args) => import::run(&args, console),
        Command::Optimize(args) => optimize::run(&args, console),
        Command::Traj(args) => traj::run(&args, console),
        Command::Map(args) => map::run(&args, console),
        Command::Build(args) => build::run(&args, console),
        Command::Planes(args) => planes::run(&args, console),
        Command::Compact(args) => compact::run(&args, console),
        Command::Compare(args) => compare::run(&args, console),
        Command::Evaluate(args) => evaluate::run(&args, console),
        Command::Plot(args) => plot::run(&args, console),
        Command::Render(args) => render::run(&args, console),
        Command::Recover(args) => recover::run(&args, console),
        Command::Calibrate(args) => calibrate::run(&args, console),
        Command::Parameters(args) => parameters::run(&args),
        Command::Completions(args) => papers::completions(&args),
        Command::Man(args) => papers::man(&args),
    }
}

/// An error and its causes, each once: many an error says its cause itself.
fn sentence(error: &anyhow::Error) -> String {
    let mut text = error.to_string();
    for cause in error.chain().skip(1).map(ToString::to_string) {
        if !text.contains(&cause) {
            text.push_str(": ");
            text.push_str(&cause);
        }
    }
    text
}

fn is_broken_pipe(error: &anyhow::Error) -> bool {
    let broken = |cause: &(dyn std::error::Error + 'static)| {
        cause.downcast_ref::<io::Error>().is_some_and(|error| error.kind() == io::ErrorKind::BrokenPipe)
    };
    error.chain().any(broken)
}
