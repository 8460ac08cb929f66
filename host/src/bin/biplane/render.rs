//! `biplane render`: a picture of a build, raw mesh beside the model.

use std::fs::{self, File};
use std::io::BufReader;
use std::path::{Path, PathBuf};

use anyhow::{Context, bail};
use biplane::deskew::StampedPose;
use biplane::model::Mesh;
use biplane::output::{check_free, write_file};
use biplane::palette;
use biplane::ply_read::{self, Ply};
use biplane::render::Picture;
use biplane::render::raster::{Style, draw};
use biplane::render::scene::Scene;
use biplane::render::views::{Bounds, View, aspect, camera};
use biplane::trajectory::read_tum;
use clap::ValueEnum;

use crate::Outcome;
use crate::console::Console;

/// Pixels between two pictures.
const GAP: usize = 16;

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
}

/// Runs the command.
pub fn run(args: &Args, console: &Console) -> anyhow::Result<Outcome> {
    check_free(&args.output, args.force)?;
    let spinner = console.spinner("drawing");
    let view = match args.view {
        ViewName::Outside => View::Outside,
        ViewName::Inside => View::Inside,
        ViewName::Top => View::Top,
    };
    let model = model_scene(&load(&args.folder.join("model.ply"))?);
    let raw = if args.what == What::Model {
        None
    } else {
        Some(raw_scene(&load(&args.folder.join("raw.ply"))?.mesh))
    };
    let Some(bounds) = Bounds::of_most(model.points_m()) else {
        bail!("{} holds no triangle to draw", args.folder.join("model.ply").display())
    };
    let poses = poses_of(&args.folder)?;
    let scenes: Vec<&Scene> = match (&raw, args.what) {
        (Some(raw), What::Raw) => vec![raw],
        (Some(raw), What::Both) => vec![raw, &model],
        _ => vec![&model],
    };
    let picture = compose(&scenes, args, view, &bounds, &poses);
    write_file(&args.output, args.force, |out| picture.write_png(out))?;
    drop(spinner);
    console.note(format!("{}: {} x {} pixels", args.output.display(), picture.width, picture.height));
    Ok(Outcome::Done)
}

/// Draws each scene with the same camera; wide scenes one above the other, others side by side.
fn compose(scenes: &[&Scene], args: &Args, view: View, bounds: &Bounds, poses: &[StampedPose]) -> Picture {
    let width = args.width as usize;
    let shape = aspect(view, bounds).clamp(0.2, 1.2) * 1.04;
    let beside = scenes.len() > 1 && shape > 0.55;
    let scene_width = if beside { (width - GAP) / 2 } else { width };
    let scene_height =
        args.height.map_or((scene_width as f64 * shape) as usize, |height| height as usize).max(1);
    let camera = camera(view, bounds, scene_height as f64 / scene_width as f64, poses);
    let style = Style { cull_backs: view != View::Inside };
    let count = scenes.len();
    let size = if beside { [width, scene_height] } else { [width, count * scene_height + (count - 1) * GAP] };
    let mut picture = Picture::blank(size[0], size[1]);
    for (index, scene) in scenes.iter().enumerate() {
        let drawn = draw(scene, &camera, [scene_width, scene_height], style);
        let (left, top) =
            if beside { (index * (scene_width + GAP), 0) } else { (0, index * (scene_height + GAP)) };
        picture.put(&drawn, left, top);
    }
    picture
}

fn load(path: &Path) -> anyhow::Result<Ply> {
    let bytes = fs::read(path).with_context(|| format!("cannot read {}", path.display()))?;
    ply_read::read(&bytes).with_context(|| format!("cannot read {}", path.display()))
}

fn poses_of(folder: &Path) -> anyhow::Result<Vec<StampedPose>> {
    let path = folder.join("trajectory.tum");
    let file = File::open(&path).with_context(|| format!("cannot read {}", path.display()))?;
    read_tum(BufReader::new(file)).with_context(|| format!("cannot read {}", path.display()))
}

fn raw_scene(mesh: &Mesh) -> Scene {
    let mut scene = Scene::default();
    scene.add_mesh(mesh, |_| palette::RAW);
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
