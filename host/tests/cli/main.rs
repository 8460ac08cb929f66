//! The program from outside: exit codes, sentences, files.

mod build;
mod careful;
#[cfg(feature = "demo")]
mod demo;
mod evaluate;
mod floor;
mod import;
mod parts;
mod planes;
mod plot;
mod room;
mod run;
mod salvage;
