//! `biplane compare`: how large and how true the raw mesh of a build is, its simplification by others, and
//! the model.

mod building;
mod equal;
mod figures;
mod page;
mod table;

use std::io::{self, Write};
use std::path::{Path, PathBuf};

use crate::formats::output::{check_free, check_not_input};
use crate::metrics::building::Frames;
use crate::metrics::compare::{BothWays, CompareParams, Reference, faces_seen};
use crate::metrics::surface_distance::Surface;
use crate::model::Mesh;
use crate::reconstruct::simplify::fewer;
use anyhow::bail;

use crate::cli::terminal::console::Console;
use crate::cli::terminal::threads::Threads;
use crate::cli::view::built;
use crate::cli::view::built::Built;
use crate::cli::view::render;
use crate::cli::view::render::ViewName;
use biplane_cli::Outcome;
use biplane_recording::mcap::write::check_apart;

pub(crate) use self::figures::Report;
use self::figures::{Equal, Figures};
pub(crate) use self::page::write_compared;

/// Words of the command.
#[derive(Debug, clap::Args)]
#[command(
    after_help = "Examples:\n  biplane compare model\n  biplane compare model --truth truth/surfaces.ply\n  biplane compare model --building truth/truth.json --json\n  biplane compare model --ifc house.ifc --storey 0\n  biplane compare model --ifc house.ifc --storey 1 --model-storey S2\n  \
    biplane compare model --truth truth/surfaces.ply --equal triangles,bytes,rms\n\n\
    qslim: the raw mesh simplified by quadric errors (Garland and Heckbert 1997) to as many triangles as the model has polygons and \
    leftover triangles.\nblocked: rays of the laser that a surface stops more than the margin before what they really hit."
)]
pub(crate) struct Args {
    /// A folder that `biplane build` wrote
    folder: PathBuf,
    /// The true surfaces, in the frame `map` of the recording; without it everything is measured against the
    /// raw points
    #[arg(long, value_name = "TRUTH.ply")]
    truth: Option<PathBuf>,
    /// The true rooms, walls and openings, in the schema of building.json and in the frame `map` of the
    /// recording: prints how well the building was found, and nothing about surfaces. A drive through an IFC
    /// file (`biplane-mock simulate --world HOUSE.ifc`) has such a truth.json; that of a built-in world has
    /// no rooms. The building.json of another model is taken, too
    #[arg(long, value_name = "TRUTH.json", group = "true_building", conflicts_with_all = ["truth", "margin", "pictures", "view", "report", "force"])]
    building: Option<PathBuf>,
    /// The same against a storey of an IFC file, which may lie anywhere: the place where the rooms agree is
    /// searched for
    #[arg(long, value_name = "TRUTH.ifc", group = "true_building", conflicts_with_all = ["building", "truth", "margin", "pictures", "view", "report", "force"])]
    ifc: Option<PathBuf>,
    /// The storey of the IFC file, counted from 0 at the lowest
    #[arg(long, value_name = "N", requires = "ifc", default_value_t = 0)]
    storey: usize,
    /// The storey of the model, by its name in building.json: needed where it has several
    #[arg(long, value_name = "S1", requires = "true_building")]
    model_storey: Option<String>,
    /// Also simplify the raw mesh until it equals the model in this, and measure it: several are separated by
    /// commas
    #[arg(long, value_enum, value_delimiter = ',', value_name = "WHAT")]
    equal: Vec<Equal>,
    /// A surface must stand so far before what a ray hit to block it, meters; three standard deviations of
    /// the noise are added
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
        Ok(meters) if meters >= 0.0 && meters.is_finite() => Ok(meters),
        _ => Err("expected a length in meters, 0 or more".to_owned()),
    }
}

/// Runs the command.
pub(crate) fn run(args: &Args, console: &Console) -> anyhow::Result<Outcome> {
    Threads::default().take()?;
    if args.building.is_some() || args.ifc.is_some() {
        return compare_building(args, console);
    }
    let picture = args
        .pictures
        .as_ref()
        .map(|picture| render::Args::for_comparison(&args.folder, picture, args.view, args.force));
    check_outputs(args, picture.as_ref())?;
    let mut parameters = CompareParams::default();
    parameters.rays.margin_m = args.margin;
    let spinner = console.spinner("measuring");
    let report = report(&args.folder, args.truth.as_deref(), &parameters, &args.equal)?;
    drop(spinner);
    let mut out = io::stdout().lock();
    if args.json {
        serde_json::to_writer_pretty(&mut out, &report).map_err(io::Error::from)?;
        writeln!(out)?;
    } else {
        table::print(&mut out, &report)?;
    }
    if args.truth.is_some() {
        report.other_frame().into_iter().for_each(|words| console.warn(words));
    }
    if let Some(page) = &args.report {
        write_compared(&args.folder, page, &report, args.force)?;
    }
    if let Some(picture) = &picture {
        render::run(picture, console)?;
    }
    Ok(Outcome::Done)
}

/// Looks before anything is measured: picture and report are two files, replace none unasked, and the truth
/// not at all.
fn check_outputs(args: &Args, picture: Option<&render::Args>) -> anyhow::Result<()> {
    let outputs: Vec<&Path> = args.pictures.iter().chain(&args.report).map(PathBuf::as_path).collect();
    check_apart(&outputs)?;
    for output in outputs {
        args.truth.iter().try_for_each(|truth| check_not_input(output, ".part", truth))?;
        check_free(output, args.force)?;
    }
    Ok(picture.map_or(Ok(()), render::Args::check)?)
}

/// Compares the building of a folder with the true one.
fn compare_building(args: &Args, console: &Console) -> anyhow::Result<Outcome> {
    let (truth, path, frames) = match (&args.building, &args.ifc) {
        (Some(path), _) => (building::read_truth(path)?, path, Frames::Same),
        (None, Some(path)) => (building::read_ifc(path, args.storey)?, path, Frames::Unknown),
        (None, None) => bail!("no true building was given"),
    };
    let mut figures = building::figures(&args.folder, &truth, args.model_storey.as_deref(), frames)?;
    figures.reference = path.display().to_string();
    let mut out = io::stdout().lock();
    if args.json {
        serde_json::to_writer_pretty(&mut out, &figures).map_err(io::Error::from)?;
        writeln!(out)?;
    } else {
        building::print(&mut out, &figures)?;
    }
    // An IFC file may lie anywhere: there the place was searched for.
    if frames == Frames::Same && figures.rooms.merged.matched == 0 {
        console.warn(format!(
            "biplane: no room lies where one of {} does: is that in the frame `map` of the recording, and in meters?",
            figures.reference
        ));
    }
    Ok(Outcome::Done)
}

/// Measures the surfaces of a build's folder.
pub(crate) fn report(
    folder: &Path,
    truth: Option<&Path>,
    parameters: &CompareParams,
    equal: &[Equal],
) -> anyhow::Result<Report> {
    let built = Built::load(folder)?;
    let raw_surface = Surface::new(&built.raw);
    let rays = built.rays(&parameters.rays);
    let (reference, true_faces_seen) = match truth {
        Some(path) => {
            let truth = built::load(path)?;
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
    let qslim = fewer::to_count(&built.raw, built.surfaces());
    let mut model = of(&built.model, Some(built.polygons), built.bytes("model.ply")?);
    model.surfaces = built.surfaces();
    let measured = |mesh: &Mesh| of(mesh, None, built::ply_bytes(mesh));
    let equal = equal.iter().map(|&equal| equal::simplified(&built.raw, &model, equal, measured)).collect();
    let found = Report {
        reference: truth.map_or_else(|| "raw points".to_owned(), |path| path.display().to_string()),
        true_faces_seen,
        raw: figures(&built.raw, &raw_surface, None, built.bytes("raw.ply")?),
        raw_triangles_of_all_passes: built.raw_triangles,
        qslim: measured(&qslim),
        equal,
        planes: of(&built.planes, Some(built.polygons), built.bytes("planes.ply")?),
        model,
        parameters: parameters.clone(),
    };
    if found.raw.to_truth.samples == 0 {
        bail!("{}: the raw mesh has no area", folder.display());
    }
    Ok(found)
}
