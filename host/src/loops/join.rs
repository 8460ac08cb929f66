//! Several recordings in one frame: where no way leads from one to another, every place of the one is looked for in the other.
//!
//! Nothing is known of the start, so a window is a whole turn around each stretch; a place found so is believed only when two more,
//! of other stretches, agree with it over the ways that both recordings drove between them.

use super::candidate::Closing;

/// Which recordings came together: for each the number of the first one that it is joined to (itself when it is alone).
pub fn groups(recordings: usize, pairs: impl Iterator<Item = [usize; 2]>) -> Vec<usize> {
    let mut group: Vec<usize> = (0..recordings).collect();
    for [one, other] in pairs {
        let (low, high) = (group[one].min(group[other]), group[one].max(group[other]));
        for entry in &mut group {
            if *entry == high {
                *entry = low;
            }
        }
    }
    group
}

impl Closing<'_> {
    /// Which recordings the believed loops join.
    pub fn groups(&self, recordings: usize) -> Vec<usize> {
        let believed = self.loops.iter().zip(&self.believed).filter(|(_, believed)| **believed);
        groups(
            recordings,
            believed.map(|(found, _)| found.stretches.map(|stretch| self.recording_of[stretch])),
        )
    }
}
