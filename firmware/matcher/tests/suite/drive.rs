//! Driving round a room with drifting odometry: the pose stays with the truth, and runs repeat exactly.

use biplane_matcher::{Method, Outcome, Pose2, Tracked, Tracker, TrackerParams};

use crate::world::{Drift, Noise, World, error, look, track};

/// Two rounds on a circle of 1 m radius, beginning at the identity.
fn circle(steps: i32) -> Vec<Pose2> {
    (0..=steps)
        .map(|i| {
            let angle = f64::from(i) / f64::from(steps) * 2.0 * std::f64::consts::TAU;
            Pose2::new(angle.sin(), 1.0 - angle.cos(), biplane_matcher::wrap_angle(angle))
        })
        .collect()
}

fn drive(params: TrackerParams) -> Vec<(Pose2, Tracked)> {
    let (world, mut noise) = (World::room(), Noise(7));
    let mut odometry = Drift::new(1.05, 0.02);
    let mut tracker = Tracker::new(params);
    let mut last = Pose2::IDENTITY;
    let mut stamp_ns = 0;
    circle(200)
        .into_iter()
        .map(|truth| {
            let odom = odometry.step(&last, &truth);
            last = truth;
            stamp_ns += 100_000_000;
            (truth, track(&mut tracker, stamp_ns, &look(&world, &truth, &mut noise), Some(odom)))
        })
        .collect()
}

#[test]
fn the_first_scan_begins_the_map_at_the_identity() {
    for method in Method::ALL {
        let (_, first) = drive(TrackerParams::for_method(method))[0];
        assert_eq!((first.outcome, first.map_from_base), (Outcome::First, Pose2::IDENTITY));
    }
}

#[test]
fn the_map_method_stays_within_three_centimeters_over_two_rounds_of_a_room() {
    for (truth, tracked) in drive(TrackerParams::default()).into_iter().skip(1) {
        let (meters, degrees) = error(&tracked.map_from_base, &truth);
        assert!(meters < 0.03 && degrees < 0.5, "{meters} m, {degrees} deg at {truth:?}");
        assert!(matches!(tracked.outcome, Outcome::Matched), "{tracked:?}");
        assert!(tracked.score > 0.7, "{tracked:?}");
    }
}

#[test]
fn the_gradient_method_beats_its_odometry_over_two_rounds_of_a_room() {
    let run = drive(TrackerParams::for_method(Method::Gradient));
    let (truth, last) = run.last().unwrap();
    let (meters, degrees) = error(&last.map_from_base, truth);
    // The odometry alone ends 14 degrees off.
    assert!(meters < 0.3 && degrees < 5.0, "{meters} m, {degrees} deg");
}

#[test]
fn two_runs_give_the_same_bits() {
    for method in Method::ALL {
        let texts = [0, 1].map(|_| format!("{:?}", drive(TrackerParams::for_method(method))));
        assert!(texts[0] == texts[1], "{method}");
    }
}

#[test]
fn a_pool_of_few_tiles_forgets_far_places_and_goes_on() {
    let mut params = TrackerParams::default();
    params.map.tiles = 12;
    params.map.surfaces = 150;
    let world = World::new(
        [World::rectangle([-2.0, -1.5], [40.0, 1.5]), World::rectangle([6.0, -1.5], [6.5, -1.0])].concat(),
    );
    let (mut tracker, mut noise) = (Tracker::new(params), Noise(3));
    for i in 0..300 {
        let truth = Pose2::new(f64::from(i) * 0.1, 0.0, 0.0);
        track(&mut tracker, i64::from(i) * 200_000_000, &look(&world, &truth, &mut noise), Some(truth));
        let size = tracker.map_size();
        assert!(size.tiles <= 12 && size.surfaces <= 150, "{size:?}");
    }
}
