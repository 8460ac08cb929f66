//! Borders of made-up rings.

use super::border::{CORNER_REACH, Rules, segment_distance, straighten};
use super::line::Line;
use super::tolerance::{Spacing, Tolerance};
use crate::reconstruct::planes::paper::random::Random;
use crate::reconstruct::polygons::plane_frame::FlatPoint;

const ACROSS: [[f64; 2]; 2] = [[1.0, 0.0], [0.0, 1.0]];

fn around(tolerance: f64) -> Tolerance {
    Tolerance { around: tolerance, ..Tolerance::default() }
}

fn free(ring: &[FlatPoint], tolerance: f64) -> Vec<FlatPoint> {
    straighten(ring, &Rules { tolerance: &|_| around(tolerance), seams: &[], directions: &[] })
}

/// A square of 10,000 steps whose border wanders by up to `wander` steps.
fn ragged(wander: f64) -> Vec<FlatPoint> {
    let mut random = Random::new(5);
    let corners = [(0, 0), (10_000, 0), (10_000, 10_000), (0, 10_000)];
    let mut ring = Vec::new();
    for (from, to) in corners.iter().zip(corners.iter().cycle().skip(1)) {
        ring.push(FlatPoint::new(from.0, from.1));
        for k in 1..20 {
            let at = |a: i32, b: i32| a + (b - a) / 20 * k + (wander * (2.0 * random.unit() - 1.0)) as i32;
            let mut at = at;
            ring.push(FlatPoint::new(at(from.0, to.0), at(from.1, to.1)));
        }
    }
    ring
}

#[test]
fn a_ragged_square_becomes_its_four_corners() {
    let straight = free(&ragged(200.0), 300.0);
    assert_eq!(straight.len(), 4, "{straight:?}");
    // Lines through the middle are far nearer to the truth than the teeth are long; with the plane's
    // directions the more.
    let off = |ring: &[FlatPoint]| {
        ring.iter().map(|p| p.x.min(10_000 - p.x).abs().max(p.y.min(10_000 - p.y).abs())).max()
    };
    assert!(off(&straight) < Some(150), "{straight:?}");
    let rules = Rules { tolerance: &|_| around(300.0), seams: &[], directions: &ACROSS };
    let turned = straighten(&ragged(200.0), &rules);
    assert_eq!(turned.len(), 4);
    assert!(turned.iter().zip(turned.iter().cycle().skip(1)).all(|(a, b)| a.x == b.x || a.y == b.y));
}

#[test]
fn no_old_corner_is_further_from_the_new_border_than_said() {
    let ring = ragged(300.0);
    let straight = free(&ring, 200.0);
    assert!(straight.len() < ring.len());
    for p in ring {
        let near = straight.iter().zip(straight.iter().cycle().skip(1));
        let nearest = near.map(|(a, b)| segment_distance(*a, *b, p)).fold(f64::INFINITY, f64::min);
        assert!(nearest <= CORNER_REACH * 200.0, "{nearest}");
    }
}

#[test]
fn a_border_on_a_seam_stays_exactly_there_and_teeth_beside_it_join_it() {
    // The lower side lies on the seam but for one tooth; the line of least squares would be higher.
    let ring = [(0, 0), (4000, 0), (4200, 180), (4400, 0), (10_000, 0), (10_000, 9000), (0, 9000)];
    let ring = ring.map(|(x, y)| FlatPoint::new(x, y));
    let seam = Line { at: [0.0, 0.0], direction: [1.0, 0.0] };
    let straight =
        straighten(&ring, &Rules { tolerance: &|_| around(300.0), seams: &[seam], directions: &[] });
    assert_eq!(straight.len(), 4, "{straight:?}");
    assert_eq!(straight.iter().filter(|p| p.y == 0).count(), 2, "{straight:?}");
    assert!(free(&ring, 300.0).iter().all(|p| p.y != 0), "without the seam the tooth pulls at the line");
}

#[test]
fn a_frame_twice_as_wide_as_the_tolerance_stays_and_what_is_thinner_vanishes() {
    let strip =
        |width: i32| [(0, 0), (10_000, 0), (10_000, width), (0, width)].map(|(x, y)| FlatPoint::new(x, y));
    assert_eq!(free(&strip(700), 300.0).len(), 4);
    let sliver = [(0, 0), (5000, 20), (10_000, 0), (5000, -20)].map(|(x, y)| FlatPoint::new(x, y));
    assert!(free(&sliver, 300.0).is_empty());
    assert!(free(&[], 300.0).is_empty());
}

/// A facade with teeth of 1500 steps along its upper edge, and a notch as deep as that in its left side.
fn combed() -> Vec<FlatPoint> {
    let mut ring: Vec<FlatPoint> =
        [(0, 0), (30_000, 0), (30_000, 20_000)].map(|(x, y)| FlatPoint::new(x, y)).into();
    ring.extend((1..30).map(|k| FlatPoint::new(30_000 - 1000 * k, if k % 2 == 0 { 20_000 } else { 18_500 })));
    ring.extend(
        [(0, 20_000), (0, 12_000), (1500, 12_000), (1500, 6000), (0, 6000)]
            .map(|(x, y)| FlatPoint::new(x, y)),
    );
    ring
}

#[test]
fn teeth_across_rows_of_points_go_and_a_notch_as_deep_along_them_stays() {
    let mut spacing = Spacing::default();
    spacing.note([100.0, 1500.0]);
    let rows = Tolerance { around: 300.0, spacing };
    let rules = Rules { tolerance: &|_| rows, seams: &[], directions: &ACROSS };
    let straight = straighten(&combed(), &rules);
    assert_eq!(straight.len(), 8, "{straight:?}");
    assert_eq!(straight.iter().filter(|p| p.x == 1500).count(), 2, "the notch is there: {straight:?}");
    assert!(free(&combed(), 300.0).len() > 30, "without rows the teeth are a border");
}

#[test]
fn a_border_that_reaches_a_seam_with_a_few_tips_does_not_follow_it() {
    // Two of twenty teeth of the upper edge reach the line where another plane would be met.
    let mut ring: Vec<FlatPoint> =
        [(0, 0), (20_000, 0), (20_000, 10_000)].map(|(x, y)| FlatPoint::new(x, y)).into();
    for k in (1..20).rev() {
        let tip = if k == 5 || k == 12 { 11_000 } else { 10_000 };
        ring.extend([FlatPoint::new(1000 * k + 300, tip), FlatPoint::new(1000 * k, tip)]);
    }
    ring.push(FlatPoint::new(0, 10_000));
    let mut spacing = Spacing::default();
    spacing.note([100.0, 1500.0]);
    let rows = Tolerance { around: 300.0, spacing };
    let seam = Line { at: [0.0, 11_000.0], direction: [1.0, 0.0] };
    let straight = straighten(&ring, &Rules { tolerance: &|_| rows, seams: &[seam], directions: &ACROSS });
    assert!(straight.iter().all(|p| p.y < 10_500), "{straight:?}");
}
