//! What the three programs share on the command line.
//!
#![doc = include_str!("../README.md")]

mod counted;
mod ending;
mod examples;
mod interrupt;
mod manual;
pub mod memory;
mod outcome;
mod output;
mod plain;
pub mod thread;
mod words;

pub use crate::counted::counted;
pub use crate::ending::{clean_up_by, wait_if_ending};
pub use crate::examples::faulty_examples;
pub use crate::interrupt::end_on_signals;
pub use crate::manual::{Completions, Man};
pub use crate::outcome::{BAD_ARGUMENTS, FAILED, Outcome};
pub use crate::output::{list, paragraph, print_result, say};
pub use crate::plain::plain_error;
pub use crate::words::{EVERYWHERE, parse, refusal, try_parse};
