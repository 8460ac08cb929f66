//! `biplane parameters`: every flag that a `--config` file can give, with its default and what it does, as
//! such a file.

use std::fmt::Write as _;
use std::io::Write as _;

use anyhow::Context;
use clap::{Arg, Command};

use crate::cli::config;
use biplane_cli::Outcome;

/// Letters a line of explanation.
const WIDTH: usize = 120;

/// Words of the command.
#[derive(Clone, Debug, clap::Args)]
#[command(after_help = "Example:\n  biplane parameters build > biplane.toml\n\n\
    Keep what you change, leave out the rest: biplane parameters > biplane.toml; biplane build run.mcap -o model --config biplane.toml")]
pub(crate) struct Args {
    /// Of these commands only
    #[arg(value_name = "COMMAND", default_values = ["build", "compact", "optimize"])]
    commands: Vec<String>,
}

/// Runs the command: prints the flags of commands of `cli`.
pub(crate) fn run(args: &Args, mut cli: Command) -> anyhow::Result<Outcome> {
    cli.build();
    let mut text = String::new();
    for name in &args.commands {
        let command = cli.find_subcommand(name).with_context(|| format!("there is no command {name}"))?;
        section(command, &mut text);
    }
    std::io::stdout().write_all(text.as_bytes()).context("cannot print the parameters")?;
    Ok(Outcome::Done)
}

fn section(command: &Command, text: &mut String) {
    let gap = if text.is_empty() { "" } else { "\n" };
    let _ = writeln!(text, "{gap}[{}]", command.get_name());
    for flag in config::flags(command) {
        let help = flag.get_long_help().or(flag.get_help()).map(ToString::to_string).unwrap_or_default();
        text.push_str(&biplane_cli::paragraph(&help, WIDTH, "# "));
        let long = flag.get_long().unwrap_or_default();
        let _ = match default(flag) {
            Some(value) => writeln!(text, "{long} = {value}"),
            // Unset is a setting of its own: nothing that could be written says the same.
            None => writeln!(
                text,
                "# {long} = {}",
                flag.get_value_names().map_or("...", |names| names[0].as_str())
            ),
        };
    }
}

/// A flag's default as TOML; nothing where it is unset.
fn default(flag: &Arg) -> Option<String> {
    if config::is_switch(flag) {
        return Some("false".to_owned());
    }
    let values: Vec<&str> = flag.get_default_values().iter().filter_map(|value| value.to_str()).collect();
    let number = |text: &str| text.parse::<f64>().is_ok();
    match values[..] {
        [] => None,
        [value] if number(value) => Some(value.to_owned()),
        [value] if flag.get_value_delimiter().is_none() => Some(format!("{value:?}")),
        _ => {
            let all: Vec<&str> = values.iter().flat_map(|value| value.split(',')).collect();
            Some(format!("{all:?}"))
        }
    }
}
