//! Which of two files is the reference: the first, as in evo. Until version 0.2 the old order, what is judged
//! first, works too where the files themselves tell that it is meant.

use std::path::Path;

use crate::cli::recordings::poses::{holds_relations, is_recording};
use crate::cli::terminal::console::Console;

/// The two files by what they are.
#[derive(Debug, Clone, Copy)]
pub(super) struct Files<'a> {
    pub(super) reference: &'a Path,
    pub(super) judged: &'a Path,
}

impl<'a> Files<'a> {
    /// A reference trajectory and one that is judged. A recording before a text is the old order. Two texts
    /// do not tell; errors are the same in either order.
    pub(super) fn of_trajectories(first: &'a Path, second: &'a Path, console: &Console) -> Self {
        Self::ordered(first, second, !is_text(first) && is_text(second), console)
    }

    /// Relations and a trajectory that is judged.
    pub(super) fn of_relations(first: &'a Path, second: &'a Path, console: &Console) -> Self {
        let holds = |path: &Path| is_text(path) && holds_relations(path);
        Self::ordered(first, second, !holds(first) && holds(second), console)
    }

    fn ordered(first: &'a Path, second: &'a Path, is_old: bool, console: &Console) -> Self {
        if !is_old {
            return Self { reference: first, judged: second };
        }
        let (judged, reference) = (first.display(), second.display());
        console.note(format!(
            "biplane: {reference} is taken as the reference, although it comes second. From version 0.2 on it must come first: {reference} {judged}"
        ));
        Self { reference: second, judged: first }
    }
}

fn is_text(path: &Path) -> bool {
    path.is_file() && is_recording(path).is_ok_and(|is_one| !is_one)
}
