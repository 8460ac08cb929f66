//! A capture's counters for a mock base that reports counts: as they were at that time since the capture's
//! start, held in between.

use super::base_track::BaseTrack;
use crate::devices::base::counters::{Counts, CountsFeed};
use crate::devices::run::Run;
use std::sync::Arc;

/// The feed.
pub struct CaptureCounts {
    track: Arc<BaseTrack>,
    origin_ns: i64,
    run: Run,
    once: bool,
}

impl CaptureCounts {
    /// `origin_ns` is the capture's start; with `once` the feed ends with the capture.
    #[must_use]
    pub fn new(track: Arc<BaseTrack>, origin_ns: i64, run: Run, once: bool) -> Self {
        Self { track, origin_ns, run, once }
    }
}

impl CountsFeed for CaptureCounts {
    fn counts(&mut self, now_ns: i64) -> Option<Counts> {
        let counts = &self.track.counts;
        let Some(begun) = self.run.begun() else { return counts.first().map(|(_, counts)| *counts) };
        let at_ns = now_ns - begun.start_ns + self.origin_ns;
        let behind = counts.partition_point(|(time_ns, _)| *time_ns <= at_ns);
        if self.once && behind == counts.len() && counts.last().is_some_and(|(last_ns, _)| at_ns > *last_ns) {
            return None;
        }
        counts.get(behind.saturating_sub(1)).map(|(_, counts)| *counts)
    }
}
