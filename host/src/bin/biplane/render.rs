//! `biplane render`: a picture of a build, raw mesh beside the model, and what others make of it between them.

use std::fs::{self, File};
use std::io::BufReader;
use std::path::{Path, PathBuf};

use anyhow::{Context, bail};
use biplane::deskew::StampedPose;
use biplane::model::Mesh;
use biplane::output::{check_free, check_not_input, write_file};
use biplane::palette;
use biplane::ply_read::Ply;
use biplane::render::Picture;
use biplane::render::camera::Camera;
use biplane::render::font;
use biplane::render::raster::{Style, draw};
use biplane::render::scene::Scene;
use biplane::render::views::{Extent, View, aspect, camera};
use biplane::trajectory::read_poses;
use clap::ValueEnum;

use crate::Outcome;
use crate::compare::{NO_SIMPLIFIER, load, simplified};
use crate::console::Console;

/// Pixels between two pictures.
const GAP: usize = 16;
const CAPTION: palette::Rgb = [70, 74, 84];

/// Words of the command.
#[derive(Clone, Debug, clap::Args)]
pub struct Args {
    /// A folder that `biplane build` wrote
    folder: PathBuf,
    /// The picture to write
    #[arg(long, short, value_name = "PICTURE.png")]
    output: PathBuf,
    /// Where to look from
    #[arg(long, value_enum, default_value_t = ViewName::Outside)]
    view: ViewName,
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
}

/// Names of the camera presets.
#[derive(Clone, Copy, Debug, ValueEnum)]
pub enum ViewName {
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
    /// The model
    Model,
    /// The raw mesh beside the model
    Both,
    /// Raw mesh, its simplification by others to as many triangles as the model has surfaces, and the model
    All,
}

impl Args {
    /// Raw mesh beside model, as the command line would ask for it.
    #[cfg(feature = "demo")]
    pub fn for_build(folder: &Path, output: &Path, view: ViewName) -> Self {
        Self {
            folder: folder.to_owned(),
            output: output.to_owned(),
            view,
            what: What::Both,
            width: 1600,
            height: None,
            force: false,
        }
    }

    /// Raw mesh, simplification and model side by side, for `compare`.
    pub fn for_comparison(folder: &Path, output: &Path, view: ViewName, force: bool) -> Self {
        Self {
            folder: folder.to_owned(),
            output: output.to_owned(),
            view,
            what: What::All,
            width: 2400,
            height: None,
            force,
        }
    }
}

/// Runs the command.
pub fn run(args: &Args, console: &Console) -> anyhow::Result<Outcome> {
    for name in ["model.ply", "raw.ply", "trajectory.tum"] {
        check_not_input(&args.output, ".part", &args.folder.join(name))?;
    }
    check_free(&args.output, args.force)?;
    let spinner = console.spinner("drawing");
    let view = match args.view {
        ViewName::Outside => View::Outside,
        ViewName::Inside => View::Inside,
        ViewName::Top => View::Top,
    };
    let model = load(&args.folder.join("model.ply"))?;
    let raw_mesh = load(&args.folder.join("raw.ply"))?.mesh;
    let raw = raw_scene(&raw_mesh);
    // The raw points are spread evenly over what was seen, a model's corners are not.
    let Some(extent) = Extent::of(view, &raw) else {
        bail!("{} holds no triangle to draw", args.folder.join("raw.ply").display())
    };
    let poses = poses_of(&args.folder)?;
    let raw = Subject { caption: format!("raw mesh: {} triangles", grouped(raw.facets.len())), scene: raw };
    let model = Subject { caption: model_caption(&args.folder, &model), scene: model_scene(&model) };
    let simple = if args.what == What::All { simple_subject(&args.folder, &raw_mesh)? } else { None };
    if args.what == What::All && simple.is_none() {
        console.note(NO_SIMPLIFIER);
    }
    let subjects: Vec<&Subject> = match args.what {
        What::Raw => vec![&raw],
        What::Model => vec![&model],
        What::Both | What::All => [Some(&raw), simple.as_ref(), Some(&model)].into_iter().flatten().collect(),
    };
    let camera = |shape: f64| camera(view, &model.scene, &extent, shape, &poses);
    let picture = compose(&subjects, args, (view, &extent), camera);
    write_file(&args.output, args.force, |out| picture.write_png(out))?;
    drop(spinner);
    console.note(format!("{}: {} x {} pixels", args.output.display(), picture.width, picture.height));
    Ok(Outcome::Done)
}

/// A scene with what is said of it.
struct Subject {
    scene: Scene,
    caption: String,
}

/// The raw mesh as others simplify it to as many triangles as the model has surfaces; `None` when this program has no simplifier.
fn simple_subject(folder: &Path, raw: &Mesh) -> anyhow::Result<Option<Subject>> {
    let (polygons, leftovers) =
        surfaces(folder).with_context(|| format!("{}: no figures in summary.json", folder.display()))?;
    Ok(simplified(raw, polygons + leftovers).map(|mesh| Subject {
        caption: format!("QSlim-like: {} triangles", grouped(mesh.triangles.len())),
        scene: raw_scene(&mesh),
    }))
}

/// 159114 as 159,114.
fn grouped(number: usize) -> String {
    let digits = number.to_string();
    let mut text = String::new();
    for (index, digit) in digits.chars().enumerate() {
        if index > 0 && (digits.len() - index).is_multiple_of(3) {
            text.push(',');
        }
        text.push(digit);
    }
    text
}

/// Polygons and leftover triangles of a build, as its summary says.
fn surfaces(folder: &Path) -> Option<(usize, usize)> {
    let text = fs::read(folder.join("summary.json")).ok()?;
    let summary: serde_json::Value = serde_json::from_slice(&text).ok()?;
    let count = |key: &str| summary.get(key)?.as_u64()?.try_into().ok();
    Some((count("polygons")?, count("leftover_triangles")?))
}

fn model_caption(folder: &Path, model: &Ply) -> String {
    match surfaces(folder) {
        Some((polygons, leftovers)) => {
            format!("model: {} polygons + {} triangles", grouped(polygons), grouped(leftovers))
        }
        None => format!("model: {} triangles", grouped(model.mesh.triangles.len())),
    }
}

/// Draws each scene with the same camera; wide scenes one above the other, others side by side.
fn compose(
    subjects: &[&Subject],
    args: &Args,
    (view, extent): (View, &Extent),
    camera: impl Fn(f64) -> Camera,
) -> Picture {
    let (width, count) = (args.width as usize, subjects.len());
    let shape = aspect(view, extent).clamp(0.2, 1.2) * 1.04;
    let beside = count > 1 && shape > 0.5;
    let scene_width = if beside { (width - (count - 1) * GAP) / count } else { width };
    let scene_height =
        args.height.map_or((scene_width as f64 * shape) as usize, |height| height as usize).max(1);
    let dot = (scene_width / 360).clamp(1, 3);
    let caption_height = (font::HEIGHT + 8) * dot;
    let cell_height = scene_height + caption_height;
    let height = if beside { cell_height } else { count * cell_height + (count - 1) * GAP };
    let camera = camera(scene_height as f64 / scene_width as f64);
    let style = Style { cull_backs: view != View::Inside };
    let mut picture = Picture::blank(width, height);
    for (index, subject) in subjects.iter().enumerate() {
        let drawn = draw(&subject.scene, &camera, [scene_width, scene_height], style);
        let (left, top) =
            if beside { (index * (scene_width + GAP), 0) } else { (0, index * (cell_height + GAP)) };
        picture.put(&drawn, left, top + caption_height);
        picture.write_text(&subject.caption, [left + 6 * dot, top + 4 * dot], dot, CAPTION);
    }
    picture
}

fn poses_of(folder: &Path) -> anyhow::Result<Vec<StampedPose>> {
    let path = folder.join("trajectory.tum");
    let file = File::open(&path).with_context(|| format!("cannot read {}", path.display()))?;
    read_poses(BufReader::new(file)).with_context(|| format!("cannot read {}", path.display()))
}

fn raw_scene(mesh: &Mesh) -> Scene {
    let mut scene = Scene::default();
    scene.add_noisy_mesh(mesh, palette::RAW);
    scene
}

/// The model in the colours of its file, with lines around its flat surfaces.
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
