//! Which of two files is the reference: the first, as in evo. Until version 0.2 the old order, what is judged
//! first, works too where the files themselves tell that it is meant.

use std::fs::File;
use std::io::{BufRead, BufReader};
use std::path::Path;

use crate::cli::recordings::poses::is_recording;
use crate::cli::terminal::console::Console;

/// So many lines of a text are looked at.
const LOOKED_AT: usize = 50;
/// How far the length of a unit quaternion may be from one, in its square.
const UNIT_TOLERANCE: f64 = 1e-3;

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
        let is_text = |path: &Path| path.is_file() && is_recording(path).is_ok_and(|is_one| !is_one);
        Self::ordered(first, second, !is_text(first) && is_text(second), console)
    }

    /// Relations and a trajectory that is judged.
    pub(super) fn of_relations(first: &'a Path, second: &'a Path, console: &Console) -> Self {
        Self::ordered(first, second, !holds_relations(first) && holds_relations(second), console)
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

/// Whether a text has lines of eight numbers that are no poses: the last four are no unit quaternions.
fn holds_relations(path: &Path) -> bool {
    if !path.is_file() || !is_recording(path).is_ok_and(|is_one| !is_one) {
        return false;
    }
    let Ok(file) = File::open(path) else { return false };
    let lines = BufReader::new(file).lines().map_while(Result::ok).take(LOOKED_AT);
    let mut rows = lines.filter(|line| !line.trim().is_empty() && !line.starts_with('#')).peekable();
    rows.peek().is_some() && !rows.all(|row| is_pose(&row))
}

/// Whether a line has another form than a relation, or ends with a unit quaternion.
fn is_pose(row: &str) -> bool {
    let numbers: Vec<f64> = row.split_whitespace().map_while(|word| word.parse().ok()).collect();
    let squared: f64 = numbers.iter().skip(4).map(|value| value * value).sum();
    numbers.len() != 8 || (squared - 1.0).abs() < UNIT_TOLERANCE
}
