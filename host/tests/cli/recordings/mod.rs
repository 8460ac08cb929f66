//! Recordings: read, imported, optimized, calibrated, salvaged.

mod calibrate;
mod import;
mod odd_recordings;
mod optimize;
mod parts;
mod salvage;
