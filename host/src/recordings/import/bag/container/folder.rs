//! A bag of ROS 2: a folder with `metadata.yaml` and its data files. Of the YAML only the list of files is
//! wanted; a folder without it is read by the numbers in the files' names.

use std::fs;
use std::io;
use std::path::{Path, PathBuf};

use super::losses::Losses;
use crate::recordings::import::bag::error::BagError;

const ENDINGS: [&str; 4] = [".db3", ".mcap", ".db3.zstd", ".mcap.zstd"];
/// A description longer than this is none, bytes.
const LONGEST_DESCRIPTION: u64 = 1 << 22;

/// The data files of a folder in the order of recording.
pub(crate) fn files(folder: &Path, losses: &mut Losses) -> Result<Vec<PathBuf>, BagError> {
    let failed = |source| BagError::Read { path: folder.to_owned(), source };
    let mut present = Vec::new();
    for entry in fs::read_dir(folder).map_err(failed)? {
        let name = entry.map_err(failed)?.file_name().to_string_lossy().into_owned();
        if ENDINGS.iter().any(|ending| name.ends_with(ending)) {
            present.push(name);
        }
    }
    present.sort_by_key(|name| (number_of(name), name.clone()));
    let listed = listed(folder).unwrap_or_default();
    for name in listed.iter().filter(|name| !present.contains(name)) {
        losses.add(folder, &format!("metadata.yaml lists {name}, which is not there"));
    }
    let mut names: Vec<String> = listed.into_iter().filter(|name| present.contains(name)).collect();
    if names.is_empty() {
        names = present;
    }
    if names.is_empty() {
        let what = "holds no .db3 and no .mcap file";
        let source = io::Error::new(io::ErrorKind::NotFound, what);
        return Err(failed(source));
    }
    Ok(names.into_iter().map(|name| folder.join(name)).collect())
}

/// The last number in a file's name: `bag_10.db3` comes after `bag_2.db3`.
fn number_of(name: &str) -> u64 {
    let stem = ENDINGS.iter().find_map(|ending| name.strip_suffix(ending)).unwrap_or(name);
    let digits = stem.rsplit(|c: char| !c.is_ascii_digit()).next().unwrap_or_default();
    digits.parse().unwrap_or(u64::MAX)
}

/// The files that `metadata.yaml` lists, without folders: older ones lead from the folder above. A packed
/// file is listed under its packed name.
fn listed(folder: &Path) -> Option<Vec<String>> {
    let path = folder.join("metadata.yaml");
    if fs::metadata(&path).ok()?.len() > LONGEST_DESCRIPTION {
        return None;
    }
    let text = fs::read_to_string(path).ok()?;
    let mut lines = text.lines().skip_while(|line| line.trim() != "relative_file_paths:");
    lines.next()?;
    let items = lines.map_while(|line| line.trim().strip_prefix("- "));
    let name = |item: &str| {
        let item = item.trim().trim_matches(['"', '\'']);
        Path::new(item).file_name().map(|name| name.to_string_lossy().into_owned())
    };
    Some(items.filter_map(name).collect())
}
