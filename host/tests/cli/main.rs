//! The program from outside: exit codes, sentences, files.

mod build;
mod floor;
mod import;
mod room;
mod run;
mod salvage;
