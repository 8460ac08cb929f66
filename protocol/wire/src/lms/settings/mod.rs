//! What a laser can be set to: operating mode, measuring mode, configuration block.

pub(crate) mod config;
pub(crate) mod measuring;
pub(crate) mod mode;
