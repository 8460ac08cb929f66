//! The onboard program.
fn main() {}
