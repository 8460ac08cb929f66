//! From a wrong start against one earlier scan (the paper's figure 2, without its 30 degrees).

use biplane_matcher::{Method, Pose2, Tracker, TrackerParams};

use crate::world::{Noise, World, error, look, track};

/// The errors after matching a second scan whose odometry is off by `wrong` (in the base's frame).
fn second_scan(method: Method, wrong: Pose2, seed: u64) -> (f64, f64) {
    let (world, mut noise) = (World::room(), Noise(seed));
    let mut tracker = Tracker::new(TrackerParams::for_method(method));
    track(&mut tracker, 0, &look(&world, &Pose2::IDENTITY, &mut noise), Some(Pose2::IDENTITY));
    let truth = Pose2::new(0.3, 0.1, 0.2);
    let tracked = track(&mut tracker, 1_000_000_000, &look(&world, &truth, &mut noise), Some(truth * wrong));
    error(&tracked.map_from_base, &truth)
}

fn starts(degrees: f64) -> impl Iterator<Item = Pose2> {
    let signs = [[1.0, 1.0, 1.0], [1.0, -1.0, 1.0], [-1.0, 1.0, -1.0], [-1.0, -1.0, -1.0]];
    signs.into_iter().map(move |[x, y, turn]| Pose2::new(0.1 * x, 0.1 * y, (degrees * turn).to_radians()))
}

#[test]
fn the_map_method_finds_the_pose_from_10_cm_and_up_to_20_degrees_off() {
    for degrees in [0.0, 10.0, 20.0] {
        for (seed, wrong) in (1..).zip(starts(degrees)) {
            let (meters, off) = second_scan(Method::Map, wrong, seed);
            assert!(meters < 0.02 && off < 0.5, "{meters} m, {off} deg from {wrong:?}");
        }
    }
}

#[test]
fn the_gradient_method_comes_within_half_a_cell_from_10_cm_and_10_degrees_off() {
    for (seed, wrong) in (1..).zip(starts(10.0)) {
        let (meters, off) = second_scan(Method::Gradient, wrong, seed);
        assert!(meters < 0.05 && off < 1.5, "{meters} m, {off} deg from {wrong:?}");
    }
}
