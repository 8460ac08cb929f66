//! Whether a model that was read agrees with itself, as all that a build makes do.

use super::ModelFileError;
use crate::model::Model;
use biplane_geometry::vec3::dot;

/// A normal's length may differ from 1 by this: far more than rounding does, far less than a wrong digit.
const UNIT_TOLERANCE: f64 = 1e-6;

/// Once round, and what rounding adds, degrees.
const MAX_TURN_DEG: f64 = 360.001;

/// Every polygon has its plane, every triangle its vertices, every normal has the length 1.
pub(super) fn model(model: &Model) -> Result<(), ModelFileError> {
    for (plane, normal) in model.planes.iter().map(|plane| plane.normal).enumerate() {
        let length = dot(normal, normal).sqrt();
        if (length - 1.0).abs() > UNIT_TOLERANCE {
            return Err(ModelFileError::NotUnit { plane, length });
        }
    }
    for (cylinder, one) in model.cylinders.iter().enumerate() {
        let length = dot(one.axis_direction, one.axis_direction).sqrt();
        let turn = one.arc_deg[1] - one.arc_deg[0];
        let is_one = (length - 1.0).abs() <= UNIT_TOLERANCE
            && one.radius_m > 0.0
            && one.to_m > one.from_m
            && turn > 0.0
            && turn <= MAX_TURN_DEG;
        if !is_one {
            return Err(ModelFileError::NoCylinder { cylinder });
        }
    }
    for (surface, normal) in model.inferred.iter().map(|surface| surface.normal).enumerate() {
        let length = dot(normal, normal).sqrt();
        if (length - 1.0).abs() > UNIT_TOLERANCE {
            return Err(ModelFileError::InferredNotUnit { surface, length });
        }
    }
    let planes = model.planes.len();
    let lost = model.polygons.iter().map(|polygon| polygon.plane).enumerate().find(|at| at.1 >= planes);
    if let Some((polygon, plane)) = lost {
        return Err(ModelFileError::NoSuchPlane { polygon, plane, planes });
    }
    let vertices = model.leftovers.vertices_m.len();
    for (triangle, corners) in model.leftovers.triangles.iter().enumerate() {
        if let Some(&vertex) = corners.iter().find(|corner| **corner as usize >= vertices) {
            return Err(ModelFileError::NoSuchVertex { triangle, vertex, vertices });
        }
    }
    Ok(())
}
