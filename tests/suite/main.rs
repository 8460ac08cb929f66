//! Tests over the whole chain, as one binary: the tree against its map, and the programs against each other and the truth.

mod accuracy;
mod captures;
mod checksum;
mod clock_steps;
mod crash;
mod fault_soak;
mod faults;
mod host_faults;
mod mounting;
mod own_process;
mod quiet_run;
mod recorded;
mod restarts;
mod rig;
mod soak;
mod start_up;
mod stopping;
mod tidy;

/// The simulated robot says what its engine allocates.
#[global_allocator]
static ALLOCATOR: biplane_onboard::allocations::CountingAllocator =
    biplane_onboard::allocations::CountingAllocator;
