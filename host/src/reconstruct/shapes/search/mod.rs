//! Where cylinders may be: among strips of planes, and in clusters of points on no wide plane.

pub(crate) mod cells;
pub(crate) mod circle;
pub(crate) mod clusters;
pub(crate) mod curved_walls;
pub(crate) mod guesses;
pub(crate) mod patches;
pub(crate) mod section;
