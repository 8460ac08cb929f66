//! `biplane export`: further formats of a model that is built already, the same files as `build` writes.

use std::fs;
use std::io::{self, Write};
use std::path::{Path, PathBuf};

use crate::formats::gltf::tileset;
use crate::formats::output::{MARKER, check_free};
use crate::formats::ply::points_file::PointsFile;
use crate::formats::text::model_json::{self, ModelFile};
use crate::model::turn::Turn;
use anyhow::{Context, bail};
use serde::Serialize;

use crate::cli::models::formats::{Format, Formats};
use crate::cli::models::viewer_file::write_viewer_file;
use crate::cli::models::{files, formats};
use crate::cli::terminal::console::Console;
use crate::cli::terminal::json::print_json;
use crate::cli::terminal::threads::Threads;
use crate::cli::view::built::{check_folder, read_summary};
use biplane_cli::Outcome;

/// Words of the command.
#[derive(Clone, Debug, clap::Args)]
#[command(
    after_help = "Examples:\n  biplane export model --formats dxf,ifc          a floor plan and a building model, into the folder model\n  \
    biplane export model --formats dxf,ifc --align-walls --force      the same with the main walls along x and y\n  \
    biplane export model --formats laz --force      the points once more\n\
    The files are the same as `biplane build --formats` writes, byte for byte, but for --align-walls."
)]
pub(crate) struct Args {
    /// A folder that `biplane build` or `biplane compact` wrote; the files are added to it
    #[arg(value_name = "MODEL_DIR")]
    folder: PathBuf,
    /// Files to write, separated by commas: glb, ply, obj, cityjson, dxf, ifc, lod, las, laz, all of these,
    /// mcap or 3dtiles; `biplane build --help` says what they are
    #[arg(long, value_name = "FORMATS", value_delimiter = ',', value_parser = formats::parse, required = true, hide_possible_values = true)]
    formats: Vec<Formats>,
    /// Turn the drawing and the building model about the vertical so that the main walls lie along x and y;
    /// for dxf and ifc only
    #[arg(long)]
    align_walls: bool,
    /// Replace files that exist
    #[arg(long)]
    force: bool,
    /// Print JSON
    #[arg(long)]
    json: bool,
    #[command(flatten)]
    threads: Threads,
}

/// What was written.
#[derive(Debug, Serialize)]
struct Written {
    /// The folder.
    folder: String,
    /// What the model was made of.
    source: String,
    /// The files, in the order of the alphabet.
    files: Vec<WrittenFile>,
    /// By how much they are turned against the frame `map`, counter-clockwise, degrees.
    #[serde(skip_serializing_if = "Option::is_none")]
    turned_deg: Option<f64>,
}

#[derive(Debug, Serialize)]
struct WrittenFile {
    name: String,
    bytes: u64,
}

impl Args {
    /// Why there is nothing to do, if there is not.
    pub(crate) fn conflict(&self) -> Option<String> {
        if self.names().is_empty() {
            return Some("--formats none writes no file".to_owned());
        }
        let is_turned = |format: Format| matches!(format, Format::Dxf | Format::Ifc);
        let is_wrong = self.align_walls && !self.wanted().all(is_turned);
        is_wrong.then(|| {
            "--align-walls goes with dxf and ifc alone: other formats stay in the frame map".to_owned()
        })
    }

    fn wanted(&self) -> impl Iterator<Item = Format> {
        self.formats.iter().copied().flatten().copied()
    }

    /// The names of the files asked for, each once.
    fn names(&self) -> Vec<&'static str> {
        let mut names: Vec<&str> = self.wanted().flat_map(Format::files).copied().collect();
        names.sort_unstable();
        names.dedup();
        names
    }
}

/// Runs the command.
pub(crate) fn run(args: &Args, console: &Console) -> anyhow::Result<Outcome> {
    args.threads.take()?;
    let names = args.names();
    check_model(&args.folder)?;
    names.iter().try_for_each(|name| check_free(&args.folder.join(name), args.force))?;
    let spinner = console.spinner("writing");
    let file = read(&args.folder)?;
    let mut shapes = file.shapes();
    if args.align_walls {
        shapes.turn = Turn::along_walls(shapes.model, &shapes.faces)
            .with_context(|| format!("{} has no upright surface to turn it by", args.folder.display()))?;
    }
    let turned_deg = args.align_walls.then(|| shapes.turn.angle_rad.to_degrees());
    let building = formats::building(&args.formats, &file);
    if args.wanted().any(Format::is_of_points) {
        let path = args.folder.join("points.ply");
        let cannot_read = || format!("cannot read {}", path.display());
        let points = PointsFile::open(&path, &file).with_context(cannot_read)?;
        files::write_las(&args.folder, &points, &args.formats)?;
    }
    files::write_model(&args.folder, &shapes, building.as_ref(), &args.formats)?;
    write_viewer_file(&args.folder, &shapes, &file, &args.formats)?;
    drop(spinner);
    print_result(args, &Written { turned_deg, ..written(&args.folder, &file, &names)? })?;
    if let Some(turned_deg) = turned_deg {
        console.note(format!(
            "main walls along x and y: turned by {turned_deg:.3} degrees against the frame map"
        ));
    }
    formats::hint(building.as_ref()).into_iter().for_each(|why| console.note(why));
    Ok(Outcome::Done)
}

/// Says in a sentence what is wrong with a folder from which nothing can be exported.
fn check_model(folder: &Path) -> anyhow::Result<()> {
    let shown = folder.display();
    fs::metadata(folder).with_context(|| format!("cannot read {shown}"))?;
    check_folder(folder)?;
    let has_summary = folder.join("summary.json").exists();
    if !has_summary && folder.join(MARKER).exists() {
        bail!("{shown} is not finished: its `biplane build` runs still, or was ended");
    }
    let summary = read_summary(folder)?;
    if !folder.join(model_json::NAME).exists() {
        let version = summary["version"].as_str().unwrap_or("an unknown version");
        bail!(
            "{shown} has no {}, which formats are made of: biplane {version} wrote the folder without it; build it again",
            model_json::NAME
        );
    }
    Ok(())
}

fn read(folder: &Path) -> anyhow::Result<ModelFile<'static>> {
    let path = folder.join(model_json::NAME);
    let cannot_read = || format!("cannot read {}", path.display());
    let bytes = fs::read(&path).with_context(cannot_read)?;
    model_json::read(&bytes).with_context(cannot_read)
}

fn written(folder: &Path, file: &ModelFile<'_>, names: &[&'static str]) -> anyhow::Result<Written> {
    let size = |name: String| {
        let path = folder.join(&name);
        let found = fs::metadata(&path).with_context(|| format!("cannot read {}", path.display()))?;
        anyhow::Ok(WrittenFile { name, bytes: found.len() })
    };
    let mut all: Vec<String> = names.iter().map(|name| (*name).to_owned()).collect();
    if names.contains(&"tileset.json") {
        all.extend(tiles_in(folder)?);
    }
    let files = all.into_iter().map(size).collect::<anyhow::Result<_>>()?;
    Ok(Written {
        folder: folder.display().to_string(),
        source: file.source.clone().into_owned(),
        files,
        turned_deg: None,
    })
}

/// The tiles that the tileset names, in the order of the alphabet.
fn tiles_in(folder: &Path) -> anyhow::Result<Vec<String>> {
    let tiles = folder.join(tileset::FOLDER);
    let cannot_read = || format!("cannot read {}", tiles.display());
    let mut names = Vec::new();
    for entry in fs::read_dir(&tiles).with_context(cannot_read)? {
        let name = entry.with_context(cannot_read)?.file_name();
        names.push(format!("{}/{}", tileset::FOLDER, name.to_string_lossy()));
    }
    names.sort_unstable();
    Ok(names)
}

fn print_result(args: &Args, written: &Written) -> anyhow::Result<()> {
    if args.json {
        return print_json(written);
    }
    let mut out = io::stdout().lock();
    for file in &written.files {
        let path = args.folder.join(&file.name);
        writeln!(out, "{:>12} bytes  {}", file.bytes, path.display())?;
    }
    Ok(())
}
