//! `completions` and `man`: what a package installs beside the program, made from the definition of its command line.

use std::io::Write;
use std::path::PathBuf;

use clap::CommandFactory;
use clap_complete::Shell;

/// Prints the completions of this program for a shell.
///
/// For one user of bash: `biplane-mock completions bash > ~/.local/share/bash-completion/completions/biplane-mock`.
#[derive(Debug, clap::Args)]
pub struct Completions {
    /// The shell.
    shell: Shell,
}

/// Writes the manual pages of this program, one for each command, into a folder.
///
/// To read one: `man -l DIR/biplane-mock.1`.
#[derive(Debug, clap::Args)]
pub struct Man {
    /// The folder; made when it is missing. Pages that are there are replaced.
    #[arg(value_name = "DIR")]
    folder: PathBuf,
}

impl Completions {
    /// Carries the command out.
    pub fn run(&self) -> anyhow::Result<()> {
        let mut text = Vec::new();
        clap_complete::generate(self.shell, &mut super::Cli::command(), "biplane-mock", &mut text);
        std::io::stdout()
            .write_all(&text)
            .map_err(|error| anyhow::anyhow!("cannot print the completions: {error}"))
    }
}

impl Man {
    /// Carries the command out.
    pub fn run(&self) -> anyhow::Result<()> {
        let command = super::Cli::command().disable_help_subcommand(true);
        std::fs::create_dir_all(&self.folder)
            .and_then(|()| clap_mangen::generate_to(command, &self.folder))
            .map_err(|error| {
                anyhow::anyhow!("cannot write manual pages into {}: {error}", self.folder.display())
            })
    }
}
