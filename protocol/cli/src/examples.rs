//! Examples in the help of commands: every command has one, and every one is a command.

use clap::Command;
use clap::error::ErrorKind;

/// What is wrong with the examples in the help of a program: commands that have none, and examples that are
/// no command. For tests.
///
/// An example is a line that begins with the program's name or, where there is none, such words between
/// backticks; a `#` or two blanks end it, and so does a sign of the shell (`>`, `|`, `;`).
#[must_use]
pub fn faulty_examples(mut program: Command) -> Vec<String> {
    program.build();
    let mut faults = Vec::new();
    visit(&program, &program, "", &mut faults);
    faults
}

fn visit(program: &Command, command: &Command, name: &str, faults: &mut Vec<String>) {
    let mut parts = command.get_subcommands().filter(|part| part.get_name() != "help").peekable();
    if parts.peek().is_none() {
        let start = format!("{}{name} ", program.get_name());
        let examples = examples(command, program.get_name());
        if !examples.iter().any(|example| format!("{example} ").starts_with(&start)) {
            faults.push(format!("{start}has no example in its help"));
        }
        faults.extend(examples.iter().filter_map(|example| fault(program, example)));
    }
    parts.for_each(|part| visit(program, part, &format!("{name} {}", part.get_name()), faults));
}

/// The examples in all that the help of a command says.
fn examples(command: &Command, program: &str) -> Vec<String> {
    let texts = [command.get_long_about().or(command.get_about()), command.get_after_help()];
    let texts: Vec<String> = texts.into_iter().flatten().map(ToString::to_string).collect();
    let lines = texts.iter().flat_map(|text| text.lines()).map(|line| {
        let line = line.trim();
        line.strip_prefix("Example: ").unwrap_or(line).to_owned()
    });
    let joined: Vec<String> = texts.iter().map(|text| text.replace('\n', " ")).collect();
    let quoted = joined.iter().flat_map(|text| text.split('`').skip(1).step_by(2)).map(str::to_owned);
    let start = format!("{program} ");
    let is_example = |words: &String| words.starts_with(&start);
    let cut = |words: String| {
        let ends = ["  ", " #", " >", " |", ";"].iter().filter_map(|end| words.find(end));
        words[..ends.min().unwrap_or(words.len())].to_owned()
    };
    let in_lines: Vec<String> = lines.filter(is_example).map(cut).collect();
    // Beside an example, backticks name other commands.
    if in_lines.is_empty() { quoted.filter(is_example).map(cut).collect() } else { in_lines }
}

fn fault(program: &Command, example: &str) -> Option<String> {
    let error = program.clone().try_get_matches_from(example.split_whitespace()).err()?;
    let is_help = matches!(error.kind(), ErrorKind::DisplayHelp | ErrorKind::DisplayVersion);
    (!is_help).then(|| format!("{example}: {error}"))
}

#[cfg(test)]
mod tests {
    use clap::Arg;

    use super::*;

    fn program(help: &str) -> Command {
        let cut = Command::new("cut").arg(Arg::new("height").long("height")).after_help(help.to_owned());
        Command::new("sample").subcommand(cut)
    }

    #[test]
    fn a_command_without_example_and_an_example_that_is_no_command_are_found() {
        assert_eq!(
            faulty_examples(program("Examples:\n  sample cut --height 1  # low")),
            Vec::<String>::new()
        );
        assert_eq!(faulty_examples(program("Or `sample\ncut > file`.")), Vec::<String>::new());
        assert_eq!(faulty_examples(program("Cuts.")), ["sample cut has no example in its help"]);
        let wrong = faulty_examples(program("  sample cut --depth 1"));
        assert!(wrong.len() == 1 && wrong[0].contains("unexpected argument '--depth'"), "{wrong:?}");
    }
}
