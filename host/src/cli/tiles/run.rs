//! `biplane tiles run`: the planes of one tile.

use std::path::PathBuf;

use crate::model::Cloud;
use crate::reconstruct::planes::{search, search_block};

use super::folder::TilesFolder;
use crate::cli::terminal::console::Console;
use crate::cli::terminal::needs;
use crate::cli::terminal::threads::Threads;
use crate::cli::terminal::values::memory;
use anyhow::anyhow;
use biplane_cli::{Outcome, counted};

/// Words of the command.
#[derive(Clone, Debug, clap::Args)]
#[command(after_help = "Examples:\n  biplane tiles run tiles --index 0\n  \
    biplane tiles run tiles --index 17 --threads 1")]
pub(super) struct Args {
    /// The folder of `biplane tiles plan`
    #[arg(value_name = "DIR")]
    folder: PathBuf,
    /// The number of the tile, from 0 on
    #[arg(long, value_name = "N")]
    index: usize,
    /// Take no more memory than this, such as 500M or 4G [default: three quarters of the machine's or the
    /// control group's]
    #[arg(long, value_name = "BYTES", value_parser = memory)]
    memory: Option<u64>,
    #[command(flatten)]
    threads: Threads,
}

impl Args {
    /// Why there is no such tile, where the folder can be read.
    pub(super) fn conflict(&self) -> Option<String> {
        let folder = TilesFolder::open(&self.folder).ok()?;
        folder.tile(self.index).err().map(|error| error.to_string())
    }
}

/// Runs the command.
pub(super) fn run(args: &Args, console: &Console) -> anyhow::Result<Outcome> {
    args.threads.take()?;
    needs::keep_below(args.memory).map_err(|why| anyhow!(why))?;
    let folder = TilesFolder::open(&args.folder)?;
    let index = args.index;
    if folder.found(index).is_some() {
        console.note(format!("tile {index} is finished already"));
        return Ok(Outcome::Done);
    }
    let clouds = folder.points(index)?;
    let _spinner = console.spinner(format!("tile {index}"));
    let planes = &folder.manifest.planes;
    let found: Vec<_> = clouds
        .iter()
        .map(|cloud| match folder.manifest.setting {
            Some(setting) => search_block(planes, cloud, setting),
            None => search(planes, cloud, &mut |_| ()),
        })
        .collect();
    folder.keep(index, &found)?;
    let points: usize = clouds.iter().map(Cloud::len).sum();
    let parts: usize = found.iter().map(|found| found.fits.len()).sum();
    console.note(format!(
        "tile {index}: {}, {} or parts of planes",
        counted(points, "point"),
        counted(parts, "plane")
    ));
    Ok(Outcome::Done)
}
