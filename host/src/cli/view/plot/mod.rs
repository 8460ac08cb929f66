//! `biplane plot`: figures of trajectories and measurements, as SVG or PNG.

mod trajectory;

use std::fs::File;
use std::io::{BufReader, Write};
use std::path::{Path, PathBuf};

use crate::formats::output::{check_free, check_not_input, write_file};
use crate::view::plot::basin;
use crate::view::plot::basin::BasinParams;
use crate::view::plot::chart::Chart;
use crate::view::plot::journal;
use crate::view::plot::raster::to_picture;
use crate::view::plot::relations;
use crate::view::plot::relations::RelationsPlotParams;
use crate::view::plot::svg::to_svg;
use crate::view::plot::table::{Table, TableError};
use anyhow::Context;
use clap::Subcommand;
use serde::Serialize;

use crate::cli::terminal::console::Console;
use crate::cli::terminal::json::print_json;
use biplane_cli::{Outcome, counted};

/// Which figure.
#[derive(Debug, clap::Args)]
pub(crate) struct Args {
    #[command(subcommand)]
    figure: Figure,
}

#[derive(Debug, Subcommand)]
enum Figure {
    /// Paths from above, in meters: compared with a reference, over a floor map
    Trajectory(trajectory::Args),
    /// How often a matcher finds the pose, by how far off it began (tables of `biplane-onboard basin`)
    Basin(BasinArgs),
    /// The error along a run (tables of `biplane evaluate relations --per-relation`)
    Relations(RelationsArgs),
    /// Cost and step size over iterations (tables of `biplane-onboard replay --journal`)
    Journal(JournalArgs),
}

/// What every figure of tables takes.
#[derive(Debug, clap::Args)]
struct Common {
    /// The tables; the files' names name the curves
    #[arg(required = true, value_name = "TABLE.csv")]
    tables: Vec<PathBuf>,
    #[command(flatten)]
    sheet: Sheet,
}

/// What is written, and the words on it.
#[derive(Debug, clap::Args)]
struct Sheet {
    /// The figure to write, .svg or .png
    #[arg(long, short, value_name = "FIGURE.svg", value_parser = figure_path)]
    output: PathBuf,
    /// What stands above the figure
    #[arg(long)]
    title: Option<String>,
    /// What stands below it, before what is known of the figure anyway
    #[arg(long)]
    caption: Option<String>,
    /// Replace the figure if it exists
    #[arg(long)]
    force: bool,
    /// Print JSON
    #[arg(long)]
    json: bool,
}

#[derive(Debug, clap::Args)]
#[command(after_help = "Example:\n  biplane plot basin basin.csv -o basin.svg")]
struct BasinArgs {
    #[command(flatten)]
    common: Common,
    /// Found: at most this far off, in meters
    #[arg(long, value_name = "METERS", default_value_t = BasinParams::default().within_m)]
    within_m: f64,
    /// Found: at most this far turned, in degrees
    #[arg(long, value_name = "DEGREES", default_value_t = BasinParams::default().within_deg)]
    within_deg: f64,
    /// Grossly wrong: farther off than this, in meters
    #[arg(long, value_name = "METERS", default_value_t = BasinParams::default().gross_m)]
    gross_m: f64,
    /// Grossly wrong: turned farther than this, in degrees
    #[arg(long, value_name = "DEGREES", default_value_t = BasinParams::default().gross_deg)]
    gross_deg: f64,
}

#[derive(Debug, clap::Args)]
#[command(after_help = "Example:\n  biplane plot relations errors.csv -o errors.svg")]
struct RelationsArgs {
    #[command(flatten)]
    common: Common,
    /// Relations of which the running median is taken
    #[arg(long, value_name = "COUNT", default_value_t = RelationsPlotParams::default().window)]
    window: usize,
    /// Show errors by their logarithm, to compare runs of very different quality
    #[arg(long)]
    log: bool,
}

#[derive(Debug, clap::Args)]
#[command(after_help = "Example:\n  biplane plot journal journal.csv -o journal.svg")]
struct JournalArgs {
    #[command(flatten)]
    common: Common,
}

fn figure_path(text: &str) -> Result<PathBuf, String> {
    let path = PathBuf::from(text);
    match path.extension().and_then(|extension| extension.to_str()) {
        Some("svg" | "png") => Ok(path),
        _ => Err("expected a name that ends in .svg or .png".to_owned()),
    }
}

/// What `--json` prints.
#[derive(Serialize)]
struct Drawn<'a> {
    /// The figure.
    output: String,
    /// The names of its curves or paths.
    names: &'a [String],
    /// What stands below it.
    caption: &'a str,
}

/// Runs the command.
pub(crate) fn run(args: &Args, console: &Console) -> anyhow::Result<Outcome> {
    match &args.figure {
        Figure::Trajectory(args) => {
            check_free(&args.sheet.output, args.sheet.force)?;
            let chart = trajectory::chart(args, console)?;
            write(&args.sheet, chart, "path", console)
        }
        Figure::Basin(args) => {
            let params = BasinParams {
                within_m: args.within_m,
                within_deg: args.within_deg,
                gross_m: args.gross_m,
                gross_deg: args.gross_deg,
            };
            let basins: Vec<_> = read_all(&args.common, basin::read)?.into_iter().flatten().collect();
            write(&args.common.sheet, basin::chart(&basins, &params), "curve", console)
        }
        Figure::Relations(args) => {
            let params = RelationsPlotParams { window: args.window.max(1), logarithmic: args.log };
            let runs = read_all(&args.common, relations::read)?;
            write(&args.common.sheet, relations::chart(&runs, &params), "curve", console)
        }
        Figure::Journal(args) => {
            let journals = read_all(&args.common, journal::read)?;
            write(&args.common.sheet, journal::chart(&journals), "curve", console)
        }
    }
}

/// Reads each table; errors name its file.
fn read_all<T>(
    common: &Common,
    read: impl Fn(&str, &Table) -> Result<T, TableError>,
) -> anyhow::Result<Vec<T>> {
    for table in &common.tables {
        check_not_input(&common.sheet.output, ".part", table)?;
    }
    check_free(&common.sheet.output, common.sheet.force)?;
    let read_one = |path: &PathBuf| {
        let table =
            File::open(path).map_err(TableError::from).and_then(|file| Table::read(BufReader::new(file)));
        table
            .and_then(|table| read(&name_of(path), &table))
            .with_context(|| format!("cannot read {}", path.display()))
    };
    common.tables.iter().map(read_one).collect()
}

/// A file's name without folder and ending.
fn name_of(path: &Path) -> String {
    path.file_stem().unwrap_or_default().to_string_lossy().into_owned()
}

fn write(sheet: &Sheet, mut chart: Chart, noun: &str, console: &Console) -> anyhow::Result<Outcome> {
    if let Some(title) = &sheet.title {
        chart.title.clone_from(title);
    }
    if let Some(caption) = &sheet.caption {
        chart.caption = format!("{caption} {}", chart.caption);
    }
    let drawing = chart.draw();
    write_file(&sheet.output, sheet.force, |out| {
        match sheet.output.extension().is_some_and(|extension| extension == "png") {
            true => to_picture(&drawing).write_png(out),
            false => out.write_all(to_svg(&drawing).as_bytes()),
        }
    })?;
    let output = sheet.output.display().to_string();
    if sheet.json {
        print_json(&Drawn { output, names: &chart.names, caption: &chart.caption })?;
    } else {
        console.note(format!("{output}: {}", counted(chart.names.len(), noun)));
    }
    Ok(Outcome::Done)
}
