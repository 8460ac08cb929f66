//! `biplane compact`: planes and merging on any triangle mesh, for people who have meshes from elsewhere.

use std::path::{Path, PathBuf};

use crate::formats::input::mesh;
use crate::formats::input::mesh::MeshFile;
use crate::formats::output::{OutputFolder, write_file};
use crate::formats::ply;
use crate::formats::ply::write::PointRows;
use crate::formats::text::model_json::{ModelFile, PointsOf};
use crate::formats::{Shapes, source_name};
use crate::model::Cloud;
use crate::pipeline::BuildOutput;
use crate::pipeline::compact::compact;
use crate::pipeline::summary::{Parameters, Summary};
use anyhow::Context;

use crate::cli::models::files;
use crate::cli::models::formats;
use crate::cli::models::formats::Formats;
use crate::cli::models::model_args::ModelArgs;
use crate::cli::models::model_args::{report_noise, report_sigma};
use crate::cli::models::no_planes_hint;
use crate::cli::models::viewer_file::write_viewer_file;
use crate::cli::terminal::console::Console;
use crate::cli::terminal::dry_run::Plan;
use crate::cli::terminal::json::print_json;
use crate::cli::terminal::replace;
use crate::cli::terminal::stages::Stages;
use crate::cli::terminal::threads::Threads;
use crate::cli::terminal::values::length;
use crate::cli::view::report;
use biplane_cli::Outcome;

/// Words of the command.
#[derive(Clone, Debug, clap::Args)]
#[command(after_help = "Example:\n  biplane compact house.ply -o house\n\n\
    Written: model.glb, model.ply, model.obj, model.city.json, planes.ply, summary.json, report.html. model.json is for \
    `biplane export`. raw.ply is the mesh. points.ply holds its vertices with the property `plane` (-1 = none).\n\
    Coordinates are meters. Flat surfaces face the way their triangles do.")]
pub(crate) struct Args {
    /// A triangle mesh: PLY (ASCII or binary) or OBJ
    #[arg(value_name = "MESH")]
    mesh: PathBuf,
    /// The folder to write
    #[arg(long, short, value_name = "DIR")]
    output: PathBuf,
    /// How far vertices of a flat surface lie off it, one standard deviation, meters [default: estimated from
    /// the mesh]
    #[arg(long, value_name = "M", value_parser = length)]
    sigma: Option<f64>,
    /// Height of a floor, meters: for the plans of model.dxf, where the mesh has none [default: found, where
    /// there are walls over a level surface]
    #[arg(long, value_name = "M", value_parser = height, allow_negative_numbers = true)]
    floor: Option<f64>,
    #[command(flatten)]
    model_args: ModelArgs,
    #[command(flatten)]
    threads: Threads,
    /// Replace the folder if it exists
    #[arg(long)]
    force: bool,
    /// Say what would be read, done and written, and do none of it
    #[arg(long)]
    dry_run: bool,
    /// Print what `summary.json` holds; with --dry-run, what would be done
    #[arg(long)]
    json: bool,
}

fn height(text: &str) -> Result<f64, String> {
    text.parse::<f64>().ok().filter(|value| value.is_finite()).ok_or_else(|| "expected meters".to_owned())
}

/// Runs the command.
pub(crate) fn run(args: &Args, console: &Console) -> anyhow::Result<Outcome> {
    args.threads.take()?;
    if args.force {
        replace::check(&files::KNOWN, &args.output, std::slice::from_ref(&args.mesh))?;
    }
    if args.dry_run {
        OutputFolder::check(&args.output, args.force)?;
        return plan(args).print_result(args.json);
    }
    let folder = OutputFolder::create(&args.output, args.force)?;
    let mut stages = Stages::new(console, &steps(args));
    let mut file = stages.time("load", || {
        let file = mesh::read(&args.mesh).with_context(|| format!("cannot read {}", args.mesh.display()))?;
        let triangles = file.mesh.triangles.len();
        Ok((file, triangles))
    })?;
    let left_out = file.triangles - file.mesh.triangles.len();
    if left_out > 0 {
        console.note(format!(
            "{left_out} of {} triangles have no three corners and are left out",
            file.triangles
        ));
    }
    report_sigma(args.sigma, console);
    let build = args.model_args.parameters(args.sigma);
    let mut output = compact(std::mem::take(&mut file.mesh), &build, &mut stages);
    args.model_args.bound(&mut output)?;
    let source = source_name(&args.mesh);
    let shapes = Shapes { shift_m: file.shift_m, source, ..Shapes::new(&output.model) };
    let floor_m = args.floor.map(|floor_m| floor_m - file.shift_m[2]);
    let points = PointsOf { count: file.vertex_of.len(), times: None };
    let lossless = ModelFile::new(&shapes, floor_m, points);
    let building = formats::building(&args.model_args.formats, &lossless);
    stages.time("write", || {
        let raw = write_raw(folder.part(), &file, &output, &shapes.source, &args.model_args.formats)?;
        let exact = files::write_lossless(folder.part(), &shapes, &lossless)?;
        let formats = &args.model_args.formats;
        let chosen = files::write_model(folder.part(), &shapes, building.as_ref(), formats)?;
        let shown = write_viewer_file(folder.part(), &shapes, &lossless, formats)?;
        Ok(((), raw + exact + chosen + shown))
    })?;
    let page = if args.model_args.no_report {
        None
    } else {
        let page = report::prepare(&report::title(&args.mesh), &output, &shapes, (None, &[]), &mut stages)?;
        let shown = building.clone().unwrap_or_else(|| lossless.building());
        Some(page.with_building(&shown))
    };
    let mut summary = Summary::new(&output.counts, &output.model, shapes.triangles());
    summary.counts.raw_points = file.vertex_of.len();
    summary.source.mesh = Some(args.mesh.display().to_string());
    summary.source.shift_m = Some(file.shift_m);
    summary.parameters =
        Parameters { build, max_triangles: args.model_args.max_triangles, ..Parameters::default() };
    stages.finish(&mut summary);
    files::write_summary(folder.part(), &summary)?;
    page.iter().try_for_each(|page| report::write(folder.part(), page, &summary))?;
    folder.finish()?;
    console.detail_parameters(&summary.parameters);
    console.detail_files(&args.output);
    report_noise(&output.counts, console);
    print_result(args, &summary, console);
    let hint = no_planes_hint::of_mesh(&output.cloud.points_m, summary.counts.polygons);
    hint.into_iter().for_each(|why| console.note(why));
    formats::hint(building.as_ref()).into_iter().for_each(|why| console.note(why));
    if args.json {
        print_json(&summary)?;
    }
    Ok(Outcome::Done)
}

/// The stages in their order.
fn steps(args: &Args) -> Vec<&'static str> {
    let mut steps = vec!["load", "planes", "polygons", "leftovers", "write", "report"];
    steps.retain(|step| *step != "report" || !args.model_args.no_report);
    steps
}

/// What [`run`] would do.
fn plan(args: &Args) -> Plan<'_> {
    // No robot drove: no map, no way.
    let is_of_meshes =
        |name: &&str| !name.starts_with("map.") && !["building.json", "trajectory.tum"].contains(name);
    Plan {
        reads: vec![&args.mesh],
        steps: steps(args),
        writes: files::names(&args.model_args.formats, !args.model_args.no_report)
            .filter(is_of_meshes)
            .map(|name| args.output.join(name).display().to_string())
            .collect(),
        takes: None,
    }
}

/// Writes the mesh, and its vertices as they were in the file.
fn write_raw(
    folder: &Path,
    file: &MeshFile,
    output: &BuildOutput,
    source: &str,
    formats: &[Formats],
) -> anyhow::Result<usize> {
    write_file(&folder.join("raw.ply"), true, |out| {
        let comment = format!("the mesh {source}, vertices at one place made one");
        ply::write_far_mesh(out, &output.mesh, file.shift_m, &comment)
    })?;
    let of_file = |vertex: &u32| output.cloud.points_m[*vertex as usize];
    let cloud = Cloud { points_m: file.vertex_of.iter().map(of_file).collect(), ..Cloud::default() };
    let labels: Vec<i32> = file.vertex_of.iter().map(|vertex| output.labels[*vertex as usize]).collect();
    let rows = PointRows {
        cloud: &cloud,
        labels: &labels,
        scan_numbers: &[],
        order: None,
        shift_m: file.shift_m,
        source,
    };
    Ok(1 + files::write_points(folder, &rows, formats)?)
}

fn print_result(args: &Args, summary: &Summary, console: &Console) {
    console.note(format!("{}: {}", args.output.display(), summary.reduction()));
}
