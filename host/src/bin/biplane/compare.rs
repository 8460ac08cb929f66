//! `biplane compare`: how large and how true the raw mesh of a build is, its simplification by others, and the model.

mod folder;
mod table;

use std::io::{self, Write};
use std::path::{Path, PathBuf};

use anyhow::bail;
use biplane::compare::{BothWays, CompareParams, Reference, faces_seen};
use biplane::model::Mesh;
use biplane::rays::Blocked;
use biplane::surface_distance::{Distances, Surface};
use serde::Serialize;

use crate::Outcome;
use crate::console::Console;
use crate::render::{self, ViewName};
use crate::report;
use folder::Built;
pub use folder::{load_built, simplified};

/// What a build without the feature `simplify` says.
pub const NO_SIMPLIFIER: &str =
    "the simplification by others is missing: this program was built without its feature `simplify`";

/// Words of the command.
#[derive(Debug, clap::Args)]
#[command(
    after_help = "qslim: the raw mesh simplified by quadric errors (meshoptimizer) to as many triangles as the model has polygons and \
    leftover triangles.\nblocked: rays of the laser that a surface stops more than the margin before what they really hit."
)]
pub struct Args {
    /// A folder that `biplane build` wrote
    folder: PathBuf,
    /// The true surfaces, in the frame `map` of the recording; without it everything is measured against the raw points
    #[arg(long, value_name = "TRUTH.ply")]
    truth: Option<PathBuf>,
    /// A surface must stand so far before what a ray hit to block it, metres; three standard deviations of the noise are added
    #[arg(long, value_name = "M", default_value_t = CompareParams::default().rays.margin_m, value_parser = margin, allow_hyphen_values = true)]
    margin: f64,
    /// Draw raw mesh, simplification and model with the same camera
    #[arg(long, value_name = "PICTURE.png")]
    pictures: Option<PathBuf>,
    /// Where the pictures look from
    #[arg(long, value_enum, default_value_t = ViewName::Outside)]
    view: ViewName,
    /// Write the build's report.html once more, with these figures in it
    #[arg(long, value_name = "REPORT.html")]
    report: Option<PathBuf>,
    /// Print JSON
    #[arg(long)]
    json: bool,
    /// Replace the picture and the report if they exist
    #[arg(long)]
    force: bool,
}

fn margin(text: &str) -> Result<f64, String> {
    match text.parse::<f64>() {
        Ok(metres) if metres >= 0.0 && metres.is_finite() => Ok(metres),
        _ => Err("expected a length in metres, 0 or more".to_owned()),
    }
}

/// One surface of a build.
#[derive(Clone, Debug, Serialize)]
pub struct Figures {
    /// Triangles of its file.
    pub triangles: usize,
    /// What the paper counts: polygons, and triangles that are part of none.
    pub surfaces: usize,
    /// Polygons with holes that its triangles stand for.
    pub polygons: Option<usize>,
    /// Size of its PLY file.
    pub bytes: u64,
    /// From the surface to the reference: how wrong it is.
    pub to_truth: Distances,
    /// From what was seen of the reference to the surface: what it misses.
    pub from_truth: Distances,
    /// Mean of the two mean distances, metres.
    pub symmetric_mean_m: f64,
    /// Rays of the laser that it blocks wrongly; `None` when the folder does not tell where they began.
    pub rays: Option<Blocked>,
}

/// What `compare` says.
#[derive(Clone, Debug, Serialize)]
pub struct Report {
    /// What distances are measured against: the truth's file, or the raw points.
    pub reference: String,
    /// Faces of the truth that the laser hit, when the truth tells its faces apart (property `plane`).
    pub true_faces_seen: Option<usize>,
    /// The raw mesh.
    pub raw: Figures,
    /// The raw mesh simplified to the model's number of surfaces; `None` without the feature `simplify`.
    pub qslim: Option<Figures>,
    /// The flat surfaces alone.
    pub planes: Figures,
    /// Flat surfaces and leftovers.
    pub model: Figures,
    /// How it was measured.
    pub parameters: CompareParams,
}

/// Runs the command.
pub fn run(args: &Args, console: &Console) -> anyhow::Result<Outcome> {
    let mut parameters = CompareParams::default();
    parameters.rays.margin_m = args.margin;
    let spinner = console.spinner("measuring");
    let report = report(&args.folder, args.truth.as_deref(), &parameters)?;
    drop(spinner);
    let mut out = io::stdout().lock();
    if args.json {
        serde_json::to_writer_pretty(&mut out, &report).map_err(io::Error::from)?;
        writeln!(out)?;
    } else {
        table::print(&mut out, &report)?;
    }
    if report.qslim.is_none() {
        console.note(NO_SIMPLIFIER);
    }
    if let Some(page) = &args.report {
        report::write_compared(&args.folder, page, &report, args.force)?;
    }
    if let Some(picture) = &args.pictures {
        render::run(&render::Args::for_comparison(&args.folder, picture, args.view, args.force), console)?;
    }
    Ok(Outcome::Done)
}

/// Measures the surfaces of a build's folder.
pub fn report(folder: &Path, truth: Option<&Path>, parameters: &CompareParams) -> anyhow::Result<Report> {
    let built = Built::load(folder)?;
    let raw_surface = Surface::new(&built.raw);
    let rays = built.rays(&parameters.rays);
    let (reference, true_faces_seen) = match truth {
        Some(path) => {
            let truth = folder::load(path)?;
            let faces = truth.face_column("plane");
            let seen = faces.map(|faces| faces_seen(parameters, &truth.mesh, faces, &rays));
            (Reference::truth(parameters, &truth.mesh, &raw_surface), seen.filter(|_| !rays.is_empty()))
        }
        None => (Reference::points(parameters, &built.points_m), None),
    };
    let blocked = |surface: &Surface| {
        (!rays.is_empty()).then(|| rays.blocked_by(surface, &parameters.rays, built.sigma_m))
    };
    let figures = |mesh: &Mesh, surface: &Surface, polygons: Option<usize>, bytes: u64| {
        let found: BothWays = reference.measure(mesh, surface);
        Figures {
            triangles: mesh.triangles.len(),
            surfaces: polygons.unwrap_or(mesh.triangles.len()),
            polygons,
            bytes,
            to_truth: found.to_reference,
            from_truth: found.from_reference,
            symmetric_mean_m: found.symmetric_mean_m(),
            rays: blocked(surface),
        }
    };
    let of = |mesh: &Mesh, polygons: Option<usize>, bytes: u64| {
        figures(mesh, &Surface::new(mesh), polygons, bytes)
    };
    let qslim = simplified(&built.raw, built.surfaces());
    let mut model = of(&built.model, Some(built.polygons), built.bytes("model.ply")?);
    model.surfaces = built.surfaces();
    let found = Report {
        reference: truth.map_or_else(|| "raw points".to_owned(), |path| path.display().to_string()),
        true_faces_seen,
        raw: figures(&built.raw, &raw_surface, None, built.bytes("raw.ply")?),
        qslim: qslim.map(|mesh| of(&mesh, None, folder::ply_bytes(&mesh))),
        planes: of(&built.planes, Some(built.polygons), built.bytes("planes.ply")?),
        model,
        parameters: parameters.clone(),
    };
    if found.raw.to_truth.samples == 0 {
        bail!("{}: the raw mesh has no area", folder.display());
    }
    Ok(found)
}
