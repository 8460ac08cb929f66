//! `completions` and `man`: what a package installs beside the program, made from the definition of its command line.

use std::io::Write;
use std::path::PathBuf;

use anyhow::Context;
use clap::CommandFactory;
use clap_complete::Shell;

use crate::Outcome;
use crate::cli::Cli;

/// Prints the completions of this program for a shell.
///
/// For one user of bash: `biplane completions bash > ~/.local/share/bash-completion/completions/biplane`.
#[derive(Debug, clap::Args)]
pub struct Completions {
    /// The shell.
    shell: Shell,
}

/// Writes the manual pages of this program, one for each command, into a folder.
///
/// To read one: `man -l DIR/biplane.1`.
#[derive(Debug, clap::Args)]
pub struct Man {
    /// The folder; made when it is missing. Pages that are there are replaced.
    #[arg(value_name = "DIR")]
    folder: PathBuf,
}

/// Runs `completions`.
pub fn completions(args: &Completions) -> anyhow::Result<Outcome> {
    let mut text = Vec::new();
    clap_complete::generate(args.shell, &mut Cli::command(), "biplane", &mut text);
    std::io::stdout().write_all(&text).context("cannot print the completions")?;
    Ok(Outcome::Done)
}

/// Runs `man`.
pub fn man(args: &Man) -> anyhow::Result<Outcome> {
    let command = Cli::command().disable_help_subcommand(true);
    std::fs::create_dir_all(&args.folder)
        .and_then(|()| clap_mangen::generate_to(command, &args.folder))
        .with_context(|| format!("cannot write manual pages into {}", args.folder.display()))?;
    Ok(Outcome::Done)
}
