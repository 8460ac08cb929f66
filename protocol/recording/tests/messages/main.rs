//! Messages as bytes: golden ones worked out by hand, and laws that hold for all types.

mod golden;
mod laws;
mod ros1;
