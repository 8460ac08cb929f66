//! Odometry that lies along a corridor where scans say little of the way: its sign is wrong, it jumps.

use biplane_matcher::{Odometry, Pose2, Tracked, Tracker, TrackerParams};

use crate::world::{Noise, World, look, track};

/// A corridor 2 m wide with a niche of 20 cm on either side every 5 m.
fn corridor() -> World {
    let mut walls = Vec::new();
    for side in [-1.0, 1.0] {
        for door in -4..8 {
            let left_m = 5.0 * f64::from(door) + 0.7 * side;
            let (right_m, next_m) = (left_m + 0.9, left_m + 5.0);
            let corners = [[left_m, 1.0], [left_m, 1.2], [right_m, 1.2], [right_m, 1.0], [next_m, 1.0]];
            walls.extend(corners.windows(2).map(|pair| [pair[0], pair[1]].map(|[x, y]| [x, side * y])));
        }
    }
    World::new(walls)
}

/// Which fifth of a second of the drive a scan shows, and its stamp in nanoseconds.
type Moment = fn(i32) -> (i32, i64);
const IN_ORDER: Moment = |i| (i, i64::from(i) * 200_000_000);
/// Two scans at once, as a computer stamps them that is busy.
const IN_PAIRS: Moment = |i| (i, i64::from(i / 2) * 400_000_000);
/// The same, the later scan first.
const SWAPPED: Moment = |i| (i ^ 1, i64::from(i / 2) * 400_000_000);

/// Where the base was, and what the tracker made of it: there at 0.4 m/s, and back as it came, five scans a
/// second.
fn drive(moment: Moment, odometry: impl Fn(i32, f64) -> f64, seed: u64) -> Vec<(f64, Tracked)> {
    let (world, mut noise) = (corridor(), Noise(seed));
    let mut tracker = Tracker::new(TrackerParams::default());
    let ahead = |i: i32| 0.08 * f64::from(if i < 120 { i } else { 240 - i });
    let run = (0..240).map(moment).map(|(i, stamp_ns)| {
        let beams = look(&world, &Pose2::new(ahead(i), 0.0, 0.0), &mut noise);
        let odom = Pose2::new(odometry(i, ahead(i)), 0.0, 0.0);
        (ahead(i), track(&mut tracker, stamp_ns, &beams, Some(odom)))
    });
    run.collect()
}

/// How far the run is from that with right odometry, at the worst: what the scans make of the corridor is in
/// both.
fn worst_m(moment: Moment, odometry: impl Fn(i32, f64) -> f64, seed: u64) -> f64 {
    let (right, wrong) = (drive(moment, |_, x_m| x_m, seed), drive(moment, odometry, seed));
    let off =
        right.iter().zip(&wrong).map(|((_, a), (_, b))| (a.map_from_base.x_m - b.map_from_base.x_m).abs());
    off.fold(0.0, f64::max)
}

const SEEDS: std::ops::RangeInclusive<u64> = 1..=41;

/// The middle one of what all seeds make of something, and what nine in ten of them stay below.
fn middle_and_nine_in_ten(of: impl Fn(u64) -> f64) -> [f64; 2] {
    let mut all: Vec<f64> = SEEDS.map(of).collect();
    all.sort_by(f64::total_cmp);
    [all[20], all[36]]
}

/// Scans by which odometry that counts the way back as a way ahead was doubted: on the way ahead, on the way
/// back.
fn doubted_with_reversed_odometry(seed: u64) -> [usize; 2] {
    let run = drive(IN_ORDER, |i, _| 0.08 * f64::from(i), seed);
    let doubted = |(_, tracked): &&(f64, Tracked)| {
        matches!(tracked.odometry, Odometry::Reversed | Odometry::Contradicted)
    };
    let (ahead, back) = run.split_at(120);
    [ahead, back].map(|half| half.iter().filter(doubted).count())
}

#[test]
fn odometry_that_counts_the_way_back_as_a_way_ahead_is_noticed() {
    let doubted: Vec<[usize; 2]> = SEEDS.map(doubted_with_reversed_odometry).collect();
    assert!(doubted.iter().all(|[ahead, _]| *ahead < 5), "{doubted:?}");
    let late = doubted.iter().filter(|[_, back]| *back <= 90).count();
    assert!(late <= 4, "{late} of 41: {doubted:?}");
    let [middle_m, _] = middle_and_nine_in_ten(|seed| worst_m(IN_ORDER, |i, _| 0.08 * f64::from(i), seed));
    assert!(middle_m < 0.8, "{middle_m} m");
}

/// A meter ahead and, six seconds later, back again.
fn jumping(i: i32, x_m: f64) -> f64 {
    x_m + f64::from(i / 30 % 2)
}

#[test]
fn odometry_that_jumps_by_a_meter_is_overcome_also_where_scans_come_at_once() {
    for moment in [IN_ORDER, IN_PAIRS] {
        let [middle_m, nine_in_ten_m] = middle_and_nine_in_ten(|seed| worst_m(moment, jumping, seed));
        assert!(middle_m < 0.2 && nine_in_ten_m < 0.3, "{middle_m} {nine_in_ten_m} m");
    }
}

#[test]
fn odometry_that_leaps_with_scans_in_a_wrong_order_is_followed() {
    let worst_m = |seed| {
        let run = drive(SWAPPED, |_, x_m| x_m, seed);
        let first_m = run[0].0;
        run.iter().map(|(x_m, at)| (at.map_from_base.x_m - (x_m - first_m)).abs()).fold(0.0, f64::max)
    };
    let [middle_m, nine_in_ten_m] = middle_and_nine_in_ten(worst_m);
    assert!(middle_m < 0.5 && nine_in_ten_m < 1.0, "{middle_m} {nine_in_ten_m} m");
}
