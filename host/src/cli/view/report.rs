//! `report.html` of `build` and `compact`.

use std::path::Path;

use crate::cli::terminal::stages::Stages;
use crate::formats::Shapes;
use crate::formats::output::error::OutputError;
use crate::formats::output::write_file;
use crate::pipeline::BuildOutput;
use crate::pipeline::summary::Summary;
use crate::reconstruct::simplify::fewer;
use crate::recordings::deskew::StampedPose;
use crate::view::report::data::reduce::to_fit;
use crate::view::report::{Floor, Page, Sources};

/// The page's name in a folder.
pub(crate) const NAME: &str = "report.html";

/// Triangles of a mesh that is simplified for a page, at most. More: a page takes longer than the model.
/// Fewer: the simplification starts from rough walls.
const MAX_SIMPLIFIED_TRIANGLES: usize = 500_000;
/// Triangles that it may have in the end: more would make the page too large.
const MAX_SIMPLE_TRIANGLES: usize = 250_000;
/// Triangles of the raw mesh in the pictures at most: as many as they have pixels.
const MAX_DRAWN_TRIANGLES: usize = 200_000;

/// What a page of this input is called: its name without folders and ending. Unlike an export's header a page
/// can hold any letter.
pub(crate) fn title(path: &Path) -> String {
    path.file_stem().unwrap_or_default().to_string_lossy().into_owned()
}

/// Prepares the page of a build or a mesh, with its map and the poses of all scans: its figures come last,
/// when everything else is done.
pub(crate) fn prepare(
    title: &str,
    output: &BuildOutput,
    shapes: &Shapes<'_>,
    (floor, poses): (Option<Floor<'_>>, &[StampedPose]),
    stages: &mut Stages<'_>,
) -> anyhow::Result<Page> {
    stages.time("report", || {
        let surfaces = output.counts.polygons + output.counts.leftover_triangles;
        // A large mesh is made coarser first, so that a page costs no more than a model.
        let coarse = to_fit(&output.mesh, MAX_SIMPLIFIED_TRIANGLES).map(|(mesh, _)| mesh);
        let is_empty = output.mesh.triangles.is_empty();
        let base = coarse.as_ref().unwrap_or(&output.mesh);
        let simple = (!is_empty).then(|| fewer::to_count(base, surfaces.min(MAX_SIMPLE_TRIANGLES)));
        let drawn = to_fit(base, MAX_DRAWN_TRIANGLES).map(|(mesh, _)| mesh);
        let page = Page::new(&Sources {
            title,
            raw: &output.mesh,
            drawn: drawn.as_ref().unwrap_or(base),
            simple: simple.as_ref(),
            shapes,
            floor,
            poses,
        })?;
        Ok((page, 1))
    })
}

/// Writes the page, when all other files of its folder are there.
pub(crate) fn write(folder: &Path, page: &Page, summary: &Summary) -> Result<(), OutputError> {
    // A folder that cannot be listed gives a page without links.
    let files: Vec<String> = folder
        .read_dir()
        .into_iter()
        .flatten()
        .filter_map(|entry| entry.ok()?.file_name().into_string().ok())
        .collect();
    write_file(&folder.join(NAME), true, |out| page.write(out, summary, &files))
}
