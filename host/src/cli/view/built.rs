//! What `compare` reads of a build's folder.

use std::fs::{self, File};
use std::io::Read as _;
use std::path::{Path, PathBuf};

use crate::formats::ply;
use crate::formats::ply::read::Ply;
use crate::formats::text::model_json;
use crate::metrics::blocked_rays::{RayParams, Rays};
use crate::model::{Mesh, part};
use anyhow::{Context, anyhow, bail};
use biplane_recording::file_kind::{self, FileKind, KIND_BYTES};
use serde_json::Value;

/// The surfaces of a build and what is known of them.
pub(crate) struct Built {
    folder: PathBuf,
    pub raw: Mesh,
    pub planes: Mesh,
    pub model: Mesh,
    /// The raw points.
    pub points_m: Vec<[f32; 3]>,
    /// For each point the number of its scan; empty when the file does not tell.
    scans: Vec<f64>,
    /// Where the laser was at each scan; empty when the file does not tell.
    origins_m: Vec<[f64; 3]>,
    pub polygons: usize,
    leftover_triangles: usize,
    /// Triangles of all passes of the drive; `raw` has those of first views.
    pub raw_triangles: usize,
    /// Range noise, meters.
    pub sigma_m: f64,
}

impl Built {
    /// Reads a folder.
    pub(crate) fn load(folder: &Path) -> anyhow::Result<Self> {
        let summary = read_summary(folder)?;
        let count = |key: &str| {
            let found =
                summary.get(key).and_then(Value::as_u64).and_then(|count| usize::try_from(count).ok());
            found.ok_or_else(|| anyhow!("{}/summary.json has no count `{key}`", folder.display()))
        };
        let mesh = |name: &str| anyhow::Ok(load_built(folder, name)?.mesh);
        let points = load_built(folder, "points.ply")?;
        Ok(Self {
            folder: folder.to_owned(),
            raw: mesh("raw.ply")?,
            planes: mesh("planes.ply")?,
            model: measured(load_built(folder, "model.ply")?),
            scans: points.vertex_column("scan").map(<[f64]>::to_vec).unwrap_or_default(),
            points_m: points.mesh.vertices_m,
            origins_m: points.scan_origins_m,
            polygons: count("polygons")?,
            leftover_triangles: count("leftover_triangles")?,
            raw_triangles: count("raw_triangles")?,
            sigma_m: summary["errors"]["sigma_m"].as_f64().unwrap_or(0.0),
        })
    }

    /// What the paper counts: polygons and leftover triangles.
    pub(crate) fn surfaces(&self) -> usize {
        self.polygons + self.leftover_triangles
    }

    /// The laser's rays; none when the folder does not tell where they began.
    pub(crate) fn rays(&self, params: &RayParams) -> Rays {
        Rays::new(params, &self.points_m, &self.scans, &self.origins_m)
    }

    /// Size of a file.
    pub(crate) fn bytes(&self, name: &str) -> anyhow::Result<u64> {
        let path = self.folder.join(name);
        Ok(fs::metadata(&path).with_context(|| format!("cannot read {}", path.display()))?.len())
    }
}

/// The triangles of a model that were measured: a truth or rays judge no others.
fn measured(model: Ply) -> Mesh {
    let Some(inferred) = model.face_column("inferred") else { return model.mesh };
    let which: Vec<usize> = (0..inferred.len()).filter(|triangle| inferred[*triangle] == 0.0).collect();
    part::only(&model.mesh, &which)
}

/// Reads a PLY file.
pub(crate) fn load(path: &Path) -> anyhow::Result<Ply> {
    let bytes = fs::read(path).with_context(|| format!("cannot read {}", path.display()))?;
    ply::read(&bytes).with_context(|| format!("cannot read {}", path.display()))
}

/// Reads a PLY file of a build's folder.
pub(crate) fn load_built(folder: &Path, name: &str) -> anyhow::Result<Ply> {
    check_folder(folder)?;
    let path = folder.join(name);
    if !path.exists() {
        let (path, shown) = (path.display(), folder.display());
        if name == "model.ply" && folder.join(model_json::NAME).exists() {
            bail!("{path} does not exist: `biplane export {shown} --formats ply` writes it");
        }
        bail!("{path} does not exist: is {shown} a folder of `biplane build`?");
    }
    load(&path)
}

/// Refuses a file where a folder is asked for, and says what it is.
pub(crate) fn check_folder(folder: &Path) -> anyhow::Result<()> {
    if !folder.is_file() {
        return Ok(());
    }
    let mut start = Vec::new();
    let file = File::open(folder).with_context(|| format!("cannot read {}", folder.display()))?;
    file.take(KIND_BYTES).read_to_end(&mut start)?;
    let hint = match FileKind::of(&start) {
        Some(FileKind::Mcap) => {
            "; `biplane build` makes one of a recording, `biplane map` draws its floor map"
        }
        _ => "",
    };
    bail!(
        "{} {}; expected a folder that `biplane build` wrote{hint}",
        folder.display(),
        file_kind::describe(&start)
    )
}

/// Size of a mesh as PLY, as `raw.ply` is written.
pub(crate) fn ply_bytes(mesh: &Mesh) -> u64 {
    let mut bytes = Vec::new();
    ply::write_mesh(&mut bytes, mesh, "raw mesh").map_or(0, |()| bytes.len() as u64)
}

/// The summary of a folder that holds a model.
pub(crate) fn read_summary(folder: &Path) -> anyhow::Result<Value> {
    check_folder(folder)?;
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
