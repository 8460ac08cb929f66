//! Nothing ties the sources to one kind of processor: what runs here is what runs on an ARM board.

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

#[test]
fn no_source_asks_for_a_processor_or_its_layout_in_memory() {
    let tops = ["protocol", "firmware", "host", "hil-fixtures"];
    let mut tied = Vec::new();
    for path in tops.iter().flat_map(|top| rust_files(top)) {
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
