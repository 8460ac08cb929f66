//! The onboard program: see `biplane_onboard::cli`.

use std::process::ExitCode;

use biplane_onboard::test_support::CountingAllocator;

/// For `bench`, which says how often the matcher allocates.
#[global_allocator]
static ALLOCATOR: CountingAllocator = CountingAllocator;

fn main() -> ExitCode {
    ExitCode::from(biplane_onboard::run(std::env::args_os()))
}
