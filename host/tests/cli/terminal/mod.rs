//! What commands have in common: care with files, comfort, being killed; and the demo.

mod careful;
mod comfort;
#[cfg(feature = "demo")]
mod demo;
mod interrupted;
mod killed;
mod memory;
