//! What the search has found: a label for every point, and the planes of the labels. Meters.

use super::blocks::Block;
use super::stitch;
use crate::model::Cloud;
use crate::reconstruct::planes::fit::noise::Noise;
use crate::reconstruct::planes::fit::scatter::Fit;
use crate::reconstruct::planes::labeled::SigmaSource;
use crate::reconstruct::planes::labels::refine::{refit, scatters};
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

/// What was found in all blocks of a cloud, as if it were of one search: each point has the label that its
/// own block gave it.
pub(crate) fn combine(cloud: &Cloud, blocks: &[Block], found: &[Searched], setting: Setting) -> Searched {
    let mut labels = vec![-1; cloud.len()];
    let mut fits: Vec<Option<Fit>> = Vec::new();
    for (block, found) in blocks.iter().zip(found) {
        let first = fits.len() as i32;
        let own = block.points.iter().zip(&found.labels).zip(&block.is_own).filter(|(_, is_own)| **is_own);
        for ((point, label), _) in own.filter(|((_, label), _)| **label >= 0) {
            labels[*point as usize] = first + label;
        }
        fits.extend(&found.fits);
    }
    // Points of the margins have helped to find a plane; its own ones make it.
    let sums = scatters(&cloud.points_m, &labels, fits.len());
    let fits = refit(&sums, &fits);
    let shared = stitch::shared_points(blocks, found, &labels);
    let into = stitch::stitch(&shared, &sums, &fits, Noise::new(setting.sigma_m));
    for label in labels.iter_mut().filter(|label| **label >= 0) {
        *label = into[*label as usize] as i32;
    }
    let fits = refit(&scatters(&cloud.points_m, &labels, fits.len()), &fits);
    Searched { setting, labels, fits, blocks: blocks.len() }
}
