//! Scans, stamps and odometry that are missing, repeated, backward or wrong: every case has a defined
//! outcome.

use biplane_matcher::{Beam, Method, Odometry, Outcome, Pose2, Tracked, Tracker, TrackerParams};

use crate::world::{Noise, World, error, look, track};

fn straight(i: i32) -> Pose2 {
    Pose2::new(0.02 * f64::from(i), 0.01 * f64::from(i), 0.01 * f64::from(i))
}

/// Fifty scans along a slight bend; `stamp` and `odom` say what the tracker is told.
fn drive(method: Method, stamp: impl Fn(i32) -> i64, odom: impl Fn(i32) -> Option<Pose2>) -> Vec<Tracked> {
    let (world, mut noise) = (World::room(), Noise(5));
    let mut tracker = Tracker::new(TrackerParams::for_method(method));
    (0..50).map(|i| track(&mut tracker, stamp(i), &look(&world, &straight(i), &mut noise), odom(i))).collect()
}

fn assert_on_track(run: &[Tracked], first: i32) {
    for (i, tracked) in (0..).zip(run).filter(|(i, _)| *i >= first) {
        let (meters, degrees) = error(&tracked.map_from_base, &straight(i));
        assert!(meters < 0.03 && degrees < 0.5, "scan {i}: {meters} m, {degrees} deg, {tracked:?}");
    }
}

#[test]
fn backward_and_repeated_stamps_change_nothing_while_odometry_comes() {
    let even = drive(Method::Map, |i| i64::from(i) * 100_000_000, |i| Some(straight(i)));
    let odd = drive(Method::Map, |i| [0, 5, 5, 2, i64::MAX, i64::MIN][i as usize % 6], |i| Some(straight(i)));
    assert_eq!(even, odd);
}

#[test]
fn without_odometry_the_last_motion_goes_on() {
    assert_on_track(&drive(Method::Map, |i| i64::from(i) * 100_000_000, |_| None), 0);
}

#[test]
fn without_odometry_broken_stamps_do_no_harm() {
    let stamp = |i: i32| [0, 5, 5, 2, i64::MAX, i64::MIN][i as usize % 6];
    assert_on_track(&drive(Method::Map, stamp, |_| None), 0);
}

/// What was said of the odometry, each state once with the first scan it was said of.
fn states(run: &[Tracked]) -> Vec<(usize, Odometry)> {
    let mut states: Vec<(usize, Odometry)> = Vec::new();
    for (i, tracked) in run.iter().enumerate() {
        if states.last().is_none_or(|(_, state)| *state != tracked.odometry) {
            states.push((i, tracked.odometry));
        }
    }
    states
}

#[test]
fn odometry_that_is_missing_jumps_or_is_no_number_is_said_and_overcome() {
    use Odometry::{Jumped, Missing, Used};
    let none = drive(Method::Map, i64::from, |_| None);
    assert_on_track(&none, 0);
    assert_eq!(states(&none), [(0, Missing)]);
    let jump = |i: i32| Some(Pose2::new(if i < 20 { 0.0 } else { 50.0 }, 0.0, 0.0) * straight(i));
    let jump = drive(Method::Map, i64::from, jump);
    assert_on_track(&jump, 0);
    assert_eq!(states(&jump), [(0, Missing), (1, Used), (20, Jumped), (21, Used)]);
    let broken = |i: i32| Some(if i == 20 { Pose2::new(f64::NAN, 0.0, 0.0) } else { straight(i) });
    let broken = drive(Method::Map, i64::from, broken);
    assert_on_track(&broken, 0);
    assert_eq!(states(&broken), [(0, Missing), (1, Used), (20, Jumped), (21, Missing), (22, Used)]);
}

#[test]
fn odometry_that_stalls_is_said_and_overcome_until_it_moves_again() {
    let stall = |i: i32| Some(straight(if i < 10 { i } else { 10.max(i - 20) }));
    let run = drive(Method::Map, i64::from, stall);
    assert_on_track(&run, 0);
    // From scan 10 on it stands; seven steps of 22 mm later that is noticed; at scan 31 it moves again.
    let [first, moves, stalls, again] = states(&run)[..] else { panic!("{:?}", states(&run)) };
    assert_eq!((first, moves), ((0, Odometry::Missing), (1, Odometry::Used)));
    assert!((17..=19).contains(&stalls.0) && stalls.1 == Odometry::Stalled, "{stalls:?}");
    assert!((31..=33).contains(&again.0) && again.1 == Odometry::Used, "{again:?}");
}

#[test]
fn odometry_that_comes_late_or_counts_wrongly_is_overcome() {
    let late = |i: i32| Some(straight((i - 3).max(0)));
    assert_on_track(&drive(Method::Map, i64::from, late), 0);
    for scale in [0.5, 2.0, -1.0] {
        let scaled = |i: i32| {
            let Pose2 { x_m, y_m, theta_rad } = straight(i);
            Some(Pose2::new(scale * x_m, scale * y_m, scale * theta_rad))
        };
        assert_on_track(&drive(Method::Map, i64::from, scaled), 0);
    }
}

/// The volume of the covariance's ellipsoid, squared: a step ahead may make a place surer than the one before
/// was, when its error and that of the heading cancel, but never place and heading together.
fn volume(tracked: &Tracked) -> f64 {
    nalgebra::Matrix3::from_fn(|i, j| tracked.covariance[i][j]).determinant()
}

#[test]
fn a_scan_without_returns_follows_the_odometry_with_a_larger_covariance() {
    for method in Method::ALL {
        let (world, mut noise) = (World::room(), Noise(5));
        let mut tracker = Tracker::new(TrackerParams::for_method(method));
        let empty = vec![Beam { direction_in_base: [1.0, 0.0], range_m: f32::INFINITY, delay_s: 0.0 }; 181];
        track(&mut tracker, 0, &look(&world, &straight(0), &mut noise), Some(straight(0)));
        let matched = track(&mut tracker, 1, &look(&world, &straight(1), &mut noise), Some(straight(1)));
        let mut last = matched;
        for i in 2..10 {
            let blind = track(&mut tracker, i64::from(i), &empty, Some(straight(i)));
            assert_eq!((blind.outcome, blind.score, blind.iterations), (Outcome::NoReturns, 0.0, 0));
            assert!(volume(&blind) > volume(&last));
            let step = matched.map_from_base.between(&blind.map_from_base);
            let (meters, degrees) = error(&step, &straight(1).between(&straight(i)));
            assert!(meters < 1e-9 && degrees < 1e-9);
            last = blind;
        }
        let back = track(&mut tracker, 10, &look(&world, &straight(10), &mut noise), Some(straight(10)));
        assert_eq!(back.outcome, Outcome::Matched);
    }
}

#[test]
fn a_scan_of_one_beam_and_one_beyond_all_range_are_scans_without_returns() {
    let (world, mut noise) = (World::room(), Noise(5));
    let mut tracker = Tracker::new(TrackerParams::default());
    let mut room = look(&world, &straight(0), &mut noise);
    track(&mut tracker, 0, &room, Some(straight(0)));
    let size = tracker.map_size();
    let one = track(&mut tracker, 1, &room[90..91], Some(straight(1)));
    room.iter_mut().for_each(|beam| beam.range_m = 81.0);
    let far = track(&mut tracker, 2, &room, Some(straight(2)));
    assert_eq!([one.outcome, far.outcome], [Outcome::NoReturns; 2]);
    assert!(volume(&far) > volume(&one) && tracker.map_size() == size);
    assert!(error(&far.map_from_base, &straight(2)).0 < 1e-9);
}

#[test]
fn a_recording_that_begins_without_returns_begins_the_map_with_the_first_that_has_some() {
    let (world, mut noise) = (World::room(), Noise(5));
    let mut tracker = Tracker::new(TrackerParams::default());
    assert_eq!(track(&mut tracker, 0, &[], None).outcome, Outcome::NoReturns);
    let seen = track(&mut tracker, 1, &look(&world, &straight(0), &mut noise), None);
    assert_eq!(seen.outcome, Outcome::First);
}

#[test]
fn a_scan_of_another_place_is_lost_and_teaches_the_map_nothing() {
    let (room, mut noise) = (World::room(), Noise(5));
    let elsewhere = World::new(World::rectangle([-0.6, -0.7], [0.9, 0.8]));
    let mut tracker = Tracker::new(TrackerParams::default());
    let mut last = track(&mut tracker, 0, &look(&room, &straight(0), &mut noise), Some(straight(0)));
    for i in 1..20 {
        last = track(&mut tracker, i64::from(i), &look(&room, &straight(i), &mut noise), Some(straight(i)));
    }
    let size = tracker.map_size();
    for i in 20..26 {
        let strange = track(
            &mut tracker,
            i64::from(i),
            &look(&elsewhere, &Pose2::IDENTITY, &mut noise),
            Some(straight(i)),
        );
        assert_eq!(strange.outcome, Outcome::Lost, "{strange:?}");
        assert!(volume(&strange) > volume(&last));
        last = strange;
    }
    assert_eq!(tracker.map_size(), size);
    let back = track(&mut tracker, 26, &look(&room, &straight(26), &mut noise), Some(straight(26)));
    assert_eq!(back.outcome, Outcome::Matched);
    assert!(error(&back.map_from_base, &straight(26)).0 < 0.03);
}

#[test]
fn a_base_carried_half_a_meter_is_found_again() {
    let (world, mut noise) = (World::room(), Noise(5));
    let mut tracker = Tracker::new(TrackerParams::default());
    for i in 0..20 {
        track(&mut tracker, i64::from(i), &look(&world, &straight(i), &mut noise), Some(straight(i)));
    }
    let carried = straight(19) * Pose2::new(0.25, -0.2, 0.25);
    let found = track(&mut tracker, 20, &look(&world, &carried, &mut noise), Some(straight(19)));
    let (meters, degrees) = error(&found.map_from_base, &carried);
    assert!(meters < 0.03 && degrees < 0.5, "{meters} m, {degrees} deg, {found:?}");
}

/// Where the base is said to be without odometry, in ten scans after twenty ordinary ones. So many of the ten
/// see the room from a place 45 cm farther on, and clutter with every second beam.
fn seen_from_elsewhere(strange: i32) -> Vec<(Tracked, Pose2)> {
    let (world, mut noise) = (World::room(), Noise(5));
    let mut tracker = Tracker::new(TrackerParams::default());
    let mut run = Vec::new();
    for i in 0..30 {
        let is_strange = (20..20 + strange).contains(&i);
        let place = straight(i) * Pose2::new(if is_strange { 0.45 } else { 0.0 }, 0.0, 0.0);
        let mut beams = look(&world, &place, &mut noise);
        if is_strange {
            beams.iter_mut().step_by(2).for_each(|beam| beam.range_m *= 0.6 + 0.3 * noise.even() as f32);
        }
        run.push((track(&mut tracker, 100_000_000 * i64::from(i), &beams, None), place));
    }
    run.split_off(20)
}

#[test]
fn without_odometry_a_leap_by_a_scan_that_hardly_fits_has_to_be_confirmed() {
    let away_m = |(tracked, place): &(Tracked, Pose2)| error(&tracked.map_from_base, place).0;
    let once = seen_from_elsewhere(1);
    assert_eq!(once[0].0.outcome, Outcome::Lost);
    assert!((away_m(&once[0]) - 0.45).abs() < 0.05, "the motion goes on: {:?}", once[0]);
    assert!(once[1..].iter().all(|seen| away_m(seen) < 0.03), "{once:?}");
    let carried = seen_from_elsewhere(3);
    let outcomes: Vec<Outcome> = carried.iter().map(|(tracked, _)| tracked.outcome).collect();
    assert_eq!(outcomes[..3], [Outcome::Lost, Outcome::Lost, Outcome::Matched]);
    assert!(away_m(&carried[2]) < 0.05, "{carried:?}");
}

/// A tracker that drove straight on, and turned once about itself first when it `knows_all_round`. Then the
/// base was moved a little and turned by so much, which the odometry did not feel: its place, and five scans.
fn turned_by_hand(turn_rad: f64, knows_all_round: bool) -> (Pose2, Vec<Tracked>) {
    let (world, mut noise) = (World::room(), Noise(5));
    let mut tracker = Tracker::new(TrackerParams::default());
    let round = (0..if knows_all_round { 64 } else { 0 }).map(|i| Pose2::new(0.0, 0.0, 0.1 * f64::from(i)));
    for (i, pose) in (0..).zip(round.chain((0..20).map(straight))) {
        track(&mut tracker, i, &look(&world, &pose, &mut noise), Some(pose));
    }
    let turned = straight(19) * Pose2::new(0.1, 0.05, turn_rad);
    let mut seen = |i| track(&mut tracker, i, &look(&world, &turned, &mut noise), Some(straight(19)));
    (turned, (100..105).map(&mut seen).collect())
}

#[test]
fn a_base_turned_round_that_its_odometry_did_not_feel_is_found_again_where_the_map_knows_what_it_sees() {
    for turn_rad in [0.8, -0.9, 1.4, -1.4, -1.9, 2.6, -2.6] {
        let (turned, seen) = turned_by_hand(turn_rad, true);
        let found = seen[4];
        let (meters, degrees) = error(&found.map_from_base, &turned);
        assert!(meters < 0.03 && degrees < 0.5, "{turn_rad}: {meters} m, {degrees} deg, {found:?}");
    }
}

#[test]
fn a_match_that_explains_little_and_contradicts_the_odometry_gives_way_to_a_heading_that_explains_all() {
    for turn_rad in [1.8, -1.8, 2.4] {
        let (turned, seen) = turned_by_hand(turn_rad, true);
        let (meters, degrees) = error(&seen[0].map_from_base, &turned);
        assert!(meters < 0.03 && degrees < 0.5, "{turn_rad}: {meters} m, {degrees} deg, {:?}", seen[0]);
    }
}

#[test]
fn a_base_turned_to_what_the_map_does_not_know_is_lost_and_not_found_elsewhere() {
    for turn_rad in [1.9, -1.9, -2.6] {
        let (_, seen) = turned_by_hand(turn_rad, false);
        for found in seen {
            let (meters, degrees) = error(&found.map_from_base, &straight(19));
            assert_eq!(found.outcome, Outcome::Lost, "{turn_rad}: {found:?}");
            assert!(meters < 0.03 && degrees < 0.5, "{turn_rad}: {meters} m, {degrees} deg, {found:?}");
        }
    }
}

#[test]
fn no_number_in_a_scan_makes_a_pose_that_is_no_number() {
    let wild = [f32::NAN, f32::NEG_INFINITY, -1.0, 0.0, f32::MAX, f32::MIN_POSITIVE, 1.0];
    for method in Method::ALL {
        let mut tracker = Tracker::new(TrackerParams::for_method(method));
        for (i, a) in (0..).zip(wild) {
            let beams: Vec<Beam> = wild
                .iter()
                .flat_map(|&b| wild.map(|c| Beam { direction_in_base: [a, b], range_m: c, delay_s: b }))
                .collect();
            let tracked = track(&mut tracker, i, &beams, Some(Pose2::new(f64::from(a), 0.0, f64::from(a))));
            assert!(tracked.map_from_base.is_finite(), "{a} {tracked:?}");
        }
    }
}
