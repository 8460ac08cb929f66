//! The fast search against the plain one, and against what was built.

use super::extract;
use super::extract_with_progress;
use crate::model::Cloud;
use crate::reconstruct::fixture::{corridor, drive};
use crate::reconstruct::planes::labeled::Planes;
use crate::reconstruct::planes::paper::params::ReferenceParams;
use crate::reconstruct::planes::paper::random::Random;
use crate::reconstruct::planes::paper::reference;
use crate::reconstruct::planes::params::PlaneParams;

/// The share of points that two labelings put together in the same way: each label of one goes with its most
/// frequent partner.
fn agreement(ours: &[i32], theirs: &[i32]) -> f64 {
    let mut together = std::collections::BTreeMap::<(i32, i32), usize>::new();
    for pair in ours.iter().zip(theirs) {
        *together.entry((*pair.0, *pair.1)).or_default() += 1;
    }
    let labels: std::collections::BTreeSet<i32> = ours.iter().copied().collect();
    let best = |label: &i32| together.iter().filter(|e| e.0.0 == *label).map(|e| *e.1).max().unwrap_or(0);
    labels.iter().map(best).sum::<usize>() as f64 / ours.len() as f64
}

/// Every second beam of the first scans of a dense drive: dense as the paper's, small enough for the plain
/// search.
fn small_cloud(seed: u64) -> Cloud {
    let mut cloud = drive(&corridor(), 200, 0.012, seed);
    let keep: Vec<usize> =
        (0..cloud.len()).filter(|k| cloud.scan[*k] < 20 && cloud.beam[*k].is_multiple_of(2)).collect();
    cloud.points_m = keep.iter().map(|k| cloud.points_m[*k]).collect();
    (cloud.scan, cloud.beam) = keep.iter().map(|k| (cloud.scan[*k], cloud.beam[*k])).unzip();
    cloud
}

#[test]
fn the_fast_search_agrees_with_the_paper_s() {
    for seed in [1, 2] {
        let cloud = small_cloud(seed);
        let points: Vec<[f64; 3]> = cloud.points_m.iter().map(|p| p.map(f64::from)).collect();
        let params = ReferenceParams { starts: 3, ..ReferenceParams::default() };
        let (theirs, planes) = reference::extract(&params, &points, seed);
        let ours = extract(&PlaneParams::default(), &cloud);
        assert_eq!((ours.planes.len(), planes.len()), (3, 3), "two walls and the ceiling");
        let both = agreement(&ours.labels, &theirs).min(agreement(&theirs, &ours.labels));
        assert!(both > 0.95, "{both}");
    }
}

#[test]
fn normals_point_towards_the_laser_and_planes_come_largest_first() {
    let cloud = drive(&corridor(), 100, 0.02, 3);
    let Planes { planes, labels, .. } = extract(&PlaneParams::default(), &cloud);
    assert!(planes.windows(2).all(|pair| pair[0].points >= pair[1].points));
    for (index, plane) in planes.iter().enumerate() {
        assert!(plane.distance_m([3.0, 0.0, 0.5]) > 0.0, "{plane:?}");
        assert_eq!(plane.points, labels.iter().filter(|label| **label == index as i32).count());
    }
}

#[test]
fn a_notice_board_four_centimeters_off_the_wall_is_a_plane_of_its_own() {
    let mut scene = corridor();
    let mut board = corridor().swap_remove(3);
    board.corner_m = [3.0, -0.96, 0.9];
    board.sides_m = [[1.5, 0.0, 0.0], [0.0, 0.0, 1.0]];
    scene.push(board);
    let cloud = drive(&scene, 240, 0.02, 4);
    let found = extract(&PlaneParams::default(), &cloud);
    let on = |y_m: f64| {
        found
            .planes
            .iter()
            .filter(|p| (p.distance_m([3.75, y_m, 1.4])).abs() < 0.01 && p.normal[1] > 0.99)
            .count()
    };
    assert_eq!((on(-0.96), on(-1.0)), (1, 1), "{:?}", found.planes);
}

#[test]
fn a_flat_grid_that_lies_on_a_border_between_cells_is_one_plane() {
    let mut random = Random::new(12);
    let mut cloud = Cloud::default();
    for k in 0..90_000 {
        let (x, y) = (0.2 * (k % 300) as f32, 0.2 * (k / 300) as f32);
        cloud.points_m.push([x, y, (0.01 * random.normal()) as f32]);
    }
    let found = extract(&PlaneParams::default(), &cloud);
    assert_eq!(found.planes.len(), 1, "{:?}", found.planes);
    assert!(found.planes[0].points > 89_500);
}

#[test]
fn every_parameter_does_something() {
    let cloud = drive(&corridor(), 100, 0.02, 5);
    let base = extract(&PlaneParams::default(), &cloud);
    let far = {
        // Points a meter apart along the corridor: only a larger delta links them.
        let mut far = cloud.clone();
        for p in &mut far.points_m {
            p[0] *= 8.0;
        }
        far
    };
    let with = |params: PlaneParams, cloud: &Cloud| extract(&params, cloud);
    assert_ne!(with(PlaneParams { sigma_m: Some(0.1), ..Default::default() }, &cloud), base);
    assert_ne!(with(PlaneParams { min_points: 3000, ..Default::default() }, &cloud), base);
    assert_ne!(with(PlaneParams { cell_m: Some(0.2), ..Default::default() }, &cloud), base);
    let linked = with(PlaneParams { delta_m: 0.6, ..Default::default() }, &far);
    assert!(linked.planes.len() != with(PlaneParams::default(), &far).planes.len());
}

#[test]
fn a_door_frame_three_centimeters_off_the_wall_is_told_from_it() {
    // Wherever it lies among the cells.
    for from_m in [3.0, 3.02, 3.05, 3.07] {
        door_frame(from_m);
    }
}

fn door_frame(from_m: f32) {
    let mut scene = corridor();
    let mut frame = corridor().swap_remove(3);
    frame.corner_m = [from_m.into(), -0.97, 0.0];
    frame.sides_m = [[0.1, 0.0, 0.0], [0.0, 0.0, 2.1]];
    scene.push(frame);
    let cloud = drive(&scene, 240, 0.02, 7);
    let found = extract(&PlaneParams::default(), &cloud);
    let of = |from: f32, to: f32| -> Vec<i32> {
        let there = |p: &[f32; 3]| p[1] < -0.85 && p[2] < 2.0 && (from..to).contains(&p[0]);
        (0..cloud.len()).filter(|k| there(&cloud.points_m[*k])).map(|k| found.labels[k]).collect()
    };
    let maximum = |labels: Vec<i32>| {
        let count = |label: i32| labels.iter().filter(|l| **l == label).count();
        let best = labels.iter().copied().max_by_key(|label| count(*label)).unwrap();
        (best, count(best) as f64 / labels.len() as f64)
    };
    let (wall, of_wall) = maximum(of(1.0, 2.9));
    let (board, of_board) = maximum(of(from_m + 0.005, from_m + 0.095));
    assert!(wall >= 0 && board >= 0 && wall != board);
    assert!(of_wall > 0.97 && of_board > 0.7, "{of_wall} {of_board}");
}

#[test]
fn cells_follow_the_density_of_the_cloud() {
    let dense = drive(&corridor(), 240, 0.02, 8);
    let thin = |every: usize| {
        let mut cloud = dense.clone();
        let keep: Vec<usize> = (0..dense.len()).step_by(every).collect();
        cloud.points_m = keep.iter().map(|k| dense.points_m[*k]).collect();
        (cloud.scan, cloud.beam) = keep.iter().map(|k| (dense.scan[*k], dense.beam[*k])).unzip();
        cloud
    };
    let size =
        |cloud: &Cloud| crate::reconstruct::planes::search::cells::grid(&PlaneParams::default(), cloud).1;
    assert!(size(&thin(1)) < size(&thin(5)) && size(&thin(5)) < size(&thin(25)));
    assert_eq!(
        crate::reconstruct::planes::search::cells::grid(
            &PlaneParams { cell_m: Some(0.07), ..Default::default() },
            &dense
        )
        .1,
        0.07
    );
    assert!(size(&Cloud::default()) > 0.0);
}

#[test]
fn any_number_of_threads_finds_the_same() {
    let cloud = drive(&corridor(), 240, 0.02, 9);
    let on = |threads: usize| {
        let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap();
        pool.install(|| extract(&PlaneParams::default(), &cloud))
    };
    let one = on(1);
    assert!(one.planes.len() > 3);
    let mut received = Vec::new();
    assert_eq!(
        extract_with_progress(&PlaneParams::default(), &cloud, &mut |percent| received.push(percent)),
        one
    );
    assert!(received.is_sorted() && received.len() > 5 && received.last() == Some(&100), "{received:?}");
    for threads in [2, 3, 7] {
        assert_eq!(on(threads), one, "{threads} threads");
    }
}
