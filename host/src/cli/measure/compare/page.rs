//! The page of a build once more, with the figures of a comparison in it.

use std::fs;
use std::path::Path;

use anyhow::{Context, bail};

use crate::cli::measure::compare::figures::Report;
use crate::cli::view::report::NAME;
use crate::formats::output::write_file;
use crate::view::report::{Row, with_comparison};

/// Writes the page of a build with the figures of a comparison in it.
pub(crate) fn write_compared(
    folder: &Path,
    path: &Path,
    report: &Report,
    overwrite: bool,
) -> anyhow::Result<()> {
    let source = folder.join(NAME);
    let page = fs::read_to_string(&source).with_context(|| format!("cannot read {}", source.display()))?;
    let measured = [
        ("raw mesh", &report.raw),
        ("QSlim-like", &report.qslim),
        ("flat surfaces", &report.planes),
        ("model", &report.model),
    ];
    let rows: Vec<Row> = measured
        .into_iter()
        .map(|(name, figures)| Row {
            name,
            surfaces: figures.surfaces,
            rms_m: figures.to_truth.rms_m,
            missed_m: figures.from_truth.mean_m,
            blocked_percent: figures.rays.map(|rays| rays.percent),
        })
        .collect();
    let Some(page) = with_comparison(&page, &report.reference, &rows) else {
        bail!("{} has no place for a comparison: is it by `biplane build`?", source.display())
    };
    Ok(write_file(path, overwrite, |out| std::io::Write::write_all(out, page.as_bytes()))?)
}
