//! The host's clock: UTC against the run's time, with steps if asked for.
//!
//! A mock cannot step the clock of the machine it runs on, and should not. It can be honest where it is the
//! host itself: in a simulated capture, whose `log_time` is the host's UTC, and in a test that gives a driver
//! both its times, the monotonic one, which never steps, and this one. The steps are those of a machine that
//! boots with a wrong clock, gets the time from the network, loses it again: away by seconds to hours,
//! forwards or backwards, and back after a while.

use super::episodes::{Episode, EpisodeParams, Episodes};
use crate::rng::Rng;

/// How wrong the clock goes.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ClockStepParams {
    /// When it is wrong.
    pub wrong: EpisodeParams,
    /// Smallest step, seconds.
    pub smallest_step_s: f64,
    /// Largest step, seconds; logarithms of steps between the two are equally likely, both signs alike.
    pub largest_step_s: f64,
}

impl Default for ClockStepParams {
    fn default() -> Self {
        let wrong =
            EpisodeParams { shortest_pause_s: 1.5, mean_pause_s: 4.0, shortest_s: 1.0, longest_s: 6.0 };
        Self { wrong, smallest_step_s: 1.0, largest_step_s: 7200.0 }
    }
}

/// The host's UTC as a function of the run's time.
#[derive(Clone, Debug)]
pub struct HostClock {
    zero_utc_ns: i64,
    steps: Option<Steps>,
}

#[derive(Clone, Debug)]
struct Steps {
    params: ClockStepParams,
    rng: Rng,
    episodes: Episodes,
    /// The episode whose step is drawn, and the step.
    drawn: Option<(Episode, i64)>,
}

impl HostClock {
    /// A clock in good order: `zero_utc_ns` at time 0 of the run.
    #[must_use]
    pub fn steady(zero_utc_ns: i64) -> Self {
        Self { zero_utc_ns, steps: None }
    }

    /// A clock that steps.
    #[must_use]
    pub fn stepping(zero_utc_ns: i64, params: ClockStepParams, mut rng: Rng) -> Self {
        let episodes = Episodes::by_chance(params.wrong, rng.branch());
        let steps = Steps { params, rng, episodes, drawn: None };
        Self { zero_utc_ns, steps: Some(steps) }
    }

    /// What the clock shows at a time of the run, which does not step back between calls.
    pub fn utc_ns(&mut self, run_ns: i64) -> i64 {
        let wrong_ns = self.steps.as_mut().map_or(0, |steps| steps.offset_ns(run_ns));
        self.zero_utc_ns + run_ns + wrong_ns
    }
}

impl Steps {
    fn offset_ns(&mut self, run_ns: i64) -> i64 {
        let Some(episode) = self.episodes.at(run_ns) else { return 0 };
        match self.drawn {
            Some((drawn, step_ns)) if drawn == episode => step_ns,
            _ => {
                let (low, high) = (self.params.smallest_step_s.ln(), self.params.largest_step_s.ln());
                let step_ns = (self.rng.between(low, high).exp() * 1e9) as i64;
                let step_ns = if self.rng.unit() < 0.5 { -step_ns } else { step_ns };
                self.drawn = Some((episode, step_ns));
                step_ns
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_clock_steps_both_ways_by_seconds_to_hours_and_comes_back() {
        let mut clock = HostClock::stepping(5_000, ClockStepParams::default(), Rng::new(3, 0, 0));
        let offsets: Vec<i64> =
            (0..600_000).map(|ms| clock.utc_ns(ms * 1_000_000) - ms * 1_000_000 - 5_000).collect();
        let right = offsets.iter().filter(|&&offset| offset == 0).count() as f64 / 600_000.0;
        assert!((0.4..0.8).contains(&right), "{right}");
        let mut steps: Vec<i64> = offsets.clone();
        steps.dedup();
        steps.retain(|&offset| offset != 0);
        assert!((40..100).contains(&steps.len()), "{}", steps.len());
        assert!(steps.iter().all(|step| (1_000_000_000..=7_200_000_000_000).contains(&step.abs())));
        assert!(steps.iter().any(|&step| step < -100_000_000_000) && steps.iter().any(|&step| step > 0));
    }
}
