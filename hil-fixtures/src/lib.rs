//! Mock lasers and base, simulated worlds, serial captures. See ARCHITECTURE.md.
pub mod source;
