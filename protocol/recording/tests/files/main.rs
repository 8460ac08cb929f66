//! Files written, read back, cut, torn and salvaged.

mod round_trip;
mod samples;
