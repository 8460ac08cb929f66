//! The odometry as it would be if its counters had stalled wherever it stands still in the midst of a drive.
//!
//! A base that stops for a moment and counters that stall look the same: from one scan to the next the
//! odometry stands, and a moment later it goes on as fast as before. Scans tell which it was, but along a
//! bare corridor they do not. There both are possible, and the way is as uncertain as the two are apart.
//! Which of them is likelier, the odometry itself tells: a base brakes and starts over some tenths of a
//! second, counters stop and go on between two reports. Units: meters, nanoseconds.

use biplane_matcher::Pose2;

use crate::recordings::deskew::StampedPose;

/// A stand is at least so long, nanoseconds. Shorter: odometry that comes less often than scans seems to
/// stand between two reports.
const SHORTEST_NS: i64 = 400_000_000;
/// And at most so long: counters do not stall longer, robots that wait do.
const LONGEST_NS: i64 = 5_000_000_000;
/// Speed before and after is measured over so long, nanoseconds. Longer: a base that brakes counts as fast.
const SPEED_NS: i64 = 400_000_000;
/// And over so many scans at most: stamps may repeat for ever.
const SPEED_SCANS: usize = 1000;
/// Slower bases stand, meters a second.
const SLOW_M_PER_S: f64 = 0.1;
/// During a stand it goes at most this share of the speed before.
const STANDING_SHARE: f64 = 0.02;
/// And turns by at most this, radians a second: counters that stall count no turn either.
const STANDING_RAD_PER_S: f64 = 0.02;
/// Speeds before and after are within this factor of each other.
const SAME_SPEED: f64 = 2.0;
/// A base that brakes is slower over the last so long before it stands, nanoseconds. Shorter: one step of
/// few counts says little; longer: a base that brakes hard seems sudden.
const BRAKES_NS: i64 = 150_000_000;
/// Than this share of its speed before. The same holds for one that starts.
const BRAKES: f64 = 0.75;

/// Where the odometry would be if its counters had stalled wherever it stands in the midst of a drive.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Unstalled {
    /// The pose.
    pub pose: Pose2,
    /// How much of the way up to here is put in where the odometry stood and went on more suddenly than a
    /// base brakes and starts, meters.
    pub sudden_m: f64,
}

/// How far counters would have gone on in a step of a stand.
#[derive(Clone, Copy, Default)]
struct Missed {
    way_m: f64,
    is_sudden: bool,
}

/// The odometry at each scan, with the way that stalled counters would have missed put in: ahead, with the
/// speed before and after. `None` where it never stands so.
pub(super) fn filled(odometry: &[Option<StampedPose>]) -> Option<Vec<Option<Unstalled>>> {
    let known: Vec<(usize, StampedPose)> =
        odometry.iter().enumerate().filter_map(|(scan, pose)| Some((scan, (*pose)?))).collect();
    let poses: Vec<StampedPose> = known.iter().map(|(_, pose)| *pose).collect();
    let mut missed = vec![Missed::default(); poses.len()];
    let mut at = 0;
    while at + 1 < poses.len() {
        let end = stand_end(&poses, at);
        let missed_m_per_s = missed_speed(&poses, at, end);
        let is_sudden = missed_m_per_s != 0.0 && is_sudden(&poses, at, end);
        for (missed, pair) in missed[at + 1..=end].iter_mut().zip(poses[at..=end].windows(2)) {
            *missed = Missed { way_m: missed_m_per_s * seconds(&pair[0], &pair[1]), is_sudden };
        }
        at = end.max(at + 1);
    }
    if missed.iter().all(|missed| missed.way_m == 0.0) {
        return None;
    }
    let mut filled = vec![None; odometry.len()];
    let (mut last, mut now) = (poses[0].pose(), Unstalled { pose: poses[0].pose(), sudden_m: 0.0 });
    for ((scan, pose), missed) in known.into_iter().zip(missed) {
        now.pose = now.pose * Pose2::new(missed.way_m, 0.0, 0.0) * last.between(&pose.pose());
        now.sudden_m += if missed.is_sudden { missed.way_m.abs() } else { 0.0 };
        last = pose.pose();
        filled[scan] = Some(now);
    }
    Some(filled)
}

/// The last pose of the stand that begins at this one; the pose itself where it goes on.
fn stand_end(poses: &[StampedPose], at: usize) -> usize {
    let Some(speed) = speed_before(poses, at).filter(|speed| speed.abs() > SLOW_M_PER_S) else { return at };
    let stands = |pair: &[StampedPose]| {
        let step = pair[0].pose().between(&pair[1].pose());
        let seconds = seconds(&pair[0], &pair[1]).max(0.0);
        step.distance_m() <= STANDING_SHARE * speed.abs() * seconds
            && step.theta_rad.abs() <= STANDING_RAD_PER_S * seconds
    };
    at + poses[at..].windows(2).take_while(|pair| stands(pair)).count()
}

/// How fast the base would have gone in a stand, meters a second ahead; zero where it is none.
fn missed_speed(poses: &[StampedPose], at: usize, end: usize) -> f64 {
    let lasted_ns = poses[end].stamp_ns - poses[at].stamp_ns;
    if !(SHORTEST_NS..=LONGEST_NS).contains(&lasted_ns) {
        return 0.0;
    }
    let Some((before, after)) = speed_before(poses, at).zip(speed_after(poses, end)) else { return 0.0 };
    let is_alike = before * after > 0.0 && (1.0 / SAME_SPEED..=SAME_SPEED).contains(&(after / before));
    if is_alike { 0.5 * (before + after) } else { 0.0 }
}

/// Whether the odometry stands and goes on more suddenly than a base brakes and starts. The steps next to the
/// stand do not count: counters stop and go on in the midst of them.
fn is_sudden(poses: &[StampedPose], at: usize, end: usize) -> bool {
    let before = || {
        let brakes = at.checked_sub(1)?;
        let from = back(poses, brakes, BRAKES_NS)?;
        Some(speed(&poses[from], &poses[brakes])? / speed_before(poses, from)?)
    };
    let after = || {
        let starts = end + 1;
        let to = on(poses, starts, BRAKES_NS)?;
        Some(speed(&poses[starts], &poses[to])? / speed_after(poses, to)?)
    };
    [before(), after()].iter().all(|share| share.is_some_and(|share| share >= BRAKES))
}

/// How fast the odometry came here, meters a second ahead.
fn speed_before(poses: &[StampedPose], at: usize) -> Option<f64> {
    speed(&poses[back(poses, at, SPEED_NS)?], &poses[at])
}

/// How fast it goes on.
fn speed_after(poses: &[StampedPose], at: usize) -> Option<f64> {
    speed(&poses[at], &poses[on(poses, at, SPEED_NS)?])
}

/// The last pose that was so long before this one.
fn back(poses: &[StampedPose], at: usize, lasts_ns: i64) -> Option<usize> {
    let is_before = |from: &usize| poses[at].stamp_ns - poses[*from].stamp_ns >= lasts_ns;
    (0..at).rev().take(SPEED_SCANS).find(is_before)
}

/// The first pose that is so long after this one.
fn on(poses: &[StampedPose], at: usize, lasts_ns: i64) -> Option<usize> {
    let is_behind = |to: &usize| poses[*to].stamp_ns - poses[at].stamp_ns >= lasts_ns;
    (at + 1..poses.len()).take(SPEED_SCANS).find(is_behind)
}

fn speed(from: &StampedPose, to: &StampedPose) -> Option<f64> {
    let seconds = seconds(from, to);
    (seconds > 0.0).then(|| from.pose().between(&to.pose()).x_m / seconds)
}

fn seconds(from: &StampedPose, to: &StampedPose) -> f64 {
    (to.stamp_ns - from.stamp_ns) as f64 * 1e-9
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A base that goes 0.15 m each 0.2 s; from one scan to another its counters stand.
    fn drive(stand: std::ops::Range<usize>, speed_after: f64) -> Vec<Option<StampedPose>> {
        let mut x_m = 0.0;
        let pose = |scan: usize| {
            let step_m = if stand.contains(&scan) { 0.0 } else { 0.15 };
            x_m += if scan >= stand.end { speed_after * step_m } else { step_m };
            Some(StampedPose::planar(200_000_000 * scan as i64, Pose2::new(x_m, 0.0, 0.0)))
        };
        (0..40).map(pose).collect()
    }

    /// What a drive misses up to each scan, centimeters.
    fn missed_cm(drive: &[Option<StampedPose>]) -> Vec<i64> {
        let Some(filled) = filled(drive) else { return Vec::new() };
        let missed_m = filled
            .iter()
            .zip(drive)
            .map(|(filled, was)| filled.unwrap().pose.x_m - was.as_ref().unwrap().pose().x_m);
        missed_m.map(|missed_m| (100.0 * missed_m).round() as i64).collect()
    }

    /// The way that a drive misses in stands that no base makes, meters.
    fn sudden_m(drive: &[Option<StampedPose>]) -> f64 {
        filled(drive).unwrap().last().unwrap().unwrap().sudden_m
    }

    /// Goes, brakes over some scans, stands, and starts over some: steps in shares of the full one.
    fn steps(brakes: &[f64], starts: &[f64]) -> Vec<Option<StampedPose>> {
        let shares = [&[1.0; 10], brakes, &[0.0; 5], starts, &[1.0; 10]].concat();
        let mut x_m = 0.0;
        let pose = |(scan, share): (usize, &f64)| {
            x_m += 0.15 * share;
            Some(StampedPose::planar(200_000_000 * scan as i64, Pose2::new(x_m, 0.0, 0.0)))
        };
        shares.iter().enumerate().map(pose).collect()
    }

    #[test]
    fn a_stand_in_the_midst_of_a_drive_may_have_missed_the_way_of_its_time() {
        let missed_cm = missed_cm(&drive(10..15, 1.0));
        assert_eq!(missed_cm[9..17], [0, 15, 30, 45, 60, 75, 75, 75]);
    }

    #[test]
    fn short_and_long_stands_and_those_that_end_otherwise_are_none() {
        for (stand, speed_after) in [(10..11, 1.0), (8..36, 1.0), (10..15, 0.3), (10..15, -1.0)] {
            assert!(missed_cm(&drive(stand, speed_after)).is_empty(), "{speed_after}");
        }
    }

    #[test]
    fn counters_stop_and_go_on_within_a_step_and_bases_brake_and_start() {
        for (brakes, starts) in [(vec![], vec![]), (vec![0.3], vec![]), (vec![0.6], vec![0.1])] {
            let sudden_m = sudden_m(&steps(&brakes, &starts));
            assert!((0.5..0.8).contains(&sudden_m), "{brakes:?} {starts:?}: {sudden_m}");
        }
        let ramp = vec![0.8, 0.6, 0.4];
        for (brakes, starts) in [(ramp.clone(), vec![]), (vec![], vec![0.4, 0.6, 0.8]), (ramp, vec![0.5])] {
            assert_eq!(sudden_m(&steps(&brakes, &starts)), 0.0, "{brakes:?} {starts:?}");
        }
    }

    #[test]
    fn a_base_that_turns_in_place_does_not_stand() {
        let mut turned = drive(10..15, 1.0);
        for (scan, pose) in turned.iter_mut().flatten().enumerate() {
            let theta_rad = 0.2 * (scan.clamp(9, 14) - 9) as f64;
            *pose = StampedPose::planar(pose.stamp_ns, Pose2 { theta_rad, ..pose.pose() });
        }
        assert!(missed_cm(&turned).is_empty());
    }

    #[test]
    fn scans_without_odometry_and_stamps_that_repeat_are_passed_over() {
        let mut gaps = drive(10..15, 1.0);
        gaps[12] = None;
        let filled = filled(&gaps).unwrap();
        assert!(filled[12].is_none() && filled[13].is_some());
        let same = vec![Some(StampedPose::planar(0, Pose2::IDENTITY)); 30];
        assert!(super::filled(&same).is_none());
    }
}
