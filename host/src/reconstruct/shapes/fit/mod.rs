//! Cylinders through points: fitted, and judged.

pub(crate) mod axis;
pub(crate) mod circle_fit;
pub(crate) mod gauss_newton;
pub(crate) mod judge;
pub(crate) mod prism;
pub(crate) mod runs;
pub(crate) mod sample;
pub(crate) mod steps;
pub(crate) mod surface;
