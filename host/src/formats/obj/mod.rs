//! Wavefront OBJ, read and written.

pub(crate) mod keyhole;
pub mod read;
pub(crate) mod welded;
pub mod write;

pub use read::{Obj, ObjError, read};
pub use write::write;
