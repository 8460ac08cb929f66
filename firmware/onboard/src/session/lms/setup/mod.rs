//! From the first byte to a configured laser: baud rate, identity, settings.

pub(crate) mod baud_search;
pub(crate) mod configure;
pub(crate) mod difference;
pub(crate) mod info;
pub(crate) mod requested;
pub(crate) mod settings;
pub(crate) mod write;
