//! The figures of `compare` as a table.

use std::io::{self, Write};

use biplane_cli::counted;

use crate::cli::measure::compare::figures::Equal;
use crate::cli::measure::compare::figures::Figures;
use crate::cli::measure::compare::figures::Report;

/// Prints it.
pub(super) fn print(out: &mut impl Write, report: &Report) -> io::Result<()> {
    writeln!(out, "distances to {}, in centimeters", report.reference)?;
    writeln!(
        out,
        "{:<8} {:>9} {:>10} {:>11}   {:>6} {:>6} {:>6} {:>7}   {:>6} {:>6} {:>6}   {:>6}   {:>9}",
        "",
        "polygons",
        "triangles",
        "bytes",
        "mean",
        "RMS",
        "95 %",
        "largest",
        "missed",
        "RMS",
        "95 %",
        "both",
        "blocked"
    )?;
    let rows = [
        ("raw", &report.raw),
        ("qslim", &report.qslim),
        ("planes", &report.planes),
        ("model", &report.model),
    ];
    for (name, figures) in rows {
        row(out, name, figures)?;
    }
    for found in &report.equal {
        let name = match found.equal {
            Equal::Triangles => "=triang.",
            Equal::Bytes => "=bytes",
            Equal::Rms => "=RMS",
        };
        row(out, name, &found.figures)?;
    }
    meanings(out, report)
}

/// What rows and columns are.
fn meanings(out: &mut impl Write, report: &Report) -> io::Result<()> {
    if let Some(note) = first_views(report.raw.triangles, report.raw_triangles_of_all_passes) {
        writeln!(out, "{note}")?;
    }
    writeln!(
        out,
        "qslim: the raw mesh simplified to as many triangles as the model has polygons and triangles on no plane"
    )?;
    if report.equal.iter().any(|found| !found.is_reached) {
        writeln!(
            out,
            "=RMS: no number of triangles has an error as small as the model's; the least is shown"
        )?;
    }
    writeln!(
        out,
        "missed: mean distance from what was seen of the reference to the surface; both: mean of the two means"
    )?;
    match report.model.rays {
        Some(rays) => writeln!(
            out,
            "blocked: of {} rays, those that meet the surface more than {:.1} cm before what they really hit",
            rays.rays,
            100.0 * rays.margin_m
        )?,
        None => writeln!(
            out,
            "blocked: not known, no points.ply here that tells where its points were seen from (a model by build has one)"
        )?,
    }
    if let (Some(faces), Some(polygons)) = (report.true_faces_seen, report.model.polygons) {
        writeln!(
            out,
            "true faces seen: {faces}, so {:.2} polygons a face",
            polygons as f64 / faces.max(1) as f64
        )?;
    }
    Ok(())
}

/// Why the raw mesh has fewer triangles than `build` counted, when it has.
fn first_views(triangles: usize, of_all_passes: usize) -> Option<String> {
    (of_all_passes > triangles).then(|| {
        let counted = counted(of_all_passes, "triangle");
        format!("raw: raw.ply, which holds first views; `build` counted {counted} of all passes of the drive")
    })
}

fn row(out: &mut impl Write, name: &str, figures: &Figures) -> io::Result<()> {
    let polygons = figures.polygons.map_or_else(|| "-".to_owned(), |count| count.to_string());
    let blocked = figures.rays.map_or_else(|| "-".to_owned(), |rays| format!("{:.3} %", rays.percent));
    let (to, from) = (&figures.to_truth, &figures.from_truth);
    writeln!(
        out,
        "{name:<8} {polygons:>9} {:>10} {:>11}   {:>6.2} {:>6.2} {:>6.2} {:>7.2}   {:>6.2} {:>6.2} {:>6.2}   {:>6.2}   {blocked:>9}",
        figures.triangles,
        figures.bytes,
        100.0 * to.mean_m,
        100.0 * to.rms_m,
        100.0 * to.p95_m,
        100.0 * to.max_m,
        100.0 * from.mean_m,
        100.0 * from.rms_m,
        100.0 * from.p95_m,
        100.0 * figures.symmetric_mean_m
    )
}

#[cfg(test)]
mod tests {
    use super::first_views;

    #[test]
    fn a_raw_mesh_of_first_views_is_explained() {
        assert_eq!(first_views(159_110, 159_110), None);
        let expected = "raw: raw.ply, which holds first views; `build` counted 300000 triangles of all passes of the drive";
        assert_eq!(first_views(159_110, 300_000).as_deref(), Some(expected));
    }
}
