//! When a fault acts: stretches of time with pauses between them, by chance or as told.
//!
//! Times are nanoseconds on the device's clock.

use crate::rng::Rng;
use std::collections::VecDeque;

/// A stretch of time, its end not included.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Episode {
    /// First instant.
    pub from_ns: i64,
    /// First instant after it.
    pub to_ns: i64,
}

impl Episode {
    /// Whether this instant lies in it.
    #[must_use]
    pub fn holds(self, now_ns: i64) -> bool {
        (self.from_ns..self.to_ns).contains(&now_ns)
    }
}

/// How episodes follow each other.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct EpisodeParams {
    /// Shortest pause before an episode, seconds. Larger leaves a driver more time to recover.
    pub shortest_pause_s: f64,
    /// Mean of what the pause is longer than that (exponential), seconds. Smaller: more episodes.
    pub mean_pause_s: f64,
    /// Shortest episode, seconds.
    pub shortest_s: f64,
    /// Longest episode, seconds; lengths between the two are equally likely.
    pub longest_s: f64,
}

/// Episodes one after another, asked for with times that do not step back: what is over is forgotten.
#[derive(Clone, Debug)]
pub struct Episodes {
    chance: Option<(EpisodeParams, Rng)>,
    given: VecDeque<Episode>,
    next: Option<Episode>,
}

impl Episodes {
    /// By chance, the first one a pause after the first question. They depend on `rng` and the time of that
    /// question alone.
    #[must_use]
    pub fn by_chance(params: EpisodeParams, rng: Rng) -> Self {
        Self { chance: Some((params, rng)), given: VecDeque::new(), next: None }
    }

    /// These and no more, in order of time.
    #[must_use]
    pub fn given(episodes: &[Episode]) -> Self {
        Self { chance: None, given: episodes.iter().copied().collect(), next: None }
    }

    /// The episode that holds `now_ns` or is the next one after it; `None` when no more come.
    pub fn current_or_next(&mut self, now_ns: i64) -> Option<Episode> {
        let mut after_ns = now_ns;
        while self.next.is_none_or(|episode| episode.to_ns <= now_ns) {
            after_ns = self.next.map_or(after_ns, |episode| episode.to_ns);
            self.next = match &mut self.chance {
                Some((params, rng)) => Some(draw(*params, after_ns, rng)),
                None => Some(self.given.pop_front()?),
            };
        }
        self.next
    }

    /// The episode that holds `now_ns`.
    pub fn at(&mut self, now_ns: i64) -> Option<Episode> {
        self.current_or_next(now_ns).filter(|episode| episode.holds(now_ns))
    }
}

fn draw(params: EpisodeParams, after_ns: i64, rng: &mut Rng) -> Episode {
    let pause_s = params.shortest_pause_s + rng.exponential(params.mean_pause_s);
    let length_s = rng.between(params.shortest_s, params.longest_s);
    let from_ns = after_ns + (pause_s * 1e9) as i64;
    // At least a nanosecond long, or the search for one that is not over would not end.
    Episode { from_ns, to_ns: from_ns + ((length_s * 1e9) as i64).max(1) }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn pauses_and_lengths_lie_where_they_were_asked_to() {
        let params =
            EpisodeParams { shortest_pause_s: 2.0, mean_pause_s: 3.0, shortest_s: 0.5, longest_s: 1.5 };
        let mut episodes = Episodes::by_chance(params, Rng::new(1, 2, 3));
        let (mut end_ns, mut paused_s) = (0, 0.0);
        for _ in 0..2000 {
            let episode = episodes.current_or_next(end_ns).expect("they never end");
            let (pause_s, length_s) =
                ((episode.from_ns - end_ns) as f64 * 1e-9, (episode.to_ns - episode.from_ns) as f64 * 1e-9);
            assert!(pause_s >= 1.999 && (0.499..1.501).contains(&length_s), "{pause_s} {length_s}");
            paused_s += pause_s / 2000.0;
            end_ns = episode.to_ns;
        }
        assert!((paused_s - 5.0).abs() < 0.25, "{paused_s}");
    }

    #[test]
    fn told_episodes_come_as_told_and_end() {
        let given = [Episode { from_ns: 10, to_ns: 20 }, Episode { from_ns: 30, to_ns: 31 }];
        let mut episodes = Episodes::given(&given);
        let inside: Vec<i64> = (0..50).filter(|&t| episodes.at(t).is_some()).collect();
        assert_eq!(inside, (10..20).chain([30]).collect::<Vec<_>>());
        assert_eq!(episodes.current_or_next(99), None);
    }
}
