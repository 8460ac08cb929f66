//! Words of the command line become types, the same way in all three programs.

use std::ffi::OsString;

use clap::{Command, Parser};

/// Reads the words of a command line; the first is the program's name.
///
/// A number below 0 behind a flag is that flag's value. Otherwise it would be taken for a flag that nobody
/// knows, and the message would not name the real reason.
///
/// # Errors
/// When the words are no command, or when they ask for help or for the version.
pub fn try_parse<P: Parser>(words: impl IntoIterator<Item = OsString>) -> Result<P, clap::Error> {
    let mut program = with_negative_numbers(P::command());
    let mut matches = program.try_get_matches_from_mut(words)?;
    P::from_arg_matches_mut(&mut matches).map_err(|error| error.format(&mut program))
}

/// As [`try_parse`]; ends the process with clap's message where the words are no command.
pub fn parse<P: Parser>(words: impl IntoIterator<Item = OsString>) -> P {
    try_parse(words).unwrap_or_else(|error| error.exit())
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
        let Inner::Cut { height } = sample.command;
        assert_eq!((height, sample.sigma), (-1.5, None));
        let refused = try_parse::<Sample>(words("sample cut --height 1 --sigma -1")).unwrap_err().to_string();
        assert!(refused.contains("expected a number above 0"), "{refused}");
        let unknown = try_parse::<Sample>(words("sample cut --height 1 --depth -1")).unwrap_err().to_string();
        assert!(unknown.contains("unexpected argument '--depth'"), "{unknown}");
    }
}
