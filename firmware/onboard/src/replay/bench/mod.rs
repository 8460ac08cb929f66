//! `bench`: what matching costs, on the scans of a log.
//!
//! The log goes once through the engine that `record` and `replay` share, which keeps what its tracker was
//! given. Then fresh trackers get the same scans, one after the other on the calling thread, and each call is
//! timed: processor time of the thread, and wall time. No scan is left out; a tracker begins with memory that
//! the system has not given yet, as in a run.

pub(crate) mod allocations;
pub(crate) mod spread;
#[cfg(test)]
mod tests;
pub(crate) mod worst_case;

use std::path::PathBuf;

use biplane_clock::{monotonic_ns, thread_cpu_ns};
use biplane_matcher::{Beam, MapSize, Method, Outcome, Tracker, TrackerParams};
use biplane_recording::Rig;
use serde::Serialize;

use crate::engine::localize::tracker_inputs::KeptScans;
use crate::replay::bench::spread::Spread;
use crate::replay::feeding::kept_scans;
use crate::types::error::OnboardError;

/// What to measure.
#[derive(Clone, PartialEq, Debug)]
pub(crate) struct BenchOptions {
    /// A capture, an import or a recording: one file, or its parts (see
    /// [`Recording`](biplane_recording::Recording)).
    pub inputs: Vec<PathBuf>,
    /// The rig; the input's own when `None`.
    pub rig: Option<Rig>,
    /// How scans are matched.
    pub matcher: TrackerParams,
    /// How many trackers get the scans, one after the other; at least 1.
    pub repeat: u32,
}

/// What became of the scans of one pass.
#[derive(Copy, Clone, PartialEq, Eq, Debug, Default, Serialize)]
pub(crate) struct Outcomes {
    /// Matched, in every direction or not.
    pub matched: u64,
    /// Of these, scans that left a direction to the odometry.
    pub weak: u64,
    /// No match was found.
    pub lost: u64,
    /// Without a usable range.
    pub no_returns: u64,
}

/// The map at the end of a pass.
#[derive(Copy, Clone, PartialEq, Debug, Serialize)]
pub(crate) struct MapReport {
    /// Tiles in use.
    pub tiles: usize,
    /// Surfaces in use.
    pub surfaces: usize,
    /// Memory in use, bytes.
    pub bytes_used: usize,
    /// Memory that the pools may come to use, bytes.
    pub bytes_reserved: usize,
}

/// What matching costs. Times in microseconds a scan.
#[derive(Clone, PartialEq, Debug, Serialize)]
pub(crate) struct BenchReport {
    /// The matcher.
    pub matcher: &'static str,
    /// Scans of the log that the tracker gets.
    pub scans: usize,
    /// Beams of a scan on average, usable or not.
    #[serde(rename = "beams_a_scan")]
    pub beams_per_scan: f64,
    /// Passes over all scans, each with a fresh tracker.
    pub passes: u32,
    /// Scans a second of processor time.
    pub scans_per_s: f64,
    /// Processor time of the thread, all scans of all passes.
    pub cpu_us: Spread,
    /// The same, of each scan the least of its passes: what else the machine did drops out.
    #[serde(rename = "cpu_least_us")]
    pub cpu_min_us: Spread,
    /// Wall time, all scans of all passes.
    pub wall_us: Spread,
    /// What reading the two clocks adds to each scan; it is not taken off.
    pub clock_us: f64,
    /// Iterations of the alignment, on average.
    #[serde(rename = "iterations_a_scan")]
    pub iterations_per_scan: f64,
    /// Processor time by beams and iterations, whatever else a scan needs included, nanoseconds.
    #[serde(rename = "ns_a_beam_and_iteration")]
    pub ns_per_beam_and_iteration: f64,
    /// Allocations from the second scan on, all passes; nothing where the program does not count.
    pub allocations: Option<u64>,
    /// What became of the scans, one pass.
    pub outcomes: Outcomes,
    /// The map at the end.
    pub map: MapReport,
}

/// Measures.
///
/// # Errors
/// What is wrong with input or rig, and an input without a scan to match.
pub(crate) fn bench(options: &BenchOptions) -> Result<BenchReport, OnboardError> {
    let kept = kept_scans(&options.inputs, options.rig.as_ref(), &options.matcher)?;
    let passes = options.repeat.max(1);
    let mut watch = Watch::default();
    for _ in 0..passes {
        watch.pass(&kept, &options.matcher);
    }
    Ok(watch.report(&kept, options.matcher.method, passes))
}

/// The sums of all passes.
#[derive(Default)]
struct Watch {
    cpu_ns: Vec<i64>,
    cpu_min_ns: Vec<i64>,
    wall_ns: Vec<i64>,
    beams: usize,
    beam_iterations: f64,
    iterations: u64,
    allocations: Option<u64>,
    outcomes: Outcomes,
    map: MapSize,
}

impl Watch {
    fn pass(&mut self, kept: &KeptScans, params: &TrackerParams) {
        let mut tracker = Tracker::new(*params);
        let mut beams: Vec<Beam> = Vec::new();
        self.outcomes = Outcomes::default();
        self.cpu_min_ns.resize(kept.len(), i64::MAX);
        for index in 0..kept.len() {
            let Some((scan, odom_from_base)) = kept.get(index, &mut beams) else { break };
            let ((tracked, wall_ns, cpu_ns), allocated) = allocations::during(|| {
                let (wall_ns, cpu_ns) = (monotonic_ns(), thread_cpu_ns());
                let tracked = tracker.track(&scan, odom_from_base);
                let cpu_ns = thread_cpu_ns() - cpu_ns;
                (tracked, monotonic_ns() - wall_ns, cpu_ns)
            });
            if let (Some(allocated), true) = (allocated, index > 0) {
                *self.allocations.get_or_insert(0) += allocated;
            }
            self.cpu_ns.push(cpu_ns);
            self.wall_ns.push(wall_ns);
            self.cpu_min_ns[index] = self.cpu_min_ns[index].min(cpu_ns);
            self.beams += scan.beams.len();
            self.iterations += u64::from(tracked.iterations);
            self.beam_iterations += scan.beams.len() as f64 * f64::from(tracked.iterations);
            self.outcomes.count(tracked.outcome);
        }
        self.map = tracker.map_size();
    }

    fn report(mut self, kept: &KeptScans, matcher: Method, passes: u32) -> BenchReport {
        let calls = self.cpu_ns.len().max(1) as f64;
        let cpu_ns = self.cpu_ns.iter().sum::<i64>().max(1) as f64;
        let MapSize { tiles, surfaces, bytes_used, bytes_reserved, .. } = self.map;
        BenchReport {
            matcher: matcher.name(),
            scans: kept.len(),
            beams_per_scan: self.beams as f64 / calls,
            passes,
            scans_per_s: calls / (cpu_ns * 1e-9),
            cpu_us: Spread::of_ns(&mut self.cpu_ns),
            cpu_min_us: Spread::of_ns(&mut self.cpu_min_ns),
            wall_us: Spread::of_ns(&mut self.wall_ns),
            clock_us: clock_us(),
            iterations_per_scan: self.iterations as f64 / calls,
            ns_per_beam_and_iteration: cpu_ns / self.beam_iterations.max(1.0),
            allocations: self.allocations,
            outcomes: self.outcomes,
            map: MapReport { tiles, surfaces, bytes_used, bytes_reserved },
        }
    }
}

impl Outcomes {
    fn count(&mut self, outcome: Outcome) {
        match outcome {
            Outcome::First => {}
            Outcome::Matched => self.matched += 1,
            Outcome::Weak => {
                self.matched += 1;
                self.weak += 1;
            }
            Outcome::Lost => self.lost += 1,
            Outcome::NoReturns => self.no_returns += 1,
        }
    }
}

/// What the clocks say of nothing at all, the median.
fn clock_us() -> f64 {
    let mut nothing_ns: Vec<i64> = (0..1001)
        .map(|_| {
            let before_ns = thread_cpu_ns();
            thread_cpu_ns() - before_ns
        })
        .collect();
    Spread::of_ns(&mut nothing_ns).p50
}
