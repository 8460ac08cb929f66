//! A folder of tiles: its manifest, and what is in the files of a tile.

use std::fs::{self, File};
use std::io::{Read, Write};
use std::path::{Path, PathBuf};

use crate::formats::output::unfinished::Unfinished;
use crate::model::Cloud;
use crate::pipeline::tiles::bytes::checksum;
use crate::pipeline::tiles::manifest::{FORMAT, Input, Manifest, NAME, TILES, Tile, VERSION};
use crate::pipeline::tiles::manifest::{found_name, points_name};
use crate::pipeline::tiles::{found_file, points_file};
use crate::reconstruct::planes::search::searched::Searched;
use anyhow::{Context, bail};

/// Bytes of an input that are read at a time.
const CHUNK: usize = 1 << 20;

/// An opened folder of tiles.
#[derive(Debug)]
pub(super) struct TilesFolder {
    path: PathBuf,
    /// What is in its manifest.
    pub manifest: Manifest,
    /// CRC-32 of the manifest.
    crc32: u32,
}

impl TilesFolder {
    /// Reads the manifest of a folder.
    pub(super) fn open(path: &Path) -> anyhow::Result<Self> {
        let name = path.join(NAME);
        let bytes = fs::read(&name).with_context(|| {
            format!("cannot read {}: is {} a folder of `biplane tiles plan`?", name.display(), path.display())
        })?;
        let manifest: Manifest = serde_json::from_slice(&bytes)
            .with_context(|| format!("{} is no manifest of tiles of this version", name.display()))?;
        if manifest.format != FORMAT || manifest.version != VERSION {
            bail!("{} is no manifest of tiles of this version", name.display());
        }
        let own = env!("CARGO_PKG_VERSION");
        if manifest.generator != own {
            let planned = &manifest.generator;
            bail!("{} was planned by version {planned}, and this is {own}: plan again", path.display());
        }
        Ok(Self { path: path.to_owned(), manifest, crc32: checksum(&bytes) })
    }

    /// A tile by its number.
    pub(super) fn tile(&self, index: usize) -> anyhow::Result<&Tile> {
        let count = self.manifest.tiles.len();
        let tile = self.manifest.tiles.get(index);
        tile.with_context(|| format!("there is no tile {index}: the plan has {count}, from 0 on"))
    }

    /// The blocks of a tile.
    pub(super) fn points(&self, index: usize) -> anyhow::Result<Vec<Cloud>> {
        let tile = self.tile(index)?;
        let path = self.path.join(TILES).join(points_name(index));
        let bytes = fs::read(&path).with_context(|| format!("cannot read {}", path.display()))?;
        let clouds = points_file::decode(&bytes).filter(|_| checksum(&bytes) == tile.crc32);
        let clouds = clouds.filter(|clouds| clouds.len() == tile.blocks.len());
        clouds.with_context(|| format!("{} is not what was planned: plan again", path.display()))
    }

    /// What was found in a tile; `None` when it is not finished.
    pub(super) fn found(&self, index: usize) -> Option<Vec<Searched>> {
        let bytes = fs::read(self.found_path(index)).ok()?;
        let blocks = self.manifest.tiles.get(index)?.blocks.len();
        found_file::decode(&bytes, self.key(index)).filter(|found| found.len() == blocks)
    }

    /// Keeps what was found in a tile. Whoever writes the same at the same time writes the same bytes, each
    /// under a name of its own until they are on the disk.
    pub(super) fn keep(&self, index: usize, found: &[Searched]) -> anyhow::Result<()> {
        let path = self.found_path(index);
        let part = path.with_extension(format!("found.{}.part", own_name()));
        let unfinished = Unfinished::new(&part);
        let write = || {
            let mut file = File::create(&part)?;
            file.write_all(&found_file::encode(self.key(index), found))?;
            file.sync_data()?;
            fs::rename(&part, &path)
        };
        let written = write();
        if written.is_err() {
            let _ = fs::remove_file(&part);
        }
        drop(unfinished);
        written.with_context(|| format!("cannot write {}", path.display()))
    }

    fn found_path(&self, index: usize) -> PathBuf {
        self.path.join(TILES).join(found_name(index))
    }

    /// What a tile's result belongs to: this plan, and this tile of it.
    fn key(&self, index: usize) -> u32 {
        checksum(&[self.crc32.to_le_bytes().as_slice(), &(index as u64).to_le_bytes()].concat())
    }
}

/// A name that no other process has: machine and number.
fn own_name() -> String {
    let machine = fs::read_to_string("/proc/sys/kernel/hostname").unwrap_or_default();
    format!("{}-{}", machine.trim(), std::process::id())
}

/// A file with its length and checksum.
pub(super) fn input(path: &Path) -> anyhow::Result<Input> {
    let read = || {
        let mut file = File::open(path)?;
        let (mut hasher, mut bytes, mut chunk) = (crc32fast::Hasher::new(), 0, vec![0; CHUNK]);
        loop {
            let count = file.read(&mut chunk)?;
            if count == 0 {
                return Ok(Input { path: path.to_owned(), bytes, crc32: hasher.finalize() });
            }
            hasher.update(&chunk[..count]);
            bytes += count as u64;
        }
    };
    read().map_err(|error: std::io::Error| error).with_context(|| format!("cannot read {}", path.display()))
}
