//! The onboard program: see `biplane_onboard::cli`.

use std::process::ExitCode;

use biplane_cli::memory::GuardedAllocator;
use biplane_onboard::test_support::CountingAllocator;

/// Counts for `bench`, which says how often the matcher allocates, and ends with a sentence where memory runs
/// out.
#[global_allocator]
static ALLOCATOR: GuardedAllocator<CountingAllocator> = GuardedAllocator(CountingAllocator);

fn main() -> ExitCode {
    ALLOCATOR.keep_reserve();
    ExitCode::from(biplane_onboard::run(std::env::args_os()))
}
