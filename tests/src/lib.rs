//! What several test programs share: the promises of every parser of outside bytes ([`inputs`]), for the
//! suite on stable Rust and for the fuzzer in `tests/fuzz`. The tests themselves stand in `suite/` and
//! `inputs/`.

pub mod inputs;
