//! `biplane build`: from a recording to the model and everything around it, in one folder.

mod ahead;
pub mod files;
pub mod formats;
mod posed;
mod stage_list;
pub mod stages;

use std::path::{Path, PathBuf};

use anyhow::bail;
use biplane::deskew::StampedPose;
use biplane::export::{Shapes, source_name};
use biplane::floor_map::FloorMapParams;
use biplane::map_files::MapImage;
use biplane::occupancy::OccupancyGrid;
use biplane::output::OutputFolder;
use biplane::page::Page;
use biplane::pipeline::{self, BuildInput, BuildOutput, Counts};
use biplane::run::{Run, VerticalScans};
use biplane::summary::{Parameters, PosesFrom, ScanFigures, Summary};

use crate::Outcome;
use crate::console::Console;
use crate::plan::Plan;
use crate::planes::length;
use crate::shaping::Shaping;
use crate::threads::Threads;
use crate::{optimize, replace, report};
use posed::Posed;
use stages::Stages;

/// Words of the command.
#[derive(Clone, Debug, clap::Args)]
#[command(
    after_help = "Written: model.glb, model.ply, model.obj, model.city.json, planes.ply, raw.ply, points.ply, map.pgm, map.yaml, \
    map.png, trajectory.tum, summary.json, report.html (look at this one first); with --formats also model.dxf, model.ifc, \
    model.lod1.glb, model.lod2.glb, points.las, points.laz."
)]
pub struct Args {
    /// Posed recordings; of one in parts all of them, in any order, or its name without the number
    #[arg(required = true, value_name = "RUN.mcap")]
    recordings: Vec<PathBuf>,
    /// The folder to write
    #[arg(long, short, value_name = "DIR")]
    output: PathBuf,
    /// Use this trajectory (TUM: t x y z qx qy qz qw) instead of the recorded one
    #[arg(long, value_name = "T.tum")]
    poses: Option<PathBuf>,
    /// Close loops first, as `biplane optimize` does: what is done without this word, too, unless --no-optimize is given
    #[arg(long, conflicts_with = "poses")]
    optimize: bool,
    /// Take the poses as they were recorded; several recordings are then in one frame already. Otherwise loops are closed first. A
    /// recording that has none keeps its poses, and so does one that is optimised already
    #[arg(long, conflicts_with_all = ["poses", "optimize"])]
    no_optimize: bool,
    /// Range noise of the laser, one standard deviation, metres. Larger: steps between surfaces disappear; smaller: a wall becomes several
    /// planes [default: estimated from the points]
    #[arg(long, value_name = "M", value_parser = length)]
    sigma: Option<f64>,
    /// Replace the folder if it exists
    #[arg(long)]
    force: bool,
    /// Say what would be read, done and written, and do none of it
    #[arg(long)]
    dry_run: bool,
    #[command(flatten)]
    shaping: Shaping,
    /// Seed of everything drawn at random; kept in summary.json (no stage draws at random today)
    #[arg(long, value_name = "N", default_value_t = 0)]
    seed: u64,
    #[command(flatten)]
    threads: Threads,
}

impl Args {
    fn parameters(&self, map: &FloorMapParams) -> Parameters {
        Parameters {
            build: self.shaping.parameters(self.sigma),
            map_resolution_m: map.grid.resolution_m,
            max_triangles: self.shaping.max_triangles,
            seed: self.seed,
        }
    }

    /// As the command line would give them for one recording.
    #[cfg(feature = "demo")]
    pub fn for_recording(recording: &Path, output: &Path) -> Self {
        Self {
            recordings: vec![recording.to_owned()],
            output: output.to_owned(),
            poses: None,
            optimize: false,
            no_optimize: false,
            sigma: None,
            force: false,
            dry_run: false,
            shaping: Shaping::unsaid(),
            seed: 0,
            threads: Threads::default(),
        }
    }
}

/// Runs the command.
pub fn run(args: &Args, console: &Console) -> anyhow::Result<Outcome> {
    args.threads.take()?;
    let runs = optimize::open(&args.recordings, console)?;
    if args.force {
        let read = runs.iter().flat_map(|run| run.recording().paths()).map(Path::to_owned);
        let inputs: Vec<PathBuf> = read.chain(args.poses.clone()).collect();
        replace::check(&files::KNOWN, &args.output, &inputs)?;
    }
    OutputFolder::check(&args.output, args.force)?;
    if args.dry_run {
        return Ok(plan(args, &runs).tell());
    }
    let mut stages = Stages::new(console, &steps(args));
    let folder = OutputFolder::create(&args.output, args.force)?;
    let posed = poses(args, &runs, &folder, &mut stages, console)?;
    let vertical = stages.time("read", || {
        let scans = posed.vertical_scans()?;
        let count = scans.as_ref().map_or(0, |scans| scans.sweeps.len());
        anyhow::Ok((scans, count))
    })?;
    let map_params = FloorMapParams::default();
    let grid = stages.time_telling("map", |told| {
        let grid = posed.map(&map_params, told)?;
        let cells = grid.bounds().map_or(0, |bounds| bounds.size().iter().product::<u64>() as usize);
        anyhow::Ok((grid, cells))
    })?;
    let parameters = args.parameters(&map_params);
    let built = match &vertical {
        Some(vertical) => Some(model(vertical, &posed, &parameters, &mut stages)?),
        None => None,
    };
    if let (Some(vertical), Some(built)) = (&vertical, &built)
        && built.counts.scans_unposed == vertical.sweeps.len()
    {
        let source = args.poses.as_deref().unwrap_or(runs[0].path()).display();
        bail!("none of the {} vertical scans lies within the poses of {source}", vertical.sweeps.len());
    }
    let counts = built.as_ref().map(|built| built.counts);
    let (mut summary, page) = write_all(args, &folder, built, (&grid, &posed), &mut stages)?;
    (summary.poses_from, summary.loops) = (Some(posed.from), posed.loops);
    summary.recordings =
        runs.iter().flat_map(|run| run.recording().paths()).map(|path| path.display().to_string()).collect();
    summary.parameters = parameters;
    (summary.scans.horizontal, summary.scans.horizontal_unposed) = posed.scans();
    summary.scans.vertical =
        vertical.as_ref().map_or(0, |vertical| vertical.sweeps.len() + vertical.odd_scans);
    summary.scans.vertical_odd = vertical.as_ref().map_or(0, |vertical| vertical.odd_scans);
    stages.finish(&mut summary);
    files::write_summary(folder.part(), &summary)?;
    page.iter().try_for_each(|page| report::write(folder.part(), page, &summary))?;
    folder.finish()?;
    counts.iter().for_each(|counts| tell_noise(counts, console));
    tell(args, &summary, vertical.is_some(), console);
    Ok(Outcome::Done)
}

/// The stages in their order.
fn steps(args: &Args) -> Vec<&'static str> {
    let optimises = args.poses.is_none() && !args.no_optimize;
    let mut steps =
        vec!["read", "map", "cloud", "mesh", "planes", "polygons", "leftovers", "write", "report"];
    steps.retain(|step| *step != "report" || !args.shaping.no_report);
    if optimises {
        steps.insert(0, "optimize");
    }
    steps
}

/// What [`run`] would do.
fn plan<'a>(args: &'a Args, runs: &'a [Run]) -> Plan<'a> {
    let recordings = runs.iter().flat_map(|run| run.recording().paths());
    Plan {
        reads: recordings.chain(args.poses.as_deref()).collect(),
        steps: steps(args),
        writes: files::names(&args.shaping.formats, !args.shaping.no_report)
            .map(|name| args.output.join(name).display().to_string())
            .collect(),
    }
}

/// Somebody else's poses, the optimised ones, or those of the recording.
fn poses<'a>(
    args: &Args,
    runs: &'a [Run],
    folder: &OutputFolder,
    stages: &mut Stages<'_>,
    console: &Console,
) -> anyhow::Result<Posed<'a>> {
    match &args.poses {
        Some(path) => Posed::foreign(runs, path),
        None if args.no_optimize => Posed::recorded(runs, console),
        None => {
            let posed = stages.time("optimize", || {
                let posed = Posed::optimised(runs, &folder.searches(), console)?;
                let loops = posed.loops.unwrap_or(0);
                anyhow::Ok((posed, loops))
            })?;
            tell_poses(&posed, console);
            Ok(posed)
        }
    }
}

/// Whether the poses are the recorded ones still.
fn tell_poses(posed: &Posed<'_>, console: &Console) {
    match (posed.from, posed.loops) {
        (PosesFrom::Optimized, Some(loops)) => {
            console.note(format!("{loops} loops closed, all poses optimised (not with --no-optimize)"));
        }
        (PosesFrom::OptimizedBefore, _) => {
            console.note("the recording is optimised already: its poses stay");
        }
        (_, Some(_)) => console.note("no loop found: the poses stay as they were recorded"),
        _ => {}
    }
}

fn tell(args: &Args, summary: &Summary, has_vertical: bool, console: &Console) {
    let folder = args.output.display();
    if summary.scans.vertical_unposed > 0 {
        console.note(format!(
            "{} of {} vertical scans lie outside the poses and are not in the model",
            summary.scans.vertical_unposed, summary.scans.vertical
        ));
    }
    if has_vertical {
        console.note(format!("{folder}: {} points, {}", summary.raw_points, summary.reduction()));
    } else {
        console.note(format!(
            "{folder}: the recording has no scan of a vertical laser, so there is a map and a trajectory, and no model"
        ));
    }
}

/// Which noise the planes were searched with.
pub fn tell_noise(counts: &Counts, console: &Console) {
    console.note(format!("noise {:.1} cm ({})", 100.0 * counts.sigma_m, counts.sigma_source.words()));
}

fn model(
    vertical: &VerticalScans,
    posed: &Posed,
    parameters: &Parameters,
    stages: &mut Stages<'_>,
) -> anyhow::Result<BuildOutput> {
    let input = BuildInput { fan: &vertical.fan, sweeps: &vertical.sweeps, trajectory: &posed.trajectory };
    Ok(pipeline::build(&input, &parameters.build, stages)?)
}

/// Writes every file but the summary, whose counts it returns, and the report, which it prepares.
fn write_all(
    args: &Args,
    folder: &OutputFolder,
    built: Option<BuildOutput>,
    (grid, posed): (&OccupancyGrid, &Posed),
    stages: &mut Stages<'_>,
) -> anyhow::Result<(Summary, Option<Page>)> {
    let part = folder.part();
    let known: Vec<StampedPose> = posed.known();
    let image = MapImage::new(grid, &known)?;
    let mut output = built.unwrap_or_default();
    posed.restore(&mut output.cloud.stamps_ns);
    args.shaping.bound(&mut output);
    let shapes = Shapes { source: posed.named(source_name), ..Shapes::new(&output.model) };
    let building = formats::building(&args.shaping.formats, &output.model, Some(0.0));
    let has_model = !output.cloud.is_empty();
    stages.time("write", || {
        let mut written = files::write_floor(part, &image, &known, &posed.used)?;
        if has_model {
            written += files::write_raw(part, &output, &shapes.source, &args.shaping.formats)?;
            written += files::write_model(part, &shapes, building.as_ref(), &args.shaping.formats)?;
        }
        anyhow::Ok(((), written))
    })?;
    let page = if args.shaping.no_report {
        None
    } else {
        let floor = Some((&image, &known[..]));
        Some(report::prepare(&posed.named(report::title), &output, &shapes, floor, stages)?)
    };
    let mut summary = Summary::new(&output.counts, &output.model, shapes.triangles());
    summary.poses = args.poses.as_ref().map(|path| path.display().to_string());
    summary.scans = ScanFigures {
        vertical_still: output.counts.scans_still,
        vertical_unposed: output.counts.scans_unposed,
        ..ScanFigures::default()
    };
    Ok((summary, page))
}
