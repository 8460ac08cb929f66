//! The paper's likelihood field (section 2.1): how likely an obstacle is, seen from earlier scans.
//!
//! For a node of the grid that some reference scan could see: minus the distance to the nearest end point,
//! cut off at `CUTOFF_M`; zero, the best value, where every reference scan's sight was blocked. Distances and
//! occlusion are computed beforehand; between nodes the field is bilinear. Frame: map, window around the
//! latest reference scan. Units: meters.

use biplane_geometry::PortableMath;
use std::f32::consts::{PI, TAU};

use crate::parameter_group::parameter_group;
use crate::placement::Placement;
use crate::scan::end_points::EndPoints;
use biplane_geometry::Pose2;
use biplane_geometry::vec2::minus;

parameter_group! { "gradient";
/// The paper's method.
#[derive(Copy, Clone, PartialEq, Debug)]
pub struct GradientParams {
    /// Side of a cell, meters; the paper's is 0.1. Smaller: finer and slower to prepare, by the square.
    pub cell_m: f64 [0.005, 10.0],
    /// Half the side of the square around the latest reference scan that the field covers, meters. End points
    /// outside count nothing.
    pub half_window_m: f64 [0.1, 1000.0],
}
}

impl Default for GradientParams {
    fn default() -> Self {
        Self { cell_m: 0.1, half_window_m: 20.0 }
    }
}

/// From this distance on the likelihood falls no further, meters. Larger: a wider basin, more harm from
/// people. Error 0.2119 m halved, 0.6671 m doubled.
const CUTOFF_M: f32 = 1.0;
/// So far behind an end point space is not yet occluded, meters. Smaller: end points slip behind the walls.
/// Error 0.3681 m halved, 0.2722 m doubled.
const OCCLUSION_MARGIN_M: f32 = 0.4;
/// Beams farther apart than this leave the space between them unknown, radians: three degrees, six beams of a
/// fine scan. Error 0.1304 m halved, 0.1801 m doubled.
const GAP_RAD: f64 = 0.05;
/// Directions that a reference scan's sight is kept for.
const DIRECTIONS: usize = 1024;

/// A reference scan, in the map.
#[derive(Clone, Debug)]
pub(crate) struct Reference {
    from_m: [f32; 2],
    ends_m: Vec<[f32; 2]>,
    /// How far it saw in each direction, meters; zero where it did not look or nothing came back.
    visible_m: Vec<f32>,
}

impl Reference {
    /// A reference with memory for this many end points.
    pub(crate) fn with_capacity(points: usize) -> Self {
        Self { from_m: [0.0; 2], ends_m: Vec::with_capacity(points), visible_m: vec![0.0; DIRECTIONS] }
    }

    /// Takes a scan at this pose.
    pub(crate) fn fill(&mut self, map_from_base: &Pose2, points: &EndPoints) {
        let placement = Placement::new(map_from_base);
        self.from_m = placement.place(points.laser_in_base_m());
        self.ends_m.clear();
        self.ends_m.extend(points.as_slice().iter().map(|point| placement.place(point.at_m)));
        self.visible_m.fill(0.0);
        let mut before: Option<(f32, f32)> = None;
        for end in &self.ends_m {
            let offset = minus(*end, self.from_m);
            let (angle, range) = (offset[1].portable_atan2(offset[0]), offset[0].portable_hypot(offset[1]));
            self.visible_m[direction(angle)] = range;
            if let Some((last_angle, last_range)) = before {
                let turn = (angle - last_angle + PI).rem_euclid(TAU) - PI;
                if f64::from(turn.abs()) < GAP_RAD {
                    let steps = (turn.abs() / TAU * DIRECTIONS as f32).ceil() as usize;
                    for step in 1..steps {
                        let u = step as f32 / steps as f32;
                        self.visible_m[direction(last_angle + u * turn)] =
                            last_range + u * (range - last_range);
                    }
                }
            }
            before = Some((angle, range));
        }
    }

    fn sees(&self, at_m: [f32; 2], margin_m: f32) -> bool {
        let offset = minus(at_m, self.from_m);
        let visible = self.visible_m[direction(offset[1].portable_atan2(offset[0]))];
        let reach = visible + margin_m;
        visible > 0.0 && offset[0] * offset[0] + offset[1] * offset[1] <= reach * reach
    }
}

fn direction(angle_rad: f32) -> usize {
    (((angle_rad + PI) / TAU).rem_euclid(1.0) * DIRECTIONS as f32) as usize % DIRECTIONS
}

/// A point's log-likelihood (meters, never positive) and its gradient.
#[derive(Copy, Clone, PartialEq, Debug)]
pub(crate) struct Likelihood {
    /// Minus the distance to the nearest end point; zero in occlusion.
    pub value: f32,
    /// Derivative by the point's map coordinates, per meter.
    pub gradient: [f32; 2],
}

/// Nothing is known.
const BLANK: Likelihood = Likelihood { value: 0.0, gradient: [0.0; 2] };

/// The field's grid.
#[derive(Clone, Debug)]
pub(crate) struct Field {
    params: GradientParams,
    side: usize,
    origin_m: [f32; 2],
    nodes: Vec<f32>,
}

impl Field {
    /// An all-occluded field with all the memory it will ever have.
    pub(crate) fn new(params: GradientParams) -> Self {
        let side = (2.0 * params.half_window_m / params.cell_m).ceil().clamp(2.0, 4096.0) as usize + 1;
        Self { side, origin_m: [0.0; 2], nodes: vec![0.0; side * side], params }
    }

    /// Computes distances and occlusion for these references.
    pub(crate) fn build(&mut self, center_m: [f32; 2], references: &[Reference]) {
        let cell = self.params.cell_m as f32;
        // On whole cells of the map, so that two fields of one place have the same nodes.
        let half = (self.side / 2) as f32;
        self.origin_m = center_m.map(|meters| ((meters / cell).round() - half) * cell);
        self.nodes.fill(-CUTOFF_M);
        for reference in references {
            for end in &reference.ends_m {
                self.spread(*end);
            }
        }
        for row in 0..self.side {
            for column in 0..self.side {
                let at_m = self.node_m(column, row);
                if !references.iter().any(|reference| reference.sees(at_m, OCCLUSION_MARGIN_M)) {
                    self.nodes[row * self.side + column] = 0.0;
                }
            }
        }
    }

    fn node_m(&self, column: usize, row: usize) -> [f32; 2] {
        let cell = self.params.cell_m as f32;
        [self.origin_m[0] + column as f32 * cell, self.origin_m[1] + row as f32 * cell]
    }

    /// Lowers the distance of all nodes within the cutoff of an end point.
    fn spread(&mut self, end_m: [f32; 2]) {
        let (cell, cutoff) = (self.params.cell_m as f32, CUTOFF_M);
        let range = |axis: usize| {
            let middle = (end_m[axis] - self.origin_m[axis]) / cell;
            let low = (middle - cutoff / cell).ceil().max(0.0) as usize;
            let beyond = (middle + cutoff / cell).floor() + 1.0;
            low..(beyond.clamp(0.0, self.side as f32) as usize)
        };
        let (columns, rows) = (range(0), range(1));
        for row in rows {
            for column in columns.clone() {
                let offset = minus(self.node_m(column, row), end_m);
                let value = -(offset[0] * offset[0] + offset[1] * offset[1]).sqrt().max(f32::MIN_POSITIVE);
                let node = &mut self.nodes[row * self.side + column];
                *node = node.max(value);
            }
        }
    }

    /// The likelihood at a point of the map; zero and flat outside the window.
    pub(crate) fn at(&self, point_m: [f32; 2]) -> Likelihood {
        let per_m = 1.0 / self.params.cell_m as f32;
        let [x, y] = minus(point_m, self.origin_m).map(|meters| meters * per_m);
        let last = (self.side - 1) as f32;
        if !(x >= 0.0 && y >= 0.0 && x < last && y < last) {
            return BLANK;
        }
        let (column, row) = (x as usize, y as usize);
        let (u, v) = (x - column as f32, y - row as f32);
        let first = row * self.side + column;
        let [a, b] = [self.nodes[first], self.nodes[first + 1]];
        let [c, d] = [self.nodes[first + self.side], self.nodes[first + self.side + 1]];
        if a == 0.0 || b == 0.0 || c == 0.0 || d == 0.0 {
            return BLANK; // partly occluded: the step to occlusion is no slope to climb
        }
        Likelihood {
            value: (1.0 - v) * ((1.0 - u) * a + u * b) + v * ((1.0 - u) * c + u * d),
            gradient: [
                ((1.0 - v) * (b - a) + v * (d - c)) * per_m,
                ((1.0 - u) * (c - a) + u * (d - b)) * per_m,
            ],
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::scan::end_points::PointParams;
    use crate::scan::{Beam, Scan};

    /// A wall at x = 2 m, seen from the origin by beams from -45 to 45 degrees, one a degree.
    fn wall() -> Field {
        let beams: Vec<Beam> = (-45..=45)
            .map(|degrees| {
                let angle = f64::from(degrees).to_radians();
                let direction_in_base = [angle.cos() as f32, angle.sin() as f32];
                Beam { direction_in_base, range_m: (2.0 / angle.cos()) as f32, delay_s: 0.0 }
            })
            .collect();
        let mut points = EndPoints::new(PointParams::default());
        points.fill(&Scan { stamp_ns: 0, laser_in_base_m: [0.0; 2], beams: &beams, twist_in_base: [0.0; 3] });
        let params = GradientParams { half_window_m: 4.0, ..GradientParams::default() };
        let mut reference = Reference::with_capacity(100);
        reference.fill(&Pose2::IDENTITY, &points);
        let mut field = Field::new(params);
        field.build([0.0; 2], &[reference]);
        field
    }

    #[test]
    fn in_free_space_the_likelihood_is_minus_the_distance_to_the_wall() {
        let field = wall();
        for x in [1.2, 1.55, 1.8] {
            let value = field.at([x, 0.1]).value;
            assert!((value + (2.0 - x)).abs() < 0.01, "{x} {value}");
        }
        assert_eq!(field.at([0.5, 0.0]).value, -1.0, "cut off at 1 m");
    }

    #[test]
    fn behind_the_wall_and_where_the_laser_did_not_look_nothing_is_known() {
        let field = wall();
        for point in [[2.8, 0.0], [-1.0, 0.0], [0.5, 1.5], [100.0, 0.0], [f32::NAN, 0.0]] {
            assert_eq!(field.at(point), BLANK, "{point:?}");
        }
        assert!(field.at([2.2, 0.0]).value < 0.0, "within the margin it is still free");
    }

    #[test]
    fn the_gradient_is_the_difference_quotient_of_the_likelihood() {
        let field = wall();
        let h = 1e-3;
        for point in [[1.23, 0.04], [1.61, -0.33], [1.87, 0.52], [2.13, 0.21]] {
            let gradient = field.at(point).gradient;
            for axis in 0..2 {
                let (mut low, mut high) = (point, point);
                low[axis] -= h;
                high[axis] += h;
                let quotient = (field.at(high).value - field.at(low).value) / (2.0 * h);
                assert!(
                    (gradient[axis] - quotient).abs() < 2e-3,
                    "{point:?} {axis}: {gradient:?} {quotient}"
                );
            }
        }
        assert!(field.at([1.5, 0.0]).gradient[0] > 0.9, "uphill is towards the wall");
    }

    #[test]
    fn without_references_nothing_is_known_anywhere() {
        let mut field = wall();
        assert!(field.nodes.iter().any(|node| *node < 0.0));
        field.build([0.0; 2], &[]);
        assert!(field.nodes.iter().all(|node| *node == 0.0));
    }
}
