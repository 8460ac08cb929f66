//! Which file takes names from which, read as text: no circles, no arrow to a floor above, no input or output
//! where none belongs.
//!
//! A path such as `crate::scan::Beam` leads to the file that defines `Beam`, also through `pub use`. A `pub
//! use` is a facade and no arrow of its own. Test modules are left out.

use std::collections::{BTreeMap, BTreeSet};
use std::fs;
use std::path::{Path, PathBuf};

use crate::architecture::floors::{CRATES, Crate, WITHOUT_IO};

/// One source file: its module path, its text without tests and comments, what it re-exports.
struct Module {
    file: PathBuf,
    code: String,
    /// Name as others see it -> path as written.
    reexports: Vec<(String, Vec<String>)>,
}

type Modules = BTreeMap<Vec<String>, Module>;

fn root() -> PathBuf {
    PathBuf::from(env!("CARGO_MANIFEST_DIR")).join("..")
}

fn collect(folder: &Path, files: &mut Vec<PathBuf>) {
    for entry in fs::read_dir(folder).unwrap() {
        let path = entry.unwrap().path();
        let name = path.file_name().unwrap().to_string_lossy().into_owned();
        if path.is_dir() && name != "tests" && name != "bin" {
            collect(&path, files);
        } else if name.ends_with(".rs") && name != "tests.rs" && !name.ends_with("_tests.rs") {
            files.push(path);
        }
    }
}

/// The text without comments and without the test module at its end.
fn code(text: &str) -> String {
    let is_inline = |at: &usize| {
        let declaration = text[*at..].lines().nth(1).unwrap_or_default();
        declaration.contains("mod ") && declaration.ends_with('{')
    };
    let tests = text.match_indices("#[cfg(test)]\n").map(|(at, _)| at).find(is_inline);
    let lines = text[..tests.unwrap_or(text.len())].lines();
    let code = lines.filter(|line| !line.trim_start().starts_with("//"));
    code.fold(String::new(), |all, line| all + line.split(" //").next().unwrap_or_default() + "\n")
}

/// The leaves of a `use` tree as paths; an alias counts as the name of its last part.
fn leaves(tree: &str, prefix: &[String], found: &mut Vec<(Vec<String>, String)>) {
    let tree = tree.trim();
    if let Some(open) = tree.find('{') {
        let mut longer = prefix.to_vec();
        longer.extend(parts(&tree[..open]));
        let inside = &tree[open + 1..tree.rfind('}').unwrap_or(tree.len())];
        let (mut depth, mut start) = (0, 0);
        for (at, character) in inside.char_indices() {
            match character {
                '{' => depth += 1,
                '}' => depth -= 1,
                ',' if depth == 0 => {
                    leaves(&inside[start..at], &longer, found);
                    start = at + 1;
                }
                _ => {}
            }
        }
        leaves(&inside[start..], &longer, found);
    } else if !tree.is_empty() {
        let (path, alias) = tree.split_once(" as ").unwrap_or((tree, ""));
        let mut whole = prefix.to_vec();
        whole.extend(parts(path));
        if whole.last().is_some_and(|last| last == "self") {
            whole.pop();
        }
        let name = if alias.is_empty() {
            whole.last().cloned().unwrap_or_default()
        } else {
            alias.trim().to_owned()
        };
        found.push((whole, name));
    }
}

fn parts(path: &str) -> Vec<String> {
    path.split("::").map(|part| part.trim().to_owned()).filter(|part| !part.is_empty()).collect()
}

/// The statements `use ...;` of a text: whether each is public, and its tree.
fn uses(code: &str) -> Vec<(bool, String)> {
    let mut found = Vec::new();
    let mut rest = code;
    while let Some(at) = rest.find("use ") {
        let line = rest[..at].rsplit('\n').next().unwrap_or_default().trim();
        let is_statement = line.is_empty() || line.starts_with("pub");
        let end = rest[at..].find(';').map_or(rest.len(), |length| at + length);
        if is_statement && !line.contains('=') {
            found.push((!line.is_empty(), rest[at + 4..end].to_owned()));
        }
        rest = &rest[if is_statement { end } else { at + 4 }..];
    }
    found
}

fn modules(source: &Path) -> Modules {
    let mut files = Vec::new();
    collect(source, &mut files);
    let mut all = Modules::new();
    for file in files {
        let below = file.strip_prefix(source).unwrap().with_extension("");
        let mut path: Vec<String> = below.iter().map(|part| part.to_string_lossy().into_owned()).collect();
        if path.last().is_some_and(|last| last == "main") {
            continue;
        }
        if path.last().is_some_and(|last| last == "mod" || last == "lib") {
            path.pop();
        }
        let code = code(&fs::read_to_string(&file).unwrap());
        let mut reexports = Vec::new();
        for (_, tree) in uses(&code).into_iter().filter(|(public, _)| *public) {
            let mut found = Vec::new();
            leaves(&tree, &[], &mut found);
            reexports.extend(found.into_iter().map(|(path, name)| (name, path)));
        }
        all.insert(path, Module { file, code, reexports });
    }
    all
}

/// A path as written in a module, from the crate's root; nothing where it leads out of the crate.
fn absolute(modules: &Modules, here: &[String], written: &[String]) -> Option<Vec<String>> {
    let first = written.first()?.as_str();
    if first == "crate" || first == "$crate" {
        return Some(written[1..].to_vec());
    }
    let supers = written.iter().take_while(|part| *part == "super").count();
    if supers > 0 || first == "self" {
        let kept = here.len().checked_sub(supers)?;
        let skipped = supers.max(1);
        return Some([&here[..kept], &written[skipped..]].concat());
    }
    let child = [here, &written[..1]].concat();
    modules.contains_key(&child).then(|| [here, written].concat())
}

/// The module that defines what a path names, behind any `pub use`.
fn definition(modules: &Modules, path: &[String], depth: usize) -> Option<Vec<String>> {
    let at = (0..=path.len()).rev().find(|&length| modules.contains_key(&path[..length]))?;
    let module = path[..at].to_vec();
    let Some(name) = path.get(at).filter(|_| depth < 8) else { return Some(module) };
    let forwarded = modules[&module].reexports.iter().find(|(seen, _)| seen == name);
    match forwarded.and_then(|(_, written)| absolute(modules, &module, written)) {
        Some(target) => definition(modules, &target, depth + 1),
        None => Some(module),
    }
}

/// Paths that begin with `crate::`, `super::` or `self::` anywhere in an expression or type.
fn inline_paths(code: &str) -> Vec<Vec<String>> {
    let mut found = Vec::new();
    for start in ["crate::", "super::", "self::"] {
        for (at, _) in code.match_indices(start) {
            let before = code[..at].chars().next_back();
            if before.is_some_and(|c| c.is_alphanumeric() || c == '_' || c == ':') {
                continue;
            }
            let end = code[at..].find(|c: char| !c.is_alphanumeric() && c != '_' && c != ':');
            found.push(parts(&code[at..end.map_or(code.len(), |length| at + length)]));
        }
    }
    found
}

/// For each module the modules that it takes names from.
fn arrows(modules: &Modules) -> BTreeMap<Vec<String>, BTreeSet<Vec<String>>> {
    let mut all = BTreeMap::new();
    for (here, module) in modules {
        let mut paths = Vec::new();
        let mut rest = module.code.clone();
        for (is_public, tree) in uses(&module.code) {
            rest = rest.replace(&format!("use {tree};"), "");
            if !is_public {
                let mut found = Vec::new();
                leaves(&tree, &[], &mut found);
                paths.extend(found.into_iter().map(|(path, _)| path));
            }
        }
        paths.extend(inline_paths(&rest));
        let to: BTreeSet<Vec<String>> = paths
            .iter()
            .filter_map(|written| absolute(modules, here, written))
            .filter_map(|path| definition(modules, &path, 0))
            .filter(|target| target != here && !(target.is_empty() && here.is_empty()))
            .collect();
        all.insert(here.clone(), to);
    }
    all
}

/// Groups of modules that reach each other, each with more than one (plain reachability: the graphs are
/// small).
fn circles(arrows: &BTreeMap<Vec<String>, BTreeSet<Vec<String>>>) -> Vec<Vec<String>> {
    let reach = |from: &Vec<String>| {
        let mut seen = BTreeSet::new();
        let mut open: Vec<&Vec<String>> = arrows[from].iter().collect();
        while let Some(next) = open.pop() {
            if seen.insert(next.clone()) {
                open.extend(arrows.get(next).into_iter().flatten());
            }
        }
        seen
    };
    let reached: BTreeMap<&Vec<String>, BTreeSet<Vec<String>>> =
        arrows.keys().map(|module| (module, reach(module))).collect();
    let mut groups: BTreeSet<Vec<String>> = BTreeSet::new();
    for (module, to) in reached.iter().filter(|(module, to)| to.contains(**module)) {
        let group = to.iter().filter(|other| reached.get(other).is_some_and(|back| back.contains(*module)));
        groups.insert(group.map(|part| part.join("::")).collect());
    }
    groups.into_iter().collect()
}

fn checked(krate: &Crate) -> (Modules, BTreeMap<Vec<String>, BTreeSet<Vec<String>>>) {
    let modules = modules(&root().join(krate.source));
    assert!(!modules.is_empty(), "{} has no sources", krate.source);
    let arrows = arrows(&modules);
    (modules, arrows)
}

#[test]
fn no_files_take_names_from_each_other() {
    let mut found = Vec::new();
    for krate in CRATES {
        let (_, arrows) = checked(krate);
        for circle in circles(&arrows) {
            let ties = arrows
                .iter()
                .flat_map(|(from, to)| to.iter().map(move |to| (from.join("::"), to.join("::"))));
            let ties: Vec<String> = ties
                .filter(|(from, to)| circle.contains(from) && circle.contains(to))
                .map(|(from, to)| format!("\n    {from} -> {to}"))
                .collect();
            found.push(format!("{}: {} files{}", krate.source, circle.len(), ties.concat()));
        }
    }
    assert!(found.is_empty(), "{} circles\n{}", found.len(), found.join("\n"));
}

#[test]
fn no_name_is_taken_from_a_floor_above() {
    let mut found = Vec::new();
    for krate in CRATES {
        let (modules, arrows) = checked(krate);
        let floor = |module: &[String]| {
            let top = module.first()?;
            krate.floors.iter().position(|floor| floor.contains(&top.as_str()))
        };
        for (from, targets) in arrows.iter().filter(|(from, _)| !from.is_empty()) {
            let Some(own) = floor(from) else {
                found.push(format!("{}: {} stands on no floor", krate.source, from[0]));
                continue;
            };
            for to in targets.iter().filter(|to| floor(to).is_some_and(|other| other > own)) {
                found.push(format!(
                    "{} -> {}::{}",
                    modules[from].file.display(),
                    krate.source,
                    to.join("::")
                ));
            }
        }
    }
    assert!(found.is_empty(), "{} arrows up\n{}", found.len(), found.join("\n"));
}

#[test]
fn state_machines_have_no_input_or_output() {
    let banned = [
        "std::fs",
        "std::net",
        "std::thread",
        "std::process",
        "std::io",
        "rustix",
        "serialport",
        "biplane_clock",
        "libc",
    ];
    for folder in WITHOUT_IO {
        let mut files = Vec::new();
        collect(&root().join(folder), &mut files);
        assert!(!files.is_empty(), "{folder} is not there");
        for file in files {
            let code = code(&fs::read_to_string(&file).unwrap());
            for word in banned {
                assert!(!code.contains(word), "{} uses {word}", file.display());
            }
        }
    }
}

#[test]
fn a_circle_through_a_facade_is_found() {
    let folder = std::env::temp_dir().join(format!("biplane-imports-{}", std::process::id()));
    fs::create_dir_all(folder.join("a")).unwrap();
    for (file, text) in [
        ("lib.rs", "//! Root.\nmod a;\nmod b;\npub use a::One;\n"),
        ("a/mod.rs", "//! Facade.\nmod inner;\npub use inner::One;\n"),
        ("a/inner.rs", "//! Takes from b.\nuse crate::b::{Two, Three};\npub struct One(Two);\n"),
        ("b.rs", "//! Takes from a, by an expression.\npub struct Two;\nfn f(_: &crate::One) {}\n"),
    ] {
        fs::write(folder.join(file), text).unwrap();
    }
    let found = circles(&arrows(&modules(&folder)));
    fs::remove_dir_all(&folder).unwrap();
    assert_eq!(found, [["a::inner".to_owned(), "b".to_owned()]]);
}
