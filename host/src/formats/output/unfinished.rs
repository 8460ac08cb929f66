//! What this process has begun and not finished. Whoever ends the process in the middle of its work (a
//! signal, too little memory) takes away what is of no use, and says what is kept.

use std::fs;
use std::path::{Path, PathBuf};
use std::sync::{Mutex, MutexGuard, PoisonError};

/// So many things are unfinished at one time: a demo's folder, a build's in it, a file in that. What comes
/// beyond stays where it is.
const SLOTS: usize = 16;
/// A folder in which something is being written is removed in so many attempts.
const ATTEMPTS: u32 = 20;

#[derive(Debug)]
struct Begun {
    path: PathBuf,
    /// What the same command goes on with.
    checkpoint: Option<PathBuf>,
}

/// An array, so that nothing is allocated while it is locked: memory that is short must not lock it for ever.
#[derive(Debug)]
struct Registry(Mutex<[Option<Begun>; SLOTS]>);

static OF_THIS_PROCESS: Registry = Registry::new();

/// Something that is unfinished as long as this lives.
#[derive(Debug)]
pub(crate) struct Unfinished {
    registry: &'static Registry,
    slot: Option<usize>,
}

impl Unfinished {
    /// A file or folder that nobody can use before it is finished.
    pub(crate) fn new(path: &Path) -> Self {
        OF_THIS_PROCESS.begin(path, None)
    }

    /// The same with a checkpoint: when that holds something, all of it is kept.
    pub(crate) fn with_checkpoint(path: &Path, checkpoint: &Path) -> Self {
        OF_THIS_PROCESS.begin(path, Some(checkpoint))
    }
}

impl Drop for Unfinished {
    fn drop(&mut self) {
        let begun = self.slot.and_then(|slot| self.registry.slots()[slot].take());
        drop(begun);
    }
}

/// Removes what this process has not finished, and says what is kept.
pub(crate) fn clean_up() -> String {
    OF_THIS_PROCESS.clean_up()
}

impl Registry {
    const fn new() -> Self {
        Self(Mutex::new([const { None }; SLOTS]))
    }

    fn slots(&self) -> MutexGuard<'_, [Option<Begun>; SLOTS]> {
        self.0.lock().unwrap_or_else(PoisonError::into_inner)
    }

    fn begin(&'static self, path: &Path, checkpoint: Option<&Path>) -> Unfinished {
        let begun = Begun { path: path.to_owned(), checkpoint: checkpoint.map(Path::to_owned) };
        let mut slots = self.slots();
        let slot = slots.iter().position(Option::is_none);
        if let Some(slot) = slot {
            slots[slot] = Some(begun);
        }
        Unfinished { registry: self, slot }
    }

    fn clean_up(&self) -> String {
        let begun = std::mem::replace(&mut *self.slots(), [const { None }; SLOTS]);
        let mut kept = Vec::new();
        for begun in begun.into_iter().flatten() {
            if begun.checkpoint.as_deref().is_some_and(holds_answers) {
                kept.push(begun.path.display().to_string());
            } else if !remove(&begun.path) {
                return format!("{} is of no use and could not be removed", begun.path.display());
            }
        }
        match &kept[..] {
            [] => "nothing unfinished is kept".to_owned(),
            kept => format!("the same command goes on with what is in {}", kept.join(", ")),
        }
    }
}

/// Whether a checkpoint (`slam::loop_closure::checkpoint`) has more than its first line, which says what it
/// belongs to.
fn holds_answers(checkpoint: &Path) -> bool {
    fs::read(checkpoint).is_ok_and(|text| text.iter().filter(|byte| **byte == b'\n').count() > 1)
}

/// Whether nothing is there any more. Another thread may still be writing into it.
fn remove(path: &Path) -> bool {
    for _ in 0..ATTEMPTS {
        let removed = if path.is_dir() { fs::remove_dir_all(path) } else { fs::remove_file(path) };
        if removed.is_ok() || path.symlink_metadata().is_err() {
            return true;
        }
    }
    false
}

#[cfg(test)]
mod tests {
    use super::*;

    static REGISTRY: Registry = Registry::new();

    #[test]
    fn what_can_go_on_is_kept_and_the_rest_is_removed() {
        let folder = std::env::temp_dir().join(format!("biplane-unfinished-{}", std::process::id()));
        fs::create_dir_all(folder.join("out.part")).unwrap();
        let checkpoint = folder.join("out.part/.searches");
        let (finished, half) = (folder.join("finished"), folder.join("half"));
        for (path, text) in [(&checkpoint, "job\n[1]\n"), (&finished, "all"), (&half, "ha")] {
            fs::write(path, text).unwrap();
        }
        assert!(holds_answers(&checkpoint));
        drop(REGISTRY.begin(&finished, None));
        let begun = [
            REGISTRY.begin(&folder.join("out.part"), Some(&checkpoint)),
            REGISTRY.begin(&half, None),
            REGISTRY.begin(&folder.join("never made"), None),
        ];
        let words = REGISTRY.clean_up();
        assert!(words.starts_with("the same command goes on") && words.contains("out.part"), "{words}");
        assert!(finished.exists() && checkpoint.exists() && !half.exists());
        drop(begun);

        fs::write(&checkpoint, "job\n").unwrap();
        let _begun = REGISTRY.begin(&folder.join("out.part"), Some(&checkpoint));
        assert_eq!(REGISTRY.clean_up(), "nothing unfinished is kept");
        assert!(!folder.join("out.part").exists());
        fs::remove_dir_all(folder).unwrap();
    }
}
