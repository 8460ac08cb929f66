//! Along a bare corridor a scan says nothing of the way driven: odometry decides, and the covariance says so.

use biplane_matcher::{Method, Outcome, Pose2, Tracked, Tracker, TrackerParams};

use crate::world::{Noise, World, look, track};

/// Drives 10 m along a corridor; the odometry is 5 % long.
fn corridor(method: Method) -> (Tracked, f64) {
    let (world, mut noise) = (World::corridor(), Noise(11));
    let mut tracker = Tracker::new(TrackerParams::for_method(method));
    let mut last = None;
    for i in 0..=100 {
        let x_m = 0.1 * f64::from(i);
        let beams = look(&world, &Pose2::new(x_m, 0.0, 0.0), &mut noise);
        let odom = Pose2::new(1.05 * x_m, 0.0, 0.0);
        last = Some(track(&mut tracker, i64::from(i) * 200_000_000, &beams, Some(odom)));
    }
    (last.unwrap(), 10.5)
}

#[test]
fn a_bare_corridor_is_weak_and_its_axis_follows_the_odometry() {
    let (tracked, odometry_m) = corridor(Method::Map);
    assert_eq!(tracked.outcome, Outcome::Weak);
    let Pose2 { x_m, y_m, theta_rad } = tracked.map_from_base;
    assert!((x_m - odometry_m).abs() < 0.05, "{x_m}");
    assert!(y_m.abs() < 0.02 && theta_rad.abs() < 0.005, "{y_m} {theta_rad}");
}

#[test]
fn the_covariance_of_a_bare_corridor_is_long_along_its_axis_and_short_across() {
    let (tracked, _) = corridor(Method::Map);
    let sigma = [0, 1].map(|axis| tracked.covariance[axis][axis].sqrt());
    assert!(sigma[0] > 10.0 * sigma[1], "{sigma:?}");
    // The odometry is wrong by half a meter here: the covariance should not be surprised.
    assert!(sigma[0] > 0.1 && sigma[1] < 0.02, "{sigma:?}");
}

#[test]
fn the_gradient_method_does_not_claim_to_know_the_axis_either() {
    let (tracked, _) = corridor(Method::Gradient);
    let sigma = [0, 1].map(|axis| tracked.covariance[axis][axis].sqrt());
    assert!(sigma[0] > 2.0 * sigma[1], "{sigma:?}");
}

#[test]
fn a_panel_carried_through_a_bare_corridor_does_not_carry_the_base_along() {
    let noise = &mut Noise(12);
    let mut tracker = Tracker::new(TrackerParams::default());
    // It stands for a second, then it is carried towards the base.
    let panels_m = [5.2, 5.2, 5.2, 5.2, 5.2, 4.95, 4.7, 4.45, 4.2, 3.95, 3.7];
    for i in 0..60_usize {
        let x_m = 0.06 * i as f64;
        let mut world = World::rectangle([-20.0, -1.0], [40.0, 1.0]);
        if let Some(at_m) = i.checked_sub(20).and_then(|i| panels_m.get(i)) {
            world.extend(World::rectangle([*at_m, -0.8], [at_m + 0.02, 0.8]));
        }
        let odom = Pose2::new(x_m, 0.0, 0.0);
        let beams = look(&World::new(world), &odom, noise);
        let tracked = track(&mut tracker, i as i64 * 200_000_000, &beams, Some(odom));
        assert!((tracked.map_from_base.x_m - x_m).abs() < 0.02, "scan {i}: {tracked:?}");
    }
}

#[test]
fn people_who_walk_along_do_not_hold_the_base_back() {
    let noise = &mut Noise(13);
    let mut tracker = Tracker::new(TrackerParams::default());
    for i in 0..120_i32 {
        let x_m = 0.1 * f64::from((i - 5).max(0)); // it stands for a second
        let mut world = World::rectangle([-200.0, -1.1], [200.0, 1.1]);
        for [ahead_m, beside_m] in [[1.2, 0.5], [1.8, -0.4], [2.5, 0.1]] {
            let (x, y) = (x_m + ahead_m, beside_m);
            world.extend(World::rectangle([x - 0.12, y - 0.2], [x + 0.12, y + 0.2]));
        }
        let odom = Pose2::new(x_m, 0.0, 0.0);
        let beams = look(&World::new(world), &odom, noise);
        let found = track(&mut tracker, i64::from(i) * 200_000_000, &beams, Some(odom)).map_from_base;
        assert!((found.x_m - x_m).abs() < 0.1, "scan {i}: {found:?}");
    }
}

#[test]
fn after_a_long_step_posts_seen_once_are_landmarks() {
    let noise = &mut Noise(14);
    let mut tracker = Tracker::new(TrackerParams::default());
    let mut world = World::rectangle([-200.0, -1.1], [200.0, 1.1]);
    for [x, y] in [[1.5, 0.6], [2.5, -0.5], [3.5, 0.3], [4.5, -0.7]] {
        world.extend(World::rectangle([x - 0.1, y - 0.1], [x + 0.1, y + 0.1]));
    }
    let world = World::new(world);
    for i in 0..2 {
        let x_m = 0.8 * f64::from(i);
        let beams = look(&world, &Pose2::new(x_m, 0.0, 0.0), noise);
        let odom = Pose2::new(1.1 * x_m, 0.0, 0.0);
        let found = track(&mut tracker, i64::from(i) * 2_000_000_000, &beams, Some(odom)).map_from_base;
        assert!((found.x_m - x_m).abs() < 0.03, "scan {i}: {found:?}");
    }
}
