//! Worlds that are built by code.

pub mod builder;
pub(crate) mod building;
pub(crate) mod corridor;
pub(crate) mod decks;
pub(crate) mod hall;
pub(crate) mod office;
pub(crate) mod passage;
pub(crate) mod pillars;
pub(crate) mod ramps;
pub mod round;
pub(crate) mod street;
