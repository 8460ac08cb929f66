//! How far the pose drifts with poor odometry, without loop closing, and what people do to it.

use biplane_matcher::{TrackerParams, wrap_angle};
use biplane_mock::world::World;
use biplane_mock::world::path::Path;

use crate::ride::{InTheWay, Odometry, Ride};
use crate::seeds;

/// Share of the way and degrees per 100 m that a drive may be off at its end.
const MAXIMUM: [f64; 2] = [0.003, 0.3];

/// The furnished corridor, so many times along and back in turns.
fn corridor(legs: u32) -> Ride {
    let world = World::named("corridor").unwrap();
    let path = Path { speed_m_s: 0.4, ..world.path(None).unwrap().clone() };
    Ride::new("furnished corridor", &world, &path, legs)
}

/// So many rounds of the office.
fn office(rounds: usize) -> Ride {
    let world = World::named("office").unwrap();
    let usual = world.path(None).unwrap();
    let corners = usual.waypoints_m.len() - 1;
    let mut waypoints_m = vec![usual.waypoints_m[0]];
    for _ in 0..rounds {
        waypoints_m.extend_from_slice(&usual.waypoints_m[1..corners]);
    }
    waypoints_m.push(usual.waypoints_m[corners]);
    Ride::new("office", &world, &Path { waypoints_m, ..usual.clone() }, 1)
}

/// Root mean square over seeds of the error at the end, meters and degrees, and the largest error on the way
/// as a share of it.
fn drift(ride: &Ride, people: u32) -> [f64; 2] {
    let (mut squares, mut worst, mut count) = ([0.0; 2], [0.0_f64; 2], 0.0);
    for seed in seeds(3) {
        let run = ride.run(
            TrackerParams::default(),
            &Odometry::poor(),
            InTheWay { people, ..InTheWay::default() },
            seed,
        );
        let mut last = [0.0; 2];
        for (step, moment) in run.iter().zip(&ride.moments) {
            let (found, truth) = (&step.tracked.map_from_base, &moment.truth);
            last = [
                (found.x_m - truth.x_m).hypot(found.y_m - truth.y_m),
                wrap_angle(found.theta_rad - truth.theta_rad).abs().to_degrees(),
            ];
            worst = [worst[0].max(last[0]), worst[1].max(last[1])];
        }
        squares = [squares[0] + last[0] * last[0], squares[1] + last[1] * last[1]];
        count += 1.0;
    }
    let rms = squares.map(|sum: f64| (sum / count).sqrt());
    let path_m = ride.moments.last().unwrap().path_m;
    let hidden =
        ride.moments.iter().map(|moment| moment.hidden(people)).sum::<f64>() / ride.moments.len() as f64;
    println!(
        "| {} | {path_m:.0} m | {:.0} % | {:.1} cm | {:.3} % | {:.2} deg | {:.2} deg/100 m | {:.1} cm, {:.2} deg |",
        ride.name,
        100.0 * hidden,
        100.0 * rms[0],
        100.0 * rms[0] / path_m,
        rms[1],
        100.0 * rms[1] / path_m,
        100.0 * worst[0],
        worst[1]
    );
    [rms[0] / path_m, 100.0 * rms[1] / path_m]
}

fn assert_little(name: &str, drift: [f64; 2]) {
    assert!(drift[0] < MAXIMUM[0] && drift[1] < MAXIMUM[1], "{name}: {drift:?}");
}

#[test]
fn with_poor_odometry_an_office_drifts_less_than_3_in_1000_and_3_tenths_of_a_degree_in_100_m() {
    let rounds: &[usize] = if seeds(3).count() < 10 { &[1] } else { &[1, 3] };
    for &rounds in rounds {
        assert_little("office", drift(&office(rounds), 0));
    }
}

#[test]
fn with_poor_odometry_a_furnished_corridor_drifts_less_than_3_in_1000_and_3_tenths_of_a_degree_in_100_m() {
    // 100 m of it are ten times its length.
    assert_little("corridor", drift(&corridor(if seeds(3).count() < 10 { 4 } else { 10 }), 0));
    // On the first 10 m the heading still has the error of the first scan, which no way divides yet.
    assert!(drift(&corridor(1), 0)[0] < MAXIMUM[0]);
}

#[test]
fn somebody_who_walks_past_changes_little() {
    assert!(drift(&corridor(2), 1)[0] < MAXIMUM[0]);
}

/// Root mean square of the positions' errors, a drive a seed, ascending, meters.
fn errors_m(ride: &Ride, way: InTheWay, seeds: std::ops::RangeInclusive<u64>) -> Vec<f64> {
    let error_m = |seed| {
        let run = ride.run(TrackerParams::default(), &Odometry::poor(), way, seed);
        let squares = run.iter().zip(&ride.moments).map(|(step, moment)| {
            let (found, truth) = (&step.tracked.map_from_base, &moment.truth);
            (found.x_m - truth.x_m).powi(2) + (found.y_m - truth.y_m).powi(2)
        });
        (squares.sum::<f64>() / run.len() as f64).sqrt()
    };
    let mut errors_m: Vec<f64> = seeds.map(error_m).collect();
    errors_m.sort_by(f64::total_cmp);
    errors_m
}

#[test]
fn a_quarter_of_the_beams_falling_short_leaves_the_pose_within_3_centimeters() {
    let ride = corridor(2);
    let way = InTheWay { short_share: 0.25, ..InTheWay::default() };
    let errors_m = errors_m(&ride, way, seeds(4));
    let rms_cm: Vec<f64> = errors_m.iter().map(|error_m| 100.0 * error_m).collect();
    let all_m = (errors_m.iter().map(|error_m| error_m.powi(2)).sum::<f64>() / errors_m.len() as f64).sqrt();
    println!("{:.1} cm rms; drives {rms_cm:.1?}", 100.0 * all_m);
    assert!(all_m < 0.03, "{all_m} m");
}

#[test]
fn a_robot_that_leans_over_sills_and_sees_the_floor_keeps_its_pose() {
    // Both worlds have corridors, where the floor ahead is all that a scan sees across the way.
    for ride in [corridor(4), office(1)] {
        let medians_m = [false, true].map(|leans| {
            let errors_m = errors_m(&ride, InTheWay { leans, ..InTheWay::default() }, seeds(5));
            let (median_m, worst_m) = (errors_m[errors_m.len() / 2], errors_m[errors_m.len() - 1]);
            let far = errors_m.iter().filter(|error_m| **error_m > 0.1).count();
            println!(
                "| {} | {} | {:.1} cm | {:.1} cm | {far} of {} |",
                ride.name,
                if leans { "leans" } else { "level" },
                100.0 * median_m,
                100.0 * worst_m,
                errors_m.len()
            );
            median_m
        });
        assert!(medians_m[1] < 2.0 * medians_m[0], "{}: {medians_m:?} m", ride.name);
    }
}
