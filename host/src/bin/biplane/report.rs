//! `report.html` of `build` and `compact`, and the distances that `compare` puts into it.

use std::fs;
use std::path::Path;

use anyhow::{Context, bail};
use biplane::deskew::StampedPose;
use biplane::export::Shapes;
use biplane::map_files::MapImage;
use biplane::output::{OutputError, write_file};
use biplane::page::{Page, Row, Sources, with_comparison};
use biplane::pipeline::BuildOutput;
use biplane::summary::Summary;

use crate::build::stages::Stages;
use crate::compare::{Report, simplified};

/// The page's name in a folder.
pub const NAME: &str = "report.html";

/// What a page of this input is called: its name without folders and ending. Unlike an export's header a page can hold any letter.
pub fn title(path: &Path) -> String {
    path.file_stem().unwrap_or_default().to_string_lossy().into_owned()
}

/// Prepares the page of a build or a mesh: its figures come last, when everything else is done.
pub fn prepare(
    title: &str,
    output: &BuildOutput,
    shapes: &Shapes<'_>,
    floor: Option<(&MapImage<'_>, &[StampedPose])>,
    stages: &mut Stages<'_>,
) -> anyhow::Result<Page> {
    stages.time("report", || {
        let surfaces = output.counts.polygons + output.counts.leftover_triangles;
        let simple = if output.mesh.triangles.is_empty() { None } else { simplified(&output.mesh, surfaces) };
        let page = Page::new(&Sources {
            title,
            raw: &output.mesh,
            simple: simple.as_ref(),
            shapes,
            map: floor.map(|(map, _)| map),
            poses: floor.map_or(&[], |(_, poses)| poses),
        })?;
        Ok((page, 1))
    })
}

/// Writes the page.
pub fn write(folder: &Path, page: &Page, summary: &Summary) -> Result<(), OutputError> {
    write_file(&folder.join(NAME), true, |out| page.write(out, summary))
}

/// Writes the page of a build with the figures of a comparison in it.
pub fn write_compared(folder: &Path, path: &Path, report: &Report, overwrite: bool) -> anyhow::Result<()> {
    let source = folder.join(NAME);
    let page = fs::read_to_string(&source).with_context(|| format!("cannot read {}", source.display()))?;
    let measured = [
        ("raw mesh", Some(&report.raw)),
        ("QSlim-like", report.qslim.as_ref()),
        ("flat surfaces", Some(&report.planes)),
        ("model", Some(&report.model)),
    ];
    let rows: Vec<Row> = measured
        .into_iter()
        .filter_map(|(name, figures)| {
            let figures = figures?;
            Some(Row {
                name,
                surfaces: figures.surfaces,
                rms_m: figures.to_truth.rms_m,
                missed_m: figures.from_truth.mean_m,
                blocked_percent: figures.rays.map(|rays| rays.percent),
            })
        })
        .collect();
    let Some(page) = with_comparison(&page, &report.reference, &rows) else {
        bail!("{} has no place for a comparison: is it by `biplane build`?", source.display())
    };
    Ok(write_file(path, overwrite, |out| std::io::Write::write_all(out, page.as_bytes()))?)
}
