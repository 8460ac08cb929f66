//! The words of identifiers: the field's own (`docs/glossary.md`), one spelling, and none that only we would
//! understand.

use std::collections::BTreeSet;
use std::fs;

use super::tidy::{root, rust_files, tree};

/// Parts of identifiers that are not to come back, each with the word that is used instead.
const BANNED: [(&str, &str); 75] = [
    ("adopt", "propagate"),
    ("audience", "status printer"),
    ("ballot", "vote"),
    ("ballots", "votes"),
    ("belief", "covariance"),
    ("beliefs", "covariances"),
    ("believe", "select inliers"),
    ("believed", "inlier, accepted or trusted"),
    ("brush", "stamp"),
    ("chapter", "submap"),
    ("chapters", "submaps"),
    ("clutter", "foliage"),
    ("company", "support"),
    ("conduct", "regularity"),
    ("contest", "innovation gate"),
    ("contested", "unconfirmed"),
    ("cracks", "T-junctions"),
    ("curtain", "mixed-pixel plane"),
    ("curtains", "mixed-pixel planes"),
    ("descent", "conjugate gradient"),
    ("doubt", "degeneracy, uncertainty or hint"),
    ("doubtful", "ambiguous"),
    ("doubts", "contradictions"),
    ("ear", "parser"),
    ("glance", "heading window"),
    ("habit", "expected interval"),
    ("habits", "expected intervals"),
    ("heard", "received"),
    ("islands", "small components"),
    ("least", "min"),
    ("lender", "reference direction"),
    ("lenders", "reference directions"),
    ("most", "max"),
    ("mouth", "byte queue"),
    ("overslept", "watchdog missed"),
    ("papers", "manual"),
    ("said", "reported"),
    ("seat", "mount hypothesis"),
    ("seats", "mount hypotheses"),
    ("shaping", "model args"),
    ("sights", "observations"),
    ("speck", "small component"),
    ("specks", "small components"),
    ("speech", "protocol or encoder"),
    ("stranger", "foreign device"),
    ("strangers", "foreign devices"),
    ("stray", "outlier"),
    ("strays", "outliers"),
    ("stretch", "submap or segment"),
    ("stretches", "submaps or segments"),
    ("stump", "partial frame"),
    ("stumps", "partial frames"),
    ("surprise", "Cauchy scale"),
    ("suspicion", "mount fault"),
    ("suspicions", "mount faults"),
    ("sweeps", "range scans"),
    ("tell", "report or notify"),
    ("telling", "informative, or with progress"),
    ("tells", "reports"),
    ("told", "reported"),
    ("trail", "keyframes"),
    ("trails", "keyframes"),
    ("trust", "confidence"),
    ("veil", "jump edge"),
    ("veils", "jump edges"),
    ("voice", "notifier"),
    // One spelling.
    ("behaviour", "behavior"),
    ("centre", "center"),
    ("centres", "centers"),
    ("colour", "color"),
    ("colours", "colors"),
    ("metre", "meter"),
    ("metres", "meters"),
    ("neighbour", "neighbor"),
    ("neighbours", "neighbors"),
];

/// Beginnings of parts that are British spelling; `storey` stays, as in `IfcBuildingStorey`.
const BRITISH: [&str; 10] = [
    "labelled",
    "labelling",
    "localis",
    "minimis",
    "normalis",
    "optimis",
    "organis",
    "rasteris",
    "recognis",
    "synchronis",
];

/// Names that are written to files or typed by people, who would lose what they have.
const RECORDED: [&str; 13] = [
    "UNKNOWN_METRES_PER_TICK",
    "chapter_every_m",
    "glance_below_share",
    "glance_rad",
    "least_half_m",
    "least_half_rad",
    "metres_per_count",
    "metres_per_count_left",
    "metres_per_count_right",
    "metres_per_tick",
    "most_looks",
    "veil_angle_deg",
    "veil_length_m",
];

/// Parts of words that are British spelling, for all texts: documents, messages, comments, scripts.
const BRITISH_TEXT: [&str; 24] = [
    "behaviour",
    "catalogue",
    "centre",
    "colour",
    "favour",
    "honour",
    "kerb",
    "labelled",
    "labelling",
    "licence",
    "localis",
    "metre",
    "minimis",
    "modelled",
    "modelling",
    "neighbour",
    "normalis",
    "optimis",
    "organis",
    "rasteris",
    "recognis",
    "signalled",
    "synchronis",
    "travelled",
];

/// Words that files and formats have, with the end of the name of the file that may say so; a rig's keys
/// may stand everywhere.
const WRITTEN: [(&str, &str); 13] = [
    ("METRES_PER_", ""),
    ("metres_per_", ""),
    ("millimetre", "rig/named.rs"),
    ("METRE", "ifc/project.rs"),
    ("SQUARE_METRE", "ifc/project.rs"),
    ("CUBIC_METRE", "ifc/project.rs"),
    ("IFCCOLOURRGB", "ifc/round.rs"),
    ("IFCCOLOURRGB", "ifc/styles.rs"),
    // The unit's name in the International System, as models have it.
    ("metre", "cityjson/mod.rs"),
    ("metre", "gltf/mod.rs"),
    ("metre", "model_json/mod.rs"),
    // Keys of JSON.
    ("metres", "evaluate/pose_error.rs"),
    ("organised", "pipeline/plane_report.rs"),
];

/// More parts than this make a sentence, such as a test's name: plain English, in which every word may stand.
const NAME_PARTS: usize = 5;

/// The code of a source without its comments, strings and characters.
fn code_of(source: &str) -> String {
    let (mut code, mut rest) = (String::with_capacity(source.len()), source);
    while let Some(letter) = rest.chars().next() {
        let in_name = code.chars().last().is_some_and(|last| last.is_alphanumeric() || last == '_');
        let length = if rest.starts_with("//") {
            rest.find('\n').unwrap_or(rest.len())
        } else if rest.starts_with("/*") {
            rest.find("*/").map_or(rest.len(), |at| at + 2)
        } else if letter == '"' {
            string_length(rest)
        } else if letter == 'r' && !in_name && rest[1..].trim_start_matches('#').starts_with('"') {
            raw_string_length(rest)
        } else if letter == '\'' {
            character_length(rest)
        } else {
            code.push(letter);
            rest = &rest[letter.len_utf8()..];
            continue;
        };
        code.push(' ');
        rest = &rest[length..];
    }
    code
}

fn string_length(text: &str) -> usize {
    let mut escaped = false;
    for (at, letter) in text.char_indices().skip(1) {
        match letter {
            '"' if !escaped => return at + 1,
            _ => escaped = letter == '\\' && !escaped,
        }
    }
    text.len()
}

fn raw_string_length(text: &str) -> usize {
    let hashes = text[1..].chars().take_while(|letter| *letter == '#').count();
    let (start, end) = (hashes + 2, format!("\"{}", "#".repeat(hashes)));
    text[start..].find(&end).map_or(text.len(), |at| start + at + end.len())
}

/// Of a character, or of the tick of a lifetime.
fn character_length(text: &str) -> usize {
    let mut letters = text.char_indices().skip(1);
    match (letters.next(), letters.next()) {
        (Some((_, '\\')), Some((after, _))) => {
            let from = after + 1;
            text[from..].find('\'').map_or(text.len(), |at| from + at + 1)
        }
        (Some(_), Some((at, '\''))) => at + 1,
        _ => 1,
    }
}

/// The parts of a `snake_case`, `CamelCase` or `UPPER_CASE` name, in small letters.
fn parts(name: &str) -> Vec<String> {
    let mut found: Vec<String> = Vec::new();
    let mut before = '_';
    for letter in name.chars() {
        if letter != '_' {
            if before == '_' || (letter.is_uppercase() && !before.is_uppercase()) {
                found.push(String::new());
            }
            if let Some(part) = found.last_mut() {
                part.extend(letter.to_lowercase());
            }
        }
        before = letter;
    }
    found
}

/// What is wrong with a name, when something is.
fn fault(name: &str) -> Option<String> {
    let parts = parts(name);
    if parts.len() > NAME_PARTS || RECORDED.contains(&name) {
        return None;
    }
    let banned = parts.iter().find_map(|part| BANNED.iter().find(|(word, _)| word == part));
    let british = parts.iter().find(|part| BRITISH.iter().any(|stem| part.starts_with(stem)));
    match (banned, british) {
        (Some((word, better)), _) => Some(format!("{name}: not \"{word}\" but {better}")),
        (_, Some(part)) => Some(format!("{name}: \"{part}\" is British spelling")),
        // `POINTS_A_CELL` is `POINTS_PER_CELL`.
        _ if name.contains("S_A_") => Some(format!("{name}: not \"A\" but \"PER\"")),
        _ => None,
    }
}

fn faults(source: &str) -> BTreeSet<String> {
    let code = code_of(source);
    let names = code.split(|letter: char| !letter.is_alphanumeric() && letter != '_');
    names.filter_map(fault).collect()
}

#[test]
fn no_source_uses_a_banned_word() {
    let mut found = Vec::new();
    for path in
        ["protocol", "firmware", "host", "hil-fixtures", "tests"].iter().flat_map(|top| rust_files(top))
    {
        let text = fs::read_to_string(&path).unwrap();
        found.extend(faults(&text).iter().map(|fault| format!("{}: {fault}", path.display())));
    }
    assert!(found.is_empty(), "words that docs/glossary.md has better ones for:\n{}", found.join("\n"));
}

/// Words of a file that are British spelling.
fn british_words<'a>(path: &str, text: &'a str) -> BTreeSet<&'a str> {
    let words = text.split(|letter: char| !letter.is_alphanumeric() && letter != '_');
    let is_british = |word: &&str| {
        let small = word.to_lowercase();
        BRITISH_TEXT.iter().any(|stem| small.contains(stem))
    };
    let is_written = |word: &&str| {
        WRITTEN.iter().any(|(known, file)| match file.is_empty() {
            true => word.contains(known),
            false => word == known && path.ends_with(file),
        })
    };
    words.filter(is_british).filter(|word| !is_written(word)).collect()
}

#[test]
fn no_text_has_british_spelling() {
    let mut files = Vec::new();
    tree(&root(), &mut files);
    let mut found = Vec::new();
    // This file names the words, and a test has the key of a report.
    let has_words = ["architecture/words.rs", "cli/measure/evaluate.rs"];
    for path in files.iter().filter(|path| !has_words.iter().any(|name| path.ends_with(name))) {
        let Ok(text) = fs::read_to_string(root().join(path)) else { continue };
        found.extend(british_words(path, &text).iter().map(|word| format!("{path}: {word}")));
    }
    assert!(found.is_empty(), "docs/glossary.md: one spelling, American\n{}", found.join("\n"));
}

#[test]
fn british_words_are_found_unless_a_format_has_them() {
    let text = "Metres of the Centre: metres_per_tick, IFCCOLOURRGB, optimised, storey";
    let found = |path: &str| british_words(path, text).into_iter().collect::<Vec<_>>();
    assert_eq!(found("ifc/styles.rs"), ["Centre", "Metres", "optimised"]);
    assert_eq!(found("docs/time.md"), ["Centre", "IFCCOLOURRGB", "Metres", "optimised"]);
}

#[test]
fn banned_words_are_found_in_names_and_nowhere_else() {
    let source = r##"
        /// Told by a stranger.
        fn told<'a>(name: &'a str) -> BaseSpeech { "a \" belief"; r#"chapter"#; '"'; POINTS_A_CELL; optimised }
        fn what_is_told_in_a_sentence_is_plain_english() { metres_per_tick; folded; '\''; toldness }
    "##;
    let found: Vec<String> = faults(source).into_iter().collect();
    assert_eq!(
        found,
        [
            "BaseSpeech: not \"speech\" but protocol or encoder",
            "POINTS_A_CELL: not \"A\" but \"PER\"",
            "optimised: \"optimised\" is British spelling",
            "told: not \"told\" but reported",
        ]
    );
}
