//! Figures of measurements: tables in, pictures out, without any other program.
//!
//! A table ([`table`]) becomes a chart of panels with axes ([`chart`]), that becomes lines and words on paper ([`drawing`]), and these an
//! SVG ([`svg`]) or a PNG ([`raster`]). The same table gives the same bytes.

pub mod basin;
pub mod chart;
pub mod drawing;
pub mod journal;
pub mod raster;
pub mod relations;
pub mod running;
pub mod svg;
pub mod table;
pub mod ticks;
