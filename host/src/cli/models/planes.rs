//! `biplane planes`: the planes of any point cloud, for people who have points from elsewhere.

use std::fs;
use std::io::{self, Write};
use std::path::{Path, PathBuf};

use crate::formats::input::cloud;
use crate::formats::input::cloud_file::CloudFile;
use crate::formats::output::{OutputFolder, write_file};
use crate::formats::ply;
use crate::formats::ply::write::PointRows;
use crate::formats::source_name;
use crate::formats::text::shapes_json;
use crate::pipeline::plane_report::{Cost, Method, PaperSearch, PlaneReport, RangeLimit};
use crate::reconstruct::planes;
use crate::reconstruct::planes::labeled::Planes;
use crate::reconstruct::planes::labels::explain::{self, Explanation, Limits};
use crate::reconstruct::planes::paper::agreement::agreement;
use crate::reconstruct::planes::paper::params::ReferenceParams;
use crate::reconstruct::planes::params::PlaneParams;
use crate::reconstruct::shapes;
use crate::reconstruct::shapes::params::ShapeParams;
use anyhow::{Context, bail};

use crate::cli::models::model_args::report_sigma;
use crate::cli::models::no_planes_hint;
use crate::cli::terminal::console::Console;
use crate::cli::terminal::replace;
use crate::cli::terminal::replace::Known;
use crate::cli::terminal::stopwatch::Stopwatch;
use crate::cli::terminal::threads::Threads;
use crate::cli::terminal::values::{length, range};
use biplane_cli::{Outcome, counted};
use biplane_geometry::vec3::dot;

/// Words of the command.
#[derive(Clone, Debug, clap::Args)]
#[command(after_help = "Example:\n  biplane planes scan.laz -o planes\n\n\
    Written: points.ply, the points in the order of the input with the property `plane` (-1 = none). planes.json, the equation, \
    points and RMS of each plane, and times. labels.bin, the plane of each point (int32, little endian).\n\
    A PLY whose points have the properties `scan` and `beam` is taken as organized. \
    An element `scan` with x, y, z says where each scan was taken from. Coordinates are meters.")]
pub(crate) struct Args {
    /// A point cloud: PLY, LAS, LAZ, E57, PCD, PTX, or text with x y z in each line (XYZ, TXT, ASC, CSV, PTS)
    #[arg(value_name = "CLOUD")]
    cloud: PathBuf,
    /// The folder to write
    #[arg(long, short, value_name = "DIR")]
    output: PathBuf,
    /// Range noise of the sensor, one standard deviation, meters. Larger: steps between surfaces disappear;
    /// smaller: a wall becomes several planes [default: estimated from the cloud]
    #[arg(long, value_name = "M", value_parser = length)]
    sigma: Option<f64>,
    /// Leave out points farther than this from where their scan was taken from, meters. For files that say
    /// so: PTX, E57 with poses, PCD with a viewpoint, PLY with origins [default: all points]
    #[arg(long, value_name = "M", value_parser = range)]
    max_range: Option<f64>,
    /// Look for no round things: their points are on planes, or on none
    #[arg(long)]
    no_shapes: bool,
    /// Say why each plane ended where it does: what kept the points around it off it
    #[arg(long)]
    explain: bool,
    /// Also say how far the result agrees with other labels of these points (int32 a point, as labels.bin)
    #[arg(long, value_name = "LABELS.bin")]
    against: Option<PathBuf>,
    #[command(flatten)]
    search: Search,
    #[command(flatten)]
    threads: Threads,
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
    pieces: None,
    sign: "planes.json",
    is_ours: |report| report["planes"].is_array() && report["method"].is_object(),
};

/// Which search, and what belongs to the paper's.
#[derive(Clone, Debug, clap::Args)]
struct Search {
    /// How planes are searched for
    #[arg(long, value_enum, default_value_t = MethodName::Fast)]
    method: MethodName,
    /// Longest distance from a point to the rest of its plane, meters. Larger: gaps are bridged; smaller:
    /// sparse surfaces fall apart
    #[arg(long, value_name = "M", value_parser = length, default_value_t = 0.3)]
    delta: f64,
    /// With --method paper: largest mean squared distance of points to their plane, square meters. Smaller
    /// than the noise squared: walls fall apart; larger: steps disappear [default: 0.00028, the paper's 2.8
    /// taken as square centimeters]
    #[arg(long, value_name = "M2", value_parser = length)]
    epsilon: Option<f64>,
    /// With --method paper: farthest that a point may lie off its plane, meters. Larger: more of what is near
    /// a wall joins it [default: 0.1]
    #[arg(long, value_name = "M", value_parser = length)]
    gamma: Option<f64>,
    /// With --method paper: seed of its random starts [default: 0]
    #[arg(long, value_name = "N")]
    seed: Option<u64>,
}

/// Names of the searches.
#[derive(Clone, Copy, Debug, PartialEq, Eq, clap::ValueEnum)]
enum MethodName {
    /// Over cells of a grid, limits after the noise
    Fast,
    /// The paper's randomized region growing, point by point with its fixed limits: slow, for comparison
    Paper,
}

impl Args {
    /// Why words do not belong together, if they do not.
    pub(crate) fn conflict(&self) -> Option<String> {
        let search = &self.search;
        if search.method == MethodName::Paper {
            return self.sigma.is_some().then(|| {
                "--sigma belongs to --method fast; the paper's limits are --epsilon and --gamma".to_owned()
            });
        }
        let given = [
            ("--epsilon", search.epsilon.is_some()),
            ("--gamma", search.gamma.is_some()),
            ("--seed", search.seed.is_some()),
        ];
        given.into_iter().find(|(_, given)| *given).map(|(name, _)| {
            format!("{name} belongs to --method paper; the limits of the fast search follow from --sigma")
        })
    }

    /// The search that was asked for.
    fn method(&self) -> Method {
        let search = &self.search;
        let delta_m = search.delta;
        if search.method == MethodName::Fast {
            return Method::Fast(PlaneParams { sigma_m: self.sigma, delta_m, ..PlaneParams::default() });
        }
        let usual = ReferenceParams::default();
        let limits = ReferenceParams {
            delta_m,
            epsilon_m2: search.epsilon.unwrap_or(usual.epsilon_m2),
            gamma_m: search.gamma.unwrap_or(usual.gamma_m),
            ..usual
        };
        Method::Paper(PaperSearch { limits, seed: search.seed.unwrap_or(0) })
    }
}

/// Runs the command.
pub(crate) fn run(args: &Args, console: &Console) -> anyhow::Result<Outcome> {
    let method = args.method();
    args.threads.take()?;
    report_sigma(args.sigma, console);
    if args.force {
        replace::check(&KNOWN, &args.output, std::slice::from_ref(&args.cloud))?;
    }
    let folder = OutputFolder::create(&args.output, args.force)?;
    let mut file = load(&args.cloud, console)?;
    let range_limit = args.max_range.map(|range_m| limit(&mut file, range_m, args, console)).transpose()?;
    let others = args.against.as_deref().map(|path| labels_of(path, file.cloud.len())).transpose()?;
    let (mut found, cost) = extract(&method, &file, console);
    found.face(|index| file.seen_from(index));
    let start = Stopwatch::now();
    let params = ShapeParams {
        enabled: !args.no_shapes && matches!(method, Method::Fast(_)),
        ..ShapeParams::default()
    };
    let rounds = shapes::extract(&params, &file.cloud, &mut found);
    let shapes_cpu_s = start.elapsed_s().1;
    let mut report = PlaneReport::new(&file, &found, method, cost);
    report.cylinders = rounds.cylinders.iter().map(|one| shapes_json::figures(one, file.shift_m)).collect();
    report.shapes_cpu_s = shapes_cpu_s;
    report.scans.range_limit = range_limit;
    if args.explain {
        report.explanation = Some(explain(&report.method, &file, &found, console));
    }
    if let Some(others) = others {
        report.agreement = Some(agreement(&file.in_file_order(&found.labels), &others));
    }
    write(folder.part(), &file, &found, &report, &source_name(&args.cloud))?;
    folder.finish()?;
    print_result(args, &report, console)?;
    let hint = no_planes_hint::of_cloud(&file.cloud.points_m, report.points_on_planes, args.search.delta);
    hint.into_iter().for_each(|why| console.note(why));
    Ok(Outcome::Done)
}

fn load(path: &Path, console: &Console) -> anyhow::Result<CloudFile> {
    let spinner = console.spinner(format!("reading {}", path.display()));
    let file = cloud::read(path).with_context(|| format!("cannot read {}", path.display()))?;
    drop(spinner);
    file.notes.iter().for_each(|note| console.note(format!("{}: {note}", path.display())));
    Ok(file)
}

/// Leaves out what lies too far from its scan.
fn limit(
    file: &mut CloudFile,
    max_range_m: f64,
    args: &Args,
    console: &Console,
) -> anyhow::Result<RangeLimit> {
    let points_left_out = file
        .leave_out_beyond(max_range_m)
        .with_context(|| format!("--max-range does not work with {}", args.cloud.display()))?;
    if !file.cloud.points_m.iter().any(|p| p.iter().all(|v| v.is_finite())) {
        bail!("{}: no point lies within {max_range_m} m of its scan's position", args.cloud.display());
    }
    console.note(format!(
        "{}: {} of {} beyond {max_range_m} m are left out",
        args.cloud.display(),
        points_left_out,
        counted(file.cloud.len(), "point")
    ));
    Ok(RangeLimit { max_range_m, points_left_out })
}

fn extract(method: &Method, file: &CloudFile, console: &Console) -> (Planes, Cost) {
    let points = file.cloud.len();
    let start = Stopwatch::now();
    let found = match method {
        Method::Fast(params) => {
            let bar = console.bar(100, format!("percent of finding planes in {points} points"));
            planes::extract_with_progress(params, &file.cloud, &mut |percent| bar.at(percent))
        }
        Method::Paper(search) => {
            let bar = console.bar(points as u64, "points on planes");
            planes::extract_paper(&search.limits, &file.cloud, search.seed, &mut |done| bar.at(done as u64))
        }
    };
    let (wall_s, cpu_s) = start.elapsed_s();
    (found, Cost { cpu_s, wall_s, threads: rayon::current_num_threads() })
}

fn explain(method: &Method, file: &CloudFile, found: &Planes, console: &Console) -> Explanation {
    let _spinner = console.spinner("asking why planes ended");
    let limits = match method {
        Method::Fast(params) => Limits::fast(params, found.sigma_m),
        Method::Paper(search) => Limits::paper(&search.limits),
    };
    explain::explain(&file.cloud, found, limits)
}

/// The labels in a file, which must be one a point.
fn labels_of(path: &Path, points: usize) -> anyhow::Result<Vec<i32>> {
    let bytes = fs::read(path).with_context(|| format!("cannot read {}", path.display()))?;
    let (labels, rest) = bytes.as_chunks::<4>();
    if !rest.is_empty() || labels.len() != points {
        bail!("{} has {} bytes, expected 4 for each of the {points} points", path.display(), bytes.len());
    }
    Ok(labels.iter().map(|label| i32::from_le_bytes(*label)).collect())
}

fn write(
    folder: &Path,
    file: &CloudFile,
    found: &Planes,
    report: &PlaneReport,
    source: &str,
) -> anyhow::Result<()> {
    // `order` says where each point of the cloud was in the file; rows are written the other way round.
    let places: Vec<u32> = (0..file.cloud.len() as u32).collect();
    let order = file.in_file_order(&places);
    let rows = PointRows {
        cloud: &file.cloud,
        labels: &found.labels,
        scan_numbers: &file.scan_numbers,
        order: Some(&order),
        shift_m: file.shift_m,
        source,
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

fn print_result(args: &Args, report: &PlaneReport, console: &Console) -> anyhow::Result<()> {
    let mut out = io::stdout().lock();
    if args.json {
        serde_json::to_writer_pretty(&mut out, report).map_err(io::Error::from)?;
        writeln!(out)?;
    } else {
        print(&mut out, report)?;
    }
    let noise = match (report.sigma_m, report.sigma_source) {
        (Some(sigma_m), Some(source)) => format!(", noise {:.1} cm ({})", 100.0 * sigma_m, source.words()),
        _ => String::new(),
    };
    let kind = match (report.scans.organized, report.scans.origins) {
        (true, true) => "organized",
        (true, false) => "organized, without origins",
        (false, true) => "unorganized, with origins",
        (false, false) => "unorganized",
    };
    console.note(format!(
        "{}: {} ({kind}), {} of them on {}{noise}; {:.3} s of processor time",
        args.output.display(),
        counted(report.points, "point"),
        report.points_on_planes,
        counted(report.planes.len(), "plane"),
        report.cost.cpu_s
    ));
    Ok(())
}

fn print(out: &mut impl Write, report: &PlaneReport) -> io::Result<()> {
    writeln!(
        out,
        "{:>6} {:>9} {:>9}   {:>8} {:>8} {:>8}   {:>14}",
        "plane", "points", "RMS", "normal", "", "", "offset"
    )?;
    for plane in &report.planes {
        let [x, y, z] = plane.normal;
        // Far from zero four digits of a normal say nothing of an offset from there.
        let near_m = dot(plane.normal, report.shift_m);
        writeln!(
            out,
            "{:>6} {:>9} {:>6.2} cm   {x:>8.4} {y:>8.4} {z:>8.4}   {:>12.3} m",
            plane.plane,
            plane.points,
            100.0 * plane.rms_m,
            plane.offset_m - near_m
        )?;
    }
    if report.shift_m != [0.0; 3] {
        let [x, y, z] = report.shift_m;
        writeln!(out, "offsets are counted from {x:.0}, {y:.0}, {z:.0} (planes.json has those from zero)")?;
    }
    for round in &report.cylinders {
        let (kind, points) = (round["kind"].as_str().unwrap_or(""), round["points"].as_u64().unwrap_or(0));
        let [radius_m, rms_m] = ["radius_m", "rms_m"].map(|name| round[name].as_f64().unwrap_or(0.0));
        writeln!(out, "{kind:>6} {points:>9} {:>6.2} cm   radius {radius_m:.3} m", 100.0 * rms_m)?;
    }
    if let Some(explanation) = &report.explanation {
        print_explanation(out, explanation)?;
    }
    if let Some(agreement) = report.agreement {
        writeln!(
            out,
            "agrees with the other labels on {:.2} % of the points; {} of {} planes are among the {} others",
            agreement.points_percent, agreement.same_planes, agreement.planes, agreement.other_planes
        )?;
    }
    Ok(())
}

fn print_explanation(out: &mut impl Write, explanation: &Explanation) -> io::Result<()> {
    writeln!(out, "\nwhy planes end ({})", explanation.limits.words())?;
    for (plane, ending) in explanation.endings.iter().enumerate() {
        writeln!(out, "{plane:>6} {}", ending.words())?;
    }
    writeln!(out, "{}", explanation.free.words())
}
