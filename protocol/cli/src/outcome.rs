//! Exit codes: 0 done, 1 failed, 2 bad arguments, 3 done but data was lost.

use std::process::ExitCode;

/// The exit code of a program that failed.
pub const FAILED: u8 = 1;
/// The exit code of a program that was called in a wrong way; clap ends with the same.
pub const BAD_ARGUMENTS: u8 = 2;

/// How a command ended that did not fail.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Outcome {
    /// All done.
    Done,
    /// Done, but data of the input was lost.
    Lossy,
}

impl Outcome {
    /// The exit code.
    #[must_use]
    pub const fn code(self) -> u8 {
        match self {
            Self::Done => 0,
            Self::Lossy => 3,
        }
    }
}

impl From<Outcome> for ExitCode {
    fn from(outcome: Outcome) -> Self {
        Self::from(outcome.code())
    }
}
