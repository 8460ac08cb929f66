//! `--force`: which folders of results may be replaced by new ones.

use std::fs;
use std::path::{Path, PathBuf};

use crate::formats::output::MARKER;
use anyhow::{Context, bail};
use serde_json::Value;

/// What the folders of a command are known by.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Known {
    /// The command, as in "no build wrote".
    pub by: &'static str,
    /// Every name that it writes.
    pub names: &'static [&'static str],
    /// A folder in it, and how names in that end.
    pub pieces: Option<(&'static str, &'static [&'static str])>,
    /// A file in JSON that is in every such folder.
    pub sign: &'static str,
    /// Whether that file is the command's.
    pub is_ours: fn(&Value) -> bool,
}

/// Refuses to replace a folder that holds what is read, or anything that the command did not write.
pub(crate) fn check(known: &Known, folder: &Path, inputs: &[PathBuf]) -> anyhow::Result<()> {
    let Ok(canonical) = folder.canonicalize() else { return Ok(()) };
    for input in inputs {
        if input.canonicalize().is_ok_and(|input| input.starts_with(&canonical)) {
            bail!("{} is read and lies in {}: name another output", input.display(), folder.display());
        }
    }
    let mut empty = true;
    for entry in fs::read_dir(folder).with_context(|| format!("cannot replace {}", folder.display()))? {
        let entry = entry?;
        empty = false;
        let name = entry.file_name();
        // A run that was killed in its last moment leaves its marker.
        let named = known.names.iter().any(|known| name == *known) || name == MARKER;
        let is_file = entry.file_type()?.is_file();
        if !(named && is_file || is_of_pieces(known, &entry.path())) {
            bail!(
                "{} holds {}, which no {} wrote; the folder is not replaced",
                folder.display(),
                entry.file_name().display(),
                known.by
            );
        }
    }
    if !empty && !is_signed(known, &folder.join(known.sign)) {
        bail!("{} holds no {} of a {}; the folder is not replaced", folder.display(), known.sign, known.by);
    }
    Ok(())
}

/// Whether this is the folder of pieces, and holds nothing else.
fn is_of_pieces(known: &Known, path: &Path) -> bool {
    let Some((_, ends)) = known.pieces.filter(|(name, _)| path.ends_with(name)) else { return false };
    let is_piece = |entry: fs::DirEntry| {
        let name = entry.file_name();
        ends.iter().any(|end| name.to_string_lossy().ends_with(end))
            && entry.file_type().is_ok_and(|kind| kind.is_file())
    };
    fs::read_dir(path).is_ok_and(|mut entries| entries.all(|entry| entry.is_ok_and(is_piece)))
}

fn is_signed(known: &Known, path: &Path) -> bool {
    let Ok(bytes) = fs::read(path) else { return false };
    serde_json::from_slice::<Value>(&bytes).is_ok_and(|value| (known.is_ours)(&value))
}
