//! Commands that draw.

pub(crate) mod built;
pub(crate) mod plot;
pub(crate) mod render;
pub(crate) mod report;
