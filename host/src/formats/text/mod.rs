//! Numbers, stamps and trajectories as text.

pub(crate) mod number;
pub(crate) mod trajectory;
