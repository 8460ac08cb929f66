//! What of a bag could not be read, in sentences, the first of them.

use std::path::Path;

/// Losses beyond these are not told one by one.
const LOSSES_KEPT: usize = 20;

/// What could not be read of the bags.
#[derive(Clone, Debug, Default, PartialEq, Eq, serde::Serialize)]
pub struct Losses {
    /// How many places.
    pub count: usize,
    /// The first of them, a sentence each.
    pub first: Vec<String>,
}

impl Losses {
    /// One more.
    pub(crate) fn add(&mut self, path: &Path, what: &str) {
        self.count += 1;
        if self.first.len() < LOSSES_KEPT {
            self.first.push(format!("{}: {what}", path.display()));
        }
    }

    /// Those of another reading too.
    pub(crate) fn merge(&mut self, other: Self) {
        self.count += other.count;
        let room = LOSSES_KEPT.saturating_sub(self.first.len());
        self.first.extend(other.first.into_iter().take(room));
    }
}
