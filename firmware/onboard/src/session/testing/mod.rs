//! What tests of sessions share.

pub(crate) mod noise;
pub(crate) mod script;
