//! What `optimize` says of what it did, in words and as JSON.

use std::collections::BTreeMap;
use std::path::{Path, PathBuf};

use serde::Serialize;

use crate::cli::terminal::console::{Console, say};
use crate::cli::terminal::stopwatch::Stopwatch;
use crate::recordings::run::Run;
use crate::slam::corrected_poses::Corrected;
use crate::slam::keyframes::Keyframes;
use crate::slam::pose_graph::wheel_calibration::OdometryScale;
use crate::slam::rewrite_recording::one_by_one::NS_PER_S;
use crate::slam::{Counts, LoopFound, Optimized};
use biplane_cli::counted;

/// What `--json` prints.
#[derive(Debug, Serialize)]
pub(super) struct Report {
    /// One each.
    pub recordings: Vec<RecordingReport>,
    #[serde(flatten)]
    counts: Counts,
    wall_s: f64,
    cpu_s: f64,
    peak_memory_bytes: Option<u64>,
}

/// What became of one recording.
#[derive(Debug, Serialize)]
pub(super) struct RecordingReport {
    /// The recording.
    pub path: String,
    scans: usize,
    /// Whether its poses are others now.
    moved: bool,
    /// The file that it is in now.
    pub output: String,
    /// Whether it lies in one frame with another one.
    joined: bool,
    /// What was added to its times in that file, seconds: other recordings there overlap it in time.
    pub added_s: i64,
    /// Stretches of its way that were found in other recordings: a few are a weak reason to join.
    #[serde(rename = "shared_stretches")]
    shared_submaps: usize,
    /// Share of their points that the others explain, 0 to 1, on average. Two floors of one plan come near 1,
    /// too.
    shared_agreement: f64,
    /// What the drive teaches of its odometry; none where scans do not tell enough.
    odometry: Option<OdometryScale>,
}

/// What a recording, by number, has in common with the others.
fn shared(number: usize, all_keyframes: &[Keyframes], loops: &[LoopFound]) -> (usize, f64) {
    let first: usize = all_keyframes[..number].iter().map(|keyframes| keyframes.nodes.len()).sum();
    let own = first..first + all_keyframes[number].nodes.len();
    let across = loops
        .iter()
        .filter(|found| found.inlier && own.contains(&found.nodes[0]) != own.contains(&found.nodes[1]));
    let of: BTreeMap<usize, f64> = across
        .map(|found| (found.nodes[usize::from(own.contains(&found.nodes[1]))], found.agreement.share))
        .collect();
    (of.len(), of.values().sum::<f64>() / of.len().max(1) as f64)
}

/// What was done.
pub(super) struct Done<'a> {
    pub runs: &'a [Run],
    pub keyframes: &'a [Keyframes],
    pub optimized: &'a Optimized,
    pub corrected: &'a [Corrected],
}

impl Done<'_> {
    /// The report; `output_of` names the file of a group of recordings.
    pub(super) fn report(
        &self,
        delays_ns: &[i64],
        output_of: impl Fn(usize) -> PathBuf,
        stopwatch: &Stopwatch,
    ) -> Report {
        let (wall_s, cpu_s) = stopwatch.elapsed_s();
        let Self { runs, keyframes, optimized, corrected } = self;
        let groups = &optimized.groups;
        let recordings = runs.iter().zip(groups).enumerate().map(|(number, (run, group))| {
            let (shared_submaps, shared_agreement) = shared(number, keyframes, &optimized.loops);
            RecordingReport {
                path: run.path().display().to_string(),
                scans: keyframes[number].scans.len(),
                moved: optimized.is_closed[number] || corrected[number].refined.is_some(),
                output: output_of(*group).display().to_string(),
                joined: groups.iter().filter(|other| *other == group).count() > 1,
                added_s: delays_ns[number] / NS_PER_S,
                shared_submaps,
                shared_agreement,
                odometry: optimized.odometry[number],
            }
        });
        Report {
            recordings: recordings.collect(),
            counts: optimized.counts,
            wall_s,
            cpu_s,
            peak_memory_bytes: biplane_clock::peak_memory_bytes(),
        }
    }
}

impl Report {
    /// Says it; `output` is what was asked for, with so many loops.
    pub(super) fn say(&self, output: &Path, loops: usize, console: &Console) {
        let output = output.display().to_string();
        let (here, apart): (Vec<_>, Vec<_>) = self.recordings.iter().partition(|one| one.output == output);
        for recording in apart {
            // Said even when quiet: it is not in what was asked for.
            say(&format!(
                "biplane: {} saw no place that {} saw; it stays apart, in {}: of those that do not join, the \
                 longest way is in {output}",
                recording.path,
                here.first().map_or("the others", |first| &first.path),
                recording.output
            ));
        }
        for recording in self.recordings.iter().filter(|recording| recording.joined) {
            console.note(format!(
                "{}: {} stretches of its way are in other recordings, {:.0} % of their points alike",
                recording.path,
                recording.shared_submaps,
                100.0 * recording.shared_agreement
            ));
        }
        say_odometry(self, console);
        let moved: usize = here.iter().filter(|one| one.moved).map(|one| one.scans).sum();
        let what = match (loops, moved) {
            (0, 0) => poses_stay(without_loops(self.counts.not_better > 0)),
            _ => format!("{}, {} moved", counted(loops, "loop"), counted(moved, "scan")),
        };
        console.note(format!("{output}: {what}, {:.1} s", self.wall_s));
    }
}

/// What is said where no loop was closed; loops that draw a worse map are not.
pub(crate) const fn without_loops(has_worse_loops: bool) -> &'static str {
    if has_worse_loops { "no loop closed" } else { "no loop found" }
}

/// What is said where poses are not changed, and why.
pub(crate) fn poses_stay(why: &str) -> String {
    format!("{why}: the poses stay as they were recorded")
}

/// What each drive has taught of its odometry.
fn say_odometry(report: &Report, console: &Console) {
    for RecordingReport { path, odometry, .. } in &report.recordings {
        let Some(OdometryScale { way_scale: way, turn_scale: turn, .. }) = odometry else { continue };
        console.detail(|| {
            format!(
                "{path}: 1 m of the odometry was {:.3} m (sigma {:.3}), 1 degree {:.3} degrees (sigma {:.3})",
                way[0], way[1], turn[0], turn[1]
            )
        });
    }
}
