//! Signals as flags, and what becomes of an output when its process has to end at once.

use std::path::{Path, PathBuf};
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::{Arc, Mutex, PoisonError};
use std::thread;

use signal_hook::consts::{SIGHUP, SIGINT, SIGTERM, SIGUSR1};
use signal_hook::iterator::Signals;

use crate::types::error::OnboardError;

fn refused(source: std::io::Error) -> OnboardError {
    OnboardError::System { what: "catch signals", source }
}

/// What becomes of an unfinished recording when memory runs out.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Remains {
    /// It holds what nobody can have again.
    Kept,
    /// The same command makes it again.
    Removed,
}

/// The output of this process, and the unfinished files of its name that were there before.
#[derive(Debug)]
struct Output {
    path: PathBuf,
    remains: Remains,
    older: Vec<PathBuf>,
}

static OUTPUT: Mutex<Option<Output>> = Mutex::new(None);

/// For [`biplane_cli::clean_up_by`].
pub(crate) fn clean_up() -> String {
    // Taken out, so that nothing waits for the lock.
    let output = OUTPUT.lock().unwrap_or_else(PoisonError::into_inner).take();
    match output {
        Some(output) if output.remains == Remains::Removed => {
            let ours = unfinished(&output.path).into_iter().filter(|path| !output.older.contains(path));
            ours.for_each(|path| drop(std::fs::remove_file(path)));
            NOTHING_REMAINS.to_owned()
        }
        Some(output) => what_remains(&output.path),
        None => NOTHING_REMAINS.to_owned(),
    }
}

/// A flag that SIGINT and SIGTERM set; the second signal ends the process at once, with exit code 1 and a
/// word on what remains of the `output`. `remains` is for memory that runs out.
pub(crate) fn stop(output: &Path, remains: Remains) -> Result<Arc<AtomicBool>, OnboardError> {
    let ours = Output { path: output.to_owned(), remains, older: unfinished(output) };
    *OUTPUT.lock().unwrap_or_else(PoisonError::into_inner) = Some(ours);
    let stop = Arc::new(AtomicBool::new(false));
    let mut signals = Signals::new([SIGINT, SIGTERM]).map_err(refused)?;
    let (flag, output) = (Arc::clone(&stop), output.to_owned());
    let watch = move || {
        for _ in signals.forever() {
            if flag.swap(true, Ordering::Relaxed) {
                super::say(&format!("\nbiplane-onboard: {}", last_words(&output)));
                std::process::exit(1);
            }
        }
    };
    thread::Builder::new()
        .name("signals".to_owned())
        .spawn(watch)
        .map_err(|source| OnboardError::System { what: "start the thread for signals", source })?;
    Ok(stop)
}

/// What a run that was ended at once leaves.
fn last_words(output: &Path) -> String {
    format!("ended at once by a second signal; {}", what_remains(output))
}

const NOTHING_REMAINS: &str = "nothing unfinished remains";

fn what_remains(output: &Path) -> String {
    let remains = unfinished(output);
    if remains.is_empty() {
        return NOTHING_REMAINS.to_owned();
    }
    let saved: Vec<_> = remains
        .iter()
        .map(|active| {
            let (active, whole) = (active.display(), active.with_extension(""));
            format!("{active} remains: `biplane recover {active} -o {}` saves what is in it", whole.display())
        })
        .collect();
    saved.join("; ")
}

/// The unfinished file of an output, or of its part.
fn unfinished(output: &Path) -> Vec<PathBuf> {
    let folder = output.parent().filter(|folder| !folder.as_os_str().is_empty()).unwrap_or(Path::new("."));
    let (Some(name), Some(stem)) = (output.file_name(), output.file_stem()) else { return Vec::new() };
    let (name, stem) = (name.to_string_lossy(), stem.to_string_lossy());
    let is_ours = |found: &str| {
        let Some(finished) = found.strip_suffix(".active") else { return false };
        let part = finished.strip_prefix(&*stem).and_then(|rest| rest.strip_prefix('_'));
        finished == name || part.is_some_and(|rest| rest.starts_with(|letter: char| letter.is_ascii_digit()))
    };
    let entries = std::fs::read_dir(folder).into_iter().flatten().flatten();
    entries
        .filter(|entry| is_ours(&entry.file_name().to_string_lossy()))
        .map(|entry| output.with_file_name(entry.file_name()))
        .collect()
}

/// A flag that SIGUSR1 sets.
pub(crate) fn rotate() -> Result<Arc<AtomicBool>, OnboardError> {
    let rotate = Arc::new(AtomicBool::new(false));
    signal_hook::flag::register(SIGUSR1, Arc::clone(&rotate)).map_err(refused)?;
    Ok(rotate)
}

/// The process goes on when its terminal goes away (SIGHUP).
pub(crate) fn outlive_terminal() -> Result<(), OnboardError> {
    signal_hook::flag::register(SIGHUP, Arc::default()).map_err(refused)?;
    Ok(())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn who_ends_a_run_at_once_is_told_what_remains_of_it() {
        let folder = std::env::temp_dir().join(format!("biplane-last-words-{}", std::process::id()));
        std::fs::create_dir_all(&folder).unwrap();
        let output = folder.join("run.mcap");
        assert!(last_words(&output).ends_with("nothing unfinished remains"));
        for (name, is_ours) in [
            ("run.mcap.active", true),
            ("run_3.mcap.active", true),
            ("runner.mcap.active", false),
            ("run_3.mcap", false),
        ] {
            std::fs::write(folder.join(name), "").unwrap();
            let reported = last_words(&output);
            assert_eq!(reported.contains("biplane recover"), is_ours, "{name}: {reported}");
            std::fs::remove_file(folder.join(name)).unwrap();
        }
        std::fs::remove_dir(folder).unwrap();
    }
}
