//! Tests over the whole chain, as one binary: the tree against its map, and the programs against each other
//! and the truth.

mod accuracy;
pub(crate) mod architecture;
mod faults;
pub(crate) mod recovery;
mod rig;
mod rig_template;
mod soak;

/// The simulated robot says what its engine allocates.
#[global_allocator]
static ALLOCATOR: biplane_onboard::test_support::CountingAllocator =
    biplane_onboard::test_support::CountingAllocator;
