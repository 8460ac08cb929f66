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
