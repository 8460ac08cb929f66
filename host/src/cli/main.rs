//! The workstation's program: see `biplane::cli`.

use std::alloc::System;
use std::process::ExitCode;

use biplane_cli::memory::{GuardedAllocator, return_large_blocks};

/// Ends with a sentence where memory runs out.
#[global_allocator]
static ALLOCATOR: GuardedAllocator<System> = GuardedAllocator(System);

fn main() -> ExitCode {
    return_large_blocks();
    ALLOCATOR.keep_reserve();
    biplane::cli::main()
}
