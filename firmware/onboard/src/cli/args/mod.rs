//! Arguments that several commands share, and their values.

pub(crate) mod live;
pub(crate) mod matcher;
pub(crate) mod rotation;
pub(crate) mod values;
