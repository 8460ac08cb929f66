//! The figures of a building: `compare --building` and `compare --ifc`.

use std::fs::{self, File};
use std::io::{self, BufReader, Write};
use std::path::Path;

use anyhow::{Context, anyhow, bail};
use biplane_ifc::Ifc;
use biplane_recording::file_kind::describe;

use crate::cli::view::built::check_folder;
use crate::formats::text::trajectory::read_poses;
use crate::metrics::building::plan::Plan;
use crate::metrics::building::{BuildingFigures, Errors, Found, Frames, measure};

/// What a build says of the building.
const NAME: &str = "building.json";

/// Compares the building of a folder, or one storey of it, with the truth.
pub(super) fn figures(
    folder: &Path,
    truth: &Plan,
    storey: Option<&str>,
    frames: Frames,
) -> anyhow::Result<BuildingFigures> {
    check_folder(folder)?;
    let path = folder.join(NAME);
    if !path.exists() {
        bail!("{} does not exist: is {} a folder of `biplane build`?", path.display(), folder.display());
    }
    let all = read(&path)?;
    let model = of_storey(&all, storey).with_context(|| format!("cannot compare {}", path.display()))?;
    if model.rooms.is_empty() {
        bail!("{} has no rooms to compare", path.display());
    }
    // A truth of one storey is that one, whatever its name.
    let truth = if truth.storeys.len() > 1 { &of_storey(truth, storey).context("the truth")? } else { truth };
    let way: Vec<[f64; 2]> =
        way(folder)?.iter().filter(|p| model.is_at(p[2], &all.storeys)).map(|p| [p[0], p[1]]).collect();
    let Some(found) = measure(truth, &model, &way, frames) else {
        bail!("nowhere do the rooms of {} agree with those of the truth", path.display());
    };
    Ok(found)
}

/// The storey of a plan that is asked for; all of it where there is one.
fn of_storey(plan: &Plan, name: Option<&str>) -> anyhow::Result<Plan> {
    let names = || plan.storeys.iter().map(|storey| storey.id.as_str()).collect::<Vec<_>>().join(", ");
    match name {
        Some(name) => {
            plan.storey(name).with_context(|| format!("there is no storey {name}, but {}", names()))
        }
        None if plan.storeys.len() > 1 => {
            bail!("it has the storeys {}: say which one with --model-storey", names())
        }
        None => Ok(plan.clone()),
    }
}

/// Reads a file in the schema of `building.json`.
pub(super) fn read(path: &Path) -> anyhow::Result<Plan> {
    let text = fs::read(path).with_context(|| format!("cannot read {}", path.display()))?;
    serde_json::from_slice(&text)
        .map_err(|why| anyhow!("{} {}, and no building as JSON: {why}", path.display(), describe(&text)))
}

/// Reads the true building.
pub(super) fn read_truth(path: &Path) -> anyhow::Result<Plan> {
    let truth = read(path)?;
    if truth.rooms.is_empty() {
        bail!(
            "{} has no rooms to compare with: expected a file in the schema of building.json (docs/building.md). \
             The truth.json of a built-in world of `biplane-mock simulate` lists no rooms, that of an IFC file does",
            path.display()
        );
    }
    Ok(truth)
}

/// Reads the plan of a storey of an IFC file, in the file's own frame.
pub(super) fn read_ifc(path: &Path, storey: usize) -> anyhow::Result<Plan> {
    let bytes = fs::read(path).with_context(|| format!("cannot read {}", path.display()))?;
    let failed = || format!("cannot read {}", path.display());
    let ifc = Ifc::read(&bytes).with_context(failed)?;
    let plan = ifc.plan(storey, &ifc.elements().0).with_context(failed)?;
    // Both are the schema of building.json.
    serde_json::to_value(&plan).and_then(serde_json::from_value).with_context(failed)
}

/// Where the robot was; nothing where the folder does not say.
fn way(folder: &Path) -> anyhow::Result<Vec<[f64; 3]>> {
    let path = folder.join("trajectory.tum");
    if !path.exists() {
        return Ok(Vec::new());
    }
    let file = File::open(&path).with_context(|| format!("cannot read {}", path.display()))?;
    let poses =
        read_poses(BufReader::new(file)).with_context(|| format!("cannot read {}", path.display()))?;
    Ok(poses.iter().map(|pose| [pose.x_m, pose.y_m, pose.z_m]).collect())
}

/// Prints the figures.
pub(super) fn print(out: &mut impl Write, figures: &BuildingFigures) -> io::Result<()> {
    let [x, y, turn] = figures.truth_from_model;
    writeln!(out, "building against {}", figures.reference)?;
    writeln!(out, "laid on it by {:.3} m, {:.3} m, {turn:.3} degrees\n", x, y)?;
    writeln!(
        out,
        "{:<24} {:>5} {:>6} {:>8}   {:>9} {:>6} {:>5}",
        "", "true", "model", "matched", "precision", "recall", "F1"
    )?;
    let (rooms, openings) = (&figures.rooms, &figures.openings);
    let rows = [
        ("rooms, as drawn", &rooms.as_drawn),
        ("rooms, open ones merged", &rooms.merged),
        ("doors and passages", &openings.doors),
        ("windows", &openings.windows),
        ("rooms joined by doors", &figures.room_graph),
        ("columns", &figures.columns),
    ];
    for (name, found) in rows {
        row(out, name, found)?;
    }
    let walls = &figures.walls;
    writeln!(
        out,
        "walls over 1 m: {} of {} found by their footprint ({} of {} between rooms), {} of {} by a face",
        walls.found, walls.truth, walls.found_inner, walls.true_inner, walls.traced, walls.truth
    )?;
    writeln!(
        out,
        "walls of any length: {} in the model, {:.2} for each true one",
        walls.model, walls.model_per_true
    )?;
    writeln!(
        out,
        "thicknesses: {} stated, {} of them wrong by more than 2 cm",
        walls.thickness_stated, walls.thickness_wrong
    )?;
    let surfaces = &figures.surfaces;
    writeln!(
        out,
        "surfaces of walls at 10 cm: completeness {:.3}, correctness {:.3}, accuracy {}",
        surfaces.completeness,
        surfaces.correctness,
        surfaces.accuracy_m.map_or_else(|| "-".to_owned(), |median| format!("{:.1} cm", 100.0 * median))
    )?;
    writeln!(out, "\n{:<24} {:>5} {:>8} {:>8}", "errors", "count", "median", "worst")?;
    let errors = [
        ("area of rooms, %", &rooms.area_error),
        ("height of rooms, cm", &rooms.height_error_m),
        ("thickness, cm", &walls.thickness_error_m),
        ("width of openings, cm", &openings.width_error_m),
        ("height of openings, cm", &openings.height_error_m),
        ("sill of windows, cm", &openings.sill_error_m),
    ];
    for (name, found) in errors {
        error(out, name, found)?;
    }
    Ok(())
}

fn row(out: &mut impl Write, name: &str, found: &Found) -> io::Result<()> {
    writeln!(
        out,
        "{name:<24} {:>5} {:>6} {:>8}   {:>9.2} {:>6.2} {:>5.2}",
        found.truth, found.model, found.matched, found.precision, found.recall, found.f1
    )
}

fn error(out: &mut impl Write, name: &str, errors: &Errors) -> io::Result<()> {
    let number = |value: Option<f64>| value.map_or_else(|| "-".to_owned(), |v| format!("{:.2}", 100.0 * v));
    writeln!(out, "{name:<24} {:>5} {:>8} {:>8}", errors.count, number(errors.median), number(errors.worst))
}
