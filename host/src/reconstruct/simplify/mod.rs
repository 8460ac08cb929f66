//! Meshes with fewer triangles, by quadric errors (Garland and Heckbert 1997).

pub(crate) mod collapse;
pub(crate) mod fewer;
pub(crate) mod quadric;
pub(crate) mod rings;
