//! STEP files: text to instances.

pub(crate) mod parse;
pub(crate) mod value;
