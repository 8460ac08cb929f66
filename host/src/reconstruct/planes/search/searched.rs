//! What the search has found: a label for every point, and the planes of the labels. Meters.

use crate::reconstruct::planes::fit::scatter::Fit;
use crate::reconstruct::planes::labeled::SigmaSource;
use serde::{Deserialize, Serialize};

/// What a search goes by, the same in all blocks of a cloud.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub(crate) struct Setting {
    /// Edge of the cells, meters.
    pub cell_m: f64,
    /// Range noise, meters.
    pub sigma_m: f64,
    /// Where it comes from.
    pub sigma_source: SigmaSource,
}

/// See the module's text.
#[derive(Clone, Debug, Default, PartialEq)]
pub(crate) struct Searched {
    /// What the search went by.
    pub setting: Setting,
    /// For each point the index of its plane in `fits`, or -1.
    pub labels: Vec<i32>,
    /// The planes; `None` where one was given up.
    pub fits: Vec<Option<Fit>>,
    /// How many blocks were searched, each by itself.
    pub blocks: usize,
}
