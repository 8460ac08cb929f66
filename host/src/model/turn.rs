//! The main direction of walls, and the turn about the vertical axis of `map` that brings them along x and y.

use crate::model::area::area_m2;
use crate::model::{Mesh, Model};
use biplane_geometry::PortableMath;

/// Walls whose directions differ by less share one, degrees: scans and furniture along a wall scatter so far.
const ALIKE_DEG: f64 = 2.0;
/// Planes whose normal is nearer to level than this are upright.
const MAX_SLOPE: f64 = 0.05;
/// So many walls tell the direction, the largest first: each is compared with each.
const MAX_WALLS: usize = 500;

/// A turn about the vertical axis of `map`.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Turn {
    /// The angle, counter-clockwise from above, radians.
    pub angle_rad: f64,
}

impl Turn {
    /// The turn by which most of a model's wall area comes along x and y, at most 45 degrees; `None` without
    /// walls. `faces` are the meshes of its polygons.
    pub(crate) fn along_walls(model: &Model, faces: &[Mesh]) -> Option<Self> {
        let mut walls: Vec<[f64; 2]> = model
            .polygons
            .iter()
            .zip(faces)
            .filter_map(|(polygon, mesh)| {
                let normal = model.planes.get(polygon.plane)?.normal;
                let is_upright = normal[2].abs() < MAX_SLOPE;
                is_upright.then(|| [normal[1].portable_atan2(normal[0]).to_degrees(), area_m2(mesh)])
            })
            .collect();
        walls.sort_by(|a, b| b[1].total_cmp(&a[1]));
        walls.truncate(MAX_WALLS);
        let main_deg = main_direction_deg(&walls)?;
        Some(Self { angle_rad: -main_deg.to_radians() })
    }

    /// A point after the turn. No turn leaves it as it is, to the bit.
    pub(crate) fn apply(&self, [x, y, z]: [f64; 3]) -> [f64; 3] {
        if self.is_none() {
            return [x, y, z];
        }
        let (sin, cos) = self.angle_rad.portable_sin_cos();
        [cos * x - sin * y, sin * x + cos * y, z]
    }

    /// Whether nothing is turned.
    pub(crate) fn is_none(&self) -> bool {
        self.angle_rad == 0.0
    }
}

/// The direction that most area shares, from -45 to 45 degrees. Right angles count as one direction.
/// Walls are direction in degrees and area.
fn main_direction_deg(walls: &[[f64; 2]]) -> Option<f64> {
    let near = |center_deg: f64| walls.iter().map(move |[deg, area]| (apart_deg(*deg, center_deg), *area));
    let support = |center_deg: f64| {
        near(center_deg).map(|(apart, area)| area * (1.0 - apart.abs() / ALIKE_DEG).max(0.0)).sum::<f64>()
    };
    let best = walls.iter().map(|[deg, _]| (*deg, support(*deg)));
    let (center_deg, _) = best.reduce(|best, other| if other.1 > best.1 { other } else { best })?;
    let alike = near(center_deg).filter(|(apart, _)| apart.abs() < ALIKE_DEG);
    let (sum, area) = alike.fold((0.0, 0.0), |sum, (apart, area)| (sum.0 + apart * area, sum.1 + area));
    (area > 0.0).then(|| apart_deg(center_deg + sum / area, 0.0))
}

/// How far a direction is from another, modulo a right angle, degrees from -45 to 45.
fn apart_deg(deg: f64, from_deg: f64) -> f64 {
    (deg - from_deg + 45.0).rem_euclid(90.0) - 45.0
}

#[cfg(test)]
mod tests {
    use super::{Turn, main_direction_deg};
    use crate::formats::Shapes;
    use crate::model::{Model, sample};

    #[test]
    fn right_angles_are_one_direction_and_the_larger_wing_decides() {
        let found = main_direction_deg(&[[12.0, 10.0], [102.4, 10.0], [-168.0, 5.0], [40.0, 20.0]]);
        assert!((found.unwrap() - 12.16).abs() < 1e-9, "{found:?}");
        // Around 45 degrees both ways are as near.
        let edge = main_direction_deg(&[[44.9, 1.0], [-44.9, 1.0]]).unwrap();
        assert!((edge.abs() - 45.0).abs() < 0.11, "{edge}");
        assert_eq!((main_direction_deg(&[]), main_direction_deg(&[[3.0, 0.0]])), (None, None));
    }

    #[test]
    fn a_model_without_walls_is_not_turned() {
        let model = sample::model();
        let faces = Shapes::new(&model).faces;
        assert!(Turn::along_walls(&model, &faces).is_some_and(|turn| turn.angle_rad.abs() < 1e-6));
        assert_eq!(Turn::along_walls(&Model::default(), &[]), None);
    }

    #[test]
    fn points_turn_counter_clockwise_about_the_vertical() {
        let [x, y, z] = Turn { angle_rad: std::f64::consts::FRAC_PI_2 }.apply([2.0, 0.0, 1.5]);
        assert!(x.abs() < 1e-12 && (y - 2.0).abs() < 1e-12 && z == 1.5);
        assert_eq!(Turn::default().apply([0.1, 0.2, 0.3]), [0.1, 0.2, 0.3]);
    }
}
