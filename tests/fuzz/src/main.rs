//! The entry of libFuzzer: one program for all targets, which `BIPLANE_TARGET` names.
#![no_main]

use std::sync::OnceLock;

use biplane_tests::inputs::making::peak::PeakAllocator;
use biplane_tests::inputs::{TARGETS, Target, judge, named};
use biplane_tests::inputs::making::mutate;
use libfuzzer_sys::{fuzz_mutator, fuzz_target, fuzzer_mutate};

#[global_allocator]
static ALLOCATOR: PeakAllocator = PeakAllocator;

fn target() -> &'static Target {
    static TARGET: OnceLock<&Target> = OnceLock::new();
    TARGET.get_or_init(|| {
        let name = std::env::var("BIPLANE_TARGET").unwrap_or_default();
        named(&name).unwrap_or_else(|| {
            let names: Vec<&str> = TARGETS.iter().map(|target| target.name).collect();
            eprintln!("BIPLANE_TARGET: expected one of {names:?}, found {name:?}");
            std::process::exit(2);
        })
    })
}

// A reader that catches the panics of a library keeps its promise: only what leaves `judge` ends the program.
fuzz_target!(
    init: drop(std::panic::take_hook()),
    |input: &[u8]| {
        if std::panic::catch_unwind(|| judge(target(), input)).is_err() {
            std::process::abort();
        }
    }
);

// Half of the damage is libFuzzer's own, half that of the stable tests, which knows how inputs are written.
fuzz_mutator!(|bytes: &mut [u8], size: usize, longest: usize, seed: u32| {
    if seed % 2 == 0 {
        return fuzzer_mutate(bytes, size, longest);
    }
    let damaged = mutate::damaged_by_seed(target().form, &bytes[..size], u64::from(seed));
    let kept = damaged.len().min(longest);
    bytes[..kept].copy_from_slice(&damaged[..kept]);
    kept
});
