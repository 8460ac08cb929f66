//! Words of the command line become types, the same way in all three programs.

use std::ffi::OsString;

use clap::builder::StyledStr;
use clap::error::{ContextKind, ContextValue, ErrorKind};
use clap::{Command, Parser};

use crate::plain::plain_number;

/// What flags that every command takes stand under in help texts, below the command's own.
pub const EVERYWHERE: &str = "Options of every command";
/// So many commands are named that have a flag which another has not.
const NAMED_COMMANDS: usize = 3;

/// Reads the words of a command line; the first is the program's name.
///
/// A number below 0 behind a flag is that flag's value. Otherwise it would be taken for a flag that nobody
/// knows, and the message would not name the real reason.
///
/// # Errors
/// When the words are no command, or when they ask for help or for the version.
pub fn try_parse<P: Parser>(words: impl IntoIterator<Item = OsString>) -> Result<P, clap::Error> {
    let mut program = with_negative_numbers(P::command());
    let mut matches = program
        .try_get_matches_from_mut(words)
        .map_err(|error| with_plain_reason(with_command_of_flag(error, &program)))?;
    P::from_arg_matches_mut(&mut matches).map_err(|error| error.format(&mut program))
}

/// As [`try_parse`]; ends the process with clap's message where the words are no command.
pub fn parse<P: Parser>(words: impl IntoIterator<Item = OsString>) -> P {
    try_parse(words).unwrap_or_else(|error| error.exit())
}

/// Refuses what one of the program's commands was given, with the usage of that command.
pub fn refusal<P: Parser>(command: &str, kind: ErrorKind, why: impl std::fmt::Display) -> clap::Error {
    let mut program = P::command();
    // Only now a command knows what it is called, program and all.
    program.build();
    let named = command.split(' ').try_fold(&mut program, |outer, name| outer.find_subcommand_mut(name));
    match named {
        Some(command) => command.error(kind, why),
        None => P::command().error(kind, why),
    }
}

/// A word that is no number is refused in plain English, instead of that of the library that read it.
fn with_plain_reason(error: clap::Error) -> clap::Error {
    let reason = std::error::Error::source(&error).and_then(|source| plain_number(&source.to_string()));
    let (Some(reason), Some(ContextValue::String(flag)), Some(ContextValue::String(value))) =
        (reason, error.get(ContextKind::InvalidArg), error.get(ContextKind::InvalidValue))
    else {
        return error;
    };
    let text =
        format!("invalid value '{value}' for '{flag}': {reason}\n\nFor more information, try '--help'.\n");
    clap::Error::raw(ErrorKind::ValueValidation, text)
}

/// A flag that a command does not have may be that of another, which is then named.
fn with_command_of_flag(mut error: clap::Error, program: &Command) -> clap::Error {
    let is_unknown = error.kind() == ErrorKind::UnknownArgument;
    // A flag that is only misspelled has its own hint.
    if !is_unknown || error.get(ContextKind::SuggestedArg).is_some() {
        return error;
    }
    let Some(ContextValue::String(flag)) = error.get(ContextKind::InvalidArg) else { return error };
    let Some(name) = flag.strip_prefix("--") else { return error };
    let has_flag = |command: &&Command| {
        command.get_arguments().any(|argument| !argument.is_hide_set() && argument.get_long() == Some(name))
    };
    let having: Vec<String> = program
        .get_subcommands()
        .filter(has_flag)
        .take(NAMED_COMMANDS)
        .map(|command| format!("`{} {}`", program.get_name(), command.get_name()))
        .collect();
    if !having.is_empty() {
        let hint = StyledStr::from(format!("{flag} is a flag of {}", having.join(", ")));
        error.insert(ContextKind::Suggested, ContextValue::StyledStrs(vec![hint]));
    }
    error
}

fn with_negative_numbers(program: Command) -> Command {
    let program = program.mut_args(|argument| {
        let is_flag_with_value = argument.get_action().takes_values() && !argument.is_positional();
        if is_flag_with_value { argument.allow_negative_numbers(true) } else { argument }
    });
    program.mut_subcommands(with_negative_numbers)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[derive(Debug, Parser)]
    #[command(name = "sample")]
    struct Sample {
        #[arg(long, value_parser = above_zero, global = true)]
        sigma: Option<f64>,
        #[command(subcommand)]
        command: Inner,
    }

    #[derive(Debug, clap::Subcommand)]
    enum Inner {
        Cut {
            #[arg(long)]
            height: f64,
            #[arg(long, value_parser = clap::value_parser!(u16).range(1..))]
            count: Option<u16>,
        },
        Draw {
            #[arg(long)]
            align_walls: bool,
        },
    }

    fn above_zero(text: &str) -> Result<f64, String> {
        text.parse().ok().filter(|&value| value > 0.0).ok_or_else(|| "expected a number above 0".to_owned())
    }

    fn words(line: &str) -> impl Iterator<Item = OsString> {
        line.split(' ').map(OsString::from)
    }

    #[test]
    fn a_number_below_0_is_a_value_and_a_refusal_names_the_reason() {
        let sample: Sample = try_parse(words("sample cut --height -1.5")).unwrap();
        assert!(matches!(sample.command, Inner::Cut { height: -1.5, .. }) && sample.sigma.is_none());
        let refused = try_parse::<Sample>(words("sample cut --height 1 --sigma -1")).unwrap_err().to_string();
        assert!(refused.contains("expected a number above 0"), "{refused}");
        let unknown = try_parse::<Sample>(words("sample cut --height 1 --depth -1")).unwrap_err().to_string();
        assert!(unknown.contains("unexpected argument '--depth'"), "{unknown}");
    }
    #[test]
    fn a_word_that_is_no_number_is_refused_in_plain_english() {
        let refused = |line| try_parse::<Sample>(words(line)).unwrap_err();
        let start = |line| refused(line).to_string().lines().next().unwrap_or_default().to_owned();
        let count = "error: invalid value '0' for '--count <COUNT>': expected a whole number from 1 to 65535";
        assert_eq!(start("sample cut --height 1 --count 0"), count);
        let word = "error: invalid value 'x' for '--count <COUNT>': expected a whole number";
        assert_eq!(start("sample cut --height 1 --count x"), word);
        let height = "error: invalid value 'x' for '--height <HEIGHT>': expected a number";
        assert_eq!(start("sample cut --height x"), height);
        assert_eq!(refused("sample cut --height x").exit_code(), 2);
    }

    #[test]
    fn a_flag_of_another_command_is_said_to_be_that_commands() {
        let refused = |line| try_parse::<Sample>(words(line)).unwrap_err().to_string();
        let other = refused("sample cut --height 1 --align-walls");
        assert!(other.contains("tip: --align-walls is a flag of `sample draw`"), "{other}");
        assert!(!other.contains("as a value"), "{other}");
        let misspelled = refused("sample draw --align-wall");
        assert!(misspelled.contains("a similar argument exists: '--align-walls'"), "{misspelled}");
        assert!(!refused("sample draw --depth").contains("is a flag of"));
    }

    #[test]
    fn a_refusal_shows_the_usage_of_its_command() {
        let refused = refusal::<Sample>("cut", ErrorKind::ValueValidation, "too high").to_string();
        assert!(refused.starts_with("error: too high") && refused.contains("Usage: sample cut"), "{refused}");
    }
}
