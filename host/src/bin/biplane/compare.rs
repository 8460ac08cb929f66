//! `biplane compare`: how large and how true the raw mesh and the model of a build are.

use std::fs;
use std::io::{self, Write};
use std::path::{Path, PathBuf};

use anyhow::{Context, bail};
use biplane::compare::{CompareParams, ToTruth, compare};
use biplane::model::Mesh;
use biplane::ply_read;
use serde::Serialize;
use serde_json::Value;

use crate::Outcome;
use crate::console::Console;

/// Words of the command.
#[derive(Debug, clap::Args)]
pub struct Args {
    /// A folder that `biplane build` wrote
    folder: PathBuf,
    /// The true surfaces, in the frame `map` of the recording; without it everything is measured against the raw mesh
    #[arg(long, value_name = "TRUTH.ply")]
    truth: Option<PathBuf>,
    /// Print JSON
    #[arg(long)]
    json: bool,
}

/// One surface of a build.
#[derive(Clone, Debug, Serialize)]
pub struct Figures {
    /// Triangles of its file.
    pub triangles: usize,
    /// Polygons with holes that these triangles stand for.
    pub polygons: Option<u64>,
    /// Size of its file.
    pub bytes: u64,
    /// From the surface to the reference: how wrong it is.
    pub to_truth: biplane::surface_distance::Distances,
    /// From what was seen of the reference to the surface: what it misses.
    pub from_truth: biplane::surface_distance::Distances,
}

/// What `compare` says.
#[derive(Clone, Debug, Serialize)]
pub struct Report {
    /// What distances are measured against: the truth's file, or the raw mesh.
    pub reference: String,
    /// The raw mesh.
    pub raw: Figures,
    /// The flat surfaces alone.
    pub planes: Figures,
    /// Flat surfaces and leftovers.
    pub model: Figures,
    /// How distances were measured.
    pub parameters: CompareParams,
}

/// Runs the command.
pub fn run(args: &Args, console: &Console) -> anyhow::Result<Outcome> {
    let spinner = console.spinner("measuring");
    let report = report(&args.folder, args.truth.as_deref())?;
    drop(spinner);
    let mut out = io::stdout().lock();
    if args.json {
        serde_json::to_writer_pretty(&mut out, &report).map_err(io::Error::from)?;
        writeln!(out)?;
    } else {
        print(&mut out, &report)?;
        console.note("a QSlim-like simplification to the same number of polygons is not supported yet");
    }
    Ok(Outcome::Done)
}

/// Measures the surfaces of a build's folder.
pub fn report(folder: &Path, truth: Option<&Path>) -> anyhow::Result<Report> {
    let summary = read_summary(folder)?;
    let load = |name: &str| load_mesh(&folder.join(name));
    let (raw, planes, model) = (load("raw.ply")?, load("planes.ply")?, load("model.ply")?);
    let reference = truth.map(load_mesh).transpose()?;
    let parameters = CompareParams::default();
    let found = compare(&parameters, reference.as_ref().unwrap_or(&raw), &raw, &planes, &model);
    let polygons = summary.get("polygons").and_then(Value::as_u64);
    let figures =
        |name: &str, mesh: &Mesh, distances: &ToTruth, polygons: Option<u64>| -> anyhow::Result<Figures> {
            Ok(Figures {
                triangles: mesh.triangles.len(),
                polygons,
                bytes: fs::metadata(folder.join(name))?.len(),
                to_truth: distances.surface_to_truth,
                from_truth: distances.truth_to_surface,
            })
        };
    Ok(Report {
        reference: truth.map_or_else(|| "raw mesh".to_owned(), |path| path.display().to_string()),
        raw: figures("raw.ply", &raw, &found.raw, None)?,
        planes: figures("planes.ply", &planes, &found.planes, polygons)?,
        model: figures("model.ply", &model, &found.model, polygons)?,
        parameters,
    })
}

fn read_summary(folder: &Path) -> anyhow::Result<Value> {
    let path = folder.join("summary.json");
    let text = fs::read(&path).with_context(|| {
        format!("cannot read {}: is {} a folder of `biplane build`?", path.display(), folder.display())
    })?;
    let summary: Value =
        serde_json::from_slice(&text).with_context(|| format!("cannot read {}", path.display()))?;
    if summary.get("raw_triangles").and_then(Value::as_u64) == Some(0) {
        bail!("{} holds no model: its recording had no vertical scans", folder.display());
    }
    Ok(summary)
}

/// Reads the triangles of a PLY file.
pub fn load_mesh(path: &Path) -> anyhow::Result<Mesh> {
    let bytes = fs::read(path).with_context(|| format!("cannot read {}", path.display()))?;
    let ply = ply_read::read(&bytes).with_context(|| format!("cannot read {}", path.display()))?;
    Ok(ply.mesh)
}

fn print(out: &mut impl Write, report: &Report) -> io::Result<()> {
    writeln!(out, "distances to {}, in centimetres", report.reference)?;
    writeln!(
        out,
        "{:<8} {:>10} {:>10} {:>12}   {:>8} {:>8} {:>8}   {:>8} {:>8}",
        "", "polygons", "triangles", "bytes", "RMS", "95 %", "largest", "missed", "95 %"
    )?;
    for (name, figures) in [("raw", &report.raw), ("planes", &report.planes), ("model", &report.model)] {
        let polygons = figures.polygons.map_or_else(|| "-".to_owned(), |count| count.to_string());
        let (to, from) = (&figures.to_truth, &figures.from_truth);
        writeln!(
            out,
            "{name:<8} {polygons:>10} {:>10} {:>12}   {:>8.2} {:>8.2} {:>8.2}   {:>8.2} {:>8.2}",
            figures.triangles,
            figures.bytes,
            100.0 * to.rms_m,
            100.0 * to.p95_m,
            100.0 * to.max_m,
            100.0 * from.rms_m,
            100.0 * from.p95_m
        )?;
    }
    writeln!(out, "(missed: RMS distance from what was seen of the reference to the surface)")
}
