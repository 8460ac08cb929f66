//! Follows the base through scans and odometry: one pose with covariance for every scan.
//!
//! Frames: `map` is the base's frame at the first scan; `odom` is the odometry's own frame. Units: meters,
//! radians.

pub(crate) mod held_match;
pub(crate) mod map_matcher;
pub(crate) mod method;
pub(crate) mod pair;
pub(crate) mod range_noise;
pub(crate) mod step_choice;
pub(crate) mod usual_score;

use nalgebra::Matrix3;

use crate::map::MapSize;
use crate::motion::innovation_gate::{Expected, InnovationGate};
use crate::motion::odometry::Odometry;
use crate::motion::odometry_scale::OdometryScale;
use crate::motion::propagation::propagate;
use crate::motion::steadiness::Steadiness;
use crate::motion::{Found, MotionModel, Prediction, Step};
use crate::moving::{MovingObjects, Outlook};
use crate::params::{Method, TrackerParams};
use crate::pose_covariance::PoseCovariance;
use crate::registration::covariance::{apart, inverse, rows, weakest_direction, weakest_sigma_m};
use crate::registration::gauss_newton::Alignment;
use crate::registration::gauss_newton::params::WEAK_M;
use crate::registration::gauss_newton::prior::Prior;
use crate::registration::journal::Journal;
use crate::registration::search::Window;
use crate::registration::verdict::{LOST_BELOW_SCORE, Verdict};
use crate::scan::Scan;
use crate::scan::end_points::EndPoints;
use crate::tracker::held_match::{HeldMatches, Way};
use crate::tracker::method::{Engine, Learned};
use crate::tracker::step_choice::{Expectation, StepChoice, is_worth_its_contradiction};
use crate::tracker::usual_score::UsualScore;
use biplane_geometry::Pose2;

/// What became of a scan.
#[derive(Copy, Clone, PartialEq, Eq, Debug)]
pub enum Outcome {
    /// The first usable scan: it begins the map.
    First,
    /// Matched in every direction.
    Matched,
    /// Matched, but some direction (along a bare corridor) is left to the odometry; the covariance says
    /// which.
    Weak,
    /// No match found, or none that can be believed yet: the pose follows the odometry, the covariance has
    /// grown.
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

/// Headings this far on either side of the prior are looked at, radians: odometry read a moment before or
/// after the scan is off by degrees in a turn. Error 0.0248 m also when halved or doubled. Without odometry
/// 4.2719 m and 0.0255 m.
const HEADING_WINDOW_RAD: f64 = 0.3;

/// Matches scans one after the other; everything is allocated by [`Tracker::new`].
#[derive(Clone, Debug)]
pub struct Tracker {
    params: TrackerParams,
    points: EndPoints,
    /// Those of the scan before.
    before: EndPoints,
    moving: MovingObjects,
    motion: MotionModel,
    innovation_gate: InnovationGate,
    held_matches: HeldMatches,
    usual_score: UsualScore,
    engine: Engine,
    map_from_base: Pose2,
    /// Of the pose against the map around it: what the prior of the next match is worth.
    covariance: Matrix3<f64>,
    /// Of the pose against the truth.
    pose_covariance: PoseCovariance,
    started: bool,
    /// Whether the last scan's pose came from the scan.
    is_placed: bool,
}

impl Tracker {
    /// A tracker that has seen nothing.
    #[must_use]
    pub fn new(params: TrackerParams) -> Self {
        Self {
            points: EndPoints::new(params.points),
            before: EndPoints::new(params.points),
            moving: MovingObjects::new(params.points.max_beams),
            motion: match params.method {
                Method::Map => MotionModel::new(params.motion),
                Method::Gradient => MotionModel::taking_odometry_as_it_is(params.motion),
            },
            innovation_gate: InnovationGate::default(),
            held_matches: HeldMatches::default(),
            usual_score: UsualScore::default(),
            engine: Engine::new(&params),
            map_from_base: Pose2::IDENTITY,
            covariance: Matrix3::zeros(),
            pose_covariance: PoseCovariance::new(params.pose_covariance),
            started: false,
            is_placed: false,
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

    /// What scans have shown so far of the odometry's scales; the method `gradient` learns nothing of them.
    #[must_use]
    pub fn odometry_scale(&self) -> OdometryScale {
        self.motion.odometry_scale()
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

    /// The pose of the next scan. `odom_from_base` is the odometry's pose at the scan's stamp, `None` when
    /// there is none.
    pub fn track(&mut self, scan: &Scan, odom_from_base: Option<Pose2>) -> Tracked {
        self.engine.journal_mut().begin();
        std::mem::swap(&mut self.points, &mut self.before);
        self.points.fill(scan);
        let prediction = self.motion.predict(scan.stamp_ns, odom_from_base);
        let (last, before) = (self.map_from_base, self.covariance);
        if self.params.method == Method::Map {
            let step = prediction.step.last_from_base;
            let scans = self.motion.scans_since_last(scan.stamp_ns);
            let (is_blind, loses_sight) = (odom_from_base.is_none(), self.moving.loses_sight(&step, scans));
            if loses_sight && !is_blind && self.is_placed {
                self.engine.learn_left_out(&last, &self.before);
            }
            // Without odometry the scans alone tell where the base is, and all of them is needed.
            if loses_sight || is_blind {
                self.moving.pause();
            }
            let is_reliable = self.motion.is_reliable();
            let outlook = Outlook { map_from_base: last * step, scans, is_reliable };
            self.moving.label(&mut self.points, &outlook);
        }
        let (tracked, step) = if self.started && !self.points.are_too_few() {
            self.matched(scan, &last, &before, &prediction)
        } else {
            let step = prediction.step;
            self.follow(&last, &before, &step);
            (if self.points.are_too_few() { self.unmatched(Outcome::NoReturns) } else { self.first() }, step)
        };
        self.moving.update(&self.map_from_base);
        self.is_placed = matches!(tracked.outcome, Outcome::First | Outcome::Matched | Outcome::Weak);
        let found = match tracked.outcome {
            Outcome::First | Outcome::Matched => Found::Surely,
            Outcome::Weak => Found::ButForTheWay,
            _ if step.measured() => Found::ByOdometry,
            Outcome::Lost | Outcome::NoReturns => Found::Guessed,
        };
        self.motion.update(scan.stamp_ns, odom_from_base, (&last, &self.map_from_base), found);
        Tracked { odometry: step.odometry, ..tracked }
    }

    fn unmatched(&self, outcome: Outcome) -> Tracked {
        Tracked {
            map_from_base: self.map_from_base,
            covariance: rows(&self.pose_covariance.covariance_at(&self.map_from_base)),
            score: 0.0,
            iterations: 0,
            outcome,
            odometry: Odometry::default(),
        }
    }

    fn first(&mut self) -> Tracked {
        self.started = true;
        self.learn(Verdict::NewGround);
        self.pose_covariance.begun(&self.map_from_base);
        self.unmatched(Outcome::First)
    }

    /// Where the step leads, without a look at the scan.
    fn follow(&mut self, last: &Pose2, before: &Matrix3<f64>, step: &Step) {
        self.covariance = propagate(before, last, step);
        self.map_from_base = *last * step.last_from_base;
        if self.started {
            self.pose_covariance.moved(last, step);
        }
    }

    /// Where the base is when it made this step, given the covariance before.
    fn expected(&self, last: &Pose2, before: &Matrix3<f64>, step: &Step) -> Option<Expectation> {
        let covariance = propagate(before, last, step);
        let mean = *last * step.last_from_base;
        let information = inverse(&covariance)?;
        let prior = Prior { mean, information, measured: step.measured(), gives_way: true };
        Some(Expectation { step: *step, covariance, prior })
    }

    fn matched(
        &mut self,
        scan: &Scan,
        last: &Pose2,
        before: &Matrix3<f64>,
        prediction: &Prediction,
    ) -> (Tracked, Step) {
        let step = prediction.step;
        let Some(mut taken) = self.expected(last, before, &step) else {
            self.follow(last, before, &step);
            return (self.unmatched(Outcome::Lost), step);
        };
        self.covariance = taken.covariance;
        let mut found = self.locate(scan, last, (&step, &prediction.steadiness), &taken.prior);
        let rival = prediction.rival.and_then(|rival| self.expected(last, before, &rival));
        if let Some(rival) = rival {
            let other = self.engine.locate_near(&self.points, &rival.prior);
            let choice = StepChoice::new(&taken, &rival, prediction);
            if prediction.odds_against_leap.is_some()
                && let Some((squared, was_made)) = choice.leap([&found, &other])
            {
                self.motion.note_leap(squared, was_made);
            }
            if choice.is_won_by(&other, &found) {
                (found, taken) = (other, rival);
            }
        }
        let (alignment, verdict) = found;
        self.covariance = taken.covariance;
        self.map_from_base = taken.prior.mean;
        self.pose_covariance.moved(last, &taken.step);
        let outcome = match verdict {
            Verdict::Found => self.accept(&alignment, &taken.prior, &taken.step),
            Verdict::Unconfirmed | Verdict::NewGround | Verdict::Lost => Outcome::Lost,
        };
        let score = alignment.fit.score();
        if let Engine::Map(matcher) = &self.engine {
            let contradicts = verdict == Verdict::Found && self.usual_score.is_contradicted_by(score);
            self.moving.label_newcomers(matcher.map(), &self.map_from_base, &mut self.points, contradicts);
        }
        self.learn(verdict);
        self.usual_score.note(score);
        let tracked = Tracked { score, iterations: alignment.iterations, ..self.unmatched(outcome) };
        (tracked, taken.step)
    }

    fn locate(
        &mut self,
        scan: &Scan,
        last: &Pose2,
        (step, steadiness): (&Step, &Steadiness),
        prior: &Prior,
    ) -> (Alignment, Verdict) {
        let (heading_window, window) = (self.heading_window(step), self.window());
        let again = *last * self.motion.same_again(scan.stamp_ns).last_from_base;
        let guesses = [again, *last];
        // After a long gap only the odometry knows the way.
        let others = if step.measured() && !steadiness.is_worth() { &[][..] } else { &guesses[..] };
        let (alignment, verdict) = self.engine.locate(&self.points, prior, others, heading_window, window);
        if verdict == Verdict::Found && step.measured() {
            let inertia = self.motion.inertia(scan.stamp_ns, &step.last_from_base);
            let expected = Expected { prior, again: *last * inertia.last_from_base, inertia: &inertia };
            // An expected pose that explains little itself is no reason to wait, unless the match does, too.
            if !self.innovation_gate.confirm(&alignment.pose, &expected)
                && (self.usual_score.is_far_above(alignment.fit.score())
                    || self.engine.score_at(&self.points, &prior.mean) >= LOST_BELOW_SCORE)
            {
                return (alignment, Verdict::Unconfirmed);
            }
            let way = Way { found: &alignment, prior, step, again: expected.again, steadiness };
            if let Some(held) = self.held(&way) {
                return (held, Verdict::Found);
            }
            let unmoved = || self.engine.score_at(&self.points, &prior.mean);
            if !is_worth_its_contradiction(&alignment, prior, unmoved) {
                return (alignment, Verdict::Unconfirmed);
            }
        } else if verdict == Verdict::Found && steadiness.is_worth() {
            // Only inertia expects the base somewhere, but a scan that hardly fits is no reason to leap.
            let expected = Expected { prior, again: prior.mean, inertia: step };
            if !self.innovation_gate.confirm(&alignment.pose, &expected)
                && self.usual_score.forbids_a_leap_by(alignment.fit.score())
            {
                return (alignment, Verdict::Unconfirmed);
            }
        }
        (alignment, verdict)
    }

    /// The match that keeps to odometry and inertia where somebody is about, or the scan contradicts the map,
    /// and another one leads away from them, unless that one explains clearly more.
    fn held(&mut self, way: &Way) -> Option<Alignment> {
        let contradicts = || self.usual_score.is_misled_by(way.found.fit.score());
        let may_mislead = self.moving.is_somebody_about() || contradicts();
        if self.params.method != Method::Map || !self.motion.is_reliable() || !may_mislead {
            return None;
        }
        let held = self.held_matches.consider(way)?;
        let (alignment, verdict) = self.engine.locate_near(&self.points, &held.prior(way.prior));
        (verdict == Verdict::Found).then(|| held.preferred(alignment, way.found)).flatten()
    }

    fn learn(&mut self, verdict: Verdict) {
        if let Some((submap, thinned)) =
            self.pose_covariance.open(&self.map_from_base, self.engine.new_surfels())
        {
            self.engine.begin_submap(submap, thinned);
        }
        match self.engine.learn(&self.map_from_base, &self.points, verdict) {
            Learned::Nothing => {}
            Learned::More => self.pose_covariance.learned(),
            Learned::Reference(number) => self.pose_covariance.refresh(number),
        }
    }

    fn accept(&mut self, alignment: &Alignment, prior: &Prior, step: &Step) -> Outcome {
        self.map_from_base = alignment.pose;
        self.engine.accept(alignment);
        if let Some(covariance) = inverse(&(prior.information_at(&alignment.pose) + alignment.information)) {
            self.covariance = covariance;
        }
        if !step.measured() || self.pose_covariance.is_due(&alignment.pose) {
            self.weigh(alignment, prior);
        }
        if weakest_sigma_m(&alignment.information) <= WEAK_M {
            return Outcome::Matched;
        }
        // Along that direction the map around was learned from the same odometry: it is no farther off than
        // the pose.
        if let Some((_, direction)) = weakest_direction(&alignment.information) {
            self.covariance = apart(&self.covariance, direction, WEAK_M);
        }
        Outcome::Weak
    }

    /// Works out what the match says of the pose's error.
    fn weigh(&mut self, alignment: &Alignment, prior: &Prior) {
        let (evidence, degeneracy) = self.engine.evidence(alignment, prior);
        self.pose_covariance.matched((&evidence, &degeneracy), prior, &alignment.pose);
    }

    /// How far to look around for every scan: headings always, places too when there is no odometry.
    fn heading_window(&self, step: &Step) -> Window {
        Window {
            half_m: if step.measured() { 0.0 } else { 2.0 * step.sigma[0] },
            half_rad: HEADING_WINDOW_RAD,
        }
    }

    /// How far the search has to look: as far as the prior may be off.
    fn window(&self) -> Window {
        let sigma_m = self.covariance[(0, 0)].max(self.covariance[(1, 1)]).sqrt();
        let search = &self.params.search;
        Window {
            half_m: (3.0 * sigma_m).max(search.min_half_m),
            half_rad: (3.0 * self.covariance[(2, 2)].sqrt()).max(search.min_half_rad),
        }
    }
}
