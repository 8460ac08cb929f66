//! The mock rig's program: see `biplane_mock::cli`.

use std::alloc::System;
use std::process::ExitCode;

use biplane_cli::memory::GuardedAllocator;

/// Ends with a sentence where memory runs out.
#[global_allocator]
static ALLOCATOR: GuardedAllocator<System> = GuardedAllocator(System);

fn main() -> ExitCode {
    ALLOCATOR.keep_reserve();
    biplane_mock::cli::main()
}
