//! `biplane planes`: the planes of any point cloud, for people who have points from elsewhere.

use std::fs;
use std::io::{self, Write};
use std::path::{Path, PathBuf};

use anyhow::Context;
use biplane::cloud_file::{self, CloudFile};
use biplane::export::ply::{self, PointRows};
use biplane::output::{OutputFolder, write_file};
use biplane::plane_report::{Cost, Method, PlaneReport};
use biplane::planes::{self, PlaneParams, Planes, SigmaSource};

use crate::Outcome;
use crate::console::Console;
use crate::moment::Moment;
use crate::replace::{self, Known};

/// Words of the command.
#[derive(Clone, Debug, clap::Args)]
#[command(
    after_help = "Written: points.ply (the points in the order of the input with the property `plane`, -1 = none), planes.json (equation, points and RMS \
    of each plane; times), labels.bin (the plane of each point, int32, little endian).\nA PLY whose points have the properties `scan` and `beam` is \
    taken as organised; an element `scan` with x, y, z says where each scan was taken from. Coordinates are metres."
)]
pub struct Args {
    /// A point cloud: PLY (ASCII or binary), LAS or LAZ
    #[arg(value_name = "CLOUD")]
    cloud: PathBuf,
    /// The folder to write
    #[arg(long, short, value_name = "DIR")]
    output: PathBuf,
    /// Range noise of the sensor, one standard deviation, metres. Larger: steps between surfaces disappear; smaller: a wall becomes several
    /// planes [default: estimated from the cloud]
    #[arg(long, value_name = "M", value_parser = length)]
    sigma: Option<f64>,
    /// Threads to use; the result does not depend on it [default: all processors]
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u16).range(1..))]
    threads: Option<u16>,
    /// Print planes.json instead of a table
    #[arg(long)]
    json: bool,
    /// Replace the folder if it exists
    #[arg(long)]
    force: bool,
}

const KNOWN: Known = Known {
    by: "search for planes",
    names: &["labels.bin", "planes.json", "points.ply"],
    sign: "planes.json",
    is_ours: |report| report["planes"].is_array() && report["method"].is_object(),
};

/// A length in metres: more than 0, and at most what makes sense for noise and distances of points.
fn length(text: &str) -> Result<f64, String> {
    match text.parse::<f64>() {
        Ok(value) if value > 0.0 && value <= 10.0 => Ok(value),
        _ => Err("expected metres, more than 0 and at most 10".to_owned()),
    }
}

/// Runs the command.
pub fn run(args: &Args, console: &Console) -> anyhow::Result<Outcome> {
    if let Some(threads) = args.threads {
        rayon::ThreadPoolBuilder::new().num_threads(usize::from(threads)).build_global()?;
    }
    if args.force {
        replace::check(&KNOWN, &args.output, std::slice::from_ref(&args.cloud))?;
    }
    let folder = OutputFolder::create(&args.output, args.force)?;
    let file = load(&args.cloud, console)?;
    let params = PlaneParams { sigma_m: args.sigma, ..PlaneParams::default() };
    let (found, cost) = extract(&params, &file, console);
    let report = PlaneReport::new(&file, &found, Method::Fast(params), cost);
    write(folder.part(), &file, &found, &report)?;
    folder.finish()?;
    tell(args, &report, console)?;
    Ok(Outcome::Done)
}

fn load(path: &Path, console: &Console) -> anyhow::Result<CloudFile> {
    let spinner = console.spinner(format!("reading {}", path.display()));
    let file = cloud_file::read(path).with_context(|| format!("cannot read {}", path.display()))?;
    drop(spinner);
    file.notes.iter().for_each(|note| console.note(format!("{}: {note}", path.display())));
    Ok(file)
}

fn extract(params: &PlaneParams, file: &CloudFile, console: &Console) -> (Planes, Cost) {
    let spinner = console.spinner(format!("finding planes in {} points", file.cloud.len()));
    let start = Moment::now();
    let found = planes::extract(params, &file.cloud);
    let (wall_s, cpu_s) = start.elapsed_s();
    drop(spinner);
    (found, Cost { cpu_s, wall_s, threads: rayon::current_num_threads() })
}

fn write(folder: &Path, file: &CloudFile, found: &Planes, report: &PlaneReport) -> anyhow::Result<()> {
    // `order` says where each point of the cloud was in the file; rows are written the other way round.
    let places: Vec<u32> = (0..file.cloud.len() as u32).collect();
    let order = file.in_file_order(&places);
    let rows = PointRows {
        cloud: &file.cloud,
        labels: &found.labels,
        scan_numbers: &file.scan_numbers,
        order: Some(&order),
        shift_m: file.shift_m,
    };
    write_file(&folder.join("points.ply"), true, |out| ply::write_points(out, &rows))?;
    write_file(&folder.join("labels.bin"), true, |out| {
        let labels = order.iter().map(|index| found.labels[*index as usize]);
        labels.into_iter().try_for_each(|label| out.write_all(&label.to_le_bytes()))
    })?;
    let mut text = serde_json::to_vec_pretty(report)?;
    text.push(b'\n');
    fs::write(folder.join("planes.json"), text).context("cannot write planes.json")?;
    Ok(())
}

fn tell(args: &Args, report: &PlaneReport, console: &Console) -> anyhow::Result<()> {
    let mut out = io::stdout().lock();
    if args.json {
        serde_json::to_writer_pretty(&mut out, report).map_err(io::Error::from)?;
        writeln!(out)?;
    } else {
        print(&mut out, report)?;
    }
    let noise = match (report.sigma_m, report.sigma_source) {
        (Some(sigma_m), Some(source)) => format!(", noise {:.1} cm ({})", 100.0 * sigma_m, words(source)),
        _ => String::new(),
    };
    let kind = match (report.organised, report.origins) {
        (true, true) => "organised",
        (true, false) => "organised, without origins",
        _ => "unorganised",
    };
    console.note(format!(
        "{}: {} points ({kind}), {} of them on {} planes{noise}; {:.3} s of processor time",
        args.output.display(),
        report.points,
        report.points_on_planes,
        report.planes.len(),
        report.cost.cpu_s
    ));
    Ok(())
}

fn words(source: SigmaSource) -> &'static str {
    match source {
        SigmaSource::Given => "as given",
        SigmaSource::Estimated => "estimated",
        SigmaSource::Assumed => "assumed: too few points to tell",
    }
}

fn print(out: &mut impl Write, report: &PlaneReport) -> io::Result<()> {
    writeln!(
        out,
        "{:>6} {:>9} {:>9}   {:>8} {:>8} {:>8}   {:>14}",
        "plane", "points", "RMS", "normal", "", "", "offset"
    )?;
    for plane in &report.planes {
        let [x, y, z] = plane.normal;
        writeln!(
            out,
            "{:>6} {:>9} {:>6.2} cm   {x:>8.4} {y:>8.4} {z:>8.4}   {:>12.3} m",
            plane.plane,
            plane.points,
            100.0 * plane.rms_m,
            plane.offset_m
        )?;
    }
    Ok(())
}
