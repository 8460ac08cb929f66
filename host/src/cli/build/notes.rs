//! What a build says of itself on stderr.

use std::path::Path;

use crate::building::elements::Elements;
use crate::pipeline::storey_fit;
use crate::pipeline::summary::{PosesFrom, Summary};
use crate::slam::refinement::spatial::choice::Refined;
use biplane_cli::counted;

use crate::cli::build::posed::Posed;
use crate::cli::recordings::optimize::report::{poses_stay, without_loops};
use crate::cli::terminal::console::Console;

/// What became of the recorded poses.
pub(super) fn report_poses(posed: &Posed<'_>, console: &Console) {
    let refined = posed.refined.as_ref().map(Refined::words);
    let found = without_loops(posed.has_worse_loops);
    poses_words(posed.from, posed.loops, found, refined).iter().for_each(|words| console.note(words));
}

/// The same as words; `found` is what is said where no loop was closed.
fn poses_words(from: PosesFrom, loops: Option<usize>, found: &str, refined: Option<String>) -> Vec<String> {
    let first = match (from, loops) {
        (PosesFrom::Optimized, Some(loops)) => {
            Some(format!("{} closed, all poses optimized (not with --no-optimize)", counted(loops, "loop")))
        }
        (PosesFrom::OptimizedBefore, _) => {
            Some("the recording is optimized already: its poses stay".to_owned())
        }
        (PosesFrom::Refined, Some(_)) => {
            return refined.into_iter().map(|words| format!("{found}; {words}")).collect();
        }
        (_, Some(_)) => Some(poses_stay(found)),
        _ => None,
    };
    first.into_iter().chain(refined).collect()
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
    let left_out = summary.counts.polygons_left_out;
    let whole = polygons + left_out;
    let reshaped = of_stage("polygons").filter(|made| *made != whole).map(|made| {
        format!("{} became {whole} with doors, windows and what is inferred", counted(made, "polygon"))
    });
    let bounded = summary.parameters.max_triangles.filter(|_| left_out > 0).map(|bound| {
        format!("{} became {polygons} within --max-triangles {bound}", counted(whole, "polygon"))
    });
    again.into_iter().chain(reshaped).chain(bounded).collect()
}

#[cfg(test)]
mod tests {
    use super::{poses_words, stage_notes};
    use crate::model::sample;
    use crate::pipeline::Counts;
    use crate::pipeline::summary::{PosesFrom, StageFigures, Summary};

    #[test]
    fn poses_that_were_refined_are_not_said_to_stay() {
        let refined = || Some("poses refined in all six directions".to_owned());
        let words = |from, loops, refined| poses_words(from, loops, "no loop found", refined).join(" | ");
        assert_eq!(
            words(PosesFrom::Refined, Some(0), refined()),
            "no loop found; poses refined in all six directions"
        );
        assert_eq!(
            words(PosesFrom::Optimized, Some(3), refined()),
            "3 loops closed, all poses optimized (not with --no-optimize) | poses refined in all six directions"
        );
        let stay = "no loop found: the poses stay as they were recorded";
        assert_eq!(words(PosesFrom::Recorded, Some(0), None), stay);
        assert_eq!(words(PosesFrom::Recorded, None, None), "");
        // A scan without any pose: nothing was searched, and what was refined is said alone.
        assert_eq!(words(PosesFrom::Refined, None, refined()), "poses refined in all six directions");
    }

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
        // A bound takes polygons too, and that is another reason.
        summary.counts.polygons_left_out = 670;
        summary.counts.polygons = 10;
        summary.parameters.max_triangles = Some(20);
        let notes = stage_notes(&summary);
        assert_eq!(notes[1], "684 polygons became 680 with doors, windows and what is inferred");
        assert_eq!(notes[2], "680 polygons became 10 within --max-triangles 20");
        summary.counts.polygons_left_out = 0;
        summary.counts.polygons = 680;
        summary.stages = vec![stage("mesh", 927_141), stage("polygons", 680)];
        assert_eq!(stage_notes(&summary), [""; 0]);
    }
}
