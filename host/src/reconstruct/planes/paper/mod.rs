//! The paper's randomized region growing, plain and fast: the oracle of our own search.

pub(crate) mod agreement;
pub(crate) mod params;
pub(crate) mod random;
#[cfg(test)]
pub(crate) mod reference;
pub(crate) mod region_growing;
