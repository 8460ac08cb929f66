//! The meshes and facts that the page's script reads.

pub(crate) mod contents;
pub(crate) mod pack;
pub(crate) mod reduce;
