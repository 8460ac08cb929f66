//! The poses of a build: optimized, as recorded, or somebody else's; of one recording or of several in one
//! frame.
//!
//! Recordings may overlap in time (two robots, one clock). A model wants one trajectory, so each recording's
//! time is shifted inside the program to follow the one before; no stamp that is written is changed.

use std::fs::File;
use std::path::Path;

use crate::pipeline::summary::PosesFrom;
use crate::recordings::deskew::{StampedPose, Trajectory};
use crate::recordings::run::{Run, RunPoses, VerticalScans};
use crate::recordings::scan_geometry::RangeScan;
use crate::recordings::stamp_text::format_seconds;
use crate::recordings::wild_poses::remove_wild;
use crate::slam::occupancy::OccupancyGrid;
use crate::slam::refinement::spatial;
use crate::slam::refinement::spatial::choice::Refined;
use crate::slam::refinement::spatial::observability::Observed;
use crate::slam::{self, LoopParams, rewrite_recording};
use crate::view::floor_map;
use crate::view::floor_map::{FloorMapParams, PosedDrive};
use anyhow::{Context, bail};

use crate::cli::recordings::{optimize, poses};
use crate::cli::terminal::console::Console;
use biplane_cli::Outcome;

/// Scans farther than this from any pose of a foreign trajectory are not posed.
const LONGEST_GAP_NS: i64 = 1_000_000_000;
/// Time between two recordings inside the program, nanoseconds: longer than any gap that is bridged.
const BETWEEN_NS: i64 = 3_600_000_000_000;

/// One recording with its poses.
struct Drive<'a> {
    run: &'a Run,
    trajectory: Trajectory,
    /// One a horizontal scan.
    at_scans: Vec<Option<StampedPose>>,
    /// What is added to its stamps inside the program.
    shift_ns: i64,
    /// Height of the floor on which it was driven, meters; its own poses count from there.
    floor_m: f64,
}

impl<'a> Drive<'a> {
    fn new(run: &'a Run, trajectory: Trajectory, at_scans: Vec<Option<StampedPose>>) -> Self {
        Self { run, trajectory, at_scans, shift_ns: 0, floor_m: 0.0 }
    }

    /// A pose of its own as one of the building.
    fn raised(&self, pose: &StampedPose) -> StampedPose {
        StampedPose { z_m: pose.z_m + self.floor_m, ..*pose }
    }

    /// The poses of its scans as those of the building.
    fn known(&self) -> impl Iterator<Item = StampedPose> {
        self.at_scans.iter().flatten().map(|pose| self.raised(pose))
    }
}

/// See the module's text.
pub(crate) struct Posed<'a> {
    drives: Vec<Drive<'a>>,
    /// All poses, in the program's time.
    pub trajectory: Trajectory,
    /// The poses as they go to `trajectory.tum`.
    pub used: Vec<StampedPose>,
    /// Where they are from.
    pub from: PosesFrom,
    /// Loops that were closed, where any were searched for.
    pub loops: Option<usize>,
    /// Whether loops were found that are not closed, as they draw a worse map.
    pub has_worse_loops: bool,
    /// Poses that no motion explains, which were left out.
    pub wild_poses: usize,
    /// What the refinement in six directions found, where it found something.
    pub refined: Option<Refined>,
    /// Recordings that match none of those that are here.
    pub left_out: Vec<&'a Run>,
}

impl<'a> Posed<'a> {
    /// Somebody else's trajectory: a text, or the poses of another recording.
    pub(crate) fn foreign(runs: &'a [Run], path: &Path, console: &Console) -> anyhow::Result<Self> {
        // The poses may be those of a recording, but not of one in parts: the name is that of a file.
        File::open(path).with_context(|| format!("cannot read {}", path.display()))?;
        let mut used = poses::read(path, console)?;
        let wild_poses = remove_wild(&mut used);
        let trajectory = Trajectory::new(used.clone());
        let mut drives = Vec::new();
        for run in runs {
            let stamps_ns = run.stamps_and_poses()?.scan_stamps_ns;
            let at_scans: Vec<Option<StampedPose>> =
                stamps_ns.iter().map(|&stamp_ns| trajectory.at(stamp_ns, LONGEST_GAP_NS)).collect();
            if at_scans.iter().all(Option::is_none) {
                bail!(
                    "no scan of {} lies in the time of {}: {}",
                    run.path().display(),
                    path.display(),
                    spans(&stamps_ns, &used)
                );
            }
            drives.push(Drive::new(run, trajectory.clone(), at_scans));
        }
        Ok(Self { used, wild_poses, ..Self::of(drives, PosesFrom::Given, None) })
    }

    /// As they were recorded.
    pub(crate) fn recorded(runs: &'a [Run], console: &Console) -> anyhow::Result<Self> {
        Self::untouched(runs, |run, poses| console.report_poses(run.recording(), poses))
    }

    fn untouched(runs: &'a [Run], notify: impl Fn(&Run, &RunPoses)) -> anyhow::Result<Self> {
        let (mut drives, mut wild_poses) = (Vec::new(), 0);
        for run in runs {
            let poses = run.poses()?;
            notify(run, &poses);
            drives.push(Drive::new(run, poses.trajectory(), poses.at_scans()));
            wild_poses += poses.wild_poses;
        }
        Ok(Self { wild_poses, ..Self::of(drives, PosesFrom::Recorded, None) })
    }

    /// Optimized. A single recording that is optimized already, that has no loop, or whose scans have no
    /// poses, is taken as it is. Where not all of several join, those with the longest way are taken, and it
    /// is said what is left out. What is searched is kept in `searches`, and what a build that was killed has
    /// left there is not searched again.
    pub(crate) fn optimized(runs: &'a [Run], searches: &Path, console: &Console) -> anyhow::Result<Self> {
        if let [run] = runs {
            if rewrite_recording::is_optimized(run)? {
                return Ok(Self { from: PosesFrom::OptimizedBefore, ..Self::recorded(runs, console)? });
            }
            if run.poses()?.at_scans().iter().all(Option::is_none) {
                return Self::recorded(runs, console);
            }
        }
        let params = LoopParams::default();
        let all_keyframes = optimize::read(runs, &params, console)?;
        let mut checkpoint = optimize::checkpoint(searches, runs, console)?;
        let optimized = optimize::work(&all_keyframes, &params, &mut checkpoint, console);
        let kept = optimized.largest_group();
        let loops = optimized.loops_in(kept);
        let has_worse_loops = optimized.counts.not_better > 0;
        if runs.len() == 1 && loops == 0 {
            // What is to be told of them was told when they were read, or searched.
            let untouched = Self::untouched(runs, |_, _| ())?;
            return Ok(Self { loops: Some(0), has_worse_loops, ..untouched });
        }
        let spinner = console.spinner("every scan");
        let corrected = slam::poses_of_scans(runs, &all_keyframes, &optimized, &params)?;
        drop(spinner);
        let (mut drives, mut wild_poses, mut left_out) = (Vec::new(), 0, Vec::new());
        for (number, (run, corrected)) in runs.iter().zip(corrected).enumerate() {
            if optimized.groups[number] != kept {
                console.warn(format!(
                    "biplane: {} saw no place that {} saw; it is left out: of those that do not join, the longest \
                     way is kept",
                    run.path().display(),
                    runs[kept].path().display()
                ));
                left_out.push(run);
                continue;
            }
            let recorded = run.poses()?;
            wild_poses += recorded.wild_poses;
            drives.push(if optimized.is_closed[number] {
                let trajectory = corrected.trajectory(&recorded.vertical_poses);
                Drive::new(run, trajectory, corrected.scans)
            } else {
                Drive::new(run, recorded.trajectory(), recorded.at_scans())
            });
        }
        let from = if loops == 0 { PosesFrom::Recorded } else { PosesFrom::Optimized };
        Ok(Self { wild_poses, left_out, has_worse_loops, ..Self::of(drives, from, Some(loops)) })
    }

    /// With the poses of a single recording refined in all six directions, where that explains its beams
    /// better. Poses that were optimized before were refined then.
    pub(super) fn in_six_directions(mut self, console: &Console) -> anyhow::Result<Self> {
        let [drive] = &mut self.drives[..] else { return Ok(self) };
        if self.from == PosesFrom::OptimizedBefore {
            return Ok(self);
        }
        let _spinner = console.spinner("six directions");
        let Some(refined) = spatial::refine_run(drive.run, &drive.trajectory)? else { return Ok(self) };
        let moved = |pose: &StampedPose| refined.knots.pose(pose.stamp_ns);
        drive.trajectory = Trajectory::new(drive.trajectory.poses().iter().map(moved).collect());
        drive.at_scans = drive.at_scans.iter().map(|pose| pose.as_ref().map(moved)).collect();
        self.trajectory = drive.trajectory.clone();
        self.used = self.known();
        if self.from == PosesFrom::Recorded {
            self.from = PosesFrom::Refined;
        }
        self.refined = Some(refined);
        Ok(self)
    }

    fn of(mut drives: Vec<Drive<'a>>, from: PosesFrom, loops: Option<usize>) -> Self {
        let mut all = Vec::new();
        let mut end_ns: Option<i64> = None;
        for drive in &mut drives {
            let poses = drive.trajectory.poses();
            let first_ns = poses.first().map_or(0, |pose| pose.stamp_ns);
            let shift_ns = end_ns.map_or(0, |end_ns| (end_ns + BETWEEN_NS).saturating_sub(first_ns));
            let later = |pose: StampedPose| StampedPose { stamp_ns: pose.stamp_ns + shift_ns, ..pose };
            all.extend(poses.iter().map(|pose| later(drive.raised(pose))));
            end_ns = all.last().map(|pose: &StampedPose| pose.stamp_ns);
            drive.shift_ns = shift_ns;
        }
        let used = drives.iter().flat_map(Drive::known).collect();
        let trajectory = Trajectory::new(all);
        Self {
            drives,
            trajectory,
            used,
            from,
            loops,
            has_worse_loops: false,
            wild_poses: 0,
            refined: None,
            left_out: Vec::new(),
        }
    }

    /// A recording that is left out is data of the input that was lost.
    pub(crate) const fn outcome(&self) -> Outcome {
        if self.left_out.is_empty() { Outcome::Done } else { Outcome::Lossy }
    }

    /// Which of height, roll and pitch the drive tells; nothing is known of others' poses.
    pub(super) fn observed(&self) -> Option<Observed> {
        match self.from {
            PosesFrom::Given => None,
            _ => Some(self.refined.as_ref().map_or(Observed::default(), Refined::observed)),
        }
    }

    /// The pose of each horizontal scan that has one.
    pub(crate) fn known(&self) -> Vec<StampedPose> {
        self.drives.iter().flat_map(Drive::known).collect()
    }

    /// The same of the drives on one floor.
    pub(super) fn known_on(&self, floor_m: f64) -> Vec<StampedPose> {
        self.on(floor_m).flat_map(Drive::known).collect()
    }

    /// Heights of the floors on which was driven, from below, meters.
    pub(super) fn floors_m(&self) -> Vec<f64> {
        let mut floors_m: Vec<f64> = self.drives.iter().map(|drive| drive.floor_m).collect();
        floors_m.sort_by(f64::total_cmp);
        floors_m.dedup();
        floors_m
    }

    fn on(&self, floor_m: f64) -> impl Iterator<Item = &Drive<'a>> {
        self.drives.iter().filter(move |drive| drive.floor_m == floor_m)
    }

    /// The same drives, on a floor at this height.
    pub(super) fn raised(mut self, floor_m: f64) -> Self {
        if floor_m == 0.0 {
            return self;
        }
        self.drives.iter_mut().for_each(|drive| drive.floor_m = floor_m);
        let Self { drives, from, loops, has_worse_loops, wild_poses, refined, left_out, .. } = self;
        Self { has_worse_loops, wild_poses, refined, left_out, ..Self::of(drives, from, loops) }
    }

    /// Drives of several storeys, from below, whose frames are one.
    pub(super) fn together(storeys: Vec<Self>) -> Self {
        let is_optimized = |storey: &Self| storey.from == PosesFrom::Optimized;
        let changed = storeys.iter().find(|storey| is_optimized(storey)).or(storeys.last());
        let from = changed.map_or(PosesFrom::Recorded, |storey| storey.from);
        let has_worse_loops = storeys.iter().any(|storey| storey.has_worse_loops);
        let loops = storeys.iter().filter_map(|storey| storey.loops).reduce(|a, b| a + b);
        let wild_poses = storeys.iter().map(|storey| storey.wild_poses).sum();
        let left_out = storeys.iter().flat_map(|storey| storey.left_out.iter().copied()).collect();
        let drives = storeys.into_iter().flat_map(|storey| storey.drives).collect();
        Self { has_worse_loops, wild_poses, left_out, ..Self::of(drives, from, loops) }
    }

    /// Turns stamps in the program's time into those of the recordings.
    pub(crate) fn restore(&self, stamps_ns: &mut [i64]) {
        let begins_ns = |drive: &Drive<'_>| {
            let first_ns = drive.trajectory.poses().first().map_or(0, |pose| pose.stamp_ns);
            first_ns.saturating_add(drive.shift_ns).saturating_sub(BETWEEN_NS / 2)
        };
        let shifts: Vec<(i64, i64)> = self.drives.iter().map(|d| (begins_ns(d), d.shift_ns)).collect();
        for stamp_ns in stamps_ns {
            let of_drive = shifts.iter().rfind(|(begins_ns, _)| begins_ns <= stamp_ns);
            *stamp_ns = stamp_ns.saturating_sub(of_drive.map_or(0, |(_, shift_ns)| *shift_ns));
        }
    }

    /// The recordings by name, each as `name` calls its path; parts of one have one.
    pub(crate) fn named(&self, name: impl Fn(&Path) -> String) -> String {
        self.drives.iter().map(|drive| name(drive.run.path())).collect::<Vec<_>>().join(", ")
    }

    /// Horizontal scans, and how many of them have no pose.
    pub(crate) fn scans(&self) -> (usize, usize) {
        let all = self.drives.iter().map(|drive| drive.at_scans.len()).sum();
        (all, all - self.known().len())
    }

    /// Draws the map of each floor, from below, and counts the cells of all.
    pub(super) fn maps(
        &self,
        params: &FloorMapParams,
        progress: &dyn Fn(f64),
    ) -> anyhow::Result<(Vec<OccupancyGrid>, usize)> {
        let floors_m = self.floors_m();
        let draw = |floor_m: &f64| self.map_of(*floor_m, params, progress);
        let grids = floors_m.iter().map(draw).collect::<anyhow::Result<Vec<OccupancyGrid>>>()?;
        let bounds = grids.iter().filter_map(OccupancyGrid::bounds);
        let cells = bounds.map(|bounds| bounds.size().iter().product::<u64>() as usize).sum();
        Ok((grids, cells))
    }

    /// Draws the map of one floor; `told` hears which share of its scans is in it.
    fn map_of(
        &self,
        floor_m: f64,
        params: &FloorMapParams,
        progress: &dyn Fn(f64),
    ) -> anyhow::Result<OccupancyGrid> {
        let mut grid = OccupancyGrid::new(params.grid);
        let all: usize = self.on(floor_m).map(|drive| drive.at_scans.len()).sum();
        let mut before = 0;
        for drive in self.on(floor_m) {
            let posed = PosedDrive { run: drive.run, poses: &drive.at_scans, trajectory: &drive.trajectory };
            let mut notify = |scans: usize| progress((before + scans) as f64 / all.max(1) as f64);
            floor_map::draw_into(&mut grid, &posed, params, &mut notify)?;
            before += drive.at_scans.len();
        }
        Ok(grid)
    }

    /// The vertical scans of all recordings, in the program's time.
    pub(crate) fn vertical_scans(&self) -> anyhow::Result<Option<VerticalScans>> {
        let mut all: Option<VerticalScans> = None;
        for drive in &self.drives {
            let Some(mut scans) = drive.run.vertical_scans()? else { continue };
            for range_scan in &mut scans.range_scans {
                range_scan.stamp_ns = range_scan.stamp_ns.saturating_add(drive.shift_ns);
            }
            let Some(all) = &mut all else {
                all = Some(scans);
                continue;
            };
            if all.geometry != scans.geometry {
                bail!(
                    "the vertical laser of {} is another than the first recording's",
                    drive.run.path().display()
                );
            }
            // An empty scan between them: the last one of a recording is no neighbor of the next one's first.
            all.range_scans.extend(scans.range_scans.first().map(|first| RangeScan {
                stamp_ns: first.stamp_ns,
                ranges_m: vec![f32::NAN; first.ranges_m.len()],
            }));
            all.range_scans.append(&mut scans.range_scans);
            all.odd_scans += scans.odd_scans;
        }
        Ok(all)
    }
}

fn spans(scan_stamps_ns: &[i64], poses: &[StampedPose]) -> String {
    let span = |stamps_ns: &mut dyn Iterator<Item = i64>| {
        let (first_ns, last_ns) =
            stamps_ns.fold((i64::MAX, i64::MIN), |(first, last), stamp| (first.min(stamp), last.max(stamp)));
        format!("{} to {}", format_seconds(first_ns), format_seconds(last_ns))
    };
    let scans = span(&mut scan_stamps_ns.iter().copied());
    let poses = span(&mut poses.iter().map(|pose| pose.stamp_ns));
    format!("the scans are from {scans} s, the poses from {poses} s")
}
