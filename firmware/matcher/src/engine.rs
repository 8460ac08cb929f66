//! A method at work, whichever it is: what `Tracker` and `PairMatcher` share.
//!
//! Frame: map, or the base at the reference scan. Units: metres, radians.

use crate::align::{Alignment, Prior};
use crate::gradient::GradientMatcher;
use crate::journal::Journal;
use crate::map_matcher::{MapMatcher, Verdict};
use crate::params::{Method, TrackerParams};
use crate::points::EndPoints;
use crate::pose::Pose2;
use crate::search::Window;
use crate::tracker::MapSize;

/// The method with what it has learnt.
#[derive(Clone, Debug)]
pub enum Engine {
    /// Everything mapped so far.
    Map(Box<MapMatcher>),
    /// The paper's.
    Gradient(Box<GradientMatcher>),
}

impl Engine {
    /// The method that the parameters name, with all the memory it will ever have.
    pub fn new(params: &TrackerParams) -> Self {
        match params.method {
            Method::Map => Self::Map(Box::new(MapMatcher::new(params))),
            Method::Gradient => Self::Gradient(Box::new(GradientMatcher::new(params))),
        }
    }

    /// Finds a scan's pose. `map` looks for it as far as the windows say, see [`MapMatcher::locate`]; `gradient` climbs from the prior.
    pub fn locate(
        &mut self,
        points: &EndPoints,
        prior: &Prior,
        others: &[Pose2],
        glance: Window,
        window: Window,
    ) -> (Alignment, Verdict) {
        match self {
            Self::Map(matcher) => matcher.locate(points, prior, others, glance, window),
            Self::Gradient(matcher) => matcher.locate(points, prior),
        }
    }

    /// How much of a scan a pose explains, 0 to 1.
    pub fn score_at(&self, points: &EndPoints, pose: &Pose2) -> f64 {
        match self {
            Self::Map(matcher) => matcher.score_at(points, pose),
            Self::Gradient(matcher) => matcher.score_at(points, pose),
        }
    }

    /// Learns from a scan at its pose.
    pub fn learn(&mut self, map_from_base: &Pose2, points: &EndPoints, verdict: Verdict) {
        match self {
            Self::Map(matcher) => matcher.learn(map_from_base, points, verdict),
            Self::Gradient(matcher) => matcher.learn(map_from_base, points),
        }
    }

    /// Forgets all that was learnt; the memory stays.
    pub fn forget(&mut self) {
        match self {
            Self::Map(matcher) => matcher.forget(),
            Self::Gradient(matcher) => matcher.forget(),
        }
    }

    /// How much of its pools the map uses by now; the method `gradient` has none.
    pub fn map_size(&self) -> MapSize {
        match self {
            Self::Map(matcher) => matcher.map().size(),
            Self::Gradient(_) => MapSize::default(),
        }
    }

    /// The iterations of the last scan.
    pub fn journal(&self) -> &Journal {
        match self {
            Self::Map(matcher) => &matcher.journal,
            Self::Gradient(matcher) => &matcher.journal,
        }
    }

    /// The same, to begin or to make one.
    pub fn journal_mut(&mut self) -> &mut Journal {
        match self {
            Self::Map(matcher) => &mut matcher.journal,
            Self::Gradient(matcher) => &mut matcher.journal,
        }
    }
}
