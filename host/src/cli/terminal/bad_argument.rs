//! An argument that turns out to be wrong only when files have been opened: the process then ends as it does
//! for any other wrong argument.

/// What is wrong with it.
#[derive(Debug, thiserror::Error)]
#[error("{why}")]
pub(crate) struct BadArgument {
    /// The command that it was given to.
    pub command: &'static str,
    /// The reason.
    pub why: String,
}
