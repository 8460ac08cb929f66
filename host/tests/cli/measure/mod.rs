//! Measures and figures.

mod evaluate;
mod plot;
