//! From node to node: what the recording, the scans and the odometry say of each step, as edges.
//!
//! A step is the recorded one where the scan, laid among the scans of the last meters, agrees: the onboard
//! matcher saw the whole map. Where the scan lies elsewhere, its place there is the step. Where the recorded
//! step contradicts the odometry (the matcher found back to places it had mapped before drifting, which is no
//! motion; or the odometry slipped) both are tried, and the scan tells which it was. Where it lies nowhere
//! among those before it, the way breaks ([`crate::slam::pose_graph::breaks`]).

mod rivals;

use biplane_matcher::{PointAlignment, PointMap, Pose2};
use nalgebra::{Matrix3, Vector3};
use rayon::prelude::*;

use crate::slam::keyframes::Node;
use crate::slam::keyframes::keyframe_scan::merged;
use crate::slam::pose_graph::Edge;
use crate::slam::pose_graph::breaks;
use crate::slam::pose_graph::wheel_calibration::{SureStep, WheelCalibration};
use crate::slam::submap_alignment::{self, Approach};

/// How steps are believed.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ChainParams {
    /// How many nodes back the scans reach that a node is matched with. More: steadier steps, at more time.
    pub behind: usize,
    /// Standard deviation of a step a meter driven, meters. Larger: loops bend the way more easily.
    pub position_m_per_m: f64,
    /// Standard deviation of a step's heading for each root of a meter, radians; errors add up like a random
    /// walk.
    pub heading_rad_per_root_m: f64,
    /// Standard deviation that every step has, meters.
    pub floor_m: f64,
    /// Standard deviation of heading that every step has, radians.
    pub floor_rad: f64,
}

impl Default for ChainParams {
    fn default() -> Self {
        Self {
            behind: 23,
            position_m_per_m: 0.02,
            heading_rad_per_root_m: 0.005,
            floor_m: 0.003,
            floor_rad: 0.001,
        }
    }
}

/// Variances of steps count so many times more for each square of what a meter of the odometry is off by,
/// as a share: each recorded step leans to the odometry by a little, and all of them the same way. With
/// odometry that is 5 % long a building of 250 m was 0.1 % too long (0.11 m) where steps counted in full,
/// and 0.03 m off where their variances count nine times. Counted nine times everywhere, drives with
/// odometry that is 1 % long were 5 to 13 % worse.
const LEANS: f64 = 3200.0;
/// Standard deviations of odometry a meter driven: meters, radians; and a radian turned: meters, radians.
const ODOMETRY: [f64; 4] = [0.1, 0.05, 0.05, 0.15];
/// A scan that leaves position or heading open by more, meters and radians, does not tell the step.
const UNSURE_M: f64 = 0.05;
const UNSURE_RAD: f64 = 0.01;
/// The recorded step is a jump when it differs from the odometry's by so many standard deviations.
const JUMP: f64 = 4.0;

/// The edges from each node to the next one, and what the drive teaches of its odometry; `first` is the
/// number of the first node in the graph.
pub(crate) fn edges(
    nodes: &[Node],
    first: usize,
    params: &ChainParams,
) -> (Vec<Edge>, Option<WheelCalibration>) {
    let chain = Chain { nodes, params };
    let mut laid: Vec<Laid> = (1..nodes.len()).into_par_iter().map(|at| chain.laid(at, 0)).collect();
    chain.lay_again_behind_breaks(&mut laid);
    let sure: Vec<Option<SureStep>> = laid.iter().map(Laid::sure).collect();
    let wheels = WheelCalibration::learn(&sure);
    let agreed = |laid: &Laid| match laid.contradicting() {
        None => {
            let step = chain.unless_stalled(laid, chain.agreed(laid, wheels.as_ref()), wheels.as_ref());
            Ok(chain.unless_drawn_along(laid, step, wheels.as_ref()))
        }
        Some(odometry) => Err(odometry),
    };
    let agreed: Vec<Result<Step, Pose2>> = laid.par_iter().map(agreed).collect();
    let mut steps: Vec<Step> = Vec::with_capacity(laid.len());
    for (laid, agreed) in laid.iter().zip(agreed) {
        let judged = |odometry| chain.judged(laid, &odometry, &steps, wheels.as_ref());
        steps.push(agreed.unwrap_or_else(judged));
    }
    let edge = |(before, (measured, information)): (usize, Step)| {
        let edge = Edge { from: first + before, to: first + before + 1, measured, information };
        if laid[before].is_break { breaks::broken(&edge) } else { edge }
    };
    (steps.into_iter().enumerate().map(edge).collect(), wheels)
}

/// A step and its information.
type Step = (Pose2, Matrix3<f64>);

/// Nodes one after the other.
#[derive(Clone, Copy)]
struct Chain<'a> {
    nodes: &'a [Node],
    params: &'a ChainParams,
}

/// A node among the last ones, from where it was recorded.
#[derive(Clone, Debug)]
struct Laid {
    at: usize,
    recorded: Pose2,
    odometry: Option<Pose2>,
    /// The odometry's step if its counters stalled during it.
    unstalled: Option<Pose2>,
    /// Whether they stood and went on more suddenly than a base does.
    is_sudden: bool,
    /// Whether the odometry goes on as fast as before and after.
    is_steady: bool,
    found: PointAlignment,
    /// The first node that it was laid among: those before a break say nothing of it.
    first: usize,
    /// Whether it lies nowhere among them.
    is_break: bool,
}

impl Laid {
    /// The odometry's step when the recorded one contradicts it.
    fn contradicting(&self) -> Option<Pose2> {
        self.odometry.filter(|odometry| is_jump(&self.recorded, odometry))
    }

    /// The step as counted and as it was, where the scan tells it in every direction.
    fn sure(&self) -> Option<SureStep> {
        let is_sure = self.contradicting().is_none() && !is_unsure(&self.found);
        self.odometry.filter(|_| is_sure).map(|odometry| (odometry, self.recorded))
    }
}

impl Chain<'_> {
    /// The surfaces that the last nodes before this one saw, from `first` on, seen from the last one, which
    /// knows where the others were.
    fn surfaces(&self, at: usize, first: usize, last_from: impl Fn(usize) -> Pose2) -> PointMap {
        let near = self.before(at, first);
        PointMap::new(&merged(near.map(|at| (last_from(at), &self.nodes[at].keyframe_scan.points))))
    }

    /// The last nodes before this one, and fewer of those farther back: they see the same walls again.
    fn before(&self, at: usize, first: usize) -> impl Iterator<Item = usize> {
        let back = BACK.iter().filter(|back| **back <= self.params.behind);
        back.filter_map(move |back| at.checked_sub(*back)).filter(move |near| *near >= first)
    }

    fn lay(&self, at: usize, surfaces: &PointMap, prior: &Pose2, sigma: &[f64; 3]) -> PointAlignment {
        submap_alignment::align(surfaces, &self.nodes[at].keyframe_scan.points, prior, sigma, OF_A_STEP)
    }

    /// A node among the last ones from `first` on, each where it was recorded.
    fn laid(&self, at: usize, first: usize) -> Laid {
        let (last, node) = (&self.nodes[at - 1], &self.nodes[at]);
        let recorded = last.recorded.between(&node.recorded);
        let between = |poses: Option<(Pose2, Pose2)>| poses.map(|(last, now)| last.between(&now));
        let odometry = between(last.odometry.zip(node.odometry));
        let stalls = last.unstalled.zip(node.unstalled);
        let unstalled = between(stalls.map(|(last, now)| (last.pose, now.pose)));
        let unstalled = unstalled.filter(|step| rivals::is_other(step, odometry.as_ref()));
        let is_sudden = stalls.is_some_and(|(last, now)| now.sudden_m - last.sudden_m > rivals::STALL_M);
        let surfaces = self.surfaces(at, first, |at| last.recorded.between(&self.nodes[at].recorded));
        let found = self.lay(at, &surfaces, &recorded, &recorded_sigma(&recorded, self.params));
        let min_share = breaks::min_share(node, &recorded, odometry.as_ref());
        let is_break = breaks::is_strange(node, found.explained_share, &recorded, min_share)
            && breaks::sees_again(&odometry.unwrap_or(recorded))
            && odometry.is_none_or(|odometry| {
                let found = self.lay(at, &surfaces, &odometry, &odometry_sigma(&odometry));
                breaks::is_strange(node, found.explained_share, &odometry, min_share)
            });
        Laid {
            at,
            recorded,
            odometry,
            unstalled,
            is_sudden,
            is_steady: self.is_steady(at),
            found,
            first,
            is_break,
        }
    }

    /// Whether the odometry of a step is as fast as before and after it: neither do its counters jump, nor do
    /// they begin to stall. Both by the clock and by scans: stamps may be wrong, and scans may be lost.
    fn is_steady(&self, at: usize) -> bool {
        let speeds = |from: usize, to: usize| {
            let (from, to) = (self.nodes.get(from)?, self.nodes.get(to)?);
            let way_m = from.odometry?.between(&to.odometry?).x_m;
            Some([to.stamp_ns - from.stamp_ns, to.scan as i64 - from.scan as i64].map(|of| way_m / of as f64))
        };
        let Some(now) = speeds(at - 1, at) else { return false };
        let before = at.checked_sub(1 + STEADY_NODES).and_then(|from| speeds(from, at - 1));
        let after = speeds(at, at + STEADY_NODES);
        let alike = |(now, other): (f64, f64)| (STEADY..=1.0 / STEADY).contains(&(now / other));
        [before, after].iter().all(|other| other.is_some_and(|other| now.into_iter().zip(other).all(alike)))
    }

    /// Whether some of the next nodes lies where it was recorded among those before a strange one: then that
    /// one is alone strange, somebody stood before the laser, and the way does not break.
    fn goes_on_behind(&self, strange: usize, Laid { recorded, odometry, first, .. }: &Laid) -> bool {
        let min_share = breaks::min_share(&self.nodes[strange], recorded, odometry.as_ref()).max(MIN_SHARE);
        let last = self.nodes[strange - 1].recorded;
        let next = &self.nodes[(strange + 1).min(self.nodes.len())..];
        let surfaces = self.surfaces(strange, *first, |at| last.between(&self.nodes[at].recorded));
        next.iter().take(breaks::NEXT_NODES).enumerate().any(|(beyond, node)| {
            let step = last.between(&node.recorded);
            let sigma = recorded_sigma(&step, self.params);
            self.lay(strange + 1 + beyond, &surfaces, &step, &sigma).explained_share >= min_share
        })
    }

    /// Lays the nodes behind each break among those behind it alone: where the poses before it lie is not
    /// known from there.
    fn lay_again_behind_breaks(&self, laid: &mut [Laid]) {
        let mut behind = None;
        for at in 1..self.nodes.len() {
            if let Some(first) = behind.filter(|first| at - first <= self.params.behind) {
                laid[at - 1] = self.laid(at, first);
            }
            laid[at - 1].is_break = laid[at - 1].is_break && !self.goes_on_behind(at, &laid[at - 1]);
            if laid[at - 1].is_break {
                behind = Some(at);
            }
        }
    }

    /// A step that recorded poses and odometry agree on. Where the scan leaves a direction open, that one is
    /// the odometry's. In the others the recorded step stays: the matcher saw the whole map, and its errors
    /// do not add up from step to step. Where it seems to leave none open, the recorded step leans to the
    /// odometry as it counts: wheels that are known are weighed against the scan where it tells least.
    fn agreed(&self, laid: &Laid, wheels: Option<&WheelCalibration>) -> Step {
        let Laid { recorded, odometry, found, .. } = laid;
        let accepted = self.accepted(recorded, &recorded_sigma(recorded, self.params), found, true);
        let Some((odometry, wheels)) = odometry.zip(wheels) else { return accepted };
        let (counted, sigma) = wheels.of(&odometry);
        let seen = match found.explained_share < MIN_SHARE {
            true => Matrix3::zeros(),
            false => submap_alignment::information(found),
        };
        let away = Vector3::from(counted.step_from(&accepted.0));
        if is_unsure(found) {
            let (moved, counts) = where_open(&seen, &sigma, &away);
            let step = accepted.0.stepped(moved.into());
            return (step, with_floor(&(seen + counts), &recorded_sigma(&step, self.params)));
        }
        if laid.unstalled.is_some() {
            return accepted;
        }
        let from_found = found.map_from_points.step_from(&counted);
        let counts = in_open_direction(&seen, &sigma, &from_found) * wheels.lean_share();
        let Some(factors) = (seen + counts).cholesky() else { return accepted };
        (accepted.0.stepped(factors.solve(&(counts * away)).into()), accepted.1)
    }

    /// The step when this was expected and the scan was found there.
    fn accepted(&self, prior: &Pose2, sigma: &[f64; 3], found: &PointAlignment, is_recorded: bool) -> Step {
        let away = Vector3::from(found.map_from_points.step_from(prior));
        let held = information(sigma);
        if found.explained_share < MIN_SHARE || away.dot(&(held * away)) > FARTHEST_SQUARED {
            let loose = [2.0 * sigma[0] + 0.02, 2.0 * sigma[1] + 0.02, 2.0 * sigma[2] + 0.01];
            return (*prior, information(&if is_recorded { loose } else { *sigma }));
        }
        let known = submap_alignment::information(found) + held;
        if is_recorded && away.dot(&(known * away)) < AGREES_SQUARED {
            return (*prior, held);
        }
        let drift = recorded_sigma(&found.map_from_points, self.params);
        (found.map_from_points, with_floor(&known, &drift))
    }
}

/// The edges of a chain where all scans are weighed against them.
pub(crate) fn leaning(chain: &[Edge], wheels: Option<&WheelCalibration>) -> Vec<Edge> {
    let off = wheels.map_or(0.0, |wheels| wheels.scale().way_scale[0] - 1.0);
    let times = 1.0 + LEANS * off * off;
    chain.iter().map(|edge| Edge { information: edge.information / times, ..*edge }).collect()
}

/// How far back the nodes lie that a node is matched with.
const BACK: [usize; 8] = [1, 2, 3, 5, 8, 12, 17, 23];
/// Of a step: a larger scale lets the scan slide along a wall to the next door frame; with a smaller one a
/// base that slipped is not followed. Fewer iterations than after a search: it begins where the matcher or
/// the odometry saw it.
const OF_A_STEP: Approach = Approach { capture_m: 0.2, max_iterations: 5 };
/// A scan of which less is explained by those before it says nothing.
const MIN_SHARE: f64 = 0.5;
/// A base goes on as before when its speed is this share of that over so many nodes before and after, or less
/// than one over it.
const STEADY: f64 = 0.75;
/// See [`STEADY`].
const STEADY_NODES: usize = 3;
/// A recorded step closer than this to where the scan lies among the last ones is taken as it is: the matcher
/// saw more of the map. Squared Mahalanobis distance.
const AGREES_SQUARED: f64 = 9.0;
/// A scan farther from where known wheels have it contradicts them: squared Mahalanobis distance.
const WHEELS_AGREE_SQUARED: f64 = 9.0;
/// A scan that is drawn farther from what was expected was drawn astray: squared Mahalanobis distance.
const FARTHEST_SQUARED: f64 = 40.0;

/// Whether the scan leaves some direction open.
fn is_unsure(found: &PointAlignment) -> bool {
    let known = submap_alignment::information(found) + Matrix3::identity() * 1e-6;
    let Some(covariance) = known.cholesky().map(|factors| factors.inverse()) else { return true };
    let position = covariance.fixed_view::<2, 2>(0, 0).symmetric_eigenvalues().max();
    let is_open = position > UNSURE_M * UNSURE_M || covariance[(2, 2)] > UNSURE_RAD * UNSURE_RAD;
    is_open || found.explained_share < MIN_SHARE
}

/// How far wheels, this far away, move a step along the directions that the scan leaves open, and their
/// heading where that is open; and their information there. Of what the scan tells they say nothing: their
/// turn slips, and errors of the heading add up from step to step.
fn where_open(seen: &Matrix3<f64>, sigma: &[f64; 3], away: &Vector3<f64>) -> (Vector3<f64>, Matrix3<f64>) {
    // Each as far as it is open while the others are known: with a way that is open all others are, a little.
    let variance = |information: f64| 1.0 / information.max(1e-6);
    let position = seen.fixed_view::<2, 2>(0, 0).symmetric_eigen();
    let places = position.eigenvalues.iter().zip(position.eigenvectors.column_iter());
    let places =
        places.map(|(known, along)| (variance(*known), Vector3::new(along[0], along[1], 0.0), UNSURE_M));
    let heading = (variance(seen[(2, 2)]), Vector3::z(), UNSURE_RAD);
    let (mut moved, mut counts) = (Vector3::zeros(), Matrix3::zeros());
    for (variance, along, unsure) in places.chain([heading]) {
        if variance > unsure * unsure {
            let of_wheels = if along[2] == 0.0 { sigma[0] * sigma[0] } else { sigma[2] * sigma[2] };
            moved += along * (along.dot(away) * variance / (variance + of_wheels));
            counts += along * along.transpose() / of_wheels;
        }
    }
    (moved, counts)
}

/// What wheels say of the direction that the scan tells least of, where the scan, this far away from them,
/// does not contradict them.
fn in_open_direction(seen: &Matrix3<f64>, sigma: &[f64; 3], away: &[f64; 3]) -> Matrix3<f64> {
    let Some(covariance) = seen.cholesky().map(|factors| factors.inverse()) else { return Matrix3::zeros() };
    let position = covariance.fixed_view::<2, 2>(0, 0).symmetric_eigen();
    let open = position.eigenvalues.imax();
    let along = position.eigenvectors.column(open);
    let away_m = along[0] * away[0] + along[1] * away[1];
    let variance = sigma[0] * sigma[0];
    if away_m * away_m > WHEELS_AGREE_SQUARED * (variance + position.eigenvalues[open]) {
        return Matrix3::zeros();
    }
    let along = Vector3::new(along[0], along[1], 0.0);
    along * along.transpose() / variance
}

fn is_jump(recorded: &Pose2, odometry: &Pose2) -> bool {
    let [x, y, turn] = odometry_sigma(odometry);
    let away = recorded.step_from(odometry);
    let squared = (away[0] / x).powi(2) + (away[1] / y).powi(2) + (away[2] / turn).powi(2);
    squared > JUMP * JUMP * 2.0
}

fn odometry_sigma(step: &Pose2) -> [f64; 3] {
    let (way, turn) = (step.distance_m(), step.theta_rad.abs());
    let position = 0.02 + ODOMETRY[0] * way + ODOMETRY[2] * turn;
    [position, position, 0.01 + ODOMETRY[1] * way + ODOMETRY[3] * turn]
}

pub(crate) fn recorded_sigma(step: &Pose2, params: &ChainParams) -> [f64; 3] {
    let (way, turn) = (step.distance_m(), step.theta_rad.abs());
    let position = params.floor_m + params.position_m_per_m * way + 0.005 * turn;
    let heading = params.floor_rad + params.heading_rad_per_root_m * way.sqrt() + 0.005 * turn;
    [position, position, heading]
}

pub(crate) fn information(sigma: &[f64; 3]) -> Matrix3<f64> {
    Matrix3::from_diagonal(&Vector3::from(sigma.map(|sigma| 1.0 / (sigma * sigma))))
}

/// The information when an error of these standard deviations comes on top.
pub(crate) fn with_floor(known: &Matrix3<f64>, sigma: &[f64; 3]) -> Matrix3<f64> {
    with_error(known, &Matrix3::from_diagonal(&Vector3::from(sigma.map(|sigma| sigma * sigma))))
}

/// The information when an error of this covariance comes on top.
fn with_error(known: &Matrix3<f64>, error: &Matrix3<f64>) -> Matrix3<f64> {
    let Some(factors) = known.cholesky() else { return Matrix3::zeros() };
    let covariance = factors.inverse() + error;
    covariance.cholesky().map_or_else(Matrix3::zeros, |factors| factors.inverse())
}

#[cfg(test)]
mod tests;
