//! The program from outside: exit codes, sentences, files.

mod build;
mod calibrate;
mod careful;
mod comfort;
mod compact;
#[cfg(feature = "demo")]
mod demo;
mod evaluate;
mod floor;
mod import;
mod killed;
mod odd_clouds;
mod odd_recordings;
mod optimize;
mod parts;
mod planes;
mod plot;
mod ring;
mod room;
mod run;
mod salvage;
