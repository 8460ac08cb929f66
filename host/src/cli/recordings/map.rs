//! `biplane map`: the floor map as map_server pair and picture.

use crate::cli::terminal::values::resolution;
use std::path::PathBuf;

use crate::formats::output::{check_free, check_not_input};
use crate::recordings::deskew::StampedPose;
use crate::recordings::run::Run;
use crate::slam::occupancy::OccupancyParams;
use crate::view::floor_map;
use crate::view::floor_map::FloorMapParams;
use crate::view::floor_map::map_files::map_paths;
use crate::view::floor_map::map_files::write_map;
use crate::view::floor_map::map_image::MapImage;
use serde::Serialize;

use crate::cli::terminal::console::Console;
use crate::cli::terminal::json::print_json;
use biplane_cli::{Outcome, counted};

/// Words of the command.
#[derive(Debug, clap::Args)]
#[command(after_help = "Examples:\n  biplane map office.mcap -o floor\n  \
    biplane map office.mcap -o fine --resolution 0.02")]
pub(crate) struct Args {
    /// A posed recording; of one in parts all of them, in any order, or its name without the number
    #[arg(required = true, value_name = "RUN.mcap")]
    recordings: Vec<PathBuf>,
    /// Name of the map: NAME.pgm and NAME.yaml for map_server, NAME.png to look at
    #[arg(long, short, value_name = "NAME")]
    output: PathBuf,
    /// Side of a cell in meters; smaller draws finer and larger maps
    #[arg(long, value_name = "METERS", default_value_t = OccupancyParams::default().resolution_m, value_parser = resolution)]
    resolution: f64,
    /// Replace the outputs if they exist
    #[arg(long)]
    force: bool,
    /// Print JSON
    #[arg(long)]
    json: bool,
}

/// What was drawn.
#[derive(Debug, Serialize)]
struct Drawn {
    /// The files: both of the map_server pair, then the picture.
    files: [String; 3],
    /// Cells from west to east.
    columns: u32,
    /// Cells from south to north.
    rows: u32,
    /// Side of a cell.
    resolution_m: f64,
    /// Scans that the map was drawn from.
    scans: usize,
}

/// Runs the command.
pub(crate) fn run(args: &Args, console: &Console) -> anyhow::Result<Outcome> {
    let run = Run::open(&args.recordings)?;
    for path in map_paths(&args.output) {
        for recording in run.recording().paths() {
            check_not_input(&path, ".part", recording)?;
        }
        check_free(&path, args.force)?;
    }
    console.report_missing(run.recording());
    let _spinner = console.spinner(format!("drawing {}", run.path().display()));
    let poses = run.poses()?;
    console.report_poses(run.recording(), &poses);
    let at_scans = poses.at_scans();
    let mut params = FloorMapParams::default();
    params.grid.resolution_m = args.resolution;
    let grid = floor_map::draw(&run, &at_scans, &poses.trajectory(), &params)?;
    let known: Vec<StampedPose> = at_scans.into_iter().flatten().collect();
    let (image, coarsened) = MapImage::new(&grid, &known)?;
    console.report_coarsened(coarsened.as_ref());
    let files = write_map(&args.output, &image, &known, args.force)?.map(|path| path.display().to_string());
    let [columns, rows] = image.size();
    let drawn = Drawn { files, columns, rows, resolution_m: image.resolution_m(), scans: known.len() };
    print_result(&drawn, args, console)?;
    Ok(Outcome::Done)
}

fn print_result(drawn: &Drawn, args: &Args, console: &Console) -> anyhow::Result<()> {
    if args.json {
        return print_json(drawn);
    }
    let Drawn { files, columns, rows, resolution_m, scans } = drawn;
    console.note(format!(
        "{}: {columns} x {rows} cells of {resolution_m} m from {}",
        files.join(", "),
        counted(*scans, "scan")
    ));
    Ok(())
}
