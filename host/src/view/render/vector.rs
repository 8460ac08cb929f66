//! Three-vectors for drawing; `biplane_geometry::vec3` has what is done with them: the same bits on any
//! machine.

/// A point or direction.
pub(crate) type Vec3 = [f64; 3];
