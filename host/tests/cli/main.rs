//! The program from outside: exit codes, sentences, files.

mod fixtures;
mod measure;
mod models;
mod recordings;
mod terminal;

use fixtures::{ring, room, run};
