//! A room with a wall that goes on behind it, to drive along; what steps are there.

use biplane_matcher::{EndPoint, Kind, Pose2};

use super::{ChainParams, edges};
use crate::slam::keyframes::Node;
use crate::slam::keyframes::keyframe_scan::KeyframeScan;
use crate::slam::pose_graph::breaks;

/// Nodes in a room, and how many of the way along a wall follow.
pub(super) const IN_ROOM: usize = 60;
pub(super) const ALONG_WALL: usize = 15;
/// True and counted way from node to node, meters.
pub(super) const STEP_M: f64 = 0.3;
pub(super) const COUNTED_M: f64 = 0.309;
/// How long a step takes, nanoseconds.
pub(super) const STEP_NS: i64 = 400_000_000;
/// And how many scans.
pub(super) const STEP_SCANS: usize = 10;

/// An end point.
pub(super) fn point(at: [f64; 2], normal: [f64; 2], kind: Kind) -> EndPoint {
    let [at_m, normal] = [at, normal].map(|of| of.map(|value| value as f32));
    EndPoint { at_m, normal, kind, weight: 1.0, ..EndPoint::default() }
}

/// What is seen of the walls from a place: of a room 8 m by 6 m, or of its lower wall alone, which has no
/// end. With edges, the wall has a narrow one each meter.
fn seen(x_m: f64, phase_m: f64, in_room: bool, with_edges: bool) -> KeyframeScan {
    let wall = |at: [f64; 2], normal| point([at[0] - x_m, at[1]], normal, Kind::Line);
    let mut points = Vec::new();
    for step in 0..60 {
        let along = f64::from(step) * 0.1 + phase_m - 3.0;
        let left_m = if in_room { 0.0 } else { x_m };
        points.push(wall([along + left_m, -3.0], [0.0, 1.0]));
        if in_room {
            points.push(wall([along, 3.0], [0.0, -1.0]));
            points.push(wall([4.0, along], [-1.0, 0.0]));
            points.push(wall([-4.0, along], [1.0, 0.0]));
        }
    }
    let edge = |at: i32| wall([x_m.floor() + f64::from(at), -2.95 + phase_m], [-1.0, 0.0]);
    points.extend((-2..4).filter(|_| with_edges).map(edge));
    KeyframeScan { points, laser_m: [0.0; 2] }
}

/// To and fro in the room, then along the wall. Wheels count 3 % too much, and recorded poses are right
/// in the room and follow the wheels along the wall.
pub(super) fn drive() -> Vec<Node> {
    drive_along(COUNTED_M, COUNTED_M, false)
}

/// The same, with what wheels count for a step and what is recorded along the wall.
pub(super) fn drive_along(step_counted_m: f64, step_recorded_m: f64, with_edges: bool) -> Vec<Node> {
    let (mut x_m, mut recorded_m, mut counted_m) = (-3.0, -3.0, 0.0);
    let node = |at: usize| {
        let ahead = if at < IN_ROOM && at / 20 % 2 == 1 { -1.0 } else { 1.0 };
        let in_room = at < IN_ROOM;
        let keyframe_scan = seen(x_m, 0.013 * (at % 7) as f64, in_room, with_edges && !in_room);
        let odometry = Some(Pose2::new(counted_m, 0.0, 0.0));
        let stamp_ns = STEP_NS * at as i64;
        let scan = STEP_SCANS * at;
        let node =
            Node { scan, odometry, stamp_ns, ..Node::at(Pose2::new(recorded_m, 0.0, 0.0), keyframe_scan) };
        x_m += ahead * STEP_M;
        counted_m += ahead * step_counted_m;
        recorded_m += ahead * if at + 1 < IN_ROOM { STEP_M } else { step_recorded_m };
        node
    };
    (0..IN_ROOM + ALONG_WALL).map(node).collect()
}

#[test]
fn where_a_scan_seems_to_know_the_way_known_wheels_are_weighed_against_it_if_they_are_clearly_off() {
    // Steps are recorded 1 % too long. How much too long they are then, in the mean.
    for (counted, expected) in [(1.06, -0.002..0.002), (1.015, 0.009..0.011)] {
        let nodes = drive_along(counted * STEP_M, 1.01 * STEP_M, true);
        let (edges, _) = edges(&nodes, 0, &ChainParams::default());
        let along = &edges[IN_ROOM + 3..];
        let length_m: f64 = along.iter().map(|edge| edge.measured.x_m).sum();
        let longer = length_m / (along.len() as f64 * STEP_M) - 1.0;
        assert!(expected.contains(&longer), "{counted}: {longer}");
    }
}

#[test]
fn along_a_wall_the_way_is_the_odometry_s_at_the_scale_that_the_room_has_taught() {
    let (edges, wheels) = edges(&drive(), 0, &ChainParams::default());
    let [scale, sigma] = wheels.unwrap().scale().way_scale;
    assert!((scale - STEP_M / COUNTED_M).abs() < 0.002 && sigma < 0.01, "{scale} {sigma}");
    for edge in &edges[IN_ROOM + 1..] {
        assert!((edge.measured.x_m - STEP_M).abs() < 2e-3, "{edge:?}");
        assert!(edge.measured.y_m.abs() < 2e-3 && edge.measured.theta_rad.abs() < 1e-3, "{edge:?}");
    }
}

#[test]
fn along_a_wall_wheels_tell_the_way_and_nothing_of_the_heading() {
    let at = IN_ROOM + 5;
    let mut nodes = drive();
    // A wheel slips: from there on the odometry is turned by 0.1 radians.
    let slipped = nodes[at].odometry.unwrap();
    let turned = Pose2 { theta_rad: 0.1, ..slipped };
    for node in &mut nodes[at..] {
        node.odometry = node.odometry.map(|pose| turned * slipped.between(&pose));
    }
    let (edges, _) = edges(&nodes, 0, &ChainParams::default());
    let step = edges[at - 1].measured;
    assert!((step.x_m - STEP_M).abs() < 2e-3 && step.theta_rad.abs() < 1e-3, "{step:?}");
}

#[test]
fn a_scan_that_lies_nowhere_breaks_the_way_once_and_the_next_ones_go_on() {
    let at = IN_ROOM - 10;
    let mut nodes = drive();
    // It is put down turned by a right angle: it sees all turned, and drives to its left.
    let [down_m, counted_m] = [nodes[at].recorded.x_m, nodes[at].odometry.unwrap().x_m];
    for node in &mut nodes[at..] {
        for point in &mut node.keyframe_scan.points {
            let [x, y] = point.at_m;
            (point.at_m, point.normal) = ([1.3 - y, x], [-point.normal[1], point.normal[0]]);
        }
        node.recorded = Pose2::new(down_m, node.recorded.x_m - down_m, 0.0);
        node.odometry = node.odometry.map(|pose| Pose2::new(counted_m, pose.x_m - counted_m, 0.0));
    }
    let broken = |nodes: &[Node]| -> Vec<usize> {
        let (edges, _) = edges(nodes, 0, &ChainParams::default());
        edges.iter().filter(|edge| breaks::is_broken(edge)).map(|edge| edge.to).collect()
    };
    assert_eq!((broken(&nodes), broken(&drive())), (vec![at], vec![]));
}
