//! The tree's own rules, read as text: file headers, file sizes, and `ARCHITECTURE.md` against the files that
//! there are.

use std::fs;
use std::path::{Path, PathBuf};

/// Lines that a source file may have before its inline test module.
const FILE_LINES: usize = 400;
/// Lines that the map may have.
const MAP_LINES: usize = 200;
/// Folders with the sources that the map describes.
const SOURCES: [&str; 10] = [
    "protocol/geometry/src",
    "protocol/clock/src",
    "protocol/cli/src",
    "protocol/wire/src",
    "protocol/recording/src",
    "protocol/ifc/src",
    "firmware/matcher/src",
    "firmware/onboard/src",
    "host/src",
    "hil-fixtures/src",
];

pub(crate) fn root() -> PathBuf {
    PathBuf::from(env!("CARGO_MANIFEST_DIR")).join("..")
}

fn collect(folder: &Path, files: &mut Vec<PathBuf>) {
    let mut entries: Vec<PathBuf> =
        fs::read_dir(folder).unwrap().map(|entry| entry.unwrap().path()).collect();
    entries.sort();
    for path in entries {
        if path.is_dir() {
            if path.file_name().is_some_and(|name| name != "target" && name != ".git") {
                collect(&path, files);
            }
        } else if path.extension().is_some_and(|extension| extension == "rs") {
            files.push(path);
        }
    }
}

pub(crate) fn rust_files(below: &str) -> Vec<PathBuf> {
    let mut files = Vec::new();
    collect(&root().join(below), &mut files);
    files
}

fn lines_before_tests(text: &str) -> usize {
    text.lines().take_while(|line| line.trim() != "mod tests {").count()
}

#[test]
fn every_source_file_opens_with_its_concept() {
    for path in
        ["protocol", "firmware", "host", "hil-fixtures", "tests"].iter().flat_map(|top| rust_files(top))
    {
        let text = fs::read_to_string(&path).unwrap();
        assert!(text.starts_with("//!"), "{} does not open with a `//!` header", path.display());
    }
}

#[test]
fn no_source_file_outgrows_its_limit() {
    let files: Vec<PathBuf> = SOURCES.iter().flat_map(|top| rust_files(top)).collect();
    assert!(files.len() > 40, "only {} source files found", files.len());
    for path in files {
        let lines = lines_before_tests(&fs::read_to_string(&path).unwrap());
        assert!(lines <= FILE_LINES, "{} has {lines} lines, {FILE_LINES} are allowed", path.display());
    }
}

#[test]
fn the_map_names_every_module_and_only_modules_that_exist() {
    let map = fs::read_to_string(root().join("ARCHITECTURE.md")).unwrap();
    assert!(map.lines().count() <= MAP_LINES, "ARCHITECTURE.md is over {MAP_LINES} lines");
    for source in SOURCES {
        let row = map
            .lines()
            .find(|line| line.starts_with(&format!("| `{source}` |")))
            .unwrap_or_else(|| panic!("ARCHITECTURE.md has no row for {source}"));
        let named: Vec<&str> = row.split('`').skip(3).step_by(2).collect();
        let mut present: Vec<String> = fs::read_dir(root().join(source))
            .unwrap()
            .map(|entry| entry.unwrap().file_name().to_string_lossy().trim_end_matches(".rs").to_owned())
            .filter(|name| !matches!(name.as_str(), "lib" | "main" | "bin"))
            .collect();
        present.sort();
        present.dedup();
        for module in &present {
            assert!(named.contains(&module.as_str()), "ARCHITECTURE.md does not name {source}/{module}");
        }
        for name in named {
            assert!(
                present.iter().any(|module| module == name),
                "ARCHITECTURE.md names {source}/{name}, which is not there"
            );
        }
    }
}

#[test]
fn only_the_clock_crate_switches_the_clock_lint_off() {
    for path in SOURCES.iter().flat_map(|top| rust_files(top)) {
        let text = fs::read_to_string(&path).unwrap();
        let reads = text.contains("disallowed_methods");
        assert!(
            !reads || path.to_string_lossy().contains("protocol/clock"),
            "{} reads the clock",
            path.display()
        );
    }
}

fn documents() -> Vec<PathBuf> {
    let mut pages: Vec<PathBuf> =
        ["README.md", "ARCHITECTURE.md", "hil-fixtures/README.md", "tests/README.md"]
            .iter()
            .map(|name| root().join(name))
            .collect();
    let docs = fs::read_dir(root().join("docs")).unwrap().map(|entry| entry.unwrap().path());
    pages.extend(docs.filter(|path| path.extension().is_some_and(|extension| extension == "md")));
    pages
}

/// Headings as GitHub names them in links: lower case, spaces as hyphens, no other punctuation.
fn anchors(page: &str) -> Vec<String> {
    let headings = page.lines().filter(|line| line.starts_with('#'));
    headings
        .map(|line| {
            let kept = line.trim_start_matches('#').trim().to_lowercase();
            kept.chars()
                .filter(|c| c.is_alphanumeric() || " -_".contains(*c))
                .collect::<String>()
                .replace(' ', "-")
        })
        .collect()
}

/// What is between `](` and `)`: targets of links and pictures.
fn targets(page: &str) -> Vec<&str> {
    page.split("](").skip(1).filter_map(|rest| rest.split(')').next()).collect()
}

#[test]
fn every_link_in_the_documents_leads_somewhere() {
    for page in documents() {
        let text = fs::read_to_string(&page).unwrap();
        for target in targets(&text).into_iter().filter(|target| !target.contains("://")) {
            let (file, anchor) = target.split_once('#').unwrap_or((target, ""));
            let linked = if file.is_empty() { page.clone() } else { page.parent().unwrap().join(file) };
            assert!(linked.exists(), "{} links to {target}, which is not there", page.display());
            let found = anchor.is_empty()
                || anchors(&fs::read_to_string(&linked).unwrap()).iter().any(|name| name == anchor);
            assert!(found, "{} links to {target}: no such heading", page.display());
        }
    }
}

#[test]
fn the_index_of_the_documents_names_every_page() {
    let index = fs::read_to_string(root().join("docs/README.md")).unwrap();
    for page in
        documents().iter().filter(|page| page.ends_with(Path::new("docs").join(page.file_name().unwrap())))
    {
        let name = page.file_name().unwrap().to_string_lossy();
        assert!(
            name == "README.md" || index.contains(&format!("]({name}")),
            "docs/README.md does not name {name}"
        );
    }
}

/// Documents that are written while programs run, or that come with real recordings.
const DOCUMENTS_OF_RUNS: [&str; 14] = [
    "OUT.md",
    "TRAJ.txt",
    "_LASER.txt",
    "hil-fixtures.md",
    "info.txt",
    "intel.opt.txt",
    "intel.txt",
    "intel_pairs.txt",
    "probe.txt",
    "run.txt",
    "scans_horizontal.txt",
    "scans_vertical.txt",
    "thinned.txt",
    "third-party-licenses.txt",
];
/// Where the package puts documents of this tree.
const INSTALLED: &str = "usr/share/doc/biplane/";
/// How a text may refer to a document without naming it.
const NAMELESS: &str = "fact sheet";

/// Folders that are not the project's: what is built, fetched or drawn at random, and what README's first
/// command writes.
const NOT_OURS: [&str; 5] = ["target", ".git", "corpus", "node_modules", "biplane-demo"];

/// Every file of the tree: its path below the root, as text.
pub(crate) fn tree(folder: &Path, found: &mut Vec<String>) {
    for entry in fs::read_dir(folder).unwrap() {
        let path = entry.unwrap().path();
        let name = path.file_name().unwrap().to_string_lossy().into_owned();
        if path.is_dir() {
            if !NOT_OURS.contains(&name.as_str()) {
                tree(&path, found);
            }
        } else {
            found.push(path.strip_prefix(root()).unwrap().to_string_lossy().into_owned());
        }
    }
}

/// Path-like names of documents in a text: `docs/time.md`, `run.txt`; not `run.txt.active`.
fn named_documents(text: &str) -> Vec<&str> {
    let is_of_name = |c: char| c.is_ascii_alphanumeric() || "_./-".contains(c);
    let names = text.split(|c| !is_of_name(c)).map(|word| word.trim_end_matches(['.', '/', '-']));
    names
        .filter(|name| Path::new(name).extension().is_some_and(|kind| kind == "md" || kind == "txt"))
        .collect()
}

/// What of a file may refer to documents: comments of Rust sources, whose code names files of tests; all of
/// the others.
fn prose(path: &str, text: String) -> String {
    if !path.ends_with(".rs") {
        return text;
    }
    text.lines().filter_map(|line| line.split_once("//")).map(|(_, comment)| format!("{comment}\n")).collect()
}

#[test]
fn no_text_refers_to_a_document_that_is_not_here() {
    let mut files = Vec::new();
    tree(&root(), &mut files);
    let (mut wrong, mut named) = (Vec::new(), Vec::new());
    // This file names the exceptions.
    for path in files.iter().filter(|path| !path.ends_with("suite/tidy.rs")) {
        let Ok(text) = fs::read_to_string(root().join(path)) else { continue };
        let text = prose(path, text);
        if text.to_lowercase().contains(NAMELESS) {
            wrong.push(format!("{path} refers to a {NAMELESS}"));
        }
        for name in named_documents(&text) {
            let below = name.trim_start_matches(['.', '/']).trim_start_matches(INSTALLED);
            let file = below.rsplit('/').next().unwrap_or_default();
            named.push(file.to_owned());
            let is_here = files.iter().any(|other| other == below || other.ends_with(&format!("/{below}")));
            if !is_here && !DOCUMENTS_OF_RUNS.contains(&file) {
                wrong.push(format!("{path} refers to {name}"));
            }
        }
    }
    assert!(wrong.is_empty(), "documents that are not here:\n{}", wrong.join("\n"));
    for document in DOCUMENTS_OF_RUNS {
        assert!(named.iter().any(|name| name == document), "nobody names {document} any more");
    }
}

/// Hosts that the sources of the programs may name: the names of XML and JSON vocabularies, which nobody
/// fetches, this machine, and an example that can be nobody's (RFC 2606).
const HOSTS: [&str; 3] = ["http://www.w3.org/", "ws://{address}", "https://viewer.example"];

/// The one file that connects: to lasers, at the addresses that the rig names.
const CONNECTS: &str = "firmware/onboard/src/io/line/connection.rs";
/// The files that listen: the live view, and mock lasers, both on this machine.
const LISTENERS: [&str; 2] =
    ["firmware/onboard/src/live/server/mod.rs", "hil-fixtures/src/serve/network_port.rs"];

#[test]
fn the_programs_name_no_host_and_connect_only_to_the_rigs_lasers() {
    let mut doors = Vec::new();
    for path in SOURCES.iter().flat_map(|top| rust_files(top)) {
        let text = fs::read_to_string(&path).unwrap();
        let below = path.strip_prefix(root()).unwrap();
        let is_test = below.iter().any(|part| part == "tests" || part == "tests.rs");
        let code = text.lines().take(if is_test { 0 } else { lines_before_tests(&text) });
        for line in code.filter(|line| !line.trim_start().starts_with("//")) {
            for (at, _) in line.match_indices("://") {
                let from =
                    line[..at].rfind(|c: char| !c.is_ascii_alphanumeric()).map_or(0, |before| before + 1);
                // Without a scheme in front it parts or joins what somebody else gave.
                let named = from == at || HOSTS.iter().any(|host| line[from..].starts_with(host));
                assert!(named, "{} names a host: {line}", path.display());
            }
            for call in ["TcpStream::connect", "UdpSocket", "to_socket_addrs", "ToSocketAddrs"] {
                let is_allowed = below == Path::new(CONNECTS);
                assert!(is_allowed || !line.contains(call), "{} speaks to others: {line}", path.display());
            }
            if line.contains("TcpListener::bind") {
                doors.push(below.to_owned());
            }
        }
    }
    doors.sort();
    assert_eq!(doors, LISTENERS.map(PathBuf::from), "files that listen");
}
