//! Worlds that are built by code.

pub mod builder;
pub(crate) mod building;
pub(crate) mod corridor;
pub(crate) mod office;
