//! Files written, read back, cut, torn and salvaged.

mod folder;
mod foreign;
mod round_trip;
mod salvage;
mod samples;
mod trouble;
