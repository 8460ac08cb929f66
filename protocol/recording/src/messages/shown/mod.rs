//! Message types that are made for viewers only, as CDR bytes: nothing of ours reads them.

mod floor_map;
mod markers;
mod points;

pub use floor_map::{FloorMap, floor_map};
pub use markers::{Marker, MarkerShape, markers};
pub use points::points;
