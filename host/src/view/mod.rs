//! What people look at: the report page, pictures, plots, floor maps.

pub(crate) mod floor_map;
pub(crate) mod markup;
pub(crate) mod plot;
pub(crate) mod render;
pub(crate) mod report;
