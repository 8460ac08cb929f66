//! `biplane render`: a picture of a build, raw mesh beside the model, and what others make of it between
//! them.

use std::fs::{self, File};
use std::io::BufReader;
use std::path::{Path, PathBuf};

use crate::formats::output::{OutputError, check_free, check_not_input, write_file};
use crate::formats::ply::read::Ply;
use crate::formats::text::trajectory::read_poses;
use crate::model::Mesh;
use crate::reconstruct::simplify::fewer;
use crate::recordings::deskew::StampedPose;
use crate::view::render::scene::Scene;
use crate::view::render::sheet::{Scope, SheetSize, Subject, compose, grouped, grouped_count, noisy_scene};
use crate::view::render::views::{Extent, View, camera, inside_at};
use anyhow::{Context, bail};
use clap::ValueEnum;
use serde::Serialize;

use crate::cli::terminal::console::Console;
use crate::cli::terminal::json::print_json;
use crate::cli::terminal::threads::Threads;
use crate::cli::view::built::load_built;
use biplane_cli::Outcome;

/// Words of the command.
#[derive(Clone, Debug, clap::Args)]
#[command(after_help = "Example:\n  biplane render model -o picture.png --view inside")]
pub(crate) struct Args {
    /// A folder that `biplane build` wrote
    folder: PathBuf,
    /// The picture to write
    #[arg(long, short, value_name = "PICTURE.png", value_parser = picture_path)]
    output: PathBuf,
    /// Where to look from
    #[arg(long, value_enum, default_value_t = ViewName::Outside)]
    view: ViewName,
    /// With `--view inside`: where on the robot's way to stand, in percent of its length, looking ahead
    /// [default: where most is seen]
    #[arg(long, value_name = "PERCENT", value_parser = percent)]
    at: Option<f64>,
    /// What to show
    #[arg(long, value_enum, default_value_t = What::Both)]
    what: What,
    /// Width of the picture in pixels
    #[arg(long, value_name = "PIXELS", default_value_t = 1600, value_parser = clap::value_parser!(u32).range(64..=16384))]
    width: u32,
    /// Height of each scene in pixels [default: what the scene needs]
    #[arg(long, value_name = "PIXELS", value_parser = clap::value_parser!(u32).range(64..=16384))]
    height: Option<u32>,
    /// Replace the picture if it exists
    #[arg(long)]
    force: bool,
    /// Print JSON
    #[arg(long)]
    json: bool,
}

/// What `--json` prints.
#[derive(Serialize)]
struct Drawn {
    /// The picture.
    output: String,
    /// Its size in pixels.
    width: usize,
    height: usize,
}

/// Names of the camera presets.
#[derive(Clone, Copy, Debug, ValueEnum)]
pub(crate) enum ViewName {
    /// From outside, into the rooms
    Outside,
    /// From where the robot drove
    Inside,
    /// From above, as a plan
    Top,
}

#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
enum What {
    /// The raw mesh
    Raw,
    /// The model: flat surfaces and what is left over
    #[value(alias = "compact")]
    Model,
    /// The flat surfaces alone
    Planes,
    /// The raw mesh beside the model
    Both,
    /// Raw mesh, its simplification by others to as many triangles as the model has surfaces, and the model
    All,
}

impl Args {
    /// Raw mesh beside model, as the command line would ask for it.
    #[cfg(feature = "demo")]
    pub(crate) fn for_build(folder: &Path, output: &Path, view: ViewName) -> Self {
        Self {
            folder: folder.to_owned(),
            output: output.to_owned(),
            view,
            at: None,
            what: What::Both,
            width: 1600,
            height: None,
            force: false,
            json: false,
        }
    }

    /// Raw mesh, simplification and model side by side, for `compare`.
    pub(crate) fn for_comparison(folder: &Path, output: &Path, view: ViewName, force: bool) -> Self {
        Self {
            folder: folder.to_owned(),
            output: output.to_owned(),
            view,
            at: None,
            what: What::All,
            width: 2400,
            height: None,
            force,
            json: false,
        }
    }
}

impl Args {
    /// Whether the picture may be written: it replaces nothing unasked, and nothing of the model at all.
    pub(crate) fn check(&self) -> Result<(), OutputError> {
        for name in ["model.ply", "planes.ply", "raw.ply", "trajectory.tum"] {
            check_not_input(&self.output, ".part", &self.folder.join(name))?;
        }
        check_free(&self.output, self.force)
    }
}

fn percent(text: &str) -> Result<f64, String> {
    match text.parse::<f64>() {
        Ok(percent) if (0.0..=100.0).contains(&percent) => Ok(percent),
        _ => Err("expected a number from 0 to 100".to_owned()),
    }
}

/// A picture is a PNG, whatever its name says.
fn picture_path(text: &str) -> Result<PathBuf, String> {
    let path = PathBuf::from(text);
    // A device or a pipe has no such ending.
    let is_png = path.extension().is_none_or(|extension| extension.eq_ignore_ascii_case("png"));
    if is_png { Ok(path) } else { Err("the picture is a PNG: expected a name that ends in .png".to_owned()) }
}

/// Runs the command.
pub(crate) fn run(args: &Args, console: &Console) -> anyhow::Result<Outcome> {
    Threads::default().take()?;
    if args.at.is_some() && !matches!(args.view, ViewName::Inside) {
        bail!("--at goes with --view inside");
    }
    args.check()?;
    let spinner = console.spinner("drawing");
    let view = match args.view {
        ViewName::Outside => View::Outside,
        ViewName::Inside => View::Inside,
        ViewName::Top => View::Top,
    };
    let model = load_built(&args.folder, if args.what == What::Planes { "planes.ply" } else { "model.ply" })?;
    let raw_mesh = load_built(&args.folder, "raw.ply")?.mesh;
    let raw = noisy_scene(&raw_mesh);
    // The raw points are spread evenly over what was seen, a model's corners are not.
    let Some(extent) = Extent::of(view, &raw) else {
        bail!("{} holds no triangle to draw", args.folder.join("raw.ply").display())
    };
    let poses = poses_of(&args.folder)?;
    let raw =
        Subject { caption: format!("raw mesh: {}", grouped_count(raw.facets.len(), "triangle")), scene: raw };
    let model = Subject { caption: model_caption(args, &model), scene: model_scene(&model) };
    let simple = match args.what {
        What::All => Some(simple_subject(&args.folder, &raw_mesh)?),
        _ => None,
    };
    let subjects: Vec<&Subject> = match args.what {
        What::Raw => vec![&raw],
        What::Model | What::Planes => vec![&model],
        What::Both | What::All => [Some(&raw), simple.as_ref(), Some(&model)].into_iter().flatten().collect(),
    };
    let at_percent = args.at.and_then(|percent| inside_at(&poses, percent / 100.0));
    if args.at.is_some() && at_percent.is_none() {
        bail!("{} has no trajectory to stand on", args.folder.display());
    }
    let extent = extent.with_surfaces(view, &model.scene);
    let camera =
        |shape: f64| at_percent.unwrap_or_else(|| camera(view, &model.scene, &extent, shape, &poses));
    let size =
        SheetSize { width: args.width as usize, scene_height: args.height.map(|height| height as usize) };
    let picture = compose(&subjects, size, Scope { view, extent: &extent }, camera);
    write_file(&args.output, args.force, |out| picture.write_png(out))?;
    drop(spinner);
    let output = args.output.display().to_string();
    let drawn = Drawn { output, width: picture.width, height: picture.height };
    if args.json {
        print_json(&drawn)?;
    } else {
        console.note(format!("{}: {} x {} pixels", drawn.output, drawn.width, drawn.height));
    }
    Ok(Outcome::Done)
}

/// The raw mesh as others simplify it to as many triangles as the model has surfaces.
fn simple_subject(folder: &Path, raw: &Mesh) -> anyhow::Result<Subject> {
    let (polygons, leftovers) =
        surfaces(folder).with_context(|| format!("{}: no figures in summary.json", folder.display()))?;
    let mesh = fewer::to_count(raw, polygons + leftovers);
    let caption = format!("QSlim-like: {}", grouped_count(mesh.triangles.len(), "triangle"));
    Ok(Subject { caption, scene: noisy_scene(&mesh) })
}

/// Polygons and leftover triangles of a build, as its summary says.
fn surfaces(folder: &Path) -> Option<(usize, usize)> {
    let text = fs::read(folder.join("summary.json")).ok()?;
    let summary: serde_json::Value = serde_json::from_slice(&text).ok()?;
    let count = |key: &str| summary.get(key)?.as_u64()?.try_into().ok();
    Some((count("polygons")?, count("leftover_triangles")?))
}

fn model_caption(args: &Args, model: &Ply) -> String {
    match surfaces(&args.folder) {
        Some((polygons, _)) if args.what == What::Planes => format!("flat surfaces: {}", grouped(polygons)),
        Some((polygons, leftovers)) => {
            let [polygons, leftovers] = [(polygons, "polygon"), (leftovers, "triangle")]
                .map(|(count, noun)| grouped_count(count, noun));
            format!("model: {polygons} + {leftovers}")
        }
        None => format!("model: {}", grouped_count(model.mesh.triangles.len(), "triangle")),
    }
}

/// The trajectory of a build; none in a folder of `compact`.
fn poses_of(folder: &Path) -> anyhow::Result<Vec<StampedPose>> {
    let path = folder.join("trajectory.tum");
    if !path.exists() {
        return Ok(Vec::new());
    }
    let file = File::open(&path).with_context(|| format!("cannot read {}", path.display()))?;
    read_poses(BufReader::new(file)).with_context(|| format!("cannot read {}", path.display()))
}

/// The model in the colors of its file, with lines around its flat surfaces.
fn model_scene(ply: &Ply) -> Scene {
    let channels = ["red", "green", "blue"].map(|name| ply.vertex_column(name));
    let color = |triangle: usize| {
        let vertex = ply.mesh.triangles[triangle][0] as usize;
        channels
            .map(|channel| channel.and_then(|values| values.get(vertex)).map_or(200, |&value| value as u8))
    };
    let planes = ply.face_column("plane");
    let plane =
        |triangle: usize| planes.and_then(|planes| planes.get(triangle)).map_or(-1, |&plane| plane as i64);
    let mut scene = Scene::default();
    scene.add_mesh(&ply.mesh, color);
    scene.add_borders(&ply.mesh, |triangle| Some(plane(triangle)).filter(|plane| *plane >= 0));
    scene
}

#[cfg(test)]
mod tests {
    use super::picture_path;

    #[test]
    fn a_picture_is_a_png_and_its_name_does_not_say_otherwise() {
        for name in ["a.png", "a.PNG", "/dev/null", "out"] {
            assert!(picture_path(name).is_ok(), "{name}");
        }
        for name in ["a.jpg", "a.svg", "a.png.gif"] {
            assert!(picture_path(name).is_err(), "{name}");
        }
    }
}
