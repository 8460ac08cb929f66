//! `completions` and `man`: what a package installs beside a program, made from the definition of its command
//! line.

use std::io;
use std::path::PathBuf;

use clap::Command;
use clap_complete::Shell;

/// Options of `completions`.
#[derive(Clone, Debug, clap::Args)]
pub struct Completions {
    /// The shell.
    shell: Shell,
}

impl Completions {
    /// The completions of a program for the shell.
    #[must_use]
    pub fn text(&self, mut program: Command) -> Vec<u8> {
        let mut text = Vec::new();
        let name = program.get_name().to_owned();
        clap_complete::generate(self.shell, &mut program, name, &mut text);
        text
    }
}

/// Options of `man`.
#[derive(Clone, Debug, clap::Args)]
pub struct Man {
    /// The folder; made when it is missing. Pages that are there are replaced.
    #[arg(value_name = "DIR")]
    pub folder: PathBuf,
}

impl Man {
    /// Writes the manual pages of a program, one for each command, into the folder.
    ///
    /// # Errors
    /// When the folder cannot be made or a page not be written.
    pub fn write(&self, program: Command) -> io::Result<()> {
        std::fs::create_dir_all(&self.folder)?;
        clap_mangen::generate_to(program.disable_help_subcommand(true), &self.folder)
    }
}

#[cfg(test)]
mod tests {
    use clap::{Args, FromArgMatches};

    use super::*;

    fn program() -> Command {
        Command::new("sample").subcommand(Command::new("measure").about("Measures a thing"))
    }

    #[test]
    fn completions_know_the_programs_name_and_commands() {
        let words =
            Completions::augment_args(Command::new("completions")).get_matches_from(["completions", "bash"]);
        let text = Completions::from_arg_matches(&words).unwrap().text(program());
        let text = String::from_utf8(text).unwrap();
        assert!(text.contains("_sample()") && text.contains("measure"), "{text}");
    }

    #[test]
    fn each_command_has_a_page_and_a_folder_that_cannot_be_made_is_an_error() {
        let folder = std::env::temp_dir().join(format!("biplane-cli-man-{}", std::process::id()));
        Man { folder: folder.join("man") }.write(program()).unwrap();
        let page = std::fs::read_to_string(folder.join("man/sample-measure.1")).unwrap();
        assert!(page.contains("Measures a thing"), "{page}");
        assert!(folder.join("man/sample.1").exists() && !folder.join("man/sample-help.1").exists());
        assert!(Man { folder: folder.join("man/sample.1") }.write(program()).is_err());
        std::fs::remove_dir_all(&folder).unwrap();
    }
}
