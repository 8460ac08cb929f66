//! Files written, read back, cut, torn and salvaged.

mod folder;
mod round_trip;
mod samples;
