//! Room between corners and borders: what comes closer than a clearance is made to touch.
//!
//! Exact rings may run a hair apart. Written with rounded coordinates, as every file format does, they would
//! cross. So corners that nearly meet become one, an edge that nearly passes through a corner is led through
//! it, and the union cleans up what collapses. Plane coordinates in whole steps
//! ([`crate::reconstruct::polygons::plane_frame`]). Source: snap rounding (Hobby 1999), with the clearance
//! for a pixel.

use crate::reconstruct::polygons::outline::border::{distance2, segment_distance};
use crate::reconstruct::polygons::outline::union::{Ring, Shape, repair};
use crate::reconstruct::polygons::plane_frame::FlatPoint;

/// Least distance between a corner and an edge that does not end in it, steps: half a millimeter, several
/// times what rounding moves.
pub(crate) const CLEARANCE_STEPS: f64 = 5.0;
/// Corners nearer than this become one, steps. Twice the clearance: an edge led through a corner then keeps
/// clear of its own old end.
const MEETING_STEPS: f64 = 2.0 * CLEARANCE_STEPS;
/// Rounds at most. Each one moves corners by less than a millimeter; in practice two are enough.
const ROUNDS: usize = 16;

/// Shapes with room between their corners and edges, valid again where they were made to touch.
pub(crate) fn clear(mut shapes: Vec<Shape>) -> Vec<Shape> {
    for _ in 0..ROUNDS {
        let mut changed = false;
        shapes = shapes
            .into_iter()
            .flat_map(|shape| match touching(&shape) {
                Some(shape) => {
                    changed = true;
                    repair(&[shape])
                }
                None => vec![shape],
            })
            .collect();
        if !changed {
            break;
        }
    }
    shapes
}

/// Whether a shape has that room everywhere, and no ring comes to a corner twice; corners may be as close to
/// each other as half of what [`clear`] leaves between them.
pub(crate) fn has_room(shape: &Shape) -> bool {
    let corners: Vec<FlatPoint> = shape.iter().flatten().copied().collect();
    let near = |a: &FlatPoint, b: &FlatPoint| a != b && (distance2(*a, *b) as f64) < CLEARANCE_STEPS.powi(2);
    let apart = |ring: &Ring| ring.iter().zip(ring.iter().cycle().skip(1)).all(|(a, b)| !near(a, b));
    let once = |ring: &Ring| {
        let mut sorted: Vec<(i32, i32)> = ring.iter().map(|p| (p.x, p.y)).collect();
        sorted.sort_unstable();
        sorted.windows(2).all(|pair| pair[0] != pair[1])
    };
    shape.iter().all(|ring| apart(ring) && once(ring) && lead_through(ring, &corners).len() == ring.len())
}

/// The shape with what nearly touches touching; `None` when nothing does.
fn touching(shape: &Shape) -> Option<Shape> {
    let (met, moved) = meet(shape);
    let corners: Vec<FlatPoint> = met.iter().flatten().copied().collect();
    let led: Shape = met.iter().map(|ring| lead_through(ring, &corners)).collect();
    let more = led.iter().zip(&met).any(|(after, before)| after.len() != before.len());
    (moved || more).then_some(led)
}

/// Corners that nearly meet become the first of them; whether any moved.
fn meet(shape: &Shape) -> (Shape, bool) {
    let mut kept: Vec<FlatPoint> = Vec::new();
    let mut moved = false;
    let mut ring_of = |ring: &Ring| {
        let mut met = Ring::with_capacity(ring.len());
        for corner in ring {
            let near = |other: &&FlatPoint| (distance2(**other, *corner) as f64) < MEETING_STEPS.powi(2);
            let at = kept.iter().find(near).copied().unwrap_or(*corner);
            if at == *corner {
                kept.push(at);
            }
            moved |= at != *corner;
            if met.last() != Some(&at) {
                met.push(at);
            }
        }
        while met.len() > 1 && met.first() == met.last() {
            met.pop();
        }
        met
    };
    let met: Shape = shape.iter().map(&mut ring_of).filter(|ring| ring.len() > 2).collect();
    (met, moved)
}

/// A ring whose edges go through the corners that they nearly pass.
fn lead_through(ring: &Ring, corners: &[FlatPoint]) -> Ring {
    let mut led = Ring::with_capacity(ring.len());
    for (a, b) in ring.iter().zip(ring.iter().cycle().skip(1)) {
        led.push(*a);
        let near = |p: &&FlatPoint| **p != *a && **p != *b && segment_distance(*a, *b, **p) < CLEARANCE_STEPS;
        let mut passed: Vec<FlatPoint> = corners.iter().filter(near).copied().collect();
        passed.sort_by_key(|p| (distance2(*a, *p), p.x, p.y));
        passed.dedup();
        led.extend(passed);
    }
    led
}

#[cfg(test)]
mod tests {
    use super::{CLEARANCE_STEPS, MEETING_STEPS, clear, has_room};
    use crate::reconstruct::planes::paper::random::Random;
    use crate::reconstruct::polygons::outline::border::segment_distance;
    use crate::reconstruct::polygons::outline::union::{Ring, Shape, area_m2, repair};
    use crate::reconstruct::polygons::plane_frame::FlatPoint;

    fn ring(points: &[(i32, i32)]) -> Ring {
        points.iter().map(|(x, y)| FlatPoint::new(*x, *y)).collect()
    }

    /// Least distance of a corner to an edge of the shape that does not end in it, by trying all.
    fn room(shape: &Shape) -> f64 {
        let edges =
            || shape.iter().flat_map(|r| r.iter().zip(r.iter().cycle().skip(1)).map(|(a, b)| (*a, *b)));
        let distances = shape.iter().flatten().flat_map(|p| {
            edges().filter(move |(a, b)| a != p && b != p).map(move |(a, b)| segment_distance(a, b, *p))
        });
        distances.fold(f64::INFINITY, f64::min)
    }

    #[test]
    fn a_notch_that_ends_a_hair_before_the_far_edge_splits_the_shape_there() {
        // The tip of the notch is one step above the lower edge.
        let notched = vec![ring(&[
            (0, 0),
            (10_000, 0),
            (10_000, 9000),
            (6000, 9000),
            (5000, 1),
            (4000, 9000),
            (0, 9000),
        ])];
        assert!(room(&notched) < 2.0);
        let cleared = clear(vec![notched]);
        assert_eq!(cleared.len(), 2, "{cleared:?}");
        assert!(cleared.iter().all(|shape| room(shape) >= CLEARANCE_STEPS));
    }

    #[test]
    fn random_stars_get_room_everywhere_and_keep_their_area() {
        let mut random = Random::new(7);
        for _ in 0..200 {
            // Short edges on a small field: near misses are frequent.
            let mut at = || FlatPoint::new((300.0 * random.unit()) as i32, (300.0 * random.unit()) as i32);
            let shapes = repair(&[vec![(0..9).map(|_| at()).collect()]]);
            let before: f64 = shapes.iter().flatten().map(|r| area_m2(r)).sum();
            let cleared = clear(shapes);
            let after: f64 = cleared.iter().flatten().map(|r| area_m2(r)).sum();
            for shape in &cleared {
                assert!(room(shape) >= CLEARANCE_STEPS, "{shape:?}");
            }
            // A border of some 2,000 steps moved by less than corners may.
            assert!((after - before).abs() < 2000.0 * MEETING_STEPS * 1e-8, "{before} {after}");
        }
    }

    #[test]
    fn a_spike_without_width_and_a_corner_close_to_an_edge_have_no_room() {
        let square = [(0, 0), (1000, 0), (1000, 1000), (0, 1000)];
        assert!(has_room(&vec![ring(&square)]));
        assert!(!has_room(&vec![ring(&[(0, 0), (1000, 0), (1500, 0), (1000, 0), (1000, 1000), (0, 1000)])]));
        assert!(!has_room(&vec![ring(&square), ring(&[(500, 3), (400, 500), (600, 500)])]));
    }

    #[test]
    fn a_shape_with_room_stays_as_it_is() {
        let square = vec![vec![
            ring(&[(0, 0), (1000, 0), (1000, 1000), (0, 1000)]),
            ring(&[(400, 400), (400, 500), (500, 500)]),
        ]];
        assert_eq!(clear(square.clone()), square);
    }
}
