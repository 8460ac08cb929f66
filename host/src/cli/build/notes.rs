//! What a build says of itself on stderr.

use std::path::Path;

use crate::building::elements::Elements;
use crate::pipeline::storey_fit;
use crate::pipeline::summary::{PosesFrom, Summary};
use biplane_cli::counted;

use crate::cli::build::posed::Posed;
use crate::cli::terminal::console::Console;

/// Whether the poses are the recorded ones still.
pub(super) fn report_poses(posed: &Posed<'_>, console: &Console) {
    match (posed.from, posed.loops) {
        (PosesFrom::Optimized, Some(loops)) => {
            console.note(format!(
                "{} closed, all poses optimized (not with --no-optimize)",
                counted(loops, "loop")
            ));
        }
        (PosesFrom::OptimizedBefore, _) => {
            console.note("the recording is optimized already: its poses stay");
        }
        (_, Some(_)) => console.note("no loop found: the poses stay as they were recorded"),
        _ => {}
    }
}

/// What speaks against storeys that lie as the drives say, also when quiet.
pub(super) fn report_storeys(elements: &Elements, console: &Console) {
    storey_fit::contradictions(elements)
        .iter()
        .for_each(|contradiction| console.warn(format!("biplane: {contradiction}")));
}

/// What came out, and what did not.
pub(super) fn report_model(folder: &Path, summary: &Summary, has_vertical: bool, console: &Console) {
    let folder = folder.display();
    if summary.scans.vertical_unposed > 0 {
        console.note(format!(
            "{} of {} vertical scans lie outside the poses and are not in the model",
            summary.scans.vertical_unposed, summary.scans.vertical
        ));
    }
    stage_notes(summary).iter().for_each(|words| console.note(words));
    if has_vertical {
        console.note(format!(
            "{folder}: {}, {}",
            counted(summary.counts.raw_points, "point"),
            summary.reduction()
        ));
    } else {
        console.note(format!("{folder}: map and trajectory"));
    }
}

/// Why the last line counts otherwise than the stages before it.
fn stage_notes(summary: &Summary) -> Vec<String> {
    let of_stage = |name: &str| Some(summary.stages.iter().find(|stage| stage.stage == name)?.count);
    let (raw, polygons) = (summary.counts.raw_triangles, summary.counts.polygons);
    let again = of_stage("mesh").filter(|meshed| *meshed < raw).map(|meshed| {
        format!(
            "{} of all {raw} are of surfaces that were seen again: they are not meshed anew, their points count",
            counted(raw - meshed, "triangle")
        )
    });
    let reshaped = of_stage("polygons").filter(|made| *made != polygons).map(|made| {
        format!("{} became {polygons} with doors, windows and what is inferred", counted(made, "polygon"))
    });
    again.into_iter().chain(reshaped).collect()
}

#[cfg(test)]
mod tests {
    use super::stage_notes;
    use crate::model::sample;
    use crate::pipeline::Counts;
    use crate::pipeline::summary::{StageFigures, Summary};

    #[test]
    fn what_the_last_line_counts_otherwise_is_explained() {
        let counts = Counts { raw_points: 9, raw_triangles: 927_141, polygons: 680, ..Counts::default() };
        let mut summary = Summary::new(&counts, &sample::model(), 0);
        assert_eq!(stage_notes(&summary), [""; 0]);
        let stage = |stage: &str, count| StageFigures {
            stage: stage.to_owned(),
            count,
            wall_s: 0.0,
            cpu_s: 0.0,
            peak_memory_bytes: None,
        };
        summary.stages = vec![stage("mesh", 421_530), stage("polygons", 684)];
        let notes = stage_notes(&summary);
        assert!(notes[0].starts_with("505611 triangles of all 927141 are of surfaces that were seen again"));
        assert_eq!(notes[1], "684 polygons became 680 with doors, windows and what is inferred");
        summary.stages = vec![stage("mesh", 927_141), stage("polygons", 680)];
        assert_eq!(stage_notes(&summary), [""; 0]);
    }
}
