//! The shape of the tree: entries of a folder, one style of modules, fields of a struct, widths of lines.

use std::fs;
use std::path::{Path, PathBuf};

/// Entries that a folder of sources may have.
const FOLDER_ENTRIES: usize = 12;
/// Fields that a struct may have.
const STRUCT_FIELDS: usize = 15;
/// Larger ones, and why: nothing may be added to this list.
const LARGE: [(&str, &str); 1] = [("SerialStruct", "the kernel's own layout")];
/// Columns of a line, comments included.
const COLUMNS: usize = 110;
/// Folders whose subfolders hold sources.
const TREES: [&str; 5] = ["protocol", "firmware", "host", "hil-fixtures", "tests"];
/// Folders of data, where each entry is one case.
const DATA: [&str; 4] =
    ["tests/fuzz/corpus", "hil-fixtures/captures", "hil-fixtures/worlds", "firmware/onboard/packaging"];

fn root() -> PathBuf {
    PathBuf::from(env!("CARGO_MANIFEST_DIR")).join("..")
}

fn folders(below: &Path, found: &mut Vec<PathBuf>) {
    let name = below.file_name().unwrap_or_default();
    let is_data = DATA.iter().any(|data| below.ends_with(data));
    if name == "target" || name == "node_modules" || name == "__pycache__" || is_data {
        return;
    }
    found.push(below.to_owned());
    for entry in fs::read_dir(below).unwrap() {
        let path = entry.unwrap().path();
        if path.is_dir() {
            folders(&path, found);
        }
    }
}

fn all_folders() -> Vec<PathBuf> {
    let mut found = Vec::new();
    for tree in TREES {
        folders(&root().join(tree), &mut found);
    }
    assert!(found.len() > 50, "only {} folders found", found.len());
    found
}

fn entries(folder: &Path) -> Vec<PathBuf> {
    let generated = ["target", "node_modules", "__pycache__", ".ruff_cache"];
    let entries = fs::read_dir(folder).unwrap().map(|entry| entry.unwrap().path());
    entries.filter(|path| !generated.iter().any(|name| path.ends_with(name))).collect()
}

/// All sources with their text, test modules included.
fn sources() -> Vec<(PathBuf, String)> {
    let files = all_folders().into_iter().flat_map(|folder| entries(&folder));
    let rust = files.filter(|path| path.extension().is_some_and(|extension| extension == "rs"));
    rust.map(|path| (path.clone(), fs::read_to_string(&path).unwrap())).collect()
}

#[test]
fn no_folder_has_too_many_entries() {
    let full = all_folders().into_iter().map(|folder| (entries(&folder).len(), folder));
    let full: Vec<_> = full.filter(|(count, _)| *count > FOLDER_ENTRIES).collect();
    assert!(full.is_empty(), "over {FOLDER_ENTRIES} entries: {full:#?}");
}

#[test]
fn a_module_with_children_is_a_folder_with_a_mod_file() {
    for (path, _) in
        sources().iter().filter(|(path, _)| path.components().any(|part| part.as_os_str() == "src"))
    {
        let folder = path.with_extension("");
        let is_test_program = folder.join("main.rs").exists();
        assert!(!folder.is_dir() || is_test_program, "{} stands beside its folder", path.display());
    }
}

/// Name and number of fields of each struct with named fields.
fn structs(text: &str) -> Vec<(String, usize)> {
    let mut found = Vec::new();
    let mut lines = text.lines();
    while let Some(line) = lines.next() {
        let words: Vec<&str> = line.split(|c: char| !c.is_alphanumeric() && c != '_').collect();
        let Some(at) = words.iter().position(|word| *word == "struct") else { continue };
        if line.trim_start().starts_with("//") || !line.ends_with('{') {
            continue;
        }
        let indent = line.len() - line.trim_start().len();
        let end = format!("{}}}", " ".repeat(indent));
        let is_field = |line: &&str| {
            let shallow = line.len() - line.trim_start().len() == indent + 4;
            let named = line.trim_start().split(':').next().is_some_and(|name| {
                name.split(' ').next_back().is_some_and(|name| {
                    !name.is_empty() && name.chars().all(|c| c.is_alphanumeric() || c == '_')
                })
            });
            shallow && named && line.contains(':') && !line.trim_start().starts_with("//")
        };
        let fields = lines.by_ref().take_while(|line| *line != end).filter(is_field).count();
        found.push((words[at + 1].to_owned(), fields));
    }
    found
}

#[test]
fn no_struct_has_too_many_fields() {
    let mut large = Vec::new();
    for (path, text) in sources() {
        let over = structs(&text).into_iter().filter(|(name, fields)| {
            *fields > STRUCT_FIELDS && !LARGE.iter().any(|(large, _)| large == name)
        });
        large.extend(over.map(|(name, fields)| format!("{}: {name} has {fields}", path.display())));
    }
    assert!(large.is_empty(), "over {STRUCT_FIELDS} fields:\n{}", large.join("\n"));
}

#[test]
fn no_line_is_too_long() {
    let mut long = Vec::new();
    for (path, text) in sources() {
        for (at, line) in text.lines().enumerate() {
            // A text that has to stand as it is cannot be broken; rustfmt leaves it as well.
            let is_text =
                line.contains('"') || line.contains("://") || line.trim_start().starts_with("//! |");
            if line.chars().count() > COLUMNS && !is_text && !is_inside_text(&text, at) {
                long.push(format!("{}:{}: {} columns", path.display(), at + 1, line.chars().count()));
            }
        }
    }
    assert!(long.is_empty(), "{} too long:\n{}", long.len(), long.join("\n"));
}

/// Whether a line stands inside a string that began on an earlier line: an odd number of quotes before it.
fn is_inside_text(text: &str, line: usize) -> bool {
    let code = text.lines().take(line).filter(|line| !line.trim_start().starts_with("//"));
    let quotes: usize =
        code.map(|line| line.replace("\\\"", "").replace("'\"'", "").matches('"').count()).sum();
    quotes % 2 == 1
}
