//! All files that one run writes, looked at before it begins: none may be an input, none another output, and
//! none may be there already, unless it may be replaced.

use std::path::{Path, PathBuf};

use super::WriteError;
use super::parts::part_of;
use super::target::{active_path, is_being_written, is_same_file, with_suffix};

/// Refuses outputs that would destroy what the run reads, or one another, under their own names or those
/// that they have until they are finished. Refuses an output that is there, unless `overwrite` is set.
///
/// Whoever writes a recording asks [`PartsWriter::check`](super::PartsWriter::check) besides, which knows
/// more about unfinished ones.
///
/// # Errors
/// [`WriteError::IsInput`], [`WriteError::IsOutput`], [`WriteError::NotAFile`], [`WriteError::BeingWritten`]
/// and [`WriteError::Exists`].
pub fn check_outputs(outputs: &[&Path], inputs: &[PathBuf], overwrite: bool) -> Result<(), WriteError> {
    check_apart(outputs)?;
    for output in outputs {
        let path = || (*output).to_owned();
        if let Some(input) = inputs.iter().find(|input| names(output).iter().any(|n| is_same_file(n, input)))
        {
            return Err(WriteError::IsInput { path: path(), input: input.clone() });
        }
        if output.is_dir() {
            return Err(WriteError::NotAFile { path: path() });
        }
        if let Some(path) = names(output).into_iter().find(|name| is_being_written(name)) {
            return Err(WriteError::BeingWritten { path });
        }
        if !overwrite && (output.is_file() || output.is_symlink() && !output.exists()) {
            return Err(WriteError::Exists { path: path() });
        }
    }
    Ok(())
}

/// Refuses two outputs that come to be one file.
///
/// # Errors
/// [`WriteError::IsOutput`].
pub fn check_apart(outputs: &[&Path]) -> Result<(), WriteError> {
    for (number, output) in outputs.iter().enumerate() {
        if outputs[..number].iter().any(|other| is_one(output, other)) {
            return Err(WriteError::IsOutput { path: (*output).to_owned() });
        }
    }
    Ok(())
}

/// An output's name, and those that it may have until it is finished. A device or a pipe is written to as it
/// is.
fn names(output: &Path) -> Vec<PathBuf> {
    let mut names = vec![output.to_owned()];
    if !output.exists() || output.is_file() {
        names.extend([active_path(output), with_suffix(output, ".part")]);
    }
    names
}

/// Whether two outputs come to be one file: a name of one is a name of the other, or of a part of the other.
fn is_one(one: &Path, other: &Path) -> bool {
    let whole = |path: &Path| part_of(path).map(|(whole, _)| whole);
    let [ones, others] = [names(one), names(other)];
    ones.iter().any(|one| others.iter().any(|other| is_same_file(one, other)))
        || whole(one).is_some_and(|one| is_same_file(&one, other))
        || whole(other).is_some_and(|other| is_same_file(one, &other))
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::fs;

    fn scratch(name: &str) -> PathBuf {
        let path = std::env::temp_dir().join(format!("biplane-outputs-{}-{name}", std::process::id()));
        let _ = fs::remove_dir_all(&path);
        fs::create_dir_all(path.join("inner")).unwrap();
        path
    }

    #[test]
    fn an_output_is_no_input_under_whatever_name_even_when_it_may_be_replaced() {
        let folder = scratch("input");
        let input = folder.join("a.mcap");
        fs::write(&input, "read").unwrap();
        fs::write(folder.join("b.mcap.active"), "read").unwrap();
        std::os::unix::fs::symlink(&input, folder.join("soft")).unwrap();
        fs::hard_link(&input, folder.join("hard")).unwrap();
        let inputs = [input, folder.join("b.mcap.active")];
        for name in ["a.mcap", "inner/../a.mcap", "soft", "hard", "b.mcap"] {
            let found = check_outputs(&[&folder.join(name)], &inputs, true);
            assert!(matches!(found, Err(WriteError::IsInput { .. })), "{name}: {found:?}");
        }
        assert!(check_outputs(&[&folder.join("c.mcap")], &inputs, false).is_ok());
        fs::remove_dir_all(folder).unwrap();
    }

    #[test]
    fn two_outputs_are_two_files_also_before_they_are_there() {
        let folder = scratch("output");
        let output = folder.join("a.mcap");
        for (name, is_one) in [
            ("a.mcap", true),
            ("inner/../a.mcap", true),
            ("a.mcap.active", true),
            ("a_3.mcap", true),
            ("a_x.mcap", false),
            ("b.mcap", false),
            ("inner/a.mcap", false),
        ] {
            for pair in [[&output, &folder.join(name)], [&folder.join(name), &output]] {
                let found = check_outputs(&pair.map(PathBuf::as_path), &[], true);
                assert_eq!(matches!(found, Err(WriteError::IsOutput { .. })), is_one, "{name}: {found:?}");
                assert_eq!(found.is_ok(), !is_one, "{name}");
            }
        }
        let null = Path::new("/dev/null");
        assert!(check_outputs(&[null, null], &[], false).is_ok(), "nothing is lost there");
        fs::remove_dir_all(folder).unwrap();
    }

    #[test]
    fn what_is_there_is_replaced_when_asked_and_a_folder_never() {
        let folder = scratch("there");
        let (table, link) = (folder.join("t.csv"), folder.join("link"));
        fs::write(&table, "somebody's").unwrap();
        std::os::unix::fs::symlink("/nowhere/t.csv", &link).unwrap();
        for path in [&table, &link] {
            let found = check_outputs(&[path], &[], false);
            assert!(matches!(found, Err(WriteError::Exists { .. })), "{found:?}");
            assert!(check_outputs(&[path], &[], true).is_ok());
        }
        let found = check_outputs(&[&folder.join("inner")], &[], true);
        assert!(matches!(found, Err(WriteError::NotAFile { .. })), "{found:?}");
        fs::remove_dir_all(folder).unwrap();
    }
}
