//! `biplane tiles merge`: the model of tiles that are all finished.

use std::path::PathBuf;

use crate::model::Cloud;
use crate::pipeline::tiles::bytes::checksum;
use crate::pipeline::tiles::manifest::SEARCHES;
use crate::pipeline::tiles::{array_words, points_file};
use crate::reconstruct::planes::search::blocks::divide;
use crate::reconstruct::planes::search::searched::Searched;
use crate::reconstruct::planes::search::stitch::combine;
use anyhow::bail;

use super::folder::{TilesFolder, input};
use crate::cli::build::{self, DriveArgs, Prepared, TargetArgs};
use crate::cli::terminal::console::Console;
use biplane_cli::Outcome;

/// Words of the command.
#[derive(Clone, Debug, clap::Args)]
#[command(after_help = "Examples:\n  biplane tiles merge tiles -o model\n  \
    biplane tiles merge tiles -o model --formats glb,ifc --no-report\n\n\
    Where tiles are missing it ends with 1 and prints --array=LIST, for sbatch to run them again.")]
pub(super) struct Args {
    /// The folder of `biplane tiles plan`
    #[arg(value_name = "DIR")]
    folder: PathBuf,
    #[command(flatten)]
    target: TargetArgs,
}

/// Runs the command.
pub(super) fn run(args: &Args, console: &Console) -> anyhow::Result<Outcome> {
    let folder = TilesFolder::open(&args.folder)?;
    let count = folder.manifest.tiles.len();
    let missing: Vec<usize> = (0..count).filter(|index| folder.found(*index).is_none()).collect();
    if !missing.is_empty() {
        println!("--array={}", array_words(&missing));
        bail!(
            "{} of {count} tiles are not finished: run them again, with Slurm by sbatch --array={}",
            missing.len(),
            array_words(&missing)
        );
    }
    for planned in &folder.manifest.inputs {
        if input(&planned.path)? != *planned {
            bail!("{} is not what it was when the tiles were planned: plan again", planned.path.display());
        }
    }
    let drive = DriveArgs {
        recordings: folder.manifest.recordings.clone(),
        poses: folder.manifest.poses.clone(),
        no_optimize: folder.manifest.no_optimize,
        planar: folder.manifest.planar,
        sigma: folder.manifest.sigma_m,
    };
    let prepared = Prepared {
        planes: folder.manifest.planes.clone(),
        searches: args.folder.join(SEARCHES),
        search: &|cloud| searched(&folder, cloud),
    };
    build::run_prepared(&build::Args::new(drive, args.target.clone()), Some(&prepared), console)
}

/// What was found in the tiles of a cloud.
///
/// # Errors
/// When the cloud is not the one that was planned for.
fn searched(folder: &TilesFolder, cloud: &Cloud) -> Result<Searched, String> {
    let other = || "the drive gives other points than when its tiles were planned: plan again".to_owned();
    let blocks = divide(&folder.manifest.planes, cloud);
    let mut found = vec![Searched::default(); blocks.len()];
    for (index, tile) in folder.manifest.tiles.iter().enumerate() {
        let of_tile = tile.blocks.iter().map(|block| blocks.get(*block)).collect::<Option<Vec<_>>>();
        let of_tile = of_tile.ok_or_else(other)?;
        if checksum(&points_file::encode(cloud, &of_tile)) != tile.crc32 {
            return Err(other());
        }
        let of_tile = folder.found(index).ok_or_else(|| format!("tile {index} is gone"))?;
        for (block, of_block) in tile.blocks.iter().zip(of_tile) {
            if of_block.labels.len() != blocks[*block].points.len() {
                return Err(other());
            }
            found[*block] = of_block;
        }
    }
    match (folder.manifest.setting, found.len()) {
        (None, 1) => Ok(found.remove(0)),
        (Some(setting), _) => Ok(combine(cloud, &blocks, &found, setting)),
        _ => Err(other()),
    }
}
