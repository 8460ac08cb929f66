//! `--dry-run`: what a command would read, do and write, in the words of the command line; nothing is made.

use std::fmt::Display;
use std::path::Path;

use biplane_cli::Outcome;
use serde::Serialize;

use super::json::print_json;

/// What would be done.
#[derive(Serialize)]
pub(crate) struct Plan<'a> {
    /// What is read.
    pub reads: Vec<&'a Path>,
    /// The steps, in order.
    pub steps: Vec<&'static str>,
    /// What is written.
    pub writes: Vec<String>,
    /// What it takes, where that is known.
    pub takes: Option<String>,
}

impl Plan<'_> {
    /// Prints it, as a result.
    pub(crate) fn print_result(&self, as_json: bool) -> anyhow::Result<Outcome> {
        if as_json {
            print_json(self)?;
            return Ok(Outcome::Done);
        }
        let reads: Vec<_> = self.reads.iter().map(|path| path.display()).collect();
        println!(
            "would read   {}\nwould do     {}\nwould write  {}",
            list(&reads),
            list(&self.steps),
            list(&self.writes)
        );
        self.takes.iter().for_each(|takes| println!("would take   {takes}"));
        Ok(Outcome::Done)
    }
}

fn list(items: &[impl Display]) -> String {
    items.iter().map(ToString::to_string).collect::<Vec<_>>().join(", ")
}
