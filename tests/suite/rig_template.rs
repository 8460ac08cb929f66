//! The rig that the package installs names every key that a rig may have, and all of its sections that stand
//! there as comments are rigs.

use biplane_recording::{Rig, RigError};

/// Kinds of devices, by section, and by what is said there besides.
const KINDS: [(&str, &str); 9] = [
    ("horizontal", "protocol = \"lms2xx\""),
    ("vertical", "protocol = \"cola\""),
    ("vertical", "protocol = \"scip\""),
    ("base", "protocol = \"p2os\""),
    ("base", "protocol = \"roboclaw\""),
    ("base", "protocol = \"rflex\""),
    ("base", "protocol = \"none\""),
    ("imu", "protocol = \"xsens\""),
    ("horizontal.mount", ""),
];

fn template() -> String {
    let path = concat!(env!("CARGO_MANIFEST_DIR"), "/../firmware/onboard/packaging/rig.toml");
    std::fs::read_to_string(path).unwrap()
}

/// The paragraphs of the template.
fn paragraphs(text: &str) -> Vec<&str> {
    text.split("\n\n").collect()
}

/// The keys that a section of a kind may have: those that the refusal of another one names.
fn keys(section: &str, kind: &str) -> Vec<String> {
    let text = format!("[{section}]\n{kind}\nno_such_key = 1\n");
    let refused = Rig::parse(&text).unwrap_err();
    let RigError::Several { faults, .. } = refused else { panic!("{section}: {refused}") };
    let known = faults.iter().find_map(|fault| match fault {
        RigError::UnknownKey { known, .. } => Some(known.split(", ").map(str::to_owned).collect()),
        _ => None,
    });
    known.unwrap_or_else(|| panic!("{section}, {kind}: nothing is refused by name"))
}

fn names(text: &str, key: &str) -> bool {
    let is_here = |line: &str| line.trim_start_matches("# ").starts_with(&format!("{key} = "));
    text.lines().any(is_here) || (text.contains("mount = {") && text.contains(&format!(" {key} = ")))
}

#[test]
fn the_template_names_every_key_of_every_kind_of_device() {
    let template = template();
    for (section, kind) in KINDS {
        let of_kind: Vec<&str> =
            paragraphs(&template).into_iter().filter(|paragraph| paragraph.contains(kind)).collect();
        let of_kind = of_kind.join("\n");
        let missing: Vec<_> = keys(section, kind).into_iter().filter(|key| !names(&of_kind, key)).collect();
        assert!(missing.is_empty(), "[{section}] {kind}: the template does not name {missing:?}");
    }
}

#[test]
fn the_sections_in_comments_are_rigs() {
    let template = template();
    let others = "[horizontal]\nport = \"/dev/lms-horizontal\"\n";
    let mut tried = 0;
    for paragraph in paragraphs(&template) {
        let Some(start) = paragraph.find("# [") else { continue };
        let lines = paragraph[start..].lines().map(|line| line.trim_start_matches("# "));
        let section: String = lines.flat_map(|line| [line, "\n"]).collect();
        let base = if section.starts_with("[base]") { "" } else { "[base]\nprotocol = \"none\"\n" };
        let text = format!("{others}{base}{section}");
        assert!(Rig::parse(&text).is_ok(), "{:?} of\n{text}", Rig::parse(&text).err());
        tried += 1;
    }
    assert_eq!(tried, 7, "sections in comments");
    Rig::parse(&template).unwrap();
}
