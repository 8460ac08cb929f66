//! The sections of the page, one file each.

pub(crate) mod comparison;
pub(crate) mod downloads;
pub(crate) mod figures;
pub(crate) mod floor;
pub(crate) mod openings;
pub(crate) mod paper;
pub(crate) mod pictures;
pub(crate) mod rooms;
pub(crate) mod stages;
