//! `biplane demo`: the whole chain with no hardware, in one program.
//!
//! Mock lasers and a mock base on pseudo-terminals drive through the paper's corridor; the onboard process
//! records from them over its real serial code; then map, model, pictures and a comparison with the truth,
//! each by the command of that name.

mod drive;

use std::fs;
use std::path::{Path, PathBuf};

use crate::formats::output::unfinished::Unfinished;
use crate::formats::output::write_file;
use crate::metrics::compare::CompareParams;
use anyhow::{Context, bail};
use biplane_onboard::RunReport;

use crate::cli::build;
use crate::cli::measure::compare;
use crate::cli::terminal::console::Console;
use crate::cli::view::render::ViewName;
use crate::cli::view::{render, report};
use biplane_cli::{Outcome, counted};
use drive::Drive;

const DEFAULT_FOLDER: &str = "biplane-demo";
/// With `--fast` the drive ends after this long, seconds.
const FAST_S: f64 = 15.0;

/// Words of the command.
#[derive(Debug, clap::Args)]
#[command(after_help = "Examples:\n  biplane demo\n  biplane demo --fast -o try")]
pub(super) struct Args {
    /// The folder to write [default: biplane-demo, or the next free name after it]
    #[arg(long, short, value_name = "DIR")]
    output: Option<PathBuf>,
    /// Drive the first 15 seconds only
    #[arg(long)]
    fast: bool,
}

/// Runs the command.
pub(super) fn run(args: &Args, console: &Console) -> anyhow::Result<Outcome> {
    let folder = make_folder(args.output.as_deref())?;
    // Interrupted, a demo leaves nothing: its parts are of use together only.
    let _folder = Unfinished::new(&folder);
    let start_ns = biplane_clock::monotonic_ns();
    let say = |text: String| {
        let elapsed_s = (biplane_clock::monotonic_ns() - start_ns) as f64 / 1e9;
        console.note(format!("[{elapsed_s:5.1} s] {text}"));
    };
    let drive = Drive::new(&folder, args.fast.then_some(FAST_S))?;
    say(format!(
        "a mock rig in {}: two SICK LMS 291 and a Pioneer base, each on a pseudo-terminal, in a corridor",
        folder.display()
    ));
    say(format!("recording from them as `biplane-onboard record` does; {}", drive.describe()));
    let report = drive.record(console)?;
    say(format!(
        "{}: {} horizontal and {}, {}",
        report.output.display(),
        report.recorded.scans_horizontal,
        counted(report.recorded.scans_vertical, "vertical scan"),
        counted(report.recorded.poses, "matched pose")
    ));

    say("building the model".to_owned());
    let model = folder.join("model");
    build::run(&build::Args::for_recording(&report.output, &model), console)?;

    say("drawing it, and measuring it against the true corridor".to_owned());
    for (view, name) in [(ViewName::Outside, "outside.png"), (ViewName::Inside, "inside.png")] {
        render::run(&render::Args::for_build(&model, &folder.join(name), view), console)?;
    }
    let comparison =
        compare::report(&model, Some(&folder.join("truth/surfaces.ply")), &CompareParams::default(), &[])?;
    write_file(&folder.join("compare.json"), false, |out| {
        Ok(serde_json::to_writer_pretty(out, &comparison)?)
    })?;
    compare::write_compared(&model, &model.join(report::NAME), &comparison, true)?;
    say("done".to_owned());
    print_results(&folder, &report, &comparison);
    Ok(if report.exit_code() == 0 { Outcome::Done } else { Outcome::Lossy })
}

/// A folder of its own: the one asked for, if it is free, else the next free name of the default one.
fn make_folder(asked: Option<&Path>) -> anyhow::Result<PathBuf> {
    let free = |path: &Path| match fs::read_dir(path) {
        Ok(mut entries) => entries.next().is_none(),
        Err(_) => !path.exists(),
    };
    let folder = match asked {
        Some(path) if free(path) => path.to_owned(),
        Some(path) => bail!("{} exists already and is not empty; name another folder", path.display()),
        None => (1..)
            .map(|number| match number {
                1 => PathBuf::from(DEFAULT_FOLDER),
                number => PathBuf::from(format!("{DEFAULT_FOLDER}-{number}")),
            })
            .find(|path| free(path))
            .unwrap_or_default(),
    };
    fs::create_dir_all(&folder).with_context(|| format!("cannot create {}", folder.display()))?;
    Ok(folder)
}

/// What came out and where to look: the command's result, so it goes to stdout.
fn print_results(folder: &Path, report: &RunReport, comparison: &compare::Report) {
    let (raw, model) = (&comparison.raw, &comparison.model);
    let polygons = model.polygons.unwrap_or_default();
    let at = |name: &str| folder.join(name).display().to_string();
    println!();
    println!(
        "{} raw triangles ({:.2} cm RMS off the true surfaces) became {} and {} on no plane ({:.2} cm).",
        raw.triangles,
        100.0 * raw.to_truth.rms_m,
        counted(polygons, "polygon"),
        counted(model.surfaces.saturating_sub(polygons), "triangle"),
        100.0 * model.to_truth.rms_m
    );
    let rows = [
        (at("model/report.html"), "everything on one page, in 3D: open it in a browser"),
        (at("outside.png"), "raw mesh beside the model, into the corridor"),
        (at("inside.png"), "the same from where the robot drove"),
        (at("model/model.glb"), "the model: open it in Blender, Windows 3D Viewer or any glTF viewer"),
        (at("model/model.ply"), "the same for MeshLab and CloudCompare; raw.ply and points.ply beside it"),
        (at("model/model.obj"), "the same with whole polygons; model.city.json for GIS programs"),
        (at("model/map.png"), "the floor map with the trajectory; map.pgm and map.yaml for map_server"),
        (at("model/summary.json"), "all figures; compare.json has the distances to the truth"),
        (report.output.display().to_string(), "the recording: open it in Foxglove, Lichtblick or ROS 2"),
    ];
    let width = rows.iter().map(|(path, _)| path.chars().count()).max().unwrap_or(0);
    for (path, what) in rows {
        println!("  {path:width$}  {what}");
    }
}
