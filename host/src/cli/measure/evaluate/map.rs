//! `biplane evaluate map`.

use std::io::{self, Write};
use std::path::PathBuf;

use crate::recordings::run::Run;
use crate::slam::map_entropy::MapEntropy;
use crate::slam::occupancy::OccupancyParams;
use crate::view::floor_map;
use crate::view::floor_map::FloorMapParams;
use anyhow::bail;

use crate::cli::terminal::console::Console;
use crate::cli::terminal::json::print_json;
use crate::cli::terminal::values::resolution;
use biplane_cli::Outcome;

/// Words of the command.
#[derive(Debug, clap::Args)]
#[command(after_help = "Example:\n  biplane evaluate map office.mcap")]
pub(super) struct Args {
    /// A posed recording; of one in parts all of them, in any order, or its name without the number
    #[arg(required = true, value_name = "RUN.mcap")]
    recordings: Vec<PathBuf>,
    /// Side of a cell in meters
    #[arg(long, value_name = "METERS", default_value_t = OccupancyParams::default().resolution_m, value_parser = resolution)]
    resolution: f64,
    /// Print JSON
    #[arg(long)]
    json: bool,
}

/// Runs the command.
pub(super) fn run(args: &Args, console: &Console) -> anyhow::Result<Outcome> {
    let run = Run::open(&args.recordings)?;
    console.report_missing(run.recording());
    let spinner = console.spinner(format!("drawing {}", run.path().display()));
    let poses = run.poses()?;
    let mut params = FloorMapParams::default();
    params.grid.resolution_m = args.resolution;
    let grid = floor_map::draw(&run, &poses.at_scans(), &poses.trajectory(), &params)?;
    drop(spinner);
    let Some(found) = MapEntropy::of(&grid) else { bail!("{}: no scan saw anything", run.path().display()) };
    if args.json {
        print_json(&found)?;
        return Ok(Outcome::Done);
    }
    writeln!(
        io::stdout().lock(),
        "{:.5} bits a cell, {:.0} bits in {} cells of {} m, of which {} are walls",
        found.mean_bits,
        found.total_bits,
        found.cells,
        found.resolution_m,
        found.occupied_cells
    )?;
    Ok(Outcome::Done)
}
