//! Random bytes through every deframer, and damaged scans past the laser's checksum. Exits with 1 when more
//! is taken for true than the checksum's length allows.
//!
//! ```text
//! cargo run --release -p biplane-wire --example random_bytes -- [BYTES [SEED]]
//! ```

#[path = "../tests/noise/mod.rs"]
mod noise;

use std::process::ExitCode;

use noise::{Damage, Noise, Outcome, damage, deframers, questions, unasked};

fn main() -> ExitCode {
    let mut numbers = std::env::args().skip(1).map(|text| text.parse::<u64>());
    let (Ok(bytes), Ok(seed)) = (numbers.next().unwrap_or(Ok(20_000_000)), numbers.next().unwrap_or(Ok(1)))
    else {
        eprintln!("usage: random_bytes [BYTES [SEED]]");
        return ExitCode::from(2);
    };
    println!("seed {seed}");
    println!(
        "| deframer | noise | bytes | checksum fits | reads as a report | mean by the checksum's length | allowed |"
    );
    println!("|---|---|---|---|---|---|---|");
    let mut outcomes = deframers(bytes, seed);
    outcomes.extend([questions(bytes, seed + 1), unasked(bytes, seed + 2)]);
    outcomes.iter().for_each(print);
    println!();
    println!(
        "| damage to a scan of 181 values | damaged | checksum fits all the same | reads as a scan of 181 values | share |"
    );
    println!("|---|---|---|---|---|");
    for kind in Damage::ALL {
        let missed = damage(kind, (bytes / 100).max(10_000), seed + 3);
        let share = missed.by_reading as f64 / missed.damaged as f64;
        println!(
            "| {kind:?} | {} | {} | {} | {share:.2e} |",
            missed.damaged, missed.by_checksum, missed.by_reading
        );
    }
    if outcomes.iter().all(Outcome::is_within) { ExitCode::SUCCESS } else { ExitCode::FAILURE }
}

fn print(outcome: &Outcome) {
    let noise = match outcome.noise {
        Noise::Uniform => "uniform",
        Noise::Heads => "a head every 64 bytes",
    };
    println!(
        "| {} | {noise} | {} | {} | {} | {:.3} | {:.1}{} |",
        outcome.name,
        outcome.bytes,
        outcome.accepted,
        outcome.read,
        outcome.expected,
        outcome.allowed(),
        if outcome.is_within() { "" } else { ": VIOLATED" }
    );
}
