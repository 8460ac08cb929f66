//! Whether the covariance keeps its word: the error of the pose in `map`, the first pose being exact,
//! normalized by it.
//!
//! The normalized error squared (NEES) of a consistent estimate of three numbers has the mean 3; summed over
//! n independent runs it follows a chi-square distribution of 3 n degrees of freedom. Poses of one run are
//! not independent, so n counts runs only. The odometry's errors are drawn with the deviations that
//! `belief`'s parameters name.

use biplane_matcher::{Outcome, Pose2, TrackerParams, wrap_angle};
use biplane_mock::world::World;
use nalgebra::{Matrix2, Matrix3, Vector3};

use crate::ride::{InTheWay, Odometry, Ride, Step, bare_corridor};
use crate::seeds;

/// Shares of a ride's scans at which the error is looked at.
const AT: [f64; 9] = [0.05, 0.1, 0.25, 0.4, 0.5, 0.6, 0.75, 0.9, 0.999];

fn error(step: &Step, truth: &Pose2) -> Vector3<f64> {
    let found = &step.tracked.map_from_base;
    let turn_rad = wrap_angle(found.theta_rad - truth.theta_rad);
    Vector3::new(found.x_m - truth.x_m, found.y_m - truth.y_m, turn_rad)
}

fn covariance(step: &Step) -> Matrix3<f64> {
    Matrix3::from_fn(|i, j| step.tracked.covariance[i][j])
}

/// 95 % of a mean over `runs` of what has `freedom` degrees of freedom lies within this (Wilson and Hilferty
/// 1931).
fn band(runs: f64, freedom: f64) -> [f64; 2] {
    let k = runs * freedom;
    [-1.96, 1.96].map(|z: f64| k * (1.0 - 2.0 / (9.0 * k) + z * (2.0 / (9.0 * k)).sqrt()).powi(3) / runs)
}

/// Mean NEES of a ride over seeds and places, and of x, y and heading each; printed place by place.
fn nees(ride: &Ride) -> (f64, [f64; 3]) {
    let params = TrackerParams::default();
    let runs: Vec<Vec<Step>> = seeds(4)
        .map(|seed| ride.run(params, &Odometry::drawn(&params, seed), InTheWay::default(), seed))
        .collect();
    let count = runs.len() as f64;
    let (mut all, mut each) = (0.0, [0.0; 3]);
    println!(
        "{}: way m | error rms x cm, y cm, heading deg | covariance x cm, y cm, heading deg | NEES | \
         mean heading error deg",
        ride.name
    );
    for share in AT {
        let place = (ride.moments.len() as f64 * share) as usize;
        let moment = &ride.moments[place];
        let (mut squares, mut reported, mut mean) = (Vector3::zeros(), Vector3::zeros(), 0.0);
        let mut off_rad = 0.0;
        for run in &runs {
            let (error, covariance) = (error(&run[place], &moment.truth), covariance(&run[place]));
            mean += error.dot(&(covariance.try_inverse().unwrap() * error)) / count;
            squares += error.component_mul(&error) / count;
            off_rad += error[2] / count;
            reported += covariance.diagonal() / count;
            for axis in 0..3 {
                each[axis] += error[axis].powi(2) / covariance[(axis, axis)] / count / AT.len() as f64;
            }
        }
        all += mean / AT.len() as f64;
        let [rms, sigma] = [squares, reported].map(|v| v.map(f64::sqrt));
        println!(
            "{:5.1} | {:6.2} {:5.2} {:6.3} | {:6.2} {:5.2} {:6.3} | {mean:5.2} | {:6.3}",
            moment.path_m,
            100.0 * rms[0],
            100.0 * rms[1],
            rms[2].to_degrees(),
            100.0 * sigma[0],
            100.0 * sigma[1],
            sigma[2].to_degrees(),
            off_rad.to_degrees()
        );
    }
    println!("mean NEES {all:.2}; x {:.2}, y {:.2}, heading {:.2}; {count} seeds", each[0], each[1], each[2]);
    (all, each)
}

fn corridor() -> Ride {
    let world = World::named("corridor").unwrap();
    let path = biplane_mock::world::path::Path { speed_m_s: 0.4, ..world.path(None).unwrap().clone() };
    Ride::new("furnished corridor, there and back", &world, &path, 2)
}

fn bare(length_m: f64) -> Ride {
    let world = bare_corridor(length_m);
    Ride::new("bare corridor, there and back", &world, world.path(None).unwrap(), 2)
}

fn office() -> Ride {
    let world = World::named("office").unwrap();
    Ride::new("office loop", &world, world.path(None).unwrap(), 1)
}

/// The same loop driven the other way round.
fn office_back() -> Ride {
    let world = World::named("office").unwrap();
    let mut path = world.path(None).unwrap().clone();
    path.waypoints_m.reverse();
    let mut ride = Ride::new("office loop, the other way round", &world, &path, 1);
    let begin = ride.moments[0].truth;
    ride.moments.iter_mut().for_each(|moment| moment.truth = begin.between(&moment.truth));
    ride
}

#[test]
fn along_a_bare_corridor_the_normalized_error_lies_within_its_chi_square_band() {
    let (all, _) = nees(&bare(if seeds(4).count() < 50 { 10.0 } else { 30.0 }));
    let [low, high] = band(seeds(4).count() as f64, 3.0);
    println!("band {low:.2} to {high:.2}");
    assert!((low..=high).contains(&all), "{all}");
}

#[test]
fn in_furnished_worlds_the_normalized_error_lies_within_its_chi_square_band() {
    let mut rides = vec![corridor()];
    if seeds(4).count() >= 50 {
        rides.extend([office(), office_back()]);
    }
    let means: Vec<f64> = rides.iter().map(|ride| nees(ride).0).collect();
    let mean = means.iter().sum::<f64>() / means.len() as f64;
    let [low, high] = band(seeds(4).count() as f64, 3.0);
    println!("mean of all worlds {mean:.2}, band {low:.2} to {high:.2}");
    assert!((low..=high).contains(&mean), "{means:?}");
}

#[test]
fn a_bare_corridors_axis_follows_the_odometry_and_its_covariance_points_along_it() {
    let ride = bare(10.0);
    let params = TrackerParams::default();
    let run = ride.run(params, &Odometry::poor(), InTheWay::default(), 3);
    let (mut by_odometry_m, mut across, mut worst_m) = (0.0, 0.0, 0.0_f64);
    for (place, pair) in run.windows(2).enumerate() {
        let (before, now) = (&pair[0].tracked.map_from_base, &pair[1].tracked.map_from_base);
        let step = pair[0].odom_from_base.between(&pair[1].odom_from_base);
        by_odometry_m += before.theta_rad.cos() * step.x_m - before.theta_rad.sin() * step.y_m;
        assert_eq!(pair[1].tracked.outcome, Outcome::Weak);
        worst_m = worst_m.max((now.x_m - by_odometry_m).abs());
        let truth = &ride.moments[place + 1].truth;
        across += (now.y_m - truth.y_m).powi(2) / (run.len() - 1) as f64;
        if ride.moments[place + 1].path_m > 2.0 {
            let plane = Matrix2::from_fn(|i, j| pair[1].tracked.covariance[i][j]).symmetric_eigen();
            let along = plane.eigenvectors.column(plane.eigenvalues.imax()).into_owned();
            // The corridor lies along x, but for the drive's first heading.
            let off_deg = (along[1] / along[0]).atan().abs().to_degrees();
            assert!(off_deg < 3.0, "{off_deg} degrees");
        }
    }
    println!("off the odometry by {worst_m:.4} m, across rms {:.4} m", across.sqrt());
    assert!(worst_m < 0.02 && across.sqrt() < 0.01, "{worst_m} m, {} m", across.sqrt());
}

#[test]
fn the_covariance_grows_on_new_ground_and_shrinks_on_coming_back() {
    let ride = corridor();
    let run = ride.run(TrackerParams::default(), &Odometry::poor(), InTheWay::default(), 1);
    let sigma_m = |step: &Step| (step.tracked.covariance[0][0] + step.tracked.covariance[1][1]).sqrt();
    let (start, far, back) =
        (sigma_m(&run[run.len() / 20]), sigma_m(&run[run.len() / 2]), sigma_m(run.last().unwrap()));
    println!("{start:.4} m at the start, {far:.4} m at the far end, {back:.4} m on coming back");
    assert!(far > 1.5 * start && back < 0.7 * far, "{start} {far} {back}");
}
