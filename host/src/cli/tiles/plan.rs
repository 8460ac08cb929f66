//! `biplane tiles plan`: poses a drive and divides it.

use std::fs;
use std::path::{Path, PathBuf};

use crate::formats::output::{OutputFolder, write_file};
use crate::model::Cloud;
use crate::pipeline::params::BuildParams;
use crate::pipeline::tiles::bytes::checksum;
use crate::pipeline::tiles::manifest::{FORMAT, Manifest, NAME, SEARCHES, TILES, VERSION, points_name};
use crate::pipeline::tiles::{points_file, tiles_of};
use crate::reconstruct::planes::{PlaneParams, search::blocks::divide, setting};
use crate::recordings::run::Run;
use anyhow::{Context, anyhow, bail};
use serde::Serialize;
use std::io::Write;

use super::folder::input;
use crate::cli::build::{self, DriveArgs};
use crate::cli::models::model_args::report_sigma;
use crate::cli::recordings::optimize;
use crate::cli::terminal::console::Console;
use crate::cli::terminal::json::print_json;
use crate::cli::terminal::needs;
use crate::cli::terminal::replace::{self, Known};
use crate::cli::terminal::stages::Stages;
use crate::cli::terminal::threads::Threads;
use crate::cli::terminal::values::{memory, tile_size};
use biplane_cli::{Outcome, counted};

/// Words of the command.
#[derive(Clone, Debug, clap::Args)]
#[command(after_help = "Examples:\n  biplane tiles plan campus.mcap -o tiles\n  \
    biplane tiles plan monday.mcap tuesday.mcap -o tiles --size 60 --force\n\n\
    Then `biplane tiles run tiles --index N` for each tile, and `biplane tiles merge tiles -o model`.")]
pub(super) struct Args {
    #[command(flatten)]
    drive: DriveArgs,
    /// The folder to write
    #[arg(long, short, value_name = "DIR")]
    output: PathBuf,
    /// Replace the folder if it exists, with all that was found in its tiles
    #[arg(long)]
    force: bool,
    /// Print JSON
    #[arg(long)]
    json: bool,
    /// Side of a tile, meters. `biplane build` searches drives of ten million points and more in squares of
    /// 20 m; a tile holds those whose middle lies in it. Smaller tiles are searched as they are, and their
    /// model differs a little from that of `biplane build`
    #[arg(long, value_name = "M", value_parser = tile_size, default_value = "20")]
    size: f64,
    /// Margin that is searched with each square, meters; with another one than 1 the model differs a little
    /// from that of `biplane build`
    #[arg(long, value_name = "M", value_parser = tile_size, default_value = "1.0")]
    halo: f64,
    /// Take no more memory than this, such as 500M or 4G [default: three quarters of the machine's or the
    /// control group's]
    #[arg(long, value_name = "BYTES", value_parser = memory)]
    memory: Option<u64>,
    #[command(flatten)]
    threads: Threads,
}

impl Args {
    fn planes(&self) -> PlaneParams {
        let mut planes = PlaneParams { sigma_m: self.drive.sigma, ..PlaneParams::default() };
        if self.size < planes.block_m {
            (planes.block_m, planes.min_points_to_divide) = (self.size, 0);
        }
        PlaneParams { halo_m: self.halo, ..planes }
    }
}

/// What `--json` prints.
#[derive(Serialize)]
struct Planned {
    /// The folder of tiles.
    folder: String,
    /// Tiles, numbered from 0: `biplane tiles run FOLDER --index N` takes one.
    tiles: usize,
    /// Points of all tiles, with their margins.
    points: usize,
}

/// What a folder of tiles is known by.
const KNOWN: Known = Known {
    by: "plan of tiles",
    names: &[NAME, SEARCHES],
    pieces: Some((TILES, &[".points", ".found", ".part"])),
    sign: NAME,
    is_ours: |manifest| manifest["format"] == FORMAT,
};

/// Runs the command.
pub(super) fn run(args: &Args, console: &Console) -> anyhow::Result<Outcome> {
    args.threads.take()?;
    let runs = optimize::open(&args.drive.recordings, console)?;
    let inputs: Vec<PathBuf> = inputs(args, &runs);
    if args.force {
        replace::check(&KNOWN, &args.output, &inputs)?;
    }
    OutputFolder::check(&args.output, args.force)?;
    report_sigma(args.drive.sigma, console);
    needs::keep_below(args.memory).map_err(|why| anyhow!(why))?;
    build::report_needs(&runs, console)?;
    let mut stages = Stages::new(console, &["optimize", "read", "cloud", "tiles"]);
    let folder = OutputFolder::create(&args.output, args.force)?;
    let planes = args.planes();
    let (cloud, outcome) = cloud(args, &runs, &folder, &mut stages, console)?;
    let manifest = stages.time("tiles", || {
        let mut manifest = Manifest {
            format: FORMAT.to_owned(),
            version: VERSION,
            generator: env!("CARGO_PKG_VERSION").to_owned(),
            recordings: args.drive.recordings.iter().map(|path| whole(path)).collect::<Result<_, _>>()?,
            poses: args.drive.poses.as_deref().map(whole).transpose()?,
            no_optimize: args.drive.no_optimize,
            planar: args.drive.planar,
            sigma_m: args.drive.sigma,
            inputs: inputs.iter().map(|path| input(&whole(path)?)).collect::<anyhow::Result<_>>()?,
            planes,
            ..Manifest::default()
        };
        write_tiles(&cloud, args.size, folder.part(), &mut manifest)?;
        write_file(&folder.part().join(NAME), true, |out| {
            serde_json::to_writer_pretty(&mut *out, &manifest)?;
            writeln!(out)
        })?;
        let count = manifest.tiles.len();
        anyhow::Ok((manifest, count))
    })?;
    folder.finish()?;
    if args.json {
        let points: usize = manifest.tiles.iter().map(|tile| tile.points).sum();
        print_json(&Planned {
            folder: args.output.display().to_string(),
            tiles: manifest.tiles.len(),
            points,
        })?;
    } else {
        println!("{}", counted(manifest.tiles.len(), "tile"));
    }
    Ok(outcome)
}

/// All files that are read.
fn inputs(args: &Args, runs: &[Run]) -> Vec<PathBuf> {
    let read = runs.iter().flat_map(|run| run.recording().paths()).map(Path::to_owned);
    read.chain(args.drive.poses.clone()).collect()
}

/// The first views of the drive, and whether all recordings are in it.
fn cloud(
    args: &Args,
    runs: &[Run],
    folder: &OutputFolder,
    stages: &mut Stages<'_>,
    console: &Console,
) -> anyhow::Result<(Cloud, Outcome)> {
    let floors_m = vec![0.0; runs.len()];
    let posed = build::storeys::poses(&args.drive, runs, &floors_m, folder, stages, console)?;
    // Where no loops are searched for there is nothing to keep.
    let _ = fs::copy(folder.searches(), folder.part().join(SEARCHES));
    let vertical = stages.time("read", || {
        let scans = posed.vertical_scans()?.context("there is no scan of a vertical laser to build of")?;
        let count = scans.range_scans.len();
        anyhow::Ok((scans, count))
    })?;
    let params = BuildParams::default();
    let cloud = stages.time("cloud", || {
        let split = build::input(&vertical, &posed).drive(&params).split(&params.revisits, &params.mesh);
        anyhow::Ok((split.cloud, split.kept.points()))
    })?;
    if cloud.is_empty() {
        bail!("no 3D point in {} vertical scans", vertical.range_scans.len());
    }
    needs::expect_first_views(cloud.len()).map_err(|why| anyhow!(why))?;
    Ok((cloud, posed.outcome()))
}

/// Writes the points of each tile, and tells the manifest of them.
fn write_tiles(cloud: &Cloud, size_m: f64, part: &Path, manifest: &mut Manifest) -> anyhow::Result<()> {
    let folder = part.join(TILES);
    fs::create_dir(&folder).with_context(|| format!("cannot create {}", folder.display()))?;
    let blocks = divide(&manifest.planes, cloud);
    manifest.setting = (blocks.len() > 1).then(|| setting(&manifest.planes, cloud, &blocks));
    manifest.tiles = tiles_of(&blocks, &manifest.planes, size_m);
    for (index, tile) in manifest.tiles.iter_mut().enumerate() {
        let of_tile: Vec<_> = tile.blocks.iter().map(|block| &blocks[*block]).collect();
        let bytes = points_file::encode(cloud, &of_tile);
        tile.crc32 = checksum(&bytes);
        write_file(&folder.join(points_name(index)), true, |out| out.write_all(&bytes))?;
    }
    Ok(())
}

/// The full path of what is named, also of a recording in parts, whose name is no file.
fn whole(path: &Path) -> anyhow::Result<PathBuf> {
    std::path::absolute(path).with_context(|| format!("cannot tell where {} is", path.display()))
}
