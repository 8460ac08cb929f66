//! Odometry whose meters are no meters: learned where scans tell the way, and used where they do not.

use biplane_matcher::{OdometryScale, Outcome, Pose2, Tracker, TrackerParams};

use crate::world::{Noise, World, look, track};

/// A corridor 2.2 m wide, with a cupboard on alternate sides every 2 m for the first 20 m and bare from there
/// on, its ends out of sight.
fn corridor() -> World {
    let mut walls = World::rectangle([-100.0, -1.1], [200.0, 1.1]);
    for number in 0..10 {
        let (at_m, side) = (f64::from(2 * number), if number % 2 == 0 { 1.0 } else { -1.0 });
        let [near_m, far_m]: [f64; 2] = [0.7 * side, 1.1 * side];
        walls.extend(World::rectangle([at_m, near_m.min(far_m)], [at_m + 0.6, near_m.max(far_m)]));
    }
    World::new(walls)
}

/// How far ahead of the truth the pose is after 20 m of cupboards and 30 bare meters, with odometry that
/// counts this share of the way; what the tracker has learned of it; how many scans were weak.
fn after_the_bare_corridor(share: f64, seed: u64) -> (f64, OdometryScale, usize) {
    let (world, mut noise) = (corridor(), Noise(seed));
    let mut tracker = Tracker::new(TrackerParams::default());
    let (mut ahead_m, mut weak) = (0.0, 0);
    for i in 0..=500 {
        let x_m = 0.1 * f64::from(i);
        let beams = look(&world, &Pose2::new(x_m, 0.0, 0.0), &mut noise);
        let odom = Pose2::new(share * x_m, 0.0, 0.0);
        let tracked = track(&mut tracker, i64::from(i) * 200_000_000, &beams, Some(odom));
        ahead_m = tracked.map_from_base.x_m - x_m;
        weak += usize::from(tracked.outcome == Outcome::Weak);
    }
    (ahead_m, tracker.odometry_scale(), weak)
}

#[test]
fn a_bare_corridor_is_as_long_as_the_odometry_has_proved_to_count() {
    for share in [0.9, 1.0, 1.1] {
        for seed in 1..=5 {
            let (ahead_m, scale, weak) = after_the_bare_corridor(share, seed);
            let way = scale.way.expect("20 m were enough");
            let off = (way.value * share - 1.0).abs();
            assert!(off < 3.0 * way.sigma, "{share} {seed}: {way:?}");
            // 10 % of the weak way would be two meters and more.
            assert!(weak > 200 && ahead_m.abs() < 0.5, "{share} {seed}: {ahead_m} m, {weak} weak, {way:?}");
        }
    }
}
