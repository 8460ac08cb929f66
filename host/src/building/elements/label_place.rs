//! Where the name of a room stands: at the place inside it that is furthest from its outline and its holes,
//! its pole of inaccessibility. The middle of its area may lie in a hole, or outside.

use std::cmp::Ordering;
use std::collections::BinaryHeap;

use biplane_geometry::vec2::distance_to_segment;

use super::Room;
use super::assemble::is_inside;
use crate::building::elevation::extent;

/// Places whose distance differs by less are as good as each other, meters.
const PRECISION_M: f64 = 0.02;
/// A room is first divided into so many squares along its shorter side.
const SQUARES: f64 = 4.0;
/// Squares that are looked at, at most: of a room with thousands of corners the best place so far will do.
const MAX_SQUARES: usize = 4000;

impl Room {
    /// Where its name stands.
    pub(crate) fn label_place_m(&self) -> [f64; 2] {
        let rings: Vec<&[[f64; 2]]> =
            std::iter::once(&self.outline_m).chain(&self.holes_m).map(Vec::as_slice).collect();
        pole(&rings).unwrap_or_default()
    }
}

/// A square: its middle, half its side, how far its middle is from the rings (negative outside), and how far
/// any place in it can be.
struct Square {
    at: [f64; 2],
    half_m: f64,
    inside_m: f64,
    bound_m: f64,
}

impl Square {
    fn new(at: [f64; 2], half_m: f64, rings: &[&[[f64; 2]]]) -> Self {
        let inside_m = inside_m(at, rings);
        Self { at, half_m, inside_m, bound_m: inside_m + half_m * std::f64::consts::SQRT_2 }
    }
}

impl PartialEq for Square {
    fn eq(&self, other: &Self) -> bool {
        self.cmp(other) == Ordering::Equal
    }
}

impl Eq for Square {}

impl PartialOrd for Square {
    fn partial_cmp(&self, other: &Self) -> Option<Ordering> {
        Some(self.cmp(other))
    }
}

impl Ord for Square {
    /// By what may still be found in it.
    fn cmp(&self, other: &Self) -> Ordering {
        self.bound_m.total_cmp(&other.bound_m)
    }
}

/// The place inside rings, of which any but the first are holes, that is furthest from all of them; none
/// without an outline. Squares are divided in the order of what they may hold (polylabel, V. Agafonkin 2016).
fn pole(rings: &[&[[f64; 2]]]) -> Option<[f64; 2]> {
    let outline = *rings.first().filter(|outline| !outline.is_empty())?;
    let sides = [0, 1].map(|axis| extent(outline.iter().map(|corner| corner[axis])));
    let size = sides.map(|[low, high]| high - low);
    let half_m = size[0].min(size[1]) / SQUARES / 2.0;
    let middle = sides.map(|[low, high]| low + (high - low) / 2.0);
    if half_m < PRECISION_M {
        return Some(middle);
    }
    let mut best = Square::new(middle, 0.0, rings);
    let mut squares = BinaryHeap::new();
    let count = size.map(|side| (side / (2.0 * half_m)).ceil() as usize);
    for (column, row) in (0..count[0]).flat_map(|column| (0..count[1]).map(move |row| (column, row))) {
        let at = [(column, sides[0][0]), (row, sides[1][0])]
            .map(|(number, from)| from + half_m * (2.0 * number as f64 + 1.0));
        squares.push(Square::new(at, half_m, rings));
    }
    for _ in 0..MAX_SQUARES {
        let Some(square) = squares.pop() else { break };
        let is_over = square.bound_m - best.inside_m <= PRECISION_M;
        let quarter_m = square.half_m / 2.0;
        let [x, y] = square.at;
        if square.inside_m > best.inside_m {
            best = square;
        }
        if is_over {
            break;
        }
        for (right, up) in [(-1.0, -1.0), (1.0, -1.0), (-1.0, 1.0), (1.0, 1.0)] {
            squares.push(Square::new([x + right * quarter_m, y + up * quarter_m], quarter_m, rings));
        }
    }
    Some(best.at)
}

/// How far a place is from the rings; negative outside, and in a hole.
fn inside_m(at: [f64; 2], rings: &[&[[f64; 2]]]) -> f64 {
    let edges = rings.iter().flat_map(|ring| ring.iter().zip(ring.iter().cycle().skip(1)));
    let nearest_m = edges.map(|(a, b)| distance_to_segment(at, *a, *b)).fold(f64::INFINITY, f64::min);
    let around = rings.iter().filter(|ring| is_inside(ring, at)).count();
    if around % 2 == 1 { nearest_m } else { -nearest_m }
}

#[cfg(test)]
mod tests {
    use super::{inside_m, pole};

    fn rectangle([x, y]: [f64; 2], [width, height]: [f64; 2]) -> Vec<[f64; 2]> {
        vec![[x, y], [x + width, y], [x + width, y + height], [x, y + height]]
    }

    #[test]
    fn a_name_stands_where_most_room_is_and_never_in_a_hole() {
        // A corridor around a block: the middle of its area is the block's.
        let (outer, block) = (rectangle([0.0, 0.0], [12.0, 8.0]), rectangle([2.0, 2.0], [7.0, 4.0]));
        let rings = [&outer[..], &block[..]];
        let at = pole(&rings).unwrap();
        // The right leg is the widest, 3 m; in its corners there is a little more room.
        assert!(inside_m(at, &rings) >= 1.5 - 0.02 && at[0] > 9.0, "{at:?}");

        // An L: the middle of its area lies outside.
        let angle = vec![[0.0, 0.0], [10.0, 0.0], [10.0, 1.0], [1.5, 1.0], [1.5, 10.0], [0.0, 10.0]];
        let at = pole(&[&angle]).unwrap();
        assert!(inside_m(at, &[&angle]) > 0.7, "{at:?}");

        let square = rectangle([4.0, -2.0], [3.0, 3.0]);
        let [x, y] = pole(&[&square]).unwrap();
        assert!((x - 5.5).abs() < 0.05 && (y + 0.5).abs() < 0.05, "{x} {y}");
    }

    #[test]
    fn what_has_no_area_has_a_place_too() {
        assert_eq!(pole(&[]), None);
        assert_eq!(pole(&[&[]]), None);
        assert_eq!(pole(&[&[[1.0, 2.0]]]), Some([1.0, 2.0]));
        assert_eq!(pole(&[&[[0.0, 0.0], [2.0, 0.0]]]), Some([1.0, 0.0]));
    }
}
