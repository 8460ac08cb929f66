//! Where a trajectory to be judged comes from: a recording, or a text file of either form.

use std::fs::File;
use std::io::{BufRead as _, BufReader, Read};
use std::path::Path;

use crate::formats::text::trajectory::read_poses;
use crate::recordings::deskew::StampedPose;
use crate::recordings::run::Run;
use crate::recordings::stamp_text::format_span;
use anyhow::{Context, bail};
use biplane_recording::file_kind::{FileKind, KIND_BYTES, describe};

use crate::cli::terminal::console::Console;

/// So many lines of a text are looked at.
const LOOKED_AT: usize = 50;
/// How far the length of a unit quaternion may be from one, in its square.
const UNIT_TOLERANCE: f64 = 1e-3;

/// Reads the poses of a recording (one a horizontal scan), or of a text of lines `t x y theta` or `t x y z qx
/// qy qz qw`.
pub(crate) fn read(path: &Path, console: &Console) -> anyhow::Result<Vec<StampedPose>> {
    // A name that is no file may be that of a recording in parts.
    if path.exists() && !is_recording(path)? {
        let file = File::open(path).with_context(|| format!("cannot read {}", path.display()))?;
        check_kind(path)?;
        return read_poses(BufReader::new(file)).with_context(|| format!("cannot read {}", path.display()));
    }
    let run = Run::open(&[path.to_owned()])?;
    console.report_missing(run.recording());
    Ok(run.poses()?.at_scans().into_iter().flatten().collect())
}

/// Why nothing is compared: no pose of a trajectory is near in time to one of another.
pub(crate) fn none_nearby(
    [judged, reference]: [&Path; 2],
    poses: [&[StampedPose]; 2],
    max_dt_s: f64,
) -> String {
    let [of_judged, of_reference] = poses.map(|poses| format_span(poses.iter().map(|pose| pose.stamp_ns)));
    let (judged, reference) = (judged.display(), reference.display());
    format!(
        "no pose of {judged} is within {max_dt_s} s of one of {reference}: {judged} is from {of_judged}, {reference} from {of_reference}; \
         --max-dt takes poses that are farther apart in time"
    )
}

/// Names what a file is that holds no poses.
fn check_kind(path: &Path) -> anyhow::Result<()> {
    let shown = path.display();
    if let Some(kind) = kind_of(path)? {
        let way_out = match kind {
            FileKind::Carmen => {
                "; `biplane import carmen` and then `biplane-onboard replay` make one of the log"
            }
            FileKind::RosBag | FileKind::Sqlite => {
                "; `biplane import bag` and then `biplane-onboard replay` make one of the bag"
            }
            _ => "",
        };
        // A log's own words would name half of the way.
        let name = if kind == FileKind::Carmen { "a CARMEN log".to_owned() } else { kind.to_string() };
        bail!("{shown} is {name}; expected a posed recording or a trajectory as text{way_out}");
    }
    if holds_relations(path) {
        bail!(
            "{shown} holds relations between poses and no trajectory: \
             `biplane evaluate relations RELATIONS TRAJECTORY` takes it as the first of its two files"
        );
    }
    Ok(())
}

/// Names what a file is that is no recording.
///
/// # Errors
/// When there is such a file and it is something else; `expected` says what is wanted.
pub(crate) fn check_recording(path: &Path, expected: &str) -> anyhow::Result<()> {
    // A name that is no file may be that of a recording in parts; a folder has its own message.
    if !path.is_file() {
        return Ok(());
    }
    let start = start_of(path)?;
    if FileKind::of(&start) != Some(FileKind::Mcap) {
        bail!("{} {}; {expected}", path.display(), describe(&start));
    }
    Ok(())
}

/// Names what a file is that holds no relations.
///
/// # Errors
/// When it is something else.
pub(crate) fn check_relations(path: &Path) -> anyhow::Result<()> {
    let shown = path.display();
    if let Some(kind) = kind_of(path)? {
        bail!("{shown} is {kind}; expected relations with \"t1 t2 x y z roll pitch yaw\" on each line");
    }
    // One or two relations may end with what is a unit quaternion by chance.
    if rows_of(path).is_some_and(|rows| rows.len() > 2 && rows.iter().all(Row::is_pose)) {
        bail!(
            "{shown} holds the poses of a trajectory and no relations: \
             `biplane evaluate trajectory TRUTH ESTIMATE` compares two trajectories"
        );
    }
    Ok(())
}

/// What a file is by its first bytes, where these tell.
fn kind_of(path: &Path) -> anyhow::Result<Option<FileKind>> {
    Ok(FileKind::of(&start_of(path)?))
}

/// The first bytes of a file, enough to know what it is.
fn start_of(path: &Path) -> anyhow::Result<Vec<u8>> {
    let mut start = Vec::new();
    File::open(path)
        .and_then(|file| file.take(KIND_BYTES).read_to_end(&mut start))
        .with_context(|| format!("cannot read {}", path.display()))?;
    Ok(start)
}

/// Eight numbers of a line: of a pose as TUM, or of a relation.
struct Row([f64; 8]);

impl Row {
    fn of(line: &str) -> Option<Self> {
        let numbers: Option<Vec<f64>> = line.split_whitespace().map(|word| word.parse().ok()).collect();
        Some(Self(numbers?.try_into().ok()?))
    }

    /// Whether the last four are a unit quaternion.
    fn is_pose(&self) -> bool {
        let squared: f64 = self.0[4..].iter().map(|value| value * value).sum();
        (squared - 1.0).abs() < UNIT_TOLERANCE
    }
}

/// The first lines of a text; `None` unless each has eight numbers.
fn rows_of(path: &Path) -> Option<Vec<Row>> {
    let lines = BufReader::new(File::open(path).ok()?).lines().map_while(Result::ok).take(LOOKED_AT);
    let rows: Option<Vec<Row>> = lines
        .filter(|line| !line.trim().is_empty() && !line.starts_with('#'))
        .map(|line| Row::of(&line))
        .collect();
    rows.filter(|rows| !rows.is_empty())
}

/// Whether a file begins as a recording does.
///
/// # Errors
/// When it cannot be read.
pub(crate) fn is_recording(path: &Path) -> anyhow::Result<bool> {
    Ok(kind_of(path)? == Some(FileKind::Mcap))
}

/// Whether a text has lines of eight numbers that are no poses: the last four are no unit quaternions.
pub(crate) fn holds_relations(path: &Path) -> bool {
    rows_of(path).is_some_and(|rows| !rows.iter().any(Row::is_pose))
}
