//! Steps of which there is more than one account: recorded poses and odometry contradict each other, or the
//! odometry stands still where the base may have gone on.
//!
//! The scan tells which it was, laid among the last ones; of both without what stands free. Somebody who
//! walks along would say that the base stands. Along a bare corridor the scan suits all of them: then the
//! step is in doubt by how far they are apart, and loops may say where the way goes on. Between two accounts
//! that the scan leaves possible the base's mass tells: it neither stops nor starts within a fifth of a
//! second.

use biplane_matcher::{EndPoint, PointAlignment, PointMap, Pose2};
use nalgebra::Vector3;

use super::{Chain, Laid, MIN_SHARE, OF_A_STEP, Step, is_unsure, odometry_sigma, recorded_sigma, with_error};
use crate::slam::keyframes::keyframe_scan::merged;
use crate::slam::pose_graph::wheel_calibration::WheelCalibration;
use crate::slam::submap_alignment;

/// Another account has to explain so much more of the scan than the recorded step.
const CLEARLY: f64 = 0.1;
/// A step so many standard deviations from what known wheels say contradicts them clearly. Fewer: more steps
/// are asked about; more: people take the matcher along unnoticed.
const FAR_FROM_WHEELS: f64 = 6.0;
/// Counters may have stalled when so much way may be missing, meters.
pub(super) const STALL_M: f64 = 0.05;
/// A scan of which so much is explained by a step, and clearly less by another one, saw nobody who would take
/// the matcher along: wheels that contradict it slip.
const NEARLY_ALL: f64 = 0.9;

/// Whether a step is another one than the odometry's.
pub(super) fn is_other(step: &Pose2, odometry: Option<&Pose2>) -> bool {
    odometry.is_some_and(|odometry| step.between(odometry).distance_m() > STALL_M)
}

/// A node's end points and those of the last ones, without what may walk.
struct Rooted {
    surfaces: PointMap,
    points: Vec<EndPoint>,
}

/// A step that may have been, within these standard deviations, and what the scan says of it.
struct Account {
    step: Pose2,
    sigma: [f64; 3],
    found: PointAlignment,
}

impl Rooted {
    fn account(&self, step: Pose2, sigma: [f64; 3]) -> Account {
        let found = submap_alignment::align(&self.surfaces, &self.points, &step, &sigma, OF_A_STEP);
        Account { step, sigma, found }
    }
}

impl Account {
    fn explained_share(&self) -> f64 {
        self.found.explained_share
    }
}

impl Chain<'_> {
    fn rooted(&self, laid: &Laid, last_from: impl Fn(usize) -> Pose2) -> Rooted {
        let near = self.before(laid.at, laid.first);
        let surfaces = PointMap::new(&merged(near.map(|at| (last_from(at), self.nodes[at].rooted()))));
        Rooted { surfaces, points: self.nodes[laid.at].rooted().copied().collect() }
    }

    /// A step that odometry and recorded poses contradict each other of: either may be wrong, and the scan
    /// tells which, laid among the last ones where the steps before have put them. Where it does not, wheels
    /// that are known are believed, unless they may have stalled: against poses that leap always.
    pub(super) fn judged(
        &self,
        laid: &Laid,
        odometry: &Pose2,
        steps: &[Step],
        wheels: Option<&WheelCalibration>,
    ) -> Step {
        let rooted = self.rooted(laid, |back| {
            let way = steps[back..].iter().fold(Pose2::IDENTITY, |way, (step, _)| way * *step);
            way.inverse()
        });
        let recorded = rooted.account(laid.recorded, recorded_sigma(&laid.recorded, self.params));
        let is_open = laid.unstalled.is_none() && is_unsure(&recorded.found);
        let is_known = is_open || self.nodes[laid.at].leaps;
        let counted = wheels.map_or(*odometry, |wheels| wheels.of(odometry).0);
        // It may have stalled for a while, too: it is not as exact as wheels that are known.
        let counted = rooted.account(counted, odometry_sigma(odometry));
        let is_carried = laid.is_carried(wheels, &recorded, &counted);
        let is_counted = match is_known && wheels.is_some() {
            _ if is_carried => true,
            true => !is_clearly_less(counted.explained_share(), recorded.explained_share()),
            false => is_clearly_less(recorded.explained_share(), counted.explained_share()),
        };
        let (taken, rival) = if is_counted { (&counted, &recorded) } else { (&recorded, &counted) };
        let step = self.accepted(&taken.step, &taken.sigma, &taken.found, !is_counted);
        let step = match is_carried {
            true => doubted_by(step, rival),
            false => self.doubted(step, taken.explained_share(), rival),
        };
        self.unless_missed(laid, step, &rooted, taken, wheels)
    }

    /// What the scan says of a step that recorded poses and odometry agree on, and what it is laid among.
    fn taken(&self, laid: &Laid, step: &Step) -> (Rooted, Account) {
        let last = self.nodes[laid.at - 1].recorded;
        let rooted = self.rooted(laid, |at| last.between(&self.nodes[at].recorded));
        let taken = rooted.account(step.0, recorded_sigma(&laid.recorded, self.params));
        (rooted, taken)
    }

    /// A step that recorded poses and odometry agree on, unless both stand still where the base may have gone
    /// on.
    pub(super) fn unless_stalled(&self, laid: &Laid, step: Step, wheels: Option<&WheelCalibration>) -> Step {
        if laid.unstalled.is_none() {
            return step;
        }
        let (rooted, taken) = self.taken(laid, &step);
        self.unless_missed(laid, step, &rooted, &taken, wheels)
    }

    /// A step in doubt by what counters may have missed. Where the scan leaves the way open, it is the step
    /// without the stall, in the same doubt, if no base stands and goes on so suddenly.
    fn unless_missed(
        &self,
        laid: &Laid,
        step: Step,
        rooted: &Rooted,
        taken: &Account,
        wheels: Option<&WheelCalibration>,
    ) -> Step {
        let Some(unstalled) = laid.unstalled else { return step };
        let share = taken.explained_share();
        let rival = stalled(rooted, &unstalled, wheels);
        let is_open = laid.is_sudden && is_unsure(&taken.found);
        if !is_open || is_clearly_less(rival.explained_share(), share) {
            return self.doubted(step, share, &rival);
        }
        doubted_by(self.step_of(&rival), taken)
    }

    /// A step that a scan seems to tell, unless wheels that are known and cannot have stalled contradict it
    /// clearly and the scan suits them as well: somebody who walks towards the base takes the matcher along.
    pub(super) fn unless_drawn_along(
        &self,
        laid: &Laid,
        step: Step,
        wheels: Option<&WheelCalibration>,
    ) -> Step {
        let Some((odometry, wheels)) = laid.odometry.zip(wheels) else { return step };
        if laid.unstalled.is_some() || is_unsure(&laid.found) {
            return step;
        }
        let (counted, sigma) = wheels.of(&odometry);
        let away = step.0.step_from(&counted);
        if away[0].powi(2) + away[1].powi(2) < (FAR_FROM_WHEELS * sigma[0]).powi(2) {
            return step;
        }
        let (rooted, taken) = self.taken(laid, &step);
        let rival = rooted.account(counted, odometry_sigma(&odometry));
        if laid.is_carried(Some(wheels), &taken, &rival) {
            return doubted_by(self.step_of(&rival), &taken);
        }
        self.doubted(step, taken.explained_share(), &rival)
    }

    /// The step of an account that is not the recorded one.
    fn step_of(&self, account: &Account) -> Step {
        self.accepted(&account.step, &account.sigma, &account.found, false)
    }

    /// A step that explains this share of the scan, in doubt by how far a rival is away that explains about
    /// as much; the rival where it explains clearly more.
    fn doubted(&self, step: Step, share: f64, rival: &Account) -> Step {
        let rival_share = rival.explained_share();
        if rival_share < MIN_SHARE.min(share) || is_clearly_less(rival_share, share) {
            return step;
        }
        if is_clearly_less(share, rival_share) {
            return self.step_of(rival);
        }
        doubted_by(step, rival)
    }
}

impl Laid {
    /// Whether somebody took the matcher along: its poses contradict wheels that are known and go on as
    /// before and after. A base does not stop and start so suddenly that its wheels do not notice.
    fn is_carried(&self, wheels: Option<&WheelCalibration>, recorded: &Account, counted: &Account) -> bool {
        let (seen, other) = (recorded.explained_share(), counted.explained_share());
        let is_clear = seen > NEARLY_ALL && is_clearly_less(other, seen);
        wheels.is_some() && self.is_steady && self.unstalled.is_none() && !is_clear
    }
}

/// A step in doubt by how far a rival is away.
fn doubted_by(step: Step, rival: &Account) -> Step {
    let away = Vector3::from(rival.found.map_from_points.step_from(&step.0));
    (step.0, with_error(&step.1, &(away * away.transpose())))
}

/// Whether one account explains clearly less than another one does: by a tenth of the scan, and by more than
/// the other one leaves unexplained.
fn is_clearly_less(share: f64, other: f64) -> bool {
    other - share > CLEARLY.max(1.0 - other)
}

/// The account of counters that have stalled.
fn stalled(rooted: &Rooted, unstalled: &Pose2, wheels: Option<&WheelCalibration>) -> Account {
    let step = wheels.map_or(*unstalled, |wheels| wheels.of(unstalled).0);
    rooted.account(step, odometry_sigma(&step))
}

#[cfg(test)]
mod tests {
    use biplane_matcher::{Kind, Pose2};

    use super::super::tests::{
        ALONG_WALL, COUNTED_M, IN_ROOM, STEP_M, STEP_NS, STEP_SCANS, drive, drive_along, point,
    };
    use super::super::{ChainParams, edges};
    use crate::slam::keyframes::{Node, Unstalled};
    use crate::slam::pose_graph::Edge;

    fn step_to(nodes: &[Node], at: usize) -> Edge {
        edges(nodes, 0, &ChainParams::default()).0[at - 1]
    }

    /// How far a step is in doubt ahead, meters.
    fn uncertain_m(edge: &Edge) -> f64 {
        edge.information.try_inverse().unwrap()[(0, 0)].sqrt()
    }

    #[test]
    fn where_the_scan_says_nothing_known_wheels_are_right_unless_they_may_have_stalled() {
        let at = IN_ROOM + 5;
        let mut nodes = drive();
        nodes[at..].iter_mut().for_each(|node| node.recorded.x_m -= 1.0);
        let as_counted = step_to(&nodes, at);
        assert!((as_counted.measured.x_m - STEP_M).abs() < 2e-3, "{as_counted:?}");
        assert!((0.7..1.3).contains(&uncertain_m(&as_counted)), "{}", uncertain_m(&as_counted));
        stall(&mut nodes, at, 0.0);
        let as_recorded = step_to(&nodes, at);
        assert!((as_recorded.measured.x_m - (COUNTED_M - 1.0)).abs() < 0.05, "{as_recorded:?}");
        assert!((1.5..1.9).contains(&uncertain_m(&as_recorded)), "{}", uncertain_m(&as_recorded));
        nodes[at].leaps = true;
        let leapt = step_to(&nodes, at);
        assert!((leapt.measured.x_m - STEP_M).abs() < 2e-3, "poses that leap are no motion: {leapt:?}");
    }

    /// Counters that may have missed 0.4 m before this node, of which so much was sudden.
    fn stall(nodes: &mut [Node], at: usize, sudden_m: f64) {
        for (number, node) in nodes.iter_mut().enumerate() {
            let (missed_m, sudden_m) = if number >= at { (0.4, sudden_m) } else { (0.0, 0.0) };
            node.unstalled = node.odometry.map(|odometry| Unstalled {
                pose: Pose2 { x_m: odometry.x_m + missed_m, ..odometry },
                sudden_m,
            });
        }
    }

    #[test]
    fn counters_that_may_have_stalled_leave_the_way_in_doubt_where_the_scan_says_nothing() {
        for (at, is_known) in [(IN_ROOM + 5, false), (IN_ROOM - 5, true)] {
            let undisturbed = step_to(&drive(), at).measured.x_m;
            for sudden_m in [0.0, 0.4] {
                let mut nodes = drive();
                stall(&mut nodes, usize::MAX, 0.0);
                assert!(uncertain_m(&step_to(&nodes, at)) < 0.03);
                stall(&mut nodes, at, sudden_m);
                let step = step_to(&nodes, at);
                let expected_m = undisturbed + if is_known { 0.0 } else { sudden_m };
                assert!((step.measured.x_m - expected_m).abs() < 0.02, "{sudden_m}: {step:?}");
                let expected = if is_known { 0.0..0.03 } else { 0.35..0.45 };
                assert!(expected.contains(&uncertain_m(&step)), "{is_known}: {}", uncertain_m(&step));
            }
        }
    }

    /// A step along a wall with an edge each meter whose poses are recorded too far ahead, as somebody comes
    /// towards the base, whom the scan tells best of.
    fn towards_somebody(ahead_m: f64) -> Edge {
        let at = IN_ROOM + ALONG_WALL - 2;
        let mut nodes = drive_along(COUNTED_M, STEP_M, true);
        for (number, node) in nodes.iter_mut().enumerate() {
            let first = node.keyframe_scan.points.len();
            let away_m = 2.0 - STEP_M * (number as f64 - at as f64 + 1.0);
            let away_m = if number >= at { away_m - ahead_m } else { away_m };
            node.keyframe_scan.points.extend(
                (0..40).map(|step| point([away_m, 0.02 * f64::from(step) - 0.4], [-1.0, 0.0], Kind::Line)),
            );
            node.free_standing = (first..first + 40).collect();
        }
        nodes[at..].iter_mut().for_each(|node| node.recorded.x_m += ahead_m);
        step_to(&nodes, at)
    }

    #[test]
    fn somebody_who_comes_leaves_the_way_in_doubt_where_known_wheels_say_another() {
        let undisturbed = towards_somebody(0.0);
        assert!(uncertain_m(&undisturbed) < 0.05, "{}", uncertain_m(&undisturbed));
        let step = towards_somebody(0.2);
        let off_m = (step.measured.x_m - STEP_M).abs();
        assert!(off_m < 0.02 || uncertain_m(&step) > 0.1, "{step:?}");
    }

    #[test]
    fn wheels_that_slip_leave_no_doubt_where_the_scan_tells_the_way() {
        let at = IN_ROOM - 5;
        let mut nodes = drive();
        nodes[at..].iter_mut().flat_map(|node| &mut node.odometry).for_each(|pose| pose.x_m += 0.12);
        let step = step_to(&nodes, at);
        assert!((step.measured.x_m.abs() - STEP_M).abs() < 2e-3, "{step:?}");
        assert!(uncertain_m(&step) < 0.03, "{}", uncertain_m(&step));
    }

    /// Wheels that spin on, as fast as before, while the base stands for as long as so much way takes.
    fn spin(nodes: &mut [Node], at: usize, way_m: f64) {
        for node in &mut nodes[at..] {
            node.odometry = node.odometry.map(|pose| Pose2 { x_m: pose.x_m + way_m, ..pose });
            node.stamp_ns += (way_m / COUNTED_M * STEP_NS as f64) as i64;
            node.scan += (way_m / COUNTED_M * STEP_SCANS as f64) as usize;
        }
    }

    #[test]
    fn wheels_that_spin_are_not_followed_where_the_scan_tells_the_way() {
        let at = IN_ROOM - 5;
        let mut nodes = drive();
        spin(&mut nodes, at, 1.0);
        let step = step_to(&nodes, at);
        assert!((step.measured.x_m - STEP_M).abs() < 2e-3, "{step:?}");
        assert!(uncertain_m(&step) < 0.03, "{}", uncertain_m(&step));
    }

    #[test]
    fn wheels_that_go_on_as_before_say_more_than_somebody_who_takes_the_matcher_along() {
        // To the scan's surprise: part of it lies on nothing.
        let step = |way_m: f64| {
            let at = IN_ROOM + ALONG_WALL - 5;
            let mut nodes = drive_along(COUNTED_M, STEP_M, true);
            for number in 0..12 {
                let place = [0.7, 0.1 * f64::from(number)];
                nodes[at].keyframe_scan.points.push(point(place, [-1.0, 0.0], Kind::Line));
            }
            spin(&mut nodes, at, way_m);
            step_to(&nodes, at)
        };
        assert!(uncertain_m(&step(0.0)) < 0.05, "{}", uncertain_m(&step(0.0)));
        let carried = step(0.5);
        let expected_m = STEP_M + 0.5 * STEP_M / COUNTED_M;
        assert!((carried.measured.x_m - expected_m).abs() < 0.03, "{carried:?}");
        assert!((0.4..0.6).contains(&uncertain_m(&carried)), "{}", uncertain_m(&carried));
        // Counters that jump: by the clock or by scans, no wheels went on so far.
        for stamps_are_wrong in [false, true] {
            let at = IN_ROOM + ALONG_WALL - 5;
            let mut nodes = drive_along(COUNTED_M, STEP_M, true);
            spin(&mut nodes, at, 0.5);
            for (number, node) in nodes.iter_mut().enumerate() {
                match stamps_are_wrong {
                    false => node.stamp_ns = STEP_NS * number as i64,
                    true => node.scan = STEP_SCANS * number,
                }
            }
            let step = step_to(&nodes, at);
            assert!((step.measured.x_m - STEP_M).abs() < 0.01, "{stamps_are_wrong}: {step:?}");
        }
    }

    #[test]
    fn somebody_who_walks_along_does_not_say_that_the_base_stands() {
        let at = IN_ROOM + ALONG_WALL - 2;
        let walks_along = |is_known: bool| {
            let mut nodes = drive();
            // Ahead, off the wall, always in the same place as the base sees it.
            for node in &mut nodes {
                let first = node.keyframe_scan.points.len();
                node.keyframe_scan.points.extend((0..40).map(|step| {
                    let across_m = 0.02 * f64::from(step);
                    point([2.0, across_m - 0.4], [-1.0, 0.0], Kind::Line)
                }));
                if is_known {
                    node.free_standing = (first..first + 40).collect();
                }
            }
            // The matcher went with them for a step.
            nodes[at..].iter_mut().for_each(|node| node.recorded.x_m -= COUNTED_M);
            step_to(&nodes, at)
        };
        assert!(uncertain_m(&walks_along(false)) < 0.05, "as if it stood");
        assert!(uncertain_m(&walks_along(true)) > 0.2);
    }
}
