//! A method at work, whichever it is: what `Tracker` and `PairMatcher` share.
//!
//! Frame: map, or the base at the reference scan. Units: metres, radians.

use crate::align::{AlignParams, Alignment, Prior};
use crate::belief::Evidence;
use crate::doubt::Doubt;
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

/// What became of a scan that was to be learnt.
#[derive(Copy, Clone, PartialEq, Eq, Debug)]
pub enum Learnt {
    /// It was not.
    Nothing,
    /// The map took it.
    More,
    /// It is the reference scan of this number now.
    Reference(u8),
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
    pub fn learn(&mut self, map_from_base: &Pose2, points: &EndPoints, verdict: Verdict) -> Learnt {
        match self {
            Self::Map(matcher) => {
                if matcher.learn(map_from_base, points, verdict) {
                    Learnt::More
                } else {
                    Learnt::Nothing
                }
            }
            Self::Gradient(matcher) => {
                matcher.learn(map_from_base, points).map_or(Learnt::Nothing, Learnt::Reference)
            }
        }
    }

    /// Surfaces of the map that have come since its last chapter began.
    pub fn new_surfaces(&self) -> u32 {
        match self {
            Self::Map(matcher) => matcher.map().born(),
            Self::Gradient(_) => 0,
        }
    }

    /// Begins a chapter of the map, see [`LocalMap::begin_chapter`](crate::local_map::LocalMap::begin_chapter).
    pub fn begin_chapter(&mut self, chapter: u8, thinned: bool) {
        if let Self::Map(matcher) = self {
            matcher.map_mut().begin_chapter(chapter, thinned);
        }
    }

    /// What a match knows of the pose, and how much of it is believed.
    pub fn evidence(
        &self,
        points: &EndPoints,
        found: &Alignment,
        prior: &Prior,
        align: &AlignParams,
    ) -> (Evidence, Doubt) {
        match self {
            Self::Map(matcher) => {
                let evidence = Evidence::gather(matcher.map(), points, &found.pose, align);
                let (nu_rad, least) = (align.direction_noise_rad, align.least_information(prior));
                (evidence, Doubt::new(&evidence.across(), &evidence.along, nu_rad, least))
            }
            Self::Gradient(matcher) => {
                let common = align.beams_per_independent_one;
                let evidence = Evidence::shared(&(found.information * common), common, matcher.references());
                (evidence, Doubt::new(&evidence.across(), &evidence.along, 0.0, 0.0))
            }
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
