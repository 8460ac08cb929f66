//! Serial captures: as files, as the source of a mock rig, and made from other recordings.

pub mod encode;
pub mod extract;
pub mod file;
pub mod source;
#[cfg(test)]
mod tests;
