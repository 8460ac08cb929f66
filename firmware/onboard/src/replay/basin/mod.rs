//! Basin of convergence (the paper's figure 2): scans of a recording found in one earlier scan each, from
//! many wrong starts.
//!
//! For every pair of a list the second scan is matched against the first one alone, by the [`PairMatcher`]
//! that the methods give: no odometry, nothing mapped besides. The starts lie 10 cm off in x and in y (four
//! corners) and -30 to 30 degrees off in heading, about the pose that the list holds to be true. Times are
//! processor time of the calling thread.

pub(crate) mod overlay;
pub(crate) mod pairs;
pub(crate) mod scans;
pub(crate) mod starts;
pub(crate) mod summary;
#[cfg(test)]
mod tests;
pub(crate) mod trial;

use std::path::{Path, PathBuf};

use biplane_clock::thread_cpu_ns;
use biplane_matcher::{PairMatcher, Scan, TrackerParams};
use biplane_recording::Rig;

use crate::engine::out::sink::ITERATIONS_PER_SCAN;
use crate::output::journal::JournalFile;
use crate::replay::feeding::kept_scans;
use crate::types::error::OnboardError;

use crate::replay::basin::pairs::{Pair, read_pairs};
use crate::replay::basin::scans::{OwnScan, scans_of};
use crate::replay::basin::trial::Basin;
use crate::replay::basin::trial::Trial;

/// What to measure.
#[derive(Clone, PartialEq, Debug)]
pub(crate) struct BasinOptions {
    /// A capture, an import or a recording: one file, or its parts.
    pub inputs: Vec<PathBuf>,
    /// The rig; the input's own when `None`.
    pub rig: Option<Rig>,
    /// The list of pairs.
    pub pairs: PathBuf,
    /// The method and its parameters.
    pub matcher: TrackerParams,
    /// A table of the iterations of each pair's first start, to be made besides.
    pub journal: Option<PathBuf>,
    /// Replace an existing table.
    pub overwrite: bool,
}

/// Matches every pair from every start.
///
/// # Errors
/// When the recording or the list cannot be read, or a pair's scan is not in the recording.
pub(crate) fn measure(options: &BasinOptions) -> Result<Basin, OnboardError> {
    let pairs = read_pairs(&options.pairs)?;
    let kept = kept_scans(&options.inputs, options.rig.as_ref(), &options.matcher)?;
    let mut matcher = PairMatcher::new(options.matcher);
    let begin_journal = |path: &Path| JournalFile::create(path, options.overwrite);
    let mut journal = options.journal.as_deref().map(begin_journal).transpose()?;
    let mut basin = Basin { pairs, ambiguous: Vec::new(), prepare_ns: Vec::new(), trials: Vec::new() };
    for index in 0..basin.pairs.len() {
        let pair = basin.pairs[index];
        let (scans, ambiguous) = scans_of(&kept, &pair).map_err(|stamp_ns| OnboardError::NoScanAt {
            path: options.inputs.first().cloned().unwrap_or_default(),
            stamp_ns,
        })?;
        basin.ambiguous.push(ambiguous);
        if let Some(journal) = &mut journal {
            let [reference, other] = scans.each_ref().map(OwnScan::scan);
            note_first(&options.matcher, &pair, [&reference, &other], journal);
        }
        try_pair(&mut matcher, index, scans.each_ref().map(OwnScan::scan), &mut basin);
    }
    journal.map_or(Ok(()), JournalFile::finish)?;
    Ok(basin)
}

/// The iterations of a pair's first start, by a matcher of their own: keeping them takes time.
fn note_first(
    params: &TrackerParams,
    pair: &Pair,
    [reference, other]: [&Scan; 2],
    journal: &mut JournalFile,
) {
    let mut matcher = PairMatcher::new(*params);
    matcher.keep_journal(ITERATIONS_PER_SCAN);
    matcher.set_reference(reference);
    for (_, start) in starts::starts().take(1) {
        matcher.find(other, &starts::guess(starts::moved(&pair.first_from_second, &start)));
    }
    journal.write(other.stamp_ns, matcher.journal().iterations());
    journal.missing(matcher.journal().dropped());
}

/// All starts of one pair.
fn try_pair(matcher: &mut PairMatcher, pair: usize, [reference, other]: [Scan; 2], basin: &mut Basin) {
    let before_ns = thread_cpu_ns();
    matcher.set_reference(&reference);
    basin.prepare_ns.push(thread_cpu_ns() - before_ns);
    let truth = basin.pairs[pair].first_from_second;
    let own = matcher.find(&other, &starts::guess(truth)).reference_from_base;
    for (heading, start) in starts::starts() {
        let guess = starts::guess(starts::moved(&truth, &start));
        let before_ns = thread_cpu_ns();
        let found = matcher.find(&other, &guess);
        let cpu_ns = thread_cpu_ns() - before_ns;
        let [off, own_off] = [truth, own].map(|pose| pose.between(&found.reference_from_base));
        basin.trials.push(Trial {
            pair,
            heading,
            start,
            error_m: off.distance_m(),
            error_rad: off.theta_rad.abs(),
            own_error_m: own_off.distance_m(),
            own_error_rad: own_off.theta_rad.abs(),
            iterations: found.iterations,
            cpu_ns,
        });
    }
}
