//! The journal tells the iterations of each match, and keeping it changes nothing.

use biplane_matcher::{Method, Pose2, Tracker, TrackerParams};

use crate::world::{Noise, World, look, track};

/// Two scans of the room, the second with odometry that is 10 cm and 5 degrees off.
fn second_scan(method: Method, keep: usize) -> (Tracker, biplane_matcher::Tracked) {
    let (room, mut noise) = (World::room(), Noise(21));
    let mut tracker = Tracker::new(TrackerParams::for_method(method));
    tracker.keep_journal(keep);
    track(&mut tracker, 0, &look(&room, &Pose2::IDENTITY, &mut noise), Some(Pose2::IDENTITY));
    assert!(tracker.journal().iterations().is_empty(), "the first scan is not matched");
    let truth = Pose2::new(0.3, 0.1, 0.2);
    let wrong = truth * Pose2::new(0.1, 0.0, 0.09);
    let tracked = track(&mut tracker, 1_000_000_000, &look(&room, &truth, &mut noise), Some(wrong));
    (tracker, tracked)
}

#[test]
fn the_journal_leads_from_the_odometrys_pose_to_the_one_that_was_found() {
    for method in Method::ALL {
        let (tracker, tracked) = second_scan(method, 500);
        let iterations = tracker.journal().iterations();
        assert_eq!(iterations.len(), tracked.iterations as usize, "{method}");
        let (first, last) = (iterations[0], iterations[iterations.len() - 1]);
        let start = Pose2::new(0.3, 0.1, 0.2) * Pose2::new(0.1, 0.0, 0.09);
        assert!(start.between(&first.pose).distance_m() < 1e-9 && first.iteration == 0, "{method} {first:?}");
        assert!(first.cost > 2.0 * last.cost && first.used > 100, "{method} {first:?} {last:?}");
        let end = tracked.map_from_base.between(&last.pose).distance_m();
        assert!(end < last.step_m + 0.005, "{method} {last:?}");
        // Each step leads to the next iteration's pose.
        for pair in iterations.windows(2).filter(|pair| pair[1].iteration > 0) {
            let path_m = (pair[1].pose.x_m - pair[0].pose.x_m).hypot(pair[1].pose.y_m - pair[0].pose.y_m);
            assert!((path_m - pair[0].step_m).abs() < 1e-9, "{method} {pair:?}");
        }
    }
}

#[test]
fn keeping_a_journal_changes_no_pose_and_a_small_one_counts_what_it_drops() {
    for method in Method::ALL {
        let (tracker, kept) = second_scan(method, 3);
        assert_eq!(tracker.journal().iterations().len(), 3);
        assert_eq!(tracker.journal().dropped(), u64::from(kept.iterations) - 3);
        let (tracker, plain) = second_scan(method, 0);
        assert_eq!(format!("{plain:?}"), format!("{kept:?}"), "{method}");
        assert!(tracker.journal().iterations().is_empty() && tracker.journal().dropped() == 0);
    }
}
