//! `biplane build`: from a recording to the model and everything around it, in one folder.

mod drive_args;
mod notes;
pub(super) mod posed;
mod rooms;
pub(super) mod storeys;

use crate::cli::models::model_args::{ModelArgs, report_noise, report_sigma};
use crate::cli::models::viewer_file::write_viewer_file;
use crate::cli::models::{files, formats};
use crate::cli::recordings::optimize;
use crate::cli::terminal::bad_argument::BadArgument;
use crate::cli::terminal::console::Console;
use crate::cli::terminal::dry_run::Plan;
use crate::cli::terminal::json::print_json;
use crate::cli::terminal::needs::{self, Needs};
use crate::cli::terminal::replace;
use crate::cli::terminal::stages::Stages;
use crate::cli::terminal::threads::Threads;
use crate::cli::terminal::values::memory;
use crate::cli::view::report;
use crate::formats::output::OutputFolder;
use crate::formats::text::model_json::ModelFile;
use crate::formats::{Shapes, source_name};
use crate::pipeline::rooms::StoreyDrive;
use crate::pipeline::summary::{Parameters, ScanFigures, Summary};
use crate::pipeline::{self, BuildInput, BuildOutput, SearchElsewhere};
use crate::reconstruct::planes::PlaneParams;
use crate::reconstruct::polygons::Merging;
use crate::reconstruct::revisits::split::Drive;
use crate::recordings::deskew::StampedPose;
use crate::recordings::run::{Run, VerticalScans};
use crate::slam::occupancy::OccupancyGrid;
use crate::view::floor_map::FloorMapParams;
use crate::view::floor_map::map_image::MapImage;
use crate::view::report::Floor;
use crate::view::report::Page;
use anyhow::{anyhow, bail};
use biplane_cli::Outcome;
pub(super) use drive_args::DriveArgs;
use posed::Posed;
use std::path::{Path, PathBuf};
use storeys::{FloorOf, poses};

/// Words of the command.
#[derive(Clone, Debug, clap::Args)]
#[command(after_help = "Examples:\n  biplane build office.mcap -o model\n  \
    biplane build office.mcap -o model --formats all --json\n\n\
    Look at report.html first. Also written: building.json, model.glb, model.ply, model.obj, model.city.json, model.json, planes.ply, raw.ply, \
    points.ply, map.pgm, map.yaml, map.png, trajectory.tum, summary.json. \
    With --formats, or later by `biplane export`: model.dxf, model.ifc, model.lod1.glb, model.lod2.glb, \
    tileset.json with tiles, points.las, points.laz.")]
pub(super) struct Args {
    #[command(flatten)]
    drive: DriveArgs,
    /// The recording was driven on a floor at this height, meters; those that are not named at 0. Each height
    /// is a storey of its own. Drives of different storeys are not matched with each other: the first ones of
    /// each have to begin over each other, looking the same way
    #[arg(long, value_name = "RUN.mcap=M", value_parser = storeys::floor_of, conflicts_with = "poses")]
    floor_z: Vec<FloorOf>,
    #[command(flatten)]
    target: TargetArgs,
    /// Say what would be read, done and written and how much memory it takes, and do none of it
    #[arg(long)]
    dry_run: bool,
}

/// What to write, and where: words that `tiles merge` has too.
#[derive(Clone, Debug, clap::Args)]
pub(super) struct TargetArgs {
    /// The folder to write
    #[arg(long, short, value_name = "DIR")]
    output: PathBuf,
    /// Replace the folder if it exists
    #[arg(long)]
    force: bool,
    /// Print what `summary.json` holds; with --dry-run, what would be done
    #[arg(long)]
    json: bool,
    /// Take no more memory than this, such as 500M or 4G; what needs more is refused, as early as it is known
    /// [default: three quarters of the machine's or the control group's]
    #[arg(long, value_name = "BYTES", value_parser = memory)]
    memory: Option<u64>,
    /// Leave surfaces as they were measured. Doors and windows keep the borders that were seen, instead of
    /// the rectangles of building.json where rays allow these. No floor and no base of a wall is inferred
    #[arg(long)]
    as_seen: bool,
    #[command(flatten)]
    model_args: ModelArgs,
    #[command(flatten)]
    threads: Threads,
}

impl TargetArgs {
    /// Whether surfaces stay as they were seen. The paper's merging rule has no holes to make rectangles of.
    fn keeps_seen(&self) -> bool {
        self.as_seen || self.model_args.merging == Merging::Paper
    }
}

/// What was done before the build: the search for planes, elsewhere.
pub(super) struct Prepared<'a> {
    /// What it went by.
    pub planes: PlaneParams,
    /// What was searched for loops.
    pub searches: PathBuf,
    /// What was found in a cloud.
    pub search: &'a SearchElsewhere<'a>,
}

impl Args {
    /// A build of what was planned before.
    pub(super) fn new(drive: DriveArgs, target: TargetArgs) -> Self {
        Self { drive, floor_z: Vec::new(), target, dry_run: false }
    }

    fn parameters(
        &self,
        floors_m: &[f64],
        map: &FloorMapParams,
        prepared: Option<&Prepared<'_>>,
    ) -> Parameters {
        let mut build = self.target.model_args.parameters(self.drive.sigma);
        build.planes = prepared.map_or(build.planes, |prepared| prepared.planes.clone());
        // Of one floor columns go down to it, whether it was seen or not.
        build.shapes.floor_m = if let [floor_m] = floors_m { Some(*floor_m) } else { None };
        Parameters {
            build,
            map_resolution_m: map.grid.resolution_m,
            max_triangles: self.target.model_args.max_triangles,
            as_seen: self.target.keeps_seen(),
        }
    }

    /// As the command line would give them for one recording.
    #[cfg(feature = "demo")]
    pub(super) fn for_recording(recording: &Path, output: &Path) -> Self {
        let drive = DriveArgs {
            recordings: vec![recording.to_owned()],
            poses: None,
            no_optimize: false,
            planar: false,
            sigma: None,
        };
        let target = TargetArgs {
            output: output.to_owned(),
            force: false,
            json: false,
            memory: None,
            as_seen: false,
            model_args: ModelArgs::unsaid(),
            threads: Threads::default(),
        };
        Self::new(drive, target)
    }
}

/// Runs the command.
pub(super) fn run(args: &Args, console: &Console) -> anyhow::Result<Outcome> {
    run_prepared(args, None, console)
}

/// Runs the command, with planes that were searched before.
pub(super) fn run_prepared(
    args: &Args,
    prepared: Option<&Prepared<'_>>,
    console: &Console,
) -> anyhow::Result<Outcome> {
    args.target.threads.take()?;
    let runs = optimize::open(&args.drive.recordings, console)?;
    let (runs, floors_m) =
        storeys::sorted(runs, &args.floor_z).map_err(|why| BadArgument { command: "build", why })?;
    report_sigma(args.drive.sigma, console);
    storeys::far_apart(&floors_m).iter().for_each(|words| console.warn(format!("biplane: {words}")));
    if args.target.force {
        let read = runs.iter().flat_map(|run| run.recording().paths()).map(Path::to_owned);
        let inputs: Vec<PathBuf> = read.chain(args.drive.poses.clone()).collect();
        replace::check(&files::KNOWN, &args.target.output, &inputs)?;
    }
    OutputFolder::check(&args.target.output, args.target.force)?;
    needs::keep_below(args.target.memory).map_err(|why| anyhow!(why))?;
    let needs = report_needs(&runs, console)?;
    if args.dry_run {
        return Plan { takes: Some(needs.words()), ..plan(args, &runs) }.print_result(args.target.json);
    }
    let mut stages = Stages::new(console, &steps(args));
    let folder = OutputFolder::create(&args.target.output, args.target.force)?;
    if let Some(prepared) = prepared {
        // What is not there is searched again.
        let _ = std::fs::copy(&prepared.searches, folder.searches());
    }
    let posed = poses(&args.drive, &runs, &floors_m, &folder, &mut stages, console)?;
    let floors_m = posed.floors_m();
    let vertical = stages.time("read", || {
        let scans = posed.vertical_scans()?;
        let count = scans.as_ref().map_or(0, |scans| scans.range_scans.len());
        anyhow::Ok((scans, count))
    })?;
    let map_params = FloorMapParams::default();
    let grids = stages.time_with_progress("map", |progress| posed.maps(&map_params, progress))?;
    let parameters = args.parameters(&floors_m, &map_params, prepared);
    console.detail_parameters(&parameters);
    let built = match &vertical {
        Some(vertical) => Some(pipeline::build_searched(
            &input(vertical, &posed),
            &parameters.build,
            prepared.map(|prepared| prepared.search),
            &mut stages,
        )?),
        None => None,
    };
    if let (Some(vertical), Some(built)) = (&vertical, &built)
        && built.counts.scans_unposed == vertical.range_scans.len()
    {
        let source = args.drive.poses.as_deref().unwrap_or(runs[0].path()).display();
        bail!("none of the {} vertical scans lies within the poses of {source}", vertical.range_scans.len());
    }
    let counts = built.as_ref().map(|built| built.counts);
    let drive = vertical.as_ref().map(|vertical| input(vertical, &posed).drive(&parameters.build));
    let (mut summary, page) = write_all(
        args,
        &folder,
        built,
        &Drawn { grids: &grids, drive, posed: &posed, console },
        &mut stages,
    )?;
    summary.parameters = parameters.clone();
    note_inputs(&mut summary, &runs, &posed, vertical.as_ref());
    stages.finish(&mut summary);
    files::write_summary(folder.part(), &summary)?;
    page.iter().try_for_each(|page| report::write(folder.part(), page, &summary))?;
    folder.finish()?;
    console.detail_files(&args.target.output);
    counts.iter().for_each(|counts| report_noise(counts, console));
    notes::report_model(&args.target.output, &summary, vertical.is_some(), console);
    if args.target.json {
        print_json(&summary)?;
    }
    Ok(posed.outcome())
}

/// Puts what was read into a summary.
fn note_inputs(summary: &mut Summary, runs: &[Run], posed: &Posed<'_>, vertical: Option<&VerticalScans>) {
    (summary.source.poses_from, summary.source.loops) = (Some(posed.from), posed.loops);
    summary.source.observed = posed.observed();
    let names = |runs: &[&Run]| -> Vec<String> {
        runs.iter().flat_map(|run| run.recording().paths()).map(|path| path.display().to_string()).collect()
    };
    let is_left_out = |run: &&Run| posed.left_out.iter().any(|left_out| std::ptr::eq(*left_out, *run));
    let (left_out, used): (Vec<&Run>, Vec<&Run>) = runs.iter().partition(is_left_out);
    (summary.source.recordings, summary.source.recordings_left_out) = (names(&used), names(&left_out));
    (summary.scans.horizontal, summary.scans.horizontal_unposed) = posed.scans();
    summary.scans.wild_poses = posed.wild_poses;
    summary.scans.vertical = vertical.map_or(0, |vertical| vertical.range_scans.len() + vertical.odd_scans);
    summary.scans.vertical_odd = vertical.map_or(0, |vertical| vertical.odd_scans);
}

/// Says before all work that there will be no model, where there cannot be one, and refuses work for which
/// there is not memory enough.
pub(super) fn report_needs(runs: &[Run], console: &Console) -> anyhow::Result<Needs> {
    let ranges = runs.iter().map(Run::vertical_ranges).sum::<Result<u64, _>>()?;
    let needs = Needs::of(ranges);
    biplane_cli::memory::expect_need_between(needs.min_bytes, needs.max_bytes).map_err(|why| anyhow!(why))?;
    // Without any scan there is no map either, which is said where the poses are read.
    if ranges == 0
        && runs.iter().map(Run::has_horizontal_scans).collect::<Result<Vec<_>, _>>()?.contains(&true)
    {
        let names: Vec<String> = runs.iter().map(|run| run.path().display().to_string()).collect();
        console.warn(format!(
            "biplane: {}: no scan of a vertical laser: there will be a map and a trajectory, and no model",
            names.join(", ")
        ));
    }
    Ok(needs)
}

/// The stages in their order.
fn steps(args: &Args) -> Vec<&'static str> {
    let optimizes = args.drive.poses.is_none() && !args.drive.no_optimize;
    let mut steps = rooms::STEPS.to_vec();
    steps.retain(|step| *step != "report" || !args.target.model_args.no_report);
    if optimizes {
        steps.insert(0, "optimize");
    }
    steps
}

/// What [`run`] would do.
fn plan<'a>(args: &'a Args, runs: &'a [Run]) -> Plan<'a> {
    let recordings = runs.iter().flat_map(|run| run.recording().paths());
    Plan {
        reads: recordings.chain(args.drive.poses.as_deref()).collect(),
        steps: steps(args),
        writes: files::names(&args.target.model_args.formats, !args.target.model_args.no_report)
            .map(|name| args.target.output.join(name).display().to_string())
            .collect(),
        takes: None,
    }
}

pub(super) fn input<'a>(vertical: &'a VerticalScans, posed: &'a Posed<'_>) -> BuildInput<'a> {
    BuildInput {
        geometry: &vertical.geometry,
        range_scans: &vertical.range_scans,
        trajectory: &posed.trajectory,
    }
}

/// Where the robot was, what it saw, and the map that it drew.
struct Drawn<'a> {
    /// The map of each floor, from below.
    grids: &'a [OccupancyGrid],
    /// What the points are made of; `None` without a vertical laser.
    drive: Option<Drive<'a>>,
    posed: &'a Posed<'a>,
    console: &'a Console,
}

/// Writes every file but the summary, whose counts it returns, and the report, which it prepares.
fn write_all(
    args: &Args,
    folder: &OutputFolder,
    built: Option<BuildOutput>,
    drawn: &Drawn<'_>,
    stages: &mut Stages<'_>,
) -> anyhow::Result<(Summary, Option<Page>)> {
    let &Drawn { grids, drive, posed, console } = drawn;
    let part = folder.part();
    let floors_m = posed.floors_m();
    let on_floors: Vec<Vec<StampedPose>> = floors_m.iter().map(|floor_m| posed.known_on(*floor_m)).collect();
    let (Some(grid), Some(lowest)) = (grids.first(), on_floors.first()) else { bail!("nothing was driven") };
    let (image, coarsened) = MapImage::new(grid, lowest)?;
    console.report_coarsened(coarsened.as_ref());
    let mut output = built.unwrap_or_default();
    posed.restore(&mut output.cloud.stamps_ns);
    posed.restore(&mut output.revisits.scans.stamps_ns);
    let as_seen = args.target.keeps_seen();
    let storeys: Vec<StoreyDrive<'_>> = floors_m
        .iter()
        .zip(grids)
        .zip(&on_floors)
        .map(|((floor_m, map), poses)| StoreyDrive { floor_m: *floor_m, map, poses })
        .collect();
    let elements = rooms::elements(&mut output, &storeys, as_seen, stages)?;
    notes::report_storeys(&elements, console);
    args.target.model_args.bound(&mut output)?;
    let shapes = Shapes { source: posed.named(source_name), ..Shapes::new(&output.model) };
    let file =
        ModelFile::new(&shapes, floors_m.first().copied(), files::points_of(&output)).with_elements(elements);
    let building = formats::building(&args.target.model_args.formats, &file);
    let has_model = !output.cloud.is_empty();
    stages.time("write", || {
        let mut written = files::write_floor(part, &image, lowest, &posed.used)?;
        if let Some(drive) = drive.filter(|_| has_model) {
            written +=
                files::write_raw(part, drive, &output, &shapes.source, &args.target.model_args.formats)?;
            written += files::write_lossless(part, &shapes, &file)?;
            written += files::write_elements(part, &file)?;
            let chosen = &args.target.model_args.formats;
            written += files::write_model(part, &shapes, building.as_ref(), chosen)?;
            written += write_viewer_file(part, &shapes, &file, chosen)?;
        }
        anyhow::Ok(((), written))
    })?;
    let is_reported = !args.target.model_args.no_report;
    let building = is_reported.then(|| building.unwrap_or_else(|| file.building()));
    // Nothing that comes asks for single points.
    (output.cloud, output.labels) = Default::default();
    output.revisits = Default::default();
    let page = building.map(|building| {
        let known = posed.known();
        let floor = Floor { map: &image, poses: lowest };
        let title = posed.named(report::title);
        let page = report::prepare(&title, &output, &shapes, (Some(floor), &known), stages)?;
        anyhow::Ok(page.with_building(&building))
    });
    let page = page.transpose()?;
    let mut summary = Summary::new(&output.counts, &output.model, shapes.triangles());
    summary.source.poses = args.drive.poses.as_ref().map(|path| path.display().to_string());
    summary.scans = ScanFigures {
        vertical_still: output.counts.scans_still,
        vertical_unposed: output.counts.scans_unposed,
        ..ScanFigures::default()
    };
    Ok((summary, page))
}
