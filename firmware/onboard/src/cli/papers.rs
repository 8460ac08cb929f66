//! `completions` and `man`: what a package installs beside the program, made from the definition of its command line.

use std::path::PathBuf;

use clap::CommandFactory;
use clap_complete::Shell;

use crate::error::OnboardError;

/// Prints the completions of this program for a shell.
///
/// For one user of bash: `biplane-onboard completions bash > ~/.local/share/bash-completion/completions/biplane-onboard`.
#[derive(Debug, clap::Args)]
pub struct Completions {
    /// The shell.
    shell: Shell,
}

/// Writes the manual pages of this program, one for each command, into a folder.
///
/// To read one: `man -l DIR/biplane-onboard.1`.
#[derive(Debug, clap::Args)]
pub struct Man {
    /// The folder; made when it is missing. Pages that are there are replaced.
    #[arg(value_name = "DIR")]
    folder: PathBuf,
}

pub(super) fn completions(args: &Completions) -> u8 {
    let mut text = Vec::new();
    clap_complete::generate(args.shell, &mut super::Cli::command(), "biplane-onboard", &mut text);
    super::print_result(&String::from_utf8_lossy(&text));
    0
}

pub(super) fn man(args: &Man) -> Result<u8, OnboardError> {
    let failed = |source| OnboardError::System { what: "write the manual pages", source };
    std::fs::create_dir_all(&args.folder).map_err(failed)?;
    let command = super::Cli::command().disable_help_subcommand(true);
    clap_mangen::generate_to(command, &args.folder).map_err(failed)?;
    Ok(0)
}
