//! When the rig's world begins to move: the one thing that the devices of a rig share.
//!
//! A run begins once every present device streams, so that a client sees the start from all of them; it is
//! over when none streams any more, and the next one begins anew. Times are virtual nanoseconds.

use crate::devices::lms::scans::feed::Timeline;
use std::sync::{Arc, Mutex, PoisonError};

/// How a run begins.
#[derive(Clone, Copy, Debug)]
pub struct RunRules {
    /// How many lasers the rig has; they have the first places.
    pub lasers: usize,
    /// How many devices it has beside them, a base and an inertial unit; they have the places behind.
    pub others: usize,
    /// Pause between the last device's start and the run's.
    pub pause_ns: i64,
    /// Without all devices, the run begins this long after the first laser; `None` waits for all.
    pub patience_ns: Option<i64>,
    /// The run begins at this time, whatever streams.
    pub start_at_ns: Option<i64>,
}

#[derive(Debug, Default)]
struct RunState {
    streaming: Vec<bool>,
    first_ns: Option<i64>,
    start_ns: Option<i64>,
    number: u64,
}

/// The run, shared by the devices' threads.
#[derive(Clone, Debug)]
pub struct Run {
    rules: RunRules,
    state: Arc<Mutex<RunState>>,
}

/// A run that has begun, or will at a known time.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Begun {
    /// When the world's time is zero.
    pub start_ns: i64,
    /// 1 for the first run.
    pub number: u64,
}

impl Run {
    /// No device streams yet.
    #[must_use]
    pub fn new(rules: RunRules) -> Self {
        let streaming = vec![false; rules.lasers + rules.others];
        let start_ns = rules.start_at_ns;
        let number = u64::from(start_ns.is_some());
        Self { rules, state: Arc::new(Mutex::new(RunState { streaming, start_ns, number, first_ns: None })) }
    }

    /// A device tells whether it streams.
    pub fn report(&self, device: usize, streams: bool, now_ns: i64) {
        let mut state = self.state.lock().unwrap_or_else(PoisonError::into_inner);
        if let Some(entry) = state.streaming.get_mut(device) {
            *entry = streams;
        }
        let (all, none) = (state.streaming.iter().all(|&s| s), !state.streaming.contains(&true));
        if none {
            state.first_ns = None;
            if self.rules.start_at_ns.is_none() {
                state.start_ns = None;
            }
            return;
        }
        if state.first_ns.is_none() && state.streaming.iter().take(self.rules.lasers).any(|&s| s) {
            state.first_ns = Some(now_ns);
        }
        let waited_ns = state.first_ns.map(|first_ns| now_ns - first_ns);
        let impatient =
            waited_ns.zip(self.rules.patience_ns).is_some_and(|(waited, patience)| waited >= patience);
        if state.start_ns.is_none() && (all || impatient) {
            state.start_ns = Some(now_ns + self.rules.pause_ns);
            state.number += 1;
        }
    }

    /// The run, once it has begun or its start is known.
    #[must_use]
    pub fn begun(&self) -> Option<Begun> {
        let state = self.state.lock().unwrap_or_else(PoisonError::into_inner);
        state.start_ns.map(|start_ns| Begun { start_ns, number: state.number })
    }
}

/// World time of a device that waits for the run: long ago, so that it never steps back.
const LONG_AGO_NS: i64 = 1_000_000 * 1_000_000_000;

impl Timeline for Run {
    fn world_ns(&self, device_ns: i64) -> i64 {
        self.begun().map_or(device_ns - LONG_AGO_NS, |begun| device_ns - begun.start_ns)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const RULES: RunRules =
        RunRules { lasers: 1, others: 1, pause_ns: 100, patience_ns: None, start_at_ns: None };

    #[test]
    fn a_run_begins_a_pause_after_the_last_device_and_ends_with_the_last() {
        let run = Run::new(RULES);
        run.report(0, true, 10);
        assert_eq!(run.begun(), None);
        run.report(1, true, 20);
        run.report(0, true, 30);
        assert_eq!(run.begun(), Some(Begun { start_ns: 120, number: 1 }));
        run.report(0, false, 40);
        assert!(run.begun().is_some());
        run.report(1, false, 50);
        assert_eq!(run.begun(), None);
    }

    #[test]
    fn with_patience_one_laser_is_enough_but_a_base_alone_is_not() {
        let run = Run::new(RunRules { patience_ns: Some(50), ..RULES });
        run.report(1, true, 1);
        run.report(1, true, 99);
        assert_eq!(run.begun(), None);
        run.report(1, false, 100);
        run.report(0, true, 110);
        run.report(0, true, 159);
        assert_eq!(run.begun(), None);
        run.report(0, true, 160);
        assert_eq!(run.begun(), Some(Begun { start_ns: 260, number: 1 }));
    }
}
