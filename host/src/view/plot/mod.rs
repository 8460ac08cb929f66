//! Figures of measurements: tables in, pictures out, without any other program.
//!
//! A table ([`table`]) becomes a chart of panels with axes ([`chart`]), that becomes lines and words on paper
//! ([`drawing`]), and these an SVG ([`svg`]) or a PNG ([`raster`]). The same table gives the same bytes.

pub(crate) mod basin;
pub(crate) mod chart;
pub(crate) mod drawing;
pub(crate) mod journal;
pub(crate) mod raster;
pub(crate) mod relations;
pub(crate) mod running;
pub(crate) mod svg;
pub(crate) mod table;
pub(crate) mod ticks;
pub(crate) mod trajectory;
