//! Where inputs come from: the corpus, seeded damage, files in memory, and the account of memory.

pub mod corpus;
pub(crate) mod memory_file;
pub mod mutate;
pub mod peak;
