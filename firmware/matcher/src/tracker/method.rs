//! A method at work, whichever it is: what `Tracker` and `PairMatcher` share.
//!
//! Frame: map, or the base at the reference scan. Units: meters, radians.

use biplane_geometry::Pose2;

use crate::map::MapSize;
use crate::params::{Method, TrackerParams};
use crate::pose_covariance::Evidence;
use crate::registration::degeneracy::Degeneracy;
use crate::registration::field_gradient::GradientMatcher;
use crate::registration::gauss_newton::Alignment;
use crate::registration::gauss_newton::params::BEAMS_PER_INDEPENDENT_ONE;
use crate::registration::gauss_newton::prior::Prior;
use crate::registration::journal::Journal;
use crate::registration::search::Window;
use crate::registration::verdict::Verdict;
use crate::scan::end_points::EndPoints;
use crate::tracker::map_matcher::MapMatcher;

/// The method with what it has learned.
#[derive(Clone, Debug)]
pub(crate) enum Engine {
    /// Everything mapped so far.
    Map(Box<MapMatcher>),
    /// The paper's.
    Gradient(Box<GradientMatcher>),
}

/// What became of a scan that was to be learned.
#[derive(Copy, Clone, PartialEq, Eq, Debug)]
pub(crate) enum Learned {
    /// It was not.
    Nothing,
    /// The map took it.
    More,
    /// It is the reference scan of this number now.
    Reference(u8),
}

impl Engine {
    /// The method that the parameters name, with all the memory it will ever have.
    pub(crate) fn new(params: &TrackerParams) -> Self {
        match params.method {
            Method::Map => Self::Map(Box::new(MapMatcher::new(params))),
            Method::Gradient => {
                Self::Gradient(Box::new(GradientMatcher::new(params.gradient, params.points.max_beams)))
            }
        }
    }

    /// Finds a scan's pose. `map` looks for it as far as the windows say, see [`MapMatcher::locate`];
    /// `gradient` climbs from the prior.
    pub(crate) fn locate(
        &mut self,
        points: &EndPoints,
        prior: &Prior,
        others: &[Pose2],
        heading_window: Window,
        window: Window,
    ) -> (Alignment, Verdict) {
        match self {
            Self::Map(matcher) => matcher.locate(points, prior, others, heading_window, window),
            Self::Gradient(matcher) => matcher.locate(points, prior),
        }
    }

    /// Takes over how well a match fits that is believed.
    pub(crate) fn accept(&mut self, found: &Alignment) {
        if let Self::Map(matcher) = self {
            matcher.accept(found);
        }
    }

    /// Finds the pose of the scan that was located last again, from another prior alone, with no search
    /// around.
    pub(crate) fn locate_near(&mut self, points: &EndPoints, prior: &Prior) -> (Alignment, Verdict) {
        match self {
            Self::Map(matcher) => matcher.locate_near(points, prior),
            Self::Gradient(matcher) => matcher.locate(points, prior),
        }
    }

    /// How much of a scan a pose explains, 0 to 1.
    pub(crate) fn score_at(&mut self, points: &EndPoints, pose: &Pose2) -> f64 {
        match self {
            Self::Map(matcher) => matcher.score_at(points, pose),
            Self::Gradient(matcher) => matcher.score_at(points, pose),
        }
    }

    /// Learns from a scan at its pose.
    pub(crate) fn learn(&mut self, map_from_base: &Pose2, points: &EndPoints, verdict: Verdict) -> Learned {
        match self {
            Self::Map(matcher) => {
                if matcher.learn(map_from_base, points, verdict) {
                    Learned::More
                } else {
                    Learned::Nothing
                }
            }
            Self::Gradient(matcher) => {
                matcher.learn(map_from_base, points).map_or(Learned::Nothing, Learned::Reference)
            }
        }
    }

    /// Learns what was left out of a scan at its pose.
    pub(crate) fn learn_left_out(&mut self, map_from_base: &Pose2, points: &EndPoints) {
        if let Self::Map(matcher) = self {
            matcher.map_mut().learn_left_out(map_from_base, points);
        }
    }

    /// Surfaces of the map that have come since its last submap began.
    pub(crate) fn new_surfels(&self) -> u32 {
        match self {
            Self::Map(matcher) => matcher.map().born(),
            Self::Gradient(_) => 0,
        }
    }

    /// Begins a submap of the map, see [`LocalMap::begin_submap`](crate::map::LocalMap::begin_chapter).
    pub(crate) fn begin_submap(&mut self, submap: u8, thinned: bool) {
        if let Self::Map(matcher) = self {
            matcher.map_mut().begin_submap(submap, thinned);
        }
    }

    /// What the match of the last scan knows of the pose, and how much of it is believed.
    pub(crate) fn evidence(&mut self, found: &Alignment, prior: &Prior) -> (Evidence, Degeneracy) {
        match self {
            Self::Map(matcher) => {
                let evidence = matcher.evidence(&found.pose);
                let align = matcher.align_params();
                let (nu_rad, minimum) = (align.direction_noise_rad, prior.min_information());
                (evidence, Degeneracy::new(&evidence.across(), &evidence.along, nu_rad, minimum))
            }
            Self::Gradient(matcher) => {
                let common = BEAMS_PER_INDEPENDENT_ONE;
                let evidence = Evidence::shared(&(found.information * common), common, matcher.references());
                (evidence, Degeneracy::new(&evidence.across(), &evidence.along, 0.0, 0.0))
            }
        }
    }

    /// Forgets all that was learned; the memory stays.
    pub(crate) fn forget(&mut self) {
        match self {
            Self::Map(matcher) => matcher.forget(),
            Self::Gradient(matcher) => matcher.forget(),
        }
    }

    /// How much of its pools the map uses by now; the method `gradient` has none.
    pub(crate) fn map_size(&self) -> MapSize {
        match self {
            Self::Map(matcher) => matcher.map().size(),
            Self::Gradient(_) => MapSize::default(),
        }
    }

    /// The iterations of the last scan.
    pub(crate) fn journal(&self) -> &Journal {
        match self {
            Self::Map(matcher) => &matcher.journal,
            Self::Gradient(matcher) => &matcher.journal,
        }
    }

    /// The same, to begin or to make one.
    pub(crate) fn journal_mut(&mut self) -> &mut Journal {
        match self {
            Self::Map(matcher) => &mut matcher.journal,
            Self::Gradient(matcher) => &mut matcher.journal,
        }
    }
}
