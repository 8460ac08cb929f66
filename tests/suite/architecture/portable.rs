//! Nothing ties the sources to one kind of processor: what runs here is what runs on an ARM board, and gives
//! the same bytes.

use std::fs;

use super::tidy::rust_files;

/// What would: instructions of one processor, and layouts in memory that differ between processors.
const TIED: [&str; 10] = [
    "core::arch",
    "std::arch",
    "target_arch",
    "target_feature",
    "target_pointer_width",
    "is_x86_feature_detected",
    "to_ne_bytes",
    "from_ne_bytes",
    "size_of::<usize>",
    "usize::to_",
];

/// The one file that asks for a processor: what it compiles twice is one source, and its bytes are the same.
const LANES: &str = "firmware/matcher/src/lanes.rs";

#[test]
fn no_source_asks_for_a_processor_or_its_layout_in_memory() {
    let tops = ["protocol", "firmware", "host", "hil-fixtures"];
    let mut tied = Vec::new();
    let paths = tops.iter().flat_map(|top| rust_files(top));
    for path in paths.filter(|path| !path.to_string_lossy().ends_with(LANES)) {
        let text = fs::read_to_string(&path).unwrap();
        // A test may check the kernel's layout where it knows it.
        let text = text.split("mod tests {").next().unwrap_or_default();
        tied.extend(TIED.iter().filter(|word| text.contains(**word)).map(|word| (path.clone(), *word)));
    }
    assert!(tied.is_empty(), "tied to a kind of processor: {tied:#?}");
}

#[test]
fn no_build_setting_names_a_processor() {
    let root = std::path::Path::new(env!("CARGO_MANIFEST_DIR")).join("..");
    for file in ["Cargo.toml", ".cargo/config.toml", "firmware/onboard/packaging/build-deb", ".ci/run"] {
        let text = fs::read_to_string(root.join(file)).unwrap_or_default();
        for word in ["target-cpu", "target-feature", "-march", "-mtune", "x86_64-unknown"] {
            assert!(!text.contains(word), "{file} holds {word}");
        }
    }
}

/// Functions of the C library, whose last digit differs between machines.
const OF_THE_C_LIBRARY: [&str; 19] = [
    "sin", "cos", "sin_cos", "tan", "asin", "acos", "atan", "atan2", "sinh", "cosh", "tanh", "exp", "exp2",
    "exp_m1", "ln", "ln_1p", "log2", "log10", "powf",
];

/// Tests may call them: they compare, and nobody relies on their bits. So may their noise.
const IS_FOR_TESTS: [&str; 3] = ["tests.rs", "test_support.rs", "paper/random.rs"];

/// Whether a text calls one of them, as a method or by its path.
fn calls(text: &str, name: &str) -> bool {
    text.contains(&format!(".{name}("))
        || ["f64", "f32"].iter().any(|real| {
            let path = format!("{real}::{name}");
            text.match_indices(&path).any(|(at, _)| {
                let next = text[at + path.len()..].chars().next();
                !next.is_some_and(|next| next.is_alphanumeric() || next == '_')
            })
        })
}

#[test]
fn no_pose_and_no_model_hangs_on_the_c_library() {
    let tops = ["protocol/geometry", "protocol/recording", "firmware", "host"];
    let mut found = Vec::new();
    for path in tops.iter().flat_map(|top| rust_files(top)) {
        let name = path.to_string_lossy();
        // The top folder is one above that of this test, and the way there is in the name.
        let name = name.rsplit("../").next().unwrap_or_default();
        if !name.contains("/src/")
            || name.contains("/tests/")
            || IS_FOR_TESTS.iter().any(|end| name.ends_with(end))
        {
            continue;
        }
        let text = fs::read_to_string(&path).unwrap();
        let text = text.split("tests {").next().unwrap_or_default();
        let names = OF_THE_C_LIBRARY.iter().chain(&["hypot", "cbrt"]);
        found.extend(names.filter(|name| calls(text, name)).map(|name| (path.clone(), *name)));
    }
    assert!(found.is_empty(), "use biplane_geometry::PortableMath: {found:#?}");
}
