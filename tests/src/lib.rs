//! Tests across the crates; see `suite/`.
