//! The command line: words become typed options, one file a subcommand.

mod encode;
mod extract;
mod fan_lasers;
mod serve;
mod simulate;
mod worlds;

use std::process::ExitCode;

use crate::world::NAMES;
use biplane_cli::{BAD_ARGUMENTS, Completions, FAILED, Man, plain_error, print_result, say};
use clap::{CommandFactory, Parser, Subcommand};

/// Runs the program with the words of its command line. Exit codes: 0 done, 1 failed, 2 bad arguments, 3 done
/// with loss.
pub fn main() -> ExitCode {
    biplane_cli::clean_up_by("biplane-mock", || "what it was writing is not whole".to_owned());
    match biplane_cli::parse::<Cli>(std::env::args_os()).run() {
        Ok(()) => ExitCode::SUCCESS,
        Err(error) => {
            // Messages name their causes themselves: the chain would say them twice.
            say(&format!("biplane-mock: {}", plain_error(&error.to_string())));
            ExitCode::from(if error.is::<BadArgument>() { BAD_ARGUMENTS } else { FAILED })
        }
    }
}

/// Mock lasers and base for Biplane: devices on pseudo-terminals, simulated drives, serial captures.
///
/// Exit codes: 0 done; 1 failed; 2 bad arguments; 3 done, with loss.
#[derive(Debug, Parser)]
#[command(version, about, propagate_version = true, after_help = built_in_worlds())]
struct Cli {
    #[command(subcommand)]
    command: Command,
}

/// What stands below the help of the program.
fn built_in_worlds() -> String {
    let names = NAMES.join(", ");
    biplane_cli::paragraph(&format!("Built-in worlds of `serve` and `simulate`: {names}."), 100, "")
}

#[derive(Debug, Subcommand)]
enum Command {
    Serve(Box<serve::Serve>),
    Simulate(Box<simulate::Simulate>),
    Encode(Box<encode::Encode>),
    Extract(extract::Extract),
    /// Prints the completions of this program for a shell.
    ///
    /// For one user of bash: `biplane-mock completions bash >
    /// ~/.local/share/bash-completion/completions/biplane-mock`.
    Completions(Completions),
    /// Writes the manual pages of this program, one for each command, into a folder.
    ///
    /// To read one: `biplane-mock man pages`, then `man -l pages/biplane-mock.1`.
    Man(Man),
}

impl Cli {
    /// Carries the command out.
    fn run(&self) -> anyhow::Result<()> {
        match &self.command {
            Command::Serve(serve) => serve.run(),
            Command::Simulate(simulate) => simulate.run(),
            Command::Encode(encode) => encode.run(),
            Command::Extract(extract) => extract.run(),
            Command::Completions(completions) => {
                print_result(&String::from_utf8_lossy(&completions.text(Cli::command())));
                Ok(())
            }
            Command::Man(man) => man.write(Cli::command()).map_err(|error| {
                anyhow::anyhow!("cannot write manual pages into {}: {error}", man.folder.display())
            }),
        }
    }
}

/// A finite number above 0.
fn above_zero(text: &str) -> Result<f64, String> {
    number(text, |value| value > 0.0, "a number above 0")
}

/// A finite number that is not below 0.
fn zero_or_more(text: &str) -> Result<f64, String> {
    number(text, |value| value >= 0.0, "0 or more")
}

fn number(text: &str, allowed: impl Fn(f64) -> bool, expected: &str) -> Result<f64, String> {
    let value = text.parse::<f64>().ok().filter(|&value| value.is_finite() && allowed(value));
    value.ok_or_else(|| format!("expected {expected}"))
}

/// Of the horizontal and of the vertical laser. (A name of its own: clap would take an array for a repeated
/// argument.)
pub type MirrorPpm = [f64; 2];

/// Millionths by which the mirrors turn too slowly: one number for both lasers, or two with a comma.
fn mirror_ppm(text: &str) -> Result<MirrorPpm, String> {
    let one = |text| number(text, |ppm: f64| ppm.abs() <= 10_000.0, "P or H,V, each within 10000 of 0");
    match text.split_once(',') {
        Some((horizontal, vertical)) => Ok([one(horizontal)?, one(vertical)?]),
        None => one(text).map(|ppm| [ppm; 2]),
    }
}

/// A share of one.
fn share(text: &str) -> Result<f64, String> {
    number(text, |value| (0.0..=1.0).contains(&value), "a number from 0 to 1")
}

/// An argument that is well formed but cannot be used; the program ends with code 2.
#[derive(Debug, thiserror::Error)]
#[error("{0}")]
pub struct BadArgument(pub String);

#[cfg(test)]
mod tests {
    use super::{Cli, NAMES};
    use clap::{CommandFactory, Parser};

    #[test]
    fn every_command_has_an_example_and_every_example_is_a_command() {
        assert_eq!(biplane_cli::faulty_examples(Cli::command()), Vec::<String>::new());
    }

    #[test]
    fn every_built_in_world_stands_in_the_help_of_the_program_and_of_what_drives_through_it() {
        let mut cli = Cli::command();
        let mut helps = vec![cli.render_help().to_string()];
        for name in ["serve", "simulate"] {
            let command = cli.find_subcommand_mut(name).expect("a command");
            let world = command.get_arguments().find(|arg| arg.get_id() == "world").expect("a world");
            helps.push(world.get_help().expect("help").to_string());
            assert!(helps.last().is_some_and(|help| help.contains("OBJ, PLY or IFC")), "{helps:?}");
        }
        for (help, name) in helps.iter().flat_map(|help| NAMES.map(|name| (help, name))) {
            let is_there = help.split([' ', ',', '.', '\n']).any(|word| word == name);
            assert!(is_there, "{name}: {help}");
        }
    }

    #[test]
    fn numbers_that_make_no_drive_and_no_stretch_are_bad_arguments() {
        let refused = |line: &str| Cli::try_parse_from(line.split(' ')).err().map(|error| error.exit_code());
        for (before, after) in [
            ("m simulate --world corridor -o c.mcap --cruise=", vec!["0", "-1", "nan", "inf"]),
            ("m simulate --world corridor -o c.mcap --stand=", vec!["-1", "nan"]),
            ("m serve --world corridor --links l --speed=", vec!["0", "nan", "-2"]),
            ("m serve --world corridor --links l --start-after=", vec!["-1", "nan", "inf"]),
            ("m simulate --world corridor -o c.mcap --mirror-ppm=", vec!["x", "nan", "20000", "1,2,3", "1,"]),
            ("m simulate --world corridor -o c.mcap --latency-timer-ms=", vec!["-1", "nan"]),
            ("m simulate --world corridor -o c.mcap --hiccup-share=", vec!["-1", "1.5"]),
            ("m serve --world corridor --links l --mirror-ppm=", vec!["", "-20000"]),
            ("m serve --world corridor --links l --boot=", vec!["-1"]),
            ("m extract r.mcap -o c.mcap --from=", vec!["nan", "-1"]),
            ("m extract r.mcap -o c.mcap --to=", vec!["nan", "-1"]),
        ] {
            for value in after {
                assert_eq!(refused(&format!("{before}{value}")), Some(2), "{before}{value}");
            }
            assert_eq!(refused(&format!("{before}0.5")), None, "{before}0.5");
        }
        let crossed = Cli::try_parse_from("m extract r.mcap -o c.mcap --from 5 --to 2".split(' '));
        let error = crossed.expect("well formed").run().expect_err("refused");
        assert!(error.is::<super::BadArgument>(), "{error}");
    }
}
