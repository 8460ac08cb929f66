//! Drives past a wall whose points are known: what is kept of later passes, and what they add.

use super::fuse::fuse;
use super::params::RevisitParams;
use super::split::{Drive, DrivePoint};
use crate::reconstruct::cloud::CloudParams;
use crate::reconstruct::mesh::MeshParams;
use crate::reconstruct::planes::extract;
use crate::reconstruct::planes::paper::random::Random;
use crate::reconstruct::planes::params::PlaneParams;
use crate::recordings::deskew::{StampedPose, Trajectory};
use crate::recordings::scan_geometry::{BeamGeometry, RangeScan, ScanGeometry};
use nalgebra::{Isometry3, Translation3, UnitQuaternion};
use std::convert::Infallible;
use std::f64::consts::FRAC_PI_2;

const NS: f64 = 1e9;
const WALL_Y_M: f64 = 1.5;

/// A laser 1 m up that looks to the left, up and down, 1 degree apart, all beams at once.
fn geometry() -> ScanGeometry {
    let beam = |k: u8| BeamGeometry { angle_rad: f64::from(k) * 1f64.to_radians() - 0.35, delay_ns: 0 };
    // The fan's x axis is the base's y axis, its y axis is up.
    let turned = UnitQuaternion::from_euler_angles(FRAC_PI_2, 0.0, FRAC_PI_2);
    let base_from_laser = Isometry3::from_parts(Translation3::new(0.0, 0.0, 1.0), turned);
    ScanGeometry { base_from_laser, beams: (0..41).map(beam).collect() }
}

/// Passes along x from 0 to `lengths_m`, each a minute after the one before, scans 4 cm apart.
fn passes(lengths_m: &[f64], sigma_m: f64) -> (Vec<RangeScan>, Trajectory) {
    let mut random = Random::new(7);
    let (mut range_scans, mut poses) = (Vec::new(), Vec::new());
    for (pass, length_m) in lengths_m.iter().enumerate() {
        for step in 0..=(length_m / 0.04).round() as usize {
            let stamp_ns = ((60.0 * pass as f64 + 0.1 * step as f64) * NS) as i64;
            // Each pass meets the wall in other places.
            let x_m = 0.04 * step as f64 + 0.013 * pass as f64;
            poses.push(StampedPose { stamp_ns, x_m, ..StampedPose::default() });
            let range =
                |beam: &BeamGeometry| (WALL_Y_M / beam.angle_rad.cos() + sigma_m * random.normal()) as f32;
            let ranges_m = geometry().beams.iter().map(range).collect();
            range_scans.push(RangeScan { stamp_ns, ranges_m });
        }
    }
    (range_scans, Trajectory::new(poses))
}

/// Whatever the share that shows nothing new.
fn always() -> RevisitParams {
    RevisitParams { min_share: 0.0, ..RevisitParams::default() }
}

fn with_drive<T>(lengths_m: &[f64], sigma_m: f64, work: impl FnOnce(&Drive<'_>) -> T) -> T {
    let (range_scans, trajectory) = passes(lengths_m, sigma_m);
    let (params, geometry) = (CloudParams::default(), geometry());
    work(&Drive { params: &params, geometry: &geometry, range_scans: &range_scans, trajectory: &trajectory })
}

/// All points with whether they are kept.
fn points(drive: &Drive<'_>) -> Vec<DrivePoint> {
    let split = drive.split(&always(), &MeshParams::default());
    let mut all = Vec::new();
    let visited: Result<(), Infallible> = drive.visit(&split.kept, |point| {
        all.push(point);
        Ok(())
    });
    let Ok(()) = visited;
    assert_eq!((all.len(), split.cloud.len()), (split.kept.points(), all.len() - split.kept.revisited()));
    for point in all.iter().filter(|point| point.first_view.is_some()) {
        let index = point.first_view.unwrap();
        assert_eq!(split.cloud.points_m[index], point.point_m);
        assert_eq!(split.cloud.beam[index], point.beam);
        assert_eq!(split.cloud.origin_of(index), Some(split.scans.origins_m[point.scan as usize]));
    }
    all
}

#[test]
fn a_single_pass_is_kept_whole() {
    with_drive(&[6.0], 0.015, |drive| assert!(points(drive).iter().all(|point| point.first_view.is_some())));
}

#[test]
fn what_is_kept_of_many_passes_does_not_grow_with_their_number() {
    let kept = |passes: usize| {
        with_drive(&vec![6.0; passes], 0.015, |drive| {
            points(drive).iter().filter(|point| point.first_view.is_some()).count()
        })
    };
    let (one, four, sixteen) = (kept(1), kept(4), kept(16));
    assert!(four < 3 * one && sixteen < four + one / 2, "{one} {four} {sixteen}");
}

#[test]
fn what_a_later_pass_sees_first_is_kept_up_to_the_border_of_what_was_covered() {
    with_drive(&[4.0, 4.0, 4.0, 6.0], 0.015, |drive| {
        let last = |point: &&DrivePoint| point.scan > 3 * 101;
        let all = points(drive);
        for point in all.iter().filter(last) {
            let (x_m, is_kept) = (point.point_m[0], point.first_view.is_some());
            // The third pass came to 4.026 m.
            assert!(is_kept || x_m < 4.03, "{x_m} was never seen before");
        }
        let covered = all.iter().filter(last).filter(|point| point.point_m[0] < 3.5);
        assert!(covered.clone().filter(|point| point.first_view.is_some()).count() * 10 < covered.count());
    });
}

#[test]
fn each_pass_makes_the_wall_more_exact() {
    let off_m = |passes: usize| {
        with_drive(&vec![3.0; passes], 0.02, |drive| {
            let split = drive.split(&always(), &MeshParams::default());
            let mut found = extract(&PlaneParams::default(), &split.cloud);
            let first_only = found.planes[0];
            let near = fuse(drive, &split.cloud, &split.kept, &mut found);
            let wall = found.planes[0];
            assert!(wall.points > split.kept.points() * 95 / 100, "{} points", wall.points);
            assert!(near.label(&found.planes, [1.0, WALL_Y_M as f32 - 0.02, 1.0]) == 0);
            // Along the wall, 3 m by 1.1 m.
            let off = |plane: &crate::model::Plane| {
                [[0.0, WALL_Y_M, 0.5], [3.0, WALL_Y_M, 1.5], [0.0, WALL_Y_M, 1.5], [3.0, WALL_Y_M, 0.5]]
                    .map(|p| plane.distance_m(p).powi(2))
                    .iter()
                    .sum::<f64>()
                    .sqrt()
            };
            (off(&first_only), off(&wall))
        })
    };
    let (of_first, of_all) = off_m(40);
    assert!(of_all < 0.7 * of_first && of_all < 0.001, "{of_first} {of_all}");
}

#[test]
fn scans_nearer_to_each_other_than_a_centimeter_are_fused_and_the_others_joined() {
    let (mut range_scans, trajectory) = passes(&[4.0], 0.015);
    // Each scan once more, a little later: some 2 mm further.
    let again: Vec<RangeScan> = range_scans
        .iter()
        .map(|scan| RangeScan { stamp_ns: scan.stamp_ns + 5_000_000, ranges_m: scan.ranges_m.clone() })
        .collect();
    range_scans.extend(again);
    range_scans.sort_by_key(|scan| scan.stamp_ns);
    let (params, geometry) = (CloudParams { still_distance_m: 0.0, ..CloudParams::default() }, geometry());
    let drive =
        Drive { params: &params, geometry: &geometry, range_scans: &range_scans, trajectory: &trajectory };
    let split = drive.split(&always(), &MeshParams::default());
    assert_eq!((split.scans.origins_m.len(), split.cloud.origins_m.len()), (202, 101));
    assert_eq!(split.kept.revisited() * 2, split.kept.points());
    let mesh = crate::reconstruct::mesh::join(&MeshParams::default(), &split.cloud);
    assert!(mesh.triangles.len() > 100 * 40 * 2 * 9 / 10, "{}", mesh.triangles.len());
}

#[test]
fn a_drive_of_which_little_is_seen_again_is_taken_whole() {
    for (lengths_m, is_whole) in [(&[4.0, 1.0][..], true), (&[4.0, 4.0, 4.0], false)] {
        with_drive(lengths_m, 0.0, |drive| {
            let split = drive.split(&RevisitParams::default(), &MeshParams::default());
            assert_eq!(split.kept.revisited() == 0, is_whole, "{lengths_m:?}");
        });
    }
}
