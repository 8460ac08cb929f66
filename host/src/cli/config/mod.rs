//! `--config FILE`: words of the command line from a TOML file, a section a command, each key a flag's name
//! without its dashes.
//!
//! ```toml
//! [build]
//! sigma = 0.02
//! formats = ["glb", "dxf"]
//! ```
//! What the command line says itself wins, also over what it excludes. `biplane parameters` prints such a
//! file with every default.

pub(crate) mod parameters;

use std::ffi::OsString;
use std::path::PathBuf;

use anyhow::{Context, bail};
use clap::parser::ValueSource;
use clap::{Arg, ArgAction, ArgMatches, Command};
use toml::{Table, Value};

/// Flags that no file can give: what they are for must be said each time.
const GIVEN_ONLY: [&str; 5] = ["config", "dry-run", "force", "help", "version"];

/// The words of the command line of `cli` with those of its file, if it names one.
///
/// # Errors
/// What is wrong with the file, by name.
pub(super) fn words(mut cli: Command, mut words: Vec<OsString>) -> anyhow::Result<Vec<OsString>> {
    cli.build();
    // A first look, which forgives what the file may yet supply.
    let Ok(given) = cli.clone().ignore_errors(true).try_get_matches_from(&words) else { return Ok(words) };
    let Some((name, matches)) = given.subcommand() else { return Ok(words) };
    let Some(path) = matches.try_get_one::<PathBuf>("config").ok().flatten() else { return Ok(words) };
    let Some(command) = cli.find_subcommand(name) else { return Ok(words) };
    let text = std::fs::read_to_string(path).with_context(|| format!("cannot read {}", path.display()))?;
    let more = read(&text, &cli)
        .and_then(|table| section(&table, command, matches))
        .with_context(|| path.display().to_string())?;
    let place = words.iter().position(|word| word == name).map_or(words.len(), |place| place + 1);
    words.splice(place..place, more);
    Ok(words)
}

/// The flags of a command that a file can give.
pub(super) fn flags(command: &Command) -> impl Iterator<Item = &Arg> {
    command.get_arguments().filter(|arg| {
        let may = |name| !GIVEN_ONLY.contains(&name);
        !arg.is_positional() && !arg.is_hide_set() && !arg.is_global_set() && arg.get_long().is_some_and(may)
    })
}

/// Whether a flag has no value.
pub(super) fn is_switch(flag: &Arg) -> bool {
    matches!(flag.get_action(), ArgAction::SetTrue)
}

/// Reads a file's text, and refuses names that nobody knows.
fn read(text: &str, cli: &Command) -> anyhow::Result<Table> {
    let table: Table = text.parse()?;
    for (name, section) in &table {
        let Some(command) = cli.find_subcommand(name) else {
            bail!("there is no command {name}: sections are commands of biplane, such as [build]")
        };
        let Some(section) = section.as_table() else {
            bail!("{name} is no section: write [{name}], and its flags below")
        };
        let known: Vec<&str> = flags(command).filter_map(Arg::get_long).collect();
        if let Some(key) = section.keys().find(|key| !known.contains(&key.as_str())) {
            if GIVEN_ONLY.contains(&key.as_str()) {
                bail!("[{name}] {key}: say --{key} on the command line");
            }
            bail!("[{name}] has no {key}; it knows {}", known.join(", "));
        }
    }
    Ok(table)
}

/// A command's section as words, without what the command line says itself.
fn section(table: &Table, command: &Command, given: &ArgMatches) -> anyhow::Result<Vec<OsString>> {
    let is_given = |flag: &Arg| given.value_source(flag.get_id().as_str()) == Some(ValueSource::CommandLine);
    let given: Vec<&Arg> = flags(command).filter(|flag| is_given(flag)).collect();
    let excludes = |one: &Arg, other: &Arg| {
        command.get_arg_conflicts_with(one).iter().any(|arg| arg.get_id() == other.get_id())
    };
    let mut words = Vec::new();
    for flag in flags(command) {
        let long = flag.get_long().unwrap_or_default();
        let Some(value) = table.get(command.get_name()).and_then(|section| section.get(long)) else {
            continue;
        };
        if given
            .iter()
            .any(|other| other.get_id() == flag.get_id() || excludes(flag, other) || excludes(other, flag))
        {
            continue;
        }
        words.extend(word(flag, long, value).with_context(|| format!("[{}] {long}", command.get_name()))?);
    }
    Ok(words)
}

/// One flag as the command line would give it; nothing for a switch that is off.
fn word(flag: &Arg, long: &str, value: &Value) -> anyhow::Result<Option<OsString>> {
    match (is_switch(flag), value) {
        (true, Value::Boolean(on)) => Ok(on.then(|| format!("--{long}").into())),
        (true, _) => bail!("expected true or false, found {value}"),
        (false, _) => Ok(Some(format!("--{long}={}", text(value)?).into())),
    }
}

/// A value as it stands on a command line; a list is separated by commas.
fn text(value: &Value) -> anyhow::Result<String> {
    Ok(match value {
        Value::String(text) => text.clone(),
        Value::Integer(number) => number.to_string(),
        Value::Float(number) => number.to_string(),
        Value::Array(values) => values.iter().map(text).collect::<anyhow::Result<Vec<_>>>()?.join(","),
        Value::Boolean(_) | Value::Datetime(_) | Value::Table(_) => {
            bail!("expected a text, a number or a list of them, found {value}")
        }
    })
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::cli::args::{Cli, Command as Parsed};
    use clap::{CommandFactory, Parser};

    /// The command line with a file of this content.
    fn with(file: &str, line: &str) -> Result<Vec<String>, String> {
        let path =
            std::env::temp_dir().join(format!("biplane-config-{}-{:p}.toml", std::process::id(), &file));
        std::fs::write(&path, file).unwrap();
        let line = format!("biplane {line} --config {}", path.display());
        let result = words(Cli::command(), line.split(' ').map(OsString::from).collect());
        std::fs::remove_file(&path).unwrap();
        let words = result.map_err(|error| format!("{error:#}"))?;
        Ok(words.into_iter().map(|word| word.into_string().unwrap()).collect())
    }

    #[test]
    fn a_file_says_what_the_line_does_not() {
        let file = "[build]\nsigma = 0.02\nmax-triangles = 7\nno-optimize = true\nno-report = false\nformats = [\"glb\", \"dxf\"]\noutput = \"d\"\n\
                    [compact]\nfloor = -1.5\n";
        let words = with(file, "build run.mcap --max-triangles 3").unwrap();
        assert_eq!(words[..2], ["biplane", "build"]);
        let mut added = words[2..words.len() - 5].to_vec();
        added.sort();
        assert_eq!(added, ["--formats=glb,dxf", "--no-optimize", "--output=d", "--sigma=0.02"]);
        assert!(matches!(Cli::try_parse_from(words).unwrap().command, Parsed::Build(_)));
        // What the line excludes stays out.
        let words = with(file, "build run.mcap --poses t.tum").unwrap();
        assert!(!words.contains(&"--no-optimize".to_owned()) && Cli::try_parse_from(words).is_ok());
        assert!(with(file, "compact m.ply -o d").unwrap().contains(&"--floor=-1.5".to_owned()));
        assert_eq!(with(file, "info run.mcap").unwrap().len(), 5);
    }

    #[test]
    fn what_a_file_cannot_say_is_refused_by_name() {
        let table = [
            ("[build]\nsigmaa = 1", "[build] has no sigmaa; it knows "),
            ("[built]\nsigma = 1", "there is no command built"),
            ("sigma = 1", "there is no command sigma"),
            ("build = 1", "build is no section"),
            ("[build]\nforce = true", "say --force on the command line"),
            ("[build]\nno-optimize = 1", "[build] no-optimize: expected true or false, found 1"),
            ("[build]\nsigma = true", "[build] sigma: expected a text, a number or a list"),
            ("[build\n", "TOML"),
        ];
        for (file, words) in table {
            let refused = with(file, "build run.mcap -o d").unwrap_err();
            assert!(refused.contains(words) && refused.contains("biplane-config"), "{file}: {refused}");
        }
        let line = ["biplane", "build", "r", "-o", "d", "--config", "/none.toml"];
        let none = words(Cli::command(), line.map(OsString::from).to_vec());
        assert!(format!("{:#}", none.unwrap_err()).contains("cannot read /none.toml"));
    }
}
