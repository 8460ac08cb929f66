//! `biplane tiles script`: a batch script for Slurm.

use std::path::PathBuf;

use anyhow::Context;

use super::folder::TilesFolder;
use biplane_cli::Outcome;

/// Words of the command.
#[derive(Clone, Debug, clap::Args)]
#[command(after_help = "Example:\n  biplane tiles script tiles\n\n\
    Write it to a file, then: sbatch FILE. Missing tiles are run again by sbatch --array=LIST FILE.")]
pub(super) struct Args {
    /// The folder of `biplane tiles plan`
    #[arg(value_name = "DIR")]
    folder: PathBuf,
    /// The model to write [default: model, in the folder of the tiles]
    #[arg(long, short, value_name = "MODEL")]
    output: Option<PathBuf>,
}

/// What the script says, with names in capitals for what differs.
const SCRIPT: &str = include_str!("slurm.sh");

/// Runs the command.
pub(super) fn run(args: &Args) -> anyhow::Result<Outcome> {
    let folder = TilesFolder::open(&args.folder)?;
    let tiles = std::path::absolute(&args.folder).context("cannot tell where the folder is")?;
    let model = args.output.clone().unwrap_or_else(|| tiles.join("model"));
    let model = std::path::absolute(model).context("cannot tell where the model goes")?;
    let program = std::env::current_exe().context("cannot tell where this program is")?;
    let last = folder.manifest.tiles.len().saturating_sub(1);
    let script = SCRIPT
        .replace("@LAST@", &last.to_string())
        .replace("@PROGRAM@", &quoted(&program))
        .replace("@TILES@", &quoted(&tiles))
        .replace("@MODEL@", &quoted(&model));
    print!("{script}");
    Ok(Outcome::Done)
}

/// A path as a shell takes it, whatever is in it.
fn quoted(path: &std::path::Path) -> String {
    format!("'{}'", path.display().to_string().replace('\'', r"'\''"))
}

#[cfg(test)]
mod tests {
    use std::path::Path;

    #[test]
    fn paths_with_spaces_and_quotes_are_one_word() {
        assert_eq!(super::quoted(Path::new("/a b/it's")), r"'/a b/it'\''s'");
    }
}
