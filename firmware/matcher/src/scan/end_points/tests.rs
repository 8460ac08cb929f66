//! Normals and weights of made-up scans.

use super::*;
use crate::scan::Beam;

/// The end points of a beam a degree, so many to each side.
pub(crate) fn seen(degrees: i32, mut range_m: impl FnMut(i32) -> f64) -> EndPoints {
    let beams: Vec<Beam> = (-degrees..=degrees)
        .map(|degree| {
            let angle = f64::from(degree).to_radians();
            let direction_in_base = [angle.cos() as f32, angle.sin() as f32];
            Beam { direction_in_base, range_m: range_m(degree) as f32, delay_s: 0.0 }
        })
        .collect();
    let mut points = EndPoints::new(PointParams::default());
    points.fill(&Scan { stamp_ns: 0, laser_in_base_m: [0.0; 2], beams: &beams, twist_in_base: [0.0; 3] });
    points
}

fn points(mut ranges_m: impl FnMut(f64) -> f64) -> EndPoints {
    seen(90, |degree| ranges_m(f64::from(degree).to_radians()))
}

/// The end point of the beam at this angle, all beams having returned.
fn at(points: &EndPoints, degrees: usize) -> EndPoint {
    points.as_slice()[degrees + 90]
}

#[test]
fn a_wall_ahead_has_normals_back_to_the_laser() {
    let points = points(|angle| if angle.abs() < 1.2 { 2.0 / angle.cos() } else { f64::INFINITY });
    for point in points.as_slice().iter().skip(1).rev().skip(1) {
        assert_eq!(point.kind, Kind::Line, "{point:?}");
        assert!((point.normal[0] + 1.0).abs() < 1e-3 && point.normal[1].abs() < 1e-3, "{point:?}");
    }
}

#[test]
fn next_to_an_edge_the_normal_comes_from_the_nearer_side_alone() {
    // A wall 2 m ahead to the left of the middle, another at 3 m to the right of it.
    let points = points(|angle| if angle >= 0.0 { 2.0 } else { 3.0 } / angle.cos().max(0.1));
    let edge = at(&points, 0);
    assert_eq!(edge.kind, Kind::Line);
    assert!((edge.normal[0] + 1.0).abs() < 1e-3, "{edge:?}");
}

#[test]
fn a_mirrored_scan_has_mirrored_normals() {
    // Noise of 3 cm, so that many end points form a line with the neighbors on one side only.
    let noise_m = |degree: i32| 0.03 * (((degree + 90) * 7919 % 1009) as f64 / 504.5 - 1.0);
    let wall_m = |degree: i32| 1.5 / f64::from(degree.abs().max(10)).to_radians().sin().min(0.95);
    let as_seen = seen(90, |degree| wall_m(degree) + noise_m(degree));
    let mirrored = seen(90, |degree| wall_m(degree) + noise_m(-degree));
    for (a, b) in as_seen.as_slice().iter().zip(mirrored.as_slice().iter().rev()) {
        assert_eq!(a.kind, b.kind, "{a:?} {b:?}");
        let apart = distance(a.normal, [b.normal[0], -b.normal[1]]);
        assert!(apart < 1e-3, "{a:?} {b:?}");
    }
}

#[test]
fn a_leg_before_a_wall_is_a_point_and_a_lone_return_is_unsure() {
    let leg = points(|angle| if angle == 0.0 { 1.0 } else { 3.0 / angle.cos().max(0.1) });
    assert_eq!((at(&leg, 0).kind, at(&leg, 0).normal), (Kind::Point, [0.0; 2]));
    let lone = points(|angle| if angle == 0.0 { 1.0 } else { f64::INFINITY });
    assert_eq!(lone.as_slice().len(), 1);
    assert_eq!(lone.as_slice()[0].kind, Kind::Unsure);
}

#[test]
fn a_wall_keeps_its_normals_when_every_fourth_beam_falls_short() {
    let mut beam = 0;
    let points = points(|angle| {
        beam += 1;
        let wall_m = if angle.abs() < 1.0 { 2.0 / angle.cos() } else { f64::INFINITY };
        if beam % 4 == 0 { wall_m * (0.2 + f64::from(beam * 37 % 60) / 100.0) } else { wall_m }
    });
    let (short, wall): (Vec<&EndPoint>, Vec<&EndPoint>) =
        points.as_slice().iter().partition(|point| point.at_m[0] < 1.7);
    assert!(short.len() > 20 && wall.len() > 80, "{} {}", short.len(), wall.len());
    assert!(short.iter().all(|point| point.kind != Kind::Line));
    let facing = |point: &&&EndPoint| point.normal[0] < -0.999;
    assert_eq!(wall.iter().filter(facing).count(), wall.len());
}

#[test]
fn beams_closer_together_than_the_spacing_share_its_weight() {
    // On a circle of 0.5 m the beams end 8.7 mm apart, on one of 5 m 87 mm.
    let (near, far) = (points(|_| 0.5), points(|_| 5.0));
    assert!((at(&near, 0).weight - 0.0087 / 0.02).abs() < 0.01, "{:?}", at(&near, 0));
    assert_eq!(at(&far, 0).weight, 1.0);
}

#[test]
fn invalid_absent_too_near_and_too_far_beams_give_no_points() {
    for range_m in [f64::NAN, f64::INFINITY, f64::NEG_INFINITY, -1.0, 0.0, 0.05, 41.0] {
        assert!(points(|_| range_m).as_slice().is_empty(), "{range_m}");
    }
}

#[test]
fn a_scan_with_too_many_beams_is_thinned_evenly() {
    let beam = Beam { direction_in_base: [1.0, 0.0], range_m: 1.0, delay_s: 0.0 };
    let beams = vec![beam; 1000];
    let mut points = EndPoints::new(PointParams { max_beams: 300, ..PointParams::default() });
    points.fill(&Scan { stamp_ns: 0, laser_in_base_m: [0.0; 2], beams: &beams, twist_in_base: [0.0; 3] });
    assert_eq!(points.as_slice().len(), 250);
}
