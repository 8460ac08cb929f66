//! `biplane compact`: planes and merging on any triangle mesh, for people who have meshes from elsewhere.

use std::path::{Path, PathBuf};

use anyhow::Context;
use biplane::compact::compact;
use biplane::export::ply::{self, PointRows};
use biplane::export::{Shapes, source_name};
use biplane::mesh_file::{self, MeshFile};
use biplane::model::Cloud;
use biplane::output::{OutputFolder, write_file};
use biplane::pipeline::BuildOutput;
use biplane::summary::{Parameters, Summary};

use crate::Outcome;
use crate::build::formats::{self, Formats};
use crate::build::stages::Stages;
use crate::build::{files, tell_noise};
use crate::console::Console;
use crate::doubt;
use crate::plan::Plan;
use crate::planes::length;
use crate::shaping::Shaping;
use crate::threads::Threads;
use crate::{replace, report};

/// Words of the command.
#[derive(Clone, Debug, clap::Args)]
#[command(
    after_help = "Written: model.glb, model.ply, model.obj, model.city.json, planes.ply, raw.ply (the mesh), points.ply (its vertices with the property \
    `plane`, -1 = none), summary.json, report.html.\nCoordinates are metres. Flat surfaces face the way their triangles do."
)]
pub struct Args {
    /// A triangle mesh: PLY (ASCII or binary) or OBJ
    #[arg(value_name = "MESH")]
    mesh: PathBuf,
    /// The folder to write
    #[arg(long, short, value_name = "DIR")]
    output: PathBuf,
    /// How far vertices of a flat surface lie off it, one standard deviation, metres [default: estimated from the mesh]
    #[arg(long, value_name = "M", value_parser = length)]
    sigma: Option<f64>,
    /// Height of a floor, metres: for the plans of model.dxf, where the mesh has none [default: found, where there are walls over a level
    /// surface]
    #[arg(long, value_name = "M", value_parser = height, allow_negative_numbers = true)]
    floor: Option<f64>,
    #[command(flatten)]
    shaping: Shaping,
    #[command(flatten)]
    threads: Threads,
    /// Replace the folder if it exists
    #[arg(long)]
    force: bool,
    /// Say what would be read, done and written, and do none of it
    #[arg(long)]
    dry_run: bool,
}

fn height(text: &str) -> Result<f64, String> {
    text.parse::<f64>().ok().filter(|value| value.is_finite()).ok_or_else(|| "expected metres".to_owned())
}

/// Runs the command.
pub fn run(args: &Args, console: &Console) -> anyhow::Result<Outcome> {
    args.threads.take()?;
    if args.force {
        replace::check(&files::KNOWN, &args.output, std::slice::from_ref(&args.mesh))?;
    }
    if args.dry_run {
        OutputFolder::check(&args.output, args.force)?;
        return Ok(plan(args).tell());
    }
    let folder = OutputFolder::create(&args.output, args.force)?;
    let mut stages = Stages::new(console, &steps(args));
    let mut file = stages.time("load", || {
        let file =
            mesh_file::read(&args.mesh).with_context(|| format!("cannot read {}", args.mesh.display()))?;
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
    let build = args.shaping.parameters(args.sigma);
    let mut output = compact(std::mem::take(&mut file.mesh), &build, &mut stages);
    args.shaping.bound(&mut output);
    let source = source_name(&args.mesh);
    let shapes = Shapes { shift_m: file.shift_m, source, ..Shapes::new(&output.model) };
    let floor_m = args.floor.map(|floor_m| floor_m - file.shift_m[2]);
    let building = formats::building(&args.shaping.formats, &output.model, floor_m);
    stages.time("write", || {
        let raw = write_raw(folder.part(), &file, &output, &shapes.source, &args.shaping.formats)?;
        Ok(((), raw + files::write_model(folder.part(), &shapes, building.as_ref(), &args.shaping.formats)?))
    })?;
    let page = if args.shaping.no_report {
        None
    } else {
        Some(report::prepare(&report::title(&args.mesh), &output, &shapes, None, &mut stages)?)
    };
    let mut summary = Summary::new(&output.counts, &output.model, shapes.triangles());
    summary.raw_points = file.vertex_of.len();
    summary.mesh = Some(args.mesh.display().to_string());
    summary.shift_m = Some(file.shift_m);
    summary.parameters =
        Parameters { build, max_triangles: args.shaping.max_triangles, ..Parameters::default() };
    stages.finish(&mut summary);
    files::write_summary(folder.part(), &summary)?;
    page.iter().try_for_each(|page| report::write(folder.part(), page, &summary))?;
    folder.finish()?;
    tell_noise(&output.counts, console);
    tell(args, &summary, console);
    let doubt = doubt::of_mesh(&output.cloud.points_m, summary.polygons);
    doubt.into_iter().for_each(|why| console.note(why));
    formats::doubt(building.as_ref()).into_iter().for_each(|why| console.note(why));
    Ok(Outcome::Done)
}

/// The stages in their order.
fn steps(args: &Args) -> Vec<&'static str> {
    let mut steps = vec!["load", "planes", "polygons", "leftovers", "write", "report"];
    steps.retain(|step| *step != "report" || !args.shaping.no_report);
    steps
}

/// What [`run`] would do.
fn plan(args: &Args) -> Plan<'_> {
    // No robot drove: no map, no way.
    let is_of_meshes = |name: &&str| !name.starts_with("map.") && *name != "trajectory.tum";
    Plan {
        reads: vec![&args.mesh],
        steps: steps(args),
        writes: files::names(&args.shaping.formats, !args.shaping.no_report)
            .filter(is_of_meshes)
            .map(|name| args.output.join(name).display().to_string())
            .collect(),
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

fn tell(args: &Args, summary: &Summary, console: &Console) {
    console.note(format!("{}: {}", args.output.display(), summary.reduction()));
}
