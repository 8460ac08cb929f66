//! Names of recordings in a folder that fills by itself: `run-0007-20261121T150403Z.mcap`.
//!
//! The number grows by one from run to run and orders them also where the date cannot: a machine without a
//! battery clock starts in the past until its time is set. The date is UTC at the start of the run.

use std::ffi::OsStr;
use std::io;
use std::path::{Path, PathBuf};

use biplane_clock::iso_8601;

/// `output` itself, or a new name inside it when it is a folder (one that is there, or any path that ends in
/// `/`).
///
/// # Errors
/// When the folder cannot be listed.
pub(crate) fn output(output: &Path, utc_ns: i64) -> io::Result<PathBuf> {
    let named_as_folder = output.as_os_str().as_encoded_bytes().ends_with(b"/");
    if named_as_folder || output.is_dir() { next_in(output, utc_ns) } else { Ok(output.to_owned()) }
}

fn next_in(folder: &Path, utc_ns: i64) -> io::Result<PathBuf> {
    let mut last = 0;
    for entry in std::fs::read_dir(folder)? {
        last = last.max(number(&entry?.file_name()).unwrap_or(0));
    }
    Ok(folder.join(format!("run-{:04}-{}.mcap", last.saturating_add(1), date(utc_ns))))
}

/// The number of a run; of a part of it, of an unfinished or of a damaged file as well.
fn number(name: &OsStr) -> Option<u64> {
    let (digits, _) = name.to_str()?.strip_prefix("run-")?.split_once('-')?;
    digits.parse().ok()
}

/// A time as ISO 8601 writes it in its short form, in UTC and whole seconds: `20261121T150403Z`.
fn date(utc_ns: i64) -> String {
    let long = iso_8601(utc_ns);
    let seconds = long.split('.').next().unwrap_or_default();
    seconds.chars().filter(|letter| !matches!(letter, '-' | ':')).chain(['Z']).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    const NS_PER_S: i64 = 1_000_000_000;

    #[test]
    fn dates_are_those_of_the_calendar() {
        // From `date -u -d @SECONDS +%Y%m%dT%H%M%SZ` of GNU coreutils.
        for (seconds, text) in [
            (0, "19700101T000000Z"),
            (951_782_400, "20000229T000000Z"),
            (951_868_799, "20000229T235959Z"),
            (951_868_800, "20000301T000000Z"),
            (1_709_164_799, "20240228T235959Z"),
            (1_795_273_443, "20261121T150403Z"),
            (4_107_542_399, "21000228T235959Z"),
            (4_107_542_400, "21000301T000000Z"),
        ] {
            assert_eq!(date(seconds * NS_PER_S + 999_999_999), text, "{seconds}");
        }
    }

    #[test]
    fn a_folder_gives_the_next_number_whatever_state_the_last_run_was_left_in() {
        let folder = std::env::temp_dir().join(format!("biplane-run-name-{}", std::process::id()));
        std::fs::create_dir(&folder).unwrap();
        let name = |utc_s: i64| {
            let path = output(&folder, utc_s * NS_PER_S).unwrap();
            path.file_name().unwrap().to_str().unwrap().to_owned()
        };
        assert_eq!(name(0), "run-0001-19700101T000000Z.mcap");
        for (left, next) in [
            ("run-0001-19700101T000000Z.mcap", "0002"),
            ("run-0009-19700101T000000Z_3.mcap.active", "0010"),
            ("run-12345-19700101T000000Z.mcap.damaged", "12346"),
            ("run-x-y.mcap", "12346"),
            ("walk-99999-z.mcap", "12346"),
        ] {
            std::fs::write(folder.join(left), "").unwrap();
            assert_eq!(name(60), format!("run-{next}-19700101T000100Z.mcap"), "after {left}");
        }
        std::fs::remove_dir_all(&folder).unwrap();
    }

    #[test]
    fn a_file_keeps_its_name_and_a_folder_that_is_missing_is_told() {
        assert_eq!(output(Path::new("a/run.mcap"), 0).unwrap(), Path::new("a/run.mcap"));
        assert_eq!(output(Path::new("/nowhere/"), 0).unwrap_err().kind(), io::ErrorKind::NotFound);
    }
}
