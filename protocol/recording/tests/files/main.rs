//! Files written, read back, cut, torn and salvaged.

mod bad_files;
mod crafted;
mod damage;
mod folder;
mod foreign;
mod parts;
mod round_trip;
mod salvage;
mod samples;
mod trouble;
