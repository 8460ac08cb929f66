//! The tracker against the simulator's truth over many seeds: covariances that keep their word, drift,
//! people.
//!
//! `cargo test -p biplane-onboard --test truth` runs a few seeds; as many as `BIPLANE_SEEDS` says where that
//! is set, in release: `BIPLANE_SEEDS=50 cargo test --release -p biplane-onboard --test truth --
//! --nocapture`, which prints the tables of `docs/matching.md`.

mod consistency;
mod drift;
mod ride;

/// Seeds to run: `few` unless the environment says how many.
fn seeds(few: u64) -> std::ops::RangeInclusive<u64> {
    let asked = std::env::var("BIPLANE_SEEDS").ok().and_then(|text| text.parse().ok());
    1..=asked.unwrap_or(few)
}
