//! The watch in a room drawn by hand: a rectangle, seen by rays; the base drives and turns in it.

use biplane_matcher::Pose2;
use biplane_recording::messages::LaserScan;
use biplane_recording::rig::{Laser, Mount};
use biplane_recording::{Port, Rig};

use crate::engine::localize::interpolated_poses::MatchedPose;
use crate::engine::mount_check::MountWatch;
use crate::engine::mount_check::news::News;
use crate::engine::scan_data::ScanData;
use crate::types::mount_fault::{MountFault, MountHypothesis, Mounting, Sense};

/// The room reaches so far from the origin, meters; not the same to both sides, so that a mirror image is
/// another room.
const ROOM_M: [[f64; 2]; 2] = [[-4.0, 3.0], [-1.5, 2.5]];
const CEILING_M: f64 = 2.6;
const S: i64 = 1_000_000_000;

/// What a laser that sits like this on a base there sees of the room.
fn seen(mount: &Mount, map_from_base: &Pose2, stamp_ns: i64) -> ScanData {
    let matrix = mount.matrix();
    let origin = map_from_base.transform([mount.x, mount.y]);
    let (sin, cos) = map_from_base.theta_rad.sin_cos();
    let ranges_m = (0..181).map(|beam| {
        let (sin_beam, cos_beam) = (f64::from(beam) - 90.0).to_radians().sin_cos();
        let [x, y, z] = matrix.map(|row| row[0] * cos_beam + row[1] * sin_beam);
        let reach = |from_m: f64, along: f64, [low_m, high_m]: [f64; 2]| match along {
            along if along.abs() < 1e-9 => f64::INFINITY,
            along => (if along > 0.0 { high_m } else { low_m } - from_m) / along,
        };
        let to_wall = reach(origin[0], cos * x - sin * y, ROOM_M[0]).min(reach(
            origin[1],
            sin * x + cos * y,
            ROOM_M[1],
        ));
        to_wall.min(reach(mount.z, z, [0.0, CEILING_M])) as f32
    });
    let message = LaserScan {
        stamp_ns,
        angle_min_rad: -std::f32::consts::FRAC_PI_2,
        angle_increment_rad: 1_f32.to_radians(),
        range_min_m: 0.01,
        range_max_m: 80.0,
        ranges_m: ranges_m.collect(),
        ..LaserScan::default()
    };
    ScanData::of_message(&message, None)
}

/// Where the base is at a step: to and fro along the room, and round at both ends.
fn driven(step: i64) -> Pose2 {
    let phase = step.rem_euclid(40);
    let back = |phase: i64| 1.0 - 0.2 * phase as f64;
    match phase {
        0..10 => Pose2::new(-1.0 + 0.2 * phase as f64, 0.2, 0.0),
        10..20 => Pose2::new(1.0, 0.2, (phase - 10) as f64 * 0.1 * std::f64::consts::PI),
        20..30 => Pose2::new(back(phase - 20), 0.2, std::f64::consts::PI),
        _ => Pose2::new(-1.0, 0.2, (phase - 40) as f64 * 0.1 * std::f64::consts::PI),
    }
}

/// Drives a rig that is built like `built` and described like `told`; the odometry is `odom` of the truth.
fn drive(
    built: &Rig,
    configured: &Rig,
    odom: impl Fn(Pose2) -> Option<Pose2>,
    steps: i64,
) -> (MountWatch, Vec<News>) {
    let mut watch = MountWatch::new(configured);
    let mut news = Vec::new();
    for step in 0..steps {
        let (stamp_ns, map_from_base) = (step * S / 2, driven(step));
        let odom_from_base = odom(map_from_base);
        let level = seen(&built.horizontal.mount, &map_from_base, stamp_ns);
        watch.level_scan(
            &level,
            &MatchedPose { stamp_ns, map_from_base, odom_from_base, ..MatchedPose::default() },
        );
        if let Some(laser) = &built.vertical {
            watch.vertical_scan(&seen(&laser.mount, &map_from_base, stamp_ns));
            watch.vertical_posed(stamp_ns, &map_from_base, odom_from_base);
        }
        news.extend(watch.news());
    }
    (watch, news)
}

fn rig(change: impl Fn(&mut Mount, &mut Mount)) -> Rig {
    let mut rig = Rig { vertical: Some(Laser { ..Rig::default().horizontal }), ..Rig::default() };
    let vertical = rig.vertical.as_mut().unwrap();
    rig.horizontal.mount = Mount { x: 0.2, z: 0.3, ..Mount::default() };
    vertical.mount = Mount { x: 0.05, z: 0.45, pitch: -90.0, ..Mount::default() };
    change(&mut rig.horizontal.mount, &mut vertical.mount);
    rig
}

#[test]
fn a_rig_as_it_is_described_fits_and_nothing_is_said() {
    let right = rig(|_, _| {});
    let (watch, news) = drive(&right, &right, Some, 80);
    assert_eq!(news, []);
    assert_eq!([Port::Horizontal, Port::Vertical].map(|port| watch.mounting(port)), [Mounting::Fits; 2]);
    let nearly = rig(|level, vertical_laser| {
        level.yaw = 2.0;
        vertical_laser.roll = 3.0;
        vertical_laser.yaw = -3.0;
    });
    assert_eq!(drive(&nearly, &right, Some, 400).1, [], "small errors are for `biplane calibrate`");
}

#[test]
fn each_mistake_is_said_once_with_the_laser_that_it_is_about() {
    use MountFault::{LiesLevel, Moves, Sits, Swapped};
    type Change = fn(&mut Mount, &mut Mount);
    let mistakes: [(Change, Port, MountFault); 8] = [
        (|level, vertical_laser| std::mem::swap(level, vertical_laser), Port::Horizontal, Swapped),
        (|level, _| level.roll = 180.0, Port::Horizontal, Moves(Sense::TurnsReversed)),
        (|level, _| level.yaw = 180.0, Port::Horizontal, Moves(Sense::Backwards)),
        (|level, _| level.yaw = 90.0, Port::Horizontal, Moves(Sense::Leftwards)),
        (|level, _| level.yaw = -90.0, Port::Horizontal, Moves(Sense::Rightwards)),
        (|_, vertical_laser| vertical_laser.yaw = 180.0, Port::Vertical, Sits(MountHypothesis::Mirrored)),
        (|_, vertical_laser| vertical_laser.pitch = 90.0, Port::Vertical, Sits(MountHypothesis::Down)),
        (|_, vertical_laser| vertical_laser.pitch = 0.0, Port::Vertical, LiesLevel),
    ];
    for (change, port, mount_fault) in mistakes {
        let (watch, news) = drive(&rig(change), &rig(|_, _| {}), Some, 120);
        assert_eq!(news.last(), Some(&News { port, mount_fault, begins: true }), "{mount_fault}: {news:?}");
        assert!(news.iter().all(|news| news.port == port && news.begins), "{news:?}");
        assert_eq!(watch.mounting(port), Mounting::Suspect(mount_fault));
    }
}

#[test]
fn odometry_that_runs_or_turns_the_other_way_is_said() {
    let right = rig(|_, _| {});
    for (odom, sense) in [
        ((|p: Pose2| Pose2::new(p.x_m, -p.y_m, -p.theta_rad)) as fn(Pose2) -> Pose2, Sense::TurnsReversed),
        (|p| Pose2::new(-p.x_m, -p.y_m, p.theta_rad), Sense::Backwards),
        (|p| Pose2::new(-p.x_m, p.y_m, -p.theta_rad), Sense::BothReversed),
    ] {
        let (_, news) = drive(&right, &right, |pose| Some(odom(pose)), 80);
        let [only] = news[..] else { panic!("{sense:?}: {news:?}") };
        assert_eq!((only.port, only.mount_fault), (Port::Horizontal, MountFault::Moves(sense)));
    }
}

#[test]
fn without_odometry_or_while_the_base_stands_nothing_is_known() {
    let right = rig(|_, _| {});
    let swapped = rig(std::mem::swap);
    for odom in [(|_| None) as fn(Pose2) -> Option<Pose2>, |_| Some(Pose2::IDENTITY)] {
        let (watch, news) = drive(&swapped, &right, odom, 200);
        assert_eq!((news, watch.mounting(Port::Horizontal)), (Vec::new(), Mounting::Unknown));
    }
}

#[test]
fn wheels_that_spin_for_a_while_are_said_and_that_it_is_over_is_said_too() {
    let right = rig(|_, _| {});
    let mut watch = MountWatch::new(&right);
    let mut news = Vec::new();
    for step in 0..400_i64 {
        // The base is held for a minute in the midst; its wheels go on.
        let at = if step < 100 { step } else { (step - 120).max(100) };
        let (stamp_ns, map_from_base) = (step * S / 2, driven(at));
        let level = seen(&right.horizontal.mount, &map_from_base, stamp_ns);
        let odom_from_base = Some(driven(step));
        watch.level_scan(
            &level,
            &MatchedPose { stamp_ns, map_from_base, odom_from_base, ..MatchedPose::default() },
        );
        news.extend(watch.news());
    }
    let reported: Vec<_> = news.iter().map(|news| (news.mount_fault, news.begins)).collect();
    assert_eq!(reported, [(MountFault::DoesNotMove, true), (MountFault::DoesNotMove, false)]);
}
