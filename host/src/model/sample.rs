//! A small model for tests: a wall with a window, a floor, and one loose triangle.

use crate::model::cylinder::{Cylinder, CylinderKind, SeenFrom};
use crate::model::inferred::{InferredKind, InferredSurface};
use crate::model::{Mesh, Model, PlanarPolygon, Plane};

/// Wall in the plane y = 2 seen from y < 2, 4 m by 3 m with a window 1 m by 1 m; floor z = 0, 4 m by 2 m.
pub(crate) fn model() -> Model {
    let wall = Plane { normal: [0.0, -1.0, 0.0], offset_m: -2.0, points: 900, rms_m: 0.011 };
    let floor = Plane { normal: [0.0, 0.0, 1.0], offset_m: 0.0, points: 500, rms_m: 0.009 };
    let wall_polygon = PlanarPolygon {
        plane: 0,
        outer_m: vec![[0.0, 2.0, 0.0], [4.0, 2.0, 0.0], [4.0, 2.0, 3.0], [0.0, 2.0, 3.0]],
        holes_m: vec![vec![[1.0, 2.0, 1.0], [1.0, 2.0, 2.0], [2.0, 2.0, 2.0], [2.0, 2.0, 1.0]]],
    };
    let floor_polygon = PlanarPolygon {
        plane: 1,
        outer_m: vec![[0.0, 0.0, 0.0], [4.0, 0.0, 0.0], [4.0, 2.0, 0.0], [0.0, 2.0, 0.0]],
        holes_m: Vec::new(),
    };
    let leftovers = Mesh {
        vertices_m: vec![[1.0, 1.0, 0.5], [1.5, 1.0, 0.5], [1.0, 1.5, 0.75]],
        triangles: vec![[0, 1, 2]],
    };
    Model {
        planes: vec![wall, floor],
        polygons: vec![wall_polygon, floor_polygon],
        leftovers,
        ..Model::default()
    }
}

/// A plane of three points.
pub(crate) fn plane(normal: [f64; 3], offset_m: f64) -> Plane {
    Plane { normal, offset_m, points: 3, rms_m: 0.0 }
}

/// A polygon without holes.
pub(crate) fn polygon(plane: usize, outer_m: &[[f64; 3]]) -> PlanarPolygon {
    PlanarPolygon { plane, outer_m: outer_m.to_vec(), holes_m: Vec::new() }
}

/// The base of a wall in the plane x = 5 seen from x < 5, 2 m by 0.5 m.
pub(crate) fn inferred() -> InferredSurface {
    InferredSurface {
        kind: InferredKind::WallBase,
        part_of: "S1-W01".to_owned(),
        normal: [-1.0, 0.0, 0.0],
        offset_m: -5.0,
        outer_m: vec![[5.0, 2.0, 0.0], [5.0, 0.0, 0.0], [5.0, 0.0, 0.5], [5.0, 2.0, 0.5]],
        holes_m: Vec::new(),
    }
}

/// A column of 20 cm radius and 3 m height at (1, 1).
pub(crate) fn column() -> Cylinder {
    Cylinder {
        kind: CylinderKind::Column,
        axis_point_m: [1.0, 1.0, 0.0],
        axis_direction: [0.0, 0.0, 1.0],
        radius_m: 0.2,
        from_m: 0.0,
        to_m: 3.0,
        arc_deg: [0.0, 360.0],
        seen_arc_deg: [0.0, 360.0],
        seen_from: SeenFrom::Outside,
        points: 1200,
        rms_m: 0.012,
        seen_m: [0.4, 2.9],
        cuts: [[0.0; 2]; 2],
    }
}

/// Half a round of a wall of 3 m radius, seen from inside.
pub(crate) fn apse() -> Cylinder {
    Cylinder {
        kind: CylinderKind::Wall,
        radius_m: 3.0,
        arc_deg: [-90.0, 90.0],
        seen_arc_deg: [-85.0, 85.0],
        seen_from: SeenFrom::Inside,
        ..column()
    }
}

/// The sample's polygons as triangles: the wall as eight around its window, the floor as two.
pub(crate) fn faces(model: &Model) -> Vec<Mesh> {
    let to_f32 = |ring: &[[f64; 3]]| ring.iter().map(|p| p.map(|v| v as f32)).collect::<Vec<_>>();
    let mut wall = to_f32(&model.polygons[0].outer_m);
    wall.extend(to_f32(&model.polygons[0].holes_m[0]));
    #[rustfmt::skip]
    let around = vec![[0, 1, 4], [4, 1, 7], [1, 2, 7], [7, 2, 6], [2, 3, 6], [6, 3, 5], [3, 0, 5], [5, 0, 4]];
    let floor = to_f32(&model.polygons[1].outer_m);
    vec![
        Mesh { vertices_m: wall, triangles: around },
        Mesh { vertices_m: floor, triangles: vec![[0, 1, 2], [0, 2, 3]] },
    ]
}
