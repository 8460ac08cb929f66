//! `biplane`: recordings in, compact models out. Words to typed options (`cli`), one file a command, one
//! place for exit codes.

mod args;
mod build;
mod config;
#[cfg(feature = "demo")]
mod demo;
mod measure;
mod models;
mod recordings;
mod terminal;
mod tiles;
mod view;

use std::io::{self, Write};
use std::process::ExitCode;

use anyhow::Context;
use biplane_cli::{BAD_ARGUMENTS, FAILED, Outcome, plain_error};
use clap::CommandFactory;
use clap::error::ErrorKind;

use crate::cli::args::{Cli, Command, refuse};
use crate::cli::terminal::bad_argument::BadArgument;
use crate::cli::terminal::console::{Console, say};
use crate::formats::output::unfinished;

/// Runs the program with the words of the command line; its exit code is 0 done, 1 failed, 2 bad arguments, 3
/// done but data was lost.
pub fn main() -> ExitCode {
    biplane_cli::clean_up_by("biplane", unfinished::clean_up);
    // Refused, an interruption is as silent as the system makes it.
    let _ = biplane_cli::end_on_signals();
    let words = match config::words(Cli::command(), std::env::args_os().collect()) {
        Ok(words) => words,
        Err(error) => {
            say(&format!("biplane: {}", sentence(&error)));
            return ExitCode::from(BAD_ARGUMENTS);
        }
    };
    let cli: Cli = biplane_cli::parse(words); // wrong arguments: clap says what, and ends with 2
    let console = Console::new(cli.quiet, cli.verbose);
    let ended = run(cli.command, &console);
    biplane_cli::wait_if_ending();
    match ended {
        Ok(outcome) => outcome.into(),
        // Whoever read our output has seen enough of it.
        Err(error) if is_broken_pipe(&error) => ExitCode::SUCCESS,
        Err(error) => {
            if let Some(BadArgument { command, why }) = error.downcast_ref() {
                refuse(command, ErrorKind::ValueValidation, why);
            }
            say(&format!("biplane: {}", sentence(&error)));
            ExitCode::from(FAILED)
        }
    }
}

fn run(command: Command, console: &Console) -> anyhow::Result<Outcome> {
    match command {
        #[cfg(feature = "demo")]
        Command::Demo(args) => demo::run(&args, console),
        Command::Info(args) => recordings::info::run(&args),
        Command::Import(args) => recordings::import::run(&args, console),
        Command::Optimize(args) => recordings::optimize::run(&args, console),
        Command::Traj(args) => recordings::traj::run(&args, console),
        Command::Map(args) => recordings::map::run(&args, console),
        Command::Build(args) => build::run(&args, console),
        Command::Tiles(args) => match args.conflict() {
            Some(why) => refuse("tiles", ErrorKind::ValueValidation, why),
            None => tiles::run(&args, console),
        },
        Command::Planes(args) => match args.conflict() {
            Some(why) => refuse("planes", ErrorKind::ArgumentConflict, why),
            None => models::planes::run(&args, console),
        },
        Command::Compact(args) => models::compact::run(&args, console),
        Command::Export(args) => match args.conflict() {
            Some(why) => refuse("export", ErrorKind::ValueValidation, why),
            None => models::export::run(&args, console),
        },
        Command::Compare(args) => measure::compare::run(&args, console),
        Command::Evaluate(args) => measure::evaluate::run(&args, console),
        Command::Plot(args) => view::plot::run(&args, console),
        Command::Render(args) => view::render::run(&args, console),
        Command::Recover(args) => recordings::recover::run(&args, console),
        Command::Calibrate(args) => recordings::calibrate::run(&args, console),
        Command::Parameters(args) => config::parameters::run(&args, Cli::command()),
        Command::Completions(args) => {
            let text = args.text(Cli::command());
            io::stdout().write_all(&text).context("cannot print the completions")?;
            Ok(Outcome::Done)
        }
        Command::Man(args) => {
            args.write(Cli::command())
                .with_context(|| format!("cannot write manual pages into {}", args.folder.display()))?;
            Ok(Outcome::Done)
        }
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
    plain_error(&text)
}

fn is_broken_pipe(error: &anyhow::Error) -> bool {
    let broken = |cause: &(dyn std::error::Error + 'static)| {
        cause.downcast_ref::<io::Error>().is_some_and(|error| error.kind() == io::ErrorKind::BrokenPipe)
    };
    error.chain().any(broken)
}

#[cfg(test)]
mod tests {
    use clap::CommandFactory;

    use super::Cli;

    #[test]
    fn every_command_has_an_example_and_every_example_is_a_command() {
        assert_eq!(biplane_cli::faulty_examples(Cli::command()), Vec::<String>::new());
    }
}
