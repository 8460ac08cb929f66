//! `biplane map`: the floor map as map_server pair and picture.

use std::path::PathBuf;

use biplane::deskew::StampedPose;
use biplane::floor_map::{self, FloorMapParams};
use biplane::map_files::{MapImage, map_paths, write_map};
use biplane::occupancy::OccupancyParams;
use biplane::output::{check_free, check_not_input};
use biplane::run::Run;

use crate::Outcome;
use crate::console::Console;

/// Words of the command.
#[derive(Debug, clap::Args)]
pub struct Args {
    /// A posed recording; of one in parts all of them, in any order, or its name without the number
    #[arg(required = true, value_name = "RUN.mcap")]
    recordings: Vec<PathBuf>,
    /// Name of the map: NAME.pgm and NAME.yaml for map_server, NAME.png to look at
    #[arg(long, short, value_name = "NAME")]
    output: PathBuf,
    /// Side of a cell in metres; smaller draws finer and larger maps
    #[arg(long, value_name = "METRES", default_value_t = OccupancyParams::default().resolution_m, value_parser = resolution)]
    resolution: f64,
    /// Replace the outputs if they exist
    #[arg(long)]
    force: bool,
}

/// Reads the side of a cell.
pub fn resolution(text: &str) -> Result<f64, String> {
    match text.parse::<f64>() {
        Ok(value) if (0.001..=10.0).contains(&value) => Ok(value),
        _ => Err("expected metres between 0.001 and 10".to_owned()),
    }
}

/// Runs the command.
pub fn run(args: &Args, console: &Console) -> anyhow::Result<Outcome> {
    let run = Run::open(&args.recordings)?;
    for path in map_paths(&args.output) {
        for recording in run.recording().paths() {
            check_not_input(&path, ".part", recording)?;
        }
        check_free(&path, args.force)?;
    }
    console.tell_missing(run.recording());
    let _spinner = console.spinner(format!("drawing {}", run.path().display()));
    let poses = run.poses()?;
    console.tell_mountings(run.recording(), &poses);
    let at_scans = poses.at_scans();
    let mut params = FloorMapParams::default();
    params.grid.resolution_m = args.resolution;
    let grid = floor_map::draw(&run, &at_scans, &poses.trajectory(), &params)?;
    let known: Vec<StampedPose> = at_scans.into_iter().flatten().collect();
    let image = MapImage::new(&grid, &known)?;
    let [pgm, yaml, png] = write_map(&args.output, &image, &known, args.force)?;
    let [columns, rows] = image.size();
    console.note(format!(
        "{}, {}, {}: {columns} x {rows} cells of {} m from {} scans",
        pgm.display(),
        yaml.display(),
        png.display(),
        args.resolution,
        known.len()
    ));
    Ok(Outcome::Done)
}
