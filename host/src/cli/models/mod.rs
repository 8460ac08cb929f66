//! Commands that make models of clouds and meshes from other programs.

pub(crate) mod compact;
pub(crate) mod export;
pub(crate) mod files;
pub(crate) mod formats;
pub(crate) mod model_args;
pub(crate) mod no_planes_hint;
pub(crate) mod planes;
pub(crate) mod viewer_file;
