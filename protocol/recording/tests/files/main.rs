//! Files written, read back, cut, torn and salvaged.

mod crafted;
mod folder;
mod foreign;
mod parts;
mod round_trip;
mod salvage;
mod samples;
mod trouble;
