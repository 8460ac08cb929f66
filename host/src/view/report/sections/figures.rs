//! The figures of a run, beside the paper's.

use std::fmt::Write;
use std::io;

use super::paper::{EXPERIMENTS, Experiment};
use crate::pipeline::summary::{Summary, percent_text};
use crate::reconstruct::planes::labeled::SigmaSource;
use crate::recordings::deskew::StampedPose;
use crate::view::markup::escaped;
use crate::view::report::text::{duration, grouped};

/// Poses farther apart than this in time belong to two drives, nanoseconds.
const LONGEST_PAUSE_NS: i64 = 60_000_000_000;
/// Shorter steps are summed up first, meters: the errors of 37 poses a second add up to meters. The sum of
/// all steps, as other programs take it, is larger by their noise.
const COUNTED_STEP_M: f64 = 0.1;

/// How long and how far the robot drove.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub(crate) struct PathFigures {
    /// Seconds.
    pub duration_s: f64,
    /// Meters.
    pub length_m: f64,
}

impl PathFigures {
    /// Of poses, those of several drives one after the other.
    pub(crate) fn of(poses: &[StampedPose]) -> Self {
        let mut way = Self::default();
        let Some(mut counted) = poses.first() else { return way };
        for pair in poses.windows(2) {
            let pause_ns = pair[1].stamp_ns.saturating_sub(pair[0].stamp_ns);
            let is_one_drive = (0..=LONGEST_PAUSE_NS).contains(&pause_ns)
                && pair[0].step_m(&pair[1]) <= StampedPose::LONGEST_STEP_M;
            if !is_one_drive {
                counted = &pair[1];
                continue;
            }
            way.duration_s += pause_ns as f64 * 1e-9;
            let step_m = counted.step_m(&pair[1]);
            if step_m >= COUNTED_STEP_M {
                way.length_m += step_m;
                counted = &pair[1];
            }
        }
        way
    }
}

/// The headline: what became of the raw mesh.
pub(crate) fn lead(summary: &Summary, way: &PathFigures) -> String {
    let mut tiles = String::new();
    let mut tile = |value: &str, words: &str| {
        let _ = write!(tiles, "<div><dt>{words}</dt><dd>{value}</dd></div>");
    };
    if summary.counts.raw_triangles > 0 {
        tile(&grouped(summary.counts.raw_triangles), "raw triangles");
        tile(&grouped(summary.counts.polygons), "flat polygons");
        tile(&grouped(summary.counts.leftover_triangles), "triangles left over");
        tile(&percent_text(summary.counts.reduction_percent), "fewer surfaces");
        tile(&format!("{:.1} cm", 100.0 * summary.errors.rms_m), "RMS off planes");
    }
    if way.length_m > 0.0 {
        tile(&format!("{:.1} m", way.length_m), "driven");
    }
    tile(&duration(summary.cost.wall_s), "computed in");
    format!("<dl class=\"tiles\">{tiles}</dl>")
}

/// The table beside the paper's experiments, and how exact the planes are.
pub(crate) fn section(summary: &Summary, way: &PathFigures) -> String {
    let mut html = String::new();
    if summary.counts.raw_triangles > 0 {
        html.push_str(&beside_paper(summary));
        html.push_str(&exactness(summary));
    }
    html.push_str(&recording(summary, way));
    html
}

fn beside_paper(summary: &Summary) -> String {
    let count = |number: Option<usize>| number.map_or_else(|| "–".to_owned(), grouped);
    type Cell<'a> = &'a dyn Fn(&Experiment) -> String;
    let rows: [(&str, String, Cell<'_>); 7] = [
        ("3D points", grouped(summary.counts.raw_points), &|e| count(e.points)),
        ("triangles of the raw mesh", grouped(summary.counts.raw_triangles), &|e| grouped(e.triangles)),
        ("polygons", grouped(summary.counts.polygons), &|e| count(e.polygons)),
        ("triangles on no plane", grouped(summary.counts.leftover_triangles), &|e| count(e.leftovers)),
        (
            "polygons and triangles",
            grouped(summary.counts.polygons + summary.counts.leftover_triangles),
            &|e| grouped(e.surfaces),
        ),
        ("fewer", percent_text(summary.counts.reduction_percent), &|e| format!("{} %", e.reduction_percent)),
        ("time", duration(summary.cost.wall_s), &|e| e.time.to_owned()),
    ];
    let mut body = String::new();
    for (name, ours, theirs) in rows {
        let _ = write!(body, "<tr><th scope=\"row\">{name}</th><td class=\"ours\">{ours}</td>");
        EXPERIMENTS.iter().for_each(|experiment| {
            let _ = write!(body, "<td>{}</td>", theirs(experiment));
        });
        body.push_str("</tr>");
    }
    let heads: String =
        EXPERIMENTS.iter().map(|e| format!("<th scope=\"col\">paper: {}</th>", e.name)).collect();
    format!(
        "<section><h2>Beside the paper</h2><div class=\"scroll\"><table class=\"figures\"><thead><tr><td></td>\
         <th scope=\"col\">this run</th>{heads}</tr></thead><tbody>{body}</tbody></table></div>\
         <p class=\"note\">Paper: D. Hähnel, W. Burgard, S. Thrun, “Learning Compact 3D Models of Indoor and Outdoor Environments with a \
         Mobile Robot”, 2001. Other buildings, other lasers: figures to compare orders of magnitude with, not to beat.</p></section>"
    )
}

fn exactness(summary: &Summary) -> String {
    let errors = &summary.errors;
    let source = match errors.sigma_source {
        SigmaSource::Given => "as given",
        _ => "estimated from the points",
    };
    let on_planes = 100.0 * errors.points as f64 / summary.counts.raw_points.max(1) as f64;
    // A drawn mesh has few points of its own: planes are found on points that are put on its triangles.
    let points = (errors.points <= summary.counts.raw_points)
        .then(|| ("points on planes", format!("{} ({on_planes:.1} %)", grouped(errors.points))));
    let rows = [
        (
            "planes, polygons, openings",
            format!(
                "{}, {}, {}",
                grouped(summary.counts.planes),
                grouped(summary.counts.polygons),
                grouped(summary.counts.holes)
            ),
        ),
        ("RMS of these points to their planes", format!("{:.2} cm", 100.0 * errors.rms_m)),
        ("RMS of the worst plane", format!("{:.2} cm", 100.0 * errors.worst_plane_rms_m)),
        (&*format!("noise of one point, {source}"), format!("{:.2} cm", 100.0 * errors.sigma_m)),
        ("triangles of the whole model", grouped(summary.counts.model_triangles)),
    ];
    let rows: Vec<(String, String)> =
        points.into_iter().chain(rows).map(|(name, value)| (name.to_owned(), value)).collect();
    format!("<section><h2>How well planes fit</h2>{}{}</section>", pairs(&rows), inferred(summary))
}

/// What is in the model and was not measured.
fn inferred(summary: &Summary) -> String {
    let found = &summary.counts.inferred;
    if found.surfaces == 0 {
        return String::new();
    }
    format!(
        "<p class=\"note\">Beside what was measured the model has {:.1} m² of floor and {:.1} m² of wall under the lowest beam and \
         around openings. They are inferred: no laser saw them, they are violet, and but for the triangles of the whole model no figure counts them.</p>",
        found.floor_m2,
        found.wall_base_m2 + found.opening_surround_m2
    )
}

fn recording(summary: &Summary, way: &PathFigures) -> String {
    let scans = &summary.scans;
    let mut rows = Vec::new();
    let mut row = |name: &str, value: String| rows.push((name.to_owned(), value));
    for path in summary.source.recordings.iter().chain(&summary.source.mesh) {
        row("from", escaped(path));
    }
    if let Some(poses) = &summary.source.poses {
        row("poses from", escaped(poses));
    }
    if way.duration_s > 0.0 {
        row("drive, in steps of 10 cm", format!("{}, {:.1} m", duration(way.duration_s), way.length_m));
    }
    if scans.horizontal + scans.vertical > 0 {
        row(
            "scans, horizontal and vertical",
            format!("{} and {}", grouped(scans.horizontal), grouped(scans.vertical)),
        );
        row("vertical scans while the robot stood, left out", grouped(scans.vertical_still));
        row("scans without a pose", grouped(scans.horizontal_unposed + scans.vertical_unposed));
    }
    if let Some(loops) = summary.source.loops {
        row("loops closed", grouped(loops));
    }
    if rows.is_empty() {
        return String::new();
    }
    format!("<section><h2>The input</h2>{}</section>", pairs(&rows))
}

/// All parameters, folded away.
///
/// # Errors
/// When a parameter is no JSON.
pub(crate) fn parameters(summary: &Summary) -> io::Result<String> {
    let json = serde_json::to_string_pretty(&summary.parameters)?;
    Ok(format!("<details><summary>Parameters</summary><pre>{}</pre></details>", escaped(&json)))
}

/// Names and values, both HTML.
fn pairs(rows: &[(String, String)]) -> String {
    let rows: String =
        rows.iter().map(|(name, value)| format!("<div><dt>{name}</dt><dd>{value}</dd></div>")).collect();
    format!("<dl class=\"pairs\">{rows}</dl>")
}

#[cfg(test)]
mod tests {
    use super::{PathFigures, beside_paper, exactness, lead};
    use crate::model::sample;
    use crate::pipeline::Counts;
    use crate::pipeline::summary::Summary;
    use crate::recordings::deskew::StampedPose;

    #[test]
    fn almost_all_is_never_rounded_to_all() {
        let counts =
            Counts { raw_triangles: 1_000_000, polygons: 30, leftover_triangles: 10, ..Counts::default() };
        let summary = Summary::new(&counts, &sample::model(), 100);
        for html in [lead(&summary, &PathFigures::default()), beside_paper(&summary)] {
            assert!(html.contains("99.996 %") && !html.contains("100.0"), "{html}");
        }
    }

    #[test]
    fn of_a_drawn_mesh_no_share_of_its_points_is_given() {
        // The sample's planes have 1400 points.
        for (raw_points, is_there) in [(1400, true), (1399, false)] {
            let counts = Counts { raw_points, ..Counts::default() };
            let html = exactness(&Summary::new(&counts, &sample::model(), 100));
            assert_eq!(html.contains("points on planes"), is_there, "{raw_points}: {html}");
        }
    }

    #[test]
    fn pauses_between_drives_are_no_driving() {
        let pose =
            |t_s: i64, x_m: f64| StampedPose { stamp_ns: t_s * 1_000_000_000, x_m, ..StampedPose::default() };
        let poses =
            [pose(0, 0.0), pose(10, 3.0), pose(1000, 3.5), pose(1010, 4.5), pose(5, 50.0), pose(6, 50.0)];
        let way = PathFigures::of(&poses);
        assert_eq!((way.duration_s, way.length_m), (21.0, 4.0));
    }

    #[test]
    fn errors_of_poses_are_no_driving() {
        let standing = |t: i64| StampedPose {
            stamp_ns: t * 10_000_000,
            x_m: if t % 2 == 0 { 0.0 } else { 0.004 },
            ..StampedPose::default()
        };
        let poses: Vec<StampedPose> = (0..1000).map(standing).collect();
        assert_eq!(PathFigures::of(&poses).length_m, 0.0);
    }
}
