//! Follows the base through scans and odometry: one pose with covariance for every scan.
//!
//! Frames: `map` is the base's frame at the first scan; `odom` is the odometry's own frame. Units: metres, radians.

use nalgebra::Matrix3;

use crate::align::{Alignment, Prior};
use crate::belief::Belief;
use crate::contest::{Contest, Expected};
use crate::covariance::{apart, inverse, rows, weakest_direction, weakest_sigma_m};
use crate::engine::{Engine, Learnt};
use crate::journal::Journal;
use crate::map_matcher::Verdict;
use crate::motion::{Found, MotionModel, Step, propagate};
use crate::odometry::Odometry;
use crate::params::TrackerParams;
use crate::points::EndPoints;
use crate::pose::Pose2;
use crate::scan::Scan;
use crate::search::Window;

/// What became of a scan.
#[derive(Copy, Clone, PartialEq, Eq, Debug)]
pub enum Outcome {
    /// The first usable scan: it begins the map.
    First,
    /// Matched in every direction.
    Matched,
    /// Matched, but some direction (along a bare corridor) is left to the odometry; the covariance says which.
    Weak,
    /// No match found, or none that can be believed yet: the pose follows the odometry, the covariance has grown.
    Lost,
    /// The scan holds no usable range: the pose follows the odometry, the covariance has grown.
    NoReturns,
}

/// The pose of one scan.
#[derive(Copy, Clone, PartialEq, Debug)]
pub struct Tracked {
    /// The base in the map at the scan's stamp.
    pub map_from_base: Pose2,
    /// Covariance of x (m), y (m) and theta (rad) in the map's axes.
    pub covariance: [[f64; 3]; 3],
    /// How well the scan fits, 0 (nothing) to 1 (every beam on a mapped surface).
    pub score: f64,
    /// Iterations of the alignment.
    pub iterations: u32,
    /// What became of the scan.
    pub outcome: Outcome,
    /// What became of its odometry.
    pub odometry: Odometry,
}

/// How much of the pools the map uses.
#[derive(Copy, Clone, PartialEq, Eq, Debug, Default)]
pub struct MapSize {
    /// Tiles in use, of [`MapParams::tiles`](crate::MapParams::tiles).
    pub tiles: usize,
    /// Surfaces in use, of [`MapParams::surfaces`](crate::MapParams::surfaces).
    pub surfaces: usize,
    /// Memory that holds them and the directory that finds them, bytes.
    pub bytes_used: usize,
    /// Memory that the pools may come to use, bytes; the system gives it page by page when it is first used.
    pub bytes_reserved: usize,
}

/// Matches scans one after the other; everything is allocated by [`Tracker::new`].
#[derive(Clone, Debug)]
pub struct Tracker {
    params: TrackerParams,
    points: EndPoints,
    motion: MotionModel,
    contest: Contest,
    engine: Engine,
    map_from_base: Pose2,
    /// Of the pose against the map around it: what the prior of the next match is worth.
    covariance: Matrix3<f64>,
    /// Of the pose against the truth.
    belief: Belief,
    started: bool,
}

impl Tracker {
    /// A tracker that has seen nothing.
    #[must_use]
    pub fn new(params: TrackerParams) -> Self {
        Self {
            points: EndPoints::new(params.points),
            motion: MotionModel::new(params.motion),
            contest: Contest::default(),
            engine: Engine::new(&params),
            map_from_base: Pose2::IDENTITY,
            covariance: Matrix3::zeros(),
            belief: Belief::new(params.belief),
            started: false,
            params,
        }
    }

    /// The parameters it was made with.
    #[must_use]
    pub fn params(&self) -> &TrackerParams {
        &self.params
    }

    /// How much of its pools the map uses by now; the method `gradient` has none.
    #[must_use]
    pub fn map_size(&self) -> MapSize {
        self.engine.map_size()
    }

    /// Keeps from here on the iterations of each scan, so many at most.
    pub fn keep_journal(&mut self, iterations: usize) {
        *self.engine.journal_mut() = Journal::with_capacity(iterations);
    }

    /// The iterations of the last scan that was matched; empty unless [`Tracker::keep_journal`] was called.
    #[must_use]
    pub fn journal(&self) -> &Journal {
        self.engine.journal()
    }

    /// The pose of the next scan. `odom_from_base` is the odometry's pose at the scan's stamp, `None` when there is none.
    pub fn track(&mut self, scan: &Scan, odom_from_base: Option<Pose2>) -> Tracked {
        self.engine.journal_mut().begin();
        self.points.fill(scan);
        let step = self.motion.predict(scan.stamp_ns, odom_from_base);
        let last = self.map_from_base;
        self.covariance = propagate(&self.covariance, &last, &step);
        if self.started {
            self.belief.moved(&last, &step);
        }
        self.map_from_base = last * step.last_from_base;
        let tracked = if self.points.as_slice().len() < self.params.points.min_points.max(1) {
            self.unmatched(Outcome::NoReturns)
        } else if self.started {
            self.matched(scan, &last, &step)
        } else {
            self.first()
        };
        let found = match tracked.outcome {
            Outcome::First | Outcome::Matched => Found::Surely,
            _ if step.measured() => Found::ByOdometry,
            Outcome::Weak => Found::ByOdometry,
            Outcome::Lost | Outcome::NoReturns => Found::Guessed,
        };
        self.motion.update(scan.stamp_ns, odom_from_base, (&last, &self.map_from_base), found);
        Tracked { odometry: step.odometry, ..tracked }
    }

    fn unmatched(&self, outcome: Outcome) -> Tracked {
        Tracked {
            map_from_base: self.map_from_base,
            covariance: rows(&self.belief.covariance_at(&self.map_from_base)),
            score: 0.0,
            iterations: 0,
            outcome,
            odometry: Odometry::default(),
        }
    }

    fn first(&mut self) -> Tracked {
        self.started = true;
        self.learn(Verdict::NewGround);
        self.belief.begun(&self.map_from_base);
        self.unmatched(Outcome::First)
    }

    fn matched(&mut self, scan: &Scan, last: &Pose2, step: &Step) -> Tracked {
        let Some(information) = inverse(&self.covariance) else { return self.unmatched(Outcome::Lost) };
        let prior = Prior { mean: self.map_from_base, information, measured: step.measured() };
        let (alignment, verdict) = self.locate(scan, last, step, &prior);
        let outcome = match verdict {
            Verdict::Found => self.accept(&alignment, &prior, step),
            Verdict::Contested | Verdict::NewGround | Verdict::Lost => Outcome::Lost,
        };
        self.learn(verdict);
        Tracked { score: alignment.fit.score(), iterations: alignment.iterations, ..self.unmatched(outcome) }
    }

    fn locate(&mut self, scan: &Scan, last: &Pose2, step: &Step, prior: &Prior) -> (Alignment, Verdict) {
        let (glance, window) = (self.glance(step), self.window());
        let again = *last * self.motion.same_again(scan.stamp_ns).last_from_base;
        let (alignment, verdict) = self.engine.locate(&self.points, prior, &[again, *last], glance, window);
        if verdict == Verdict::Found && step.measured() {
            let inertia = self.motion.inertia(scan.stamp_ns, step);
            let expected = Expected { prior, again: *last * inertia.last_from_base, inertia: &inertia };
            let search = &self.params.search;
            // An expected pose that explains little itself is no reason to wait.
            if !self.contest.settle(&alignment.pose, &expected, search.confirm_scans)
                && self.engine.score_at(&self.points, &prior.mean) >= search.lost_below_score
            {
                return (alignment, Verdict::Contested);
            }
        }
        (alignment, verdict)
    }

    fn learn(&mut self, verdict: Verdict) {
        if let Some((chapter, thinned)) = self.belief.open(&self.map_from_base, self.engine.new_surfaces()) {
            self.engine.begin_chapter(chapter, thinned);
        }
        match self.engine.learn(&self.map_from_base, &self.points, verdict) {
            Learnt::Nothing => {}
            Learnt::More => self.belief.learnt(),
            Learnt::Reference(number) => self.belief.refresh(number),
        }
    }

    fn accept(&mut self, alignment: &Alignment, prior: &Prior, step: &Step) -> Outcome {
        self.map_from_base = alignment.pose;
        if let Some(covariance) = inverse(&(prior.information_at(&alignment.pose) + alignment.information)) {
            self.covariance = covariance;
        }
        if !step.measured() || self.belief.is_due(&alignment.pose) {
            self.weigh(alignment, prior);
        }
        let weak_m = self.params.align.weak_m;
        if weakest_sigma_m(&alignment.information) <= weak_m {
            return Outcome::Matched;
        }
        // Along that direction the map around was learnt from the same odometry: it is no farther off than the pose.
        if let Some((_, direction)) = weakest_direction(&alignment.information) {
            self.covariance = apart(&self.covariance, direction, weak_m);
        }
        Outcome::Weak
    }

    /// Works out what the match says of the pose's error.
    fn weigh(&mut self, alignment: &Alignment, prior: &Prior) {
        let (evidence, doubt) = self.engine.evidence(&self.points, alignment, prior, &self.params.align);
        self.belief.matched((&evidence, &doubt), prior, &alignment.pose);
    }

    /// How far to look around for every scan: headings always, places too when there is no odometry.
    fn glance(&self, step: &Step) -> Window {
        let half_rad = self.params.search.glance_rad;
        Window { half_m: if step.measured() { 0.0 } else { 2.0 * step.sigma[0] }, half_rad }
    }

    /// How far the search has to look: as far as the prior may be off.
    fn window(&self) -> Window {
        let sigma_m = self.covariance[(0, 0)].max(self.covariance[(1, 1)]).sqrt();
        let search = &self.params.search;
        Window {
            half_m: (3.0 * sigma_m).max(search.least_half_m),
            half_rad: (3.0 * self.covariance[(2, 2)].sqrt()).max(search.least_half_rad),
        }
    }
}
