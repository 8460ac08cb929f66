//! `manifest.json`: what is to be built, of what, and in which tiles.

use std::path::PathBuf;

use crate::reconstruct::planes::PlaneParams;
use crate::reconstruct::planes::search::searched::Setting;
use serde::{Deserialize, Serialize};

/// Its name in a folder of tiles.
pub(crate) const NAME: &str = "manifest.json";
/// The file of searches for loops in a folder of tiles.
pub(crate) const SEARCHES: &str = "loops";
/// The folder of tiles in it.
pub(crate) const TILES: &str = "tiles";
/// What the file says it is.
pub(crate) const FORMAT: &str = "biplane-tiles";
/// The layout of the folder. Whoever changes a file in it counts on.
pub(crate) const VERSION: u64 = 1;

/// See the module's text.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub(crate) struct Manifest {
    /// [`FORMAT`].
    pub format: String,
    /// [`VERSION`].
    pub version: u64,
    /// The program's version: another one may search otherwise.
    pub generator: String,
    /// The recordings as they were named, with their full paths.
    pub recordings: Vec<PathBuf>,
    /// Somebody else's poses.
    pub poses: Option<PathBuf>,
    /// Whether poses stay as they were recorded.
    pub no_optimize: bool,
    /// Whether poses stay in the plane.
    pub planar: bool,
    /// Range noise that was given, meters.
    pub sigma_m: Option<f64>,
    /// Every file that is read.
    pub inputs: Vec<Input>,
    /// What a plane is.
    pub planes: PlaneParams,
    /// What all tiles go by; a single block finds it out by itself.
    pub setting: Option<Setting>,
    /// The tiles, by index.
    pub tiles: Vec<Tile>,
}

/// A file that is read.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub(crate) struct Input {
    /// Its full path.
    pub path: PathBuf,
    /// Its length.
    pub bytes: u64,
    /// CRC-32 of its bytes.
    pub crc32: u32,
}

/// A piece of the work.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub(crate) struct Tile {
    /// The smallest and the largest x and y in `map`, meters.
    pub box_m: [[f64; 2]; 2],
    /// Margin that is searched with it, meters.
    pub halo_m: f64,
    /// Points in the box.
    pub points: usize,
    /// Its blocks among all.
    pub blocks: Vec<usize>,
    /// CRC-32 of the file with its points.
    pub crc32: u32,
}

/// The name of the file with a tile's points.
pub(crate) fn points_name(index: usize) -> String {
    format!("{index:05}.points")
}

/// The name of the file with what was found in a tile.
pub(crate) fn found_name(index: usize) -> String {
    format!("{index:05}.found")
}
