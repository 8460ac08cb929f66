//! Stamps of scans against simulated truth: whole telegrams at exact times, through adapters that delay them,
//! into the engine.
//!
//! `cargo test -p biplane-onboard --test stamps -- --nocapture` prints the table of `docs/time.md`. The truth
//! is that of the simulation: when the mirror stood where the first beam is taken. Lines and adapters are
//! those of the mock; none of it is the code that is judged.

mod simulated_laser;

use simulated_laser::{Events, Laser, Mirror, Usb, base_errors_ms, errors_ms};

/// Field of view, resolution (hundredths of a degree), turns a scan.
const VARIANTS: [(u16, u16, i64); 6] =
    [(180, 100, 1), (180, 50, 2), (100, 25, 4), (100, 50, 2), (100, 100, 1), (90, 50, 1)];
const RATES: [u32; 4] = [9600, 19_200, 38_400, 500_000];

struct Condition {
    name: &'static str,
    usb: Usb,
    mirror: Mirror,
    events: Events,
    with_index: bool,
}

const PLAIN: Condition =
    Condition { name: "", usb: Usb::Chance, mirror: Mirror::TRUE, events: Events::NONE, with_index: false };

fn ppm(ppm: f64) -> Mirror {
    Mirror { ppm, ..Mirror::TRUE }
}

fn rms(errors: &[f64]) -> f64 {
    (errors.iter().map(|error| error * error).sum::<f64>() / errors.len().max(1) as f64).sqrt()
}

/// Root mean square of the worst run, 99th percentile and largest of all, milliseconds.
fn measure(condition: &Condition, baud: u32, seeds: std::ops::Range<u64>) -> [f64; 3] {
    let (mut worst, mut all) = (0.0_f64, Vec::new());
    for (fov_deg, resolution_cdeg, turns) in VARIANTS {
        for seed in seeds.clone() {
            let Condition { usb, mirror, events, with_index, .. } = *condition;
            let laser = Laser { fov_deg, resolution_cdeg, turns, baud, mirror, events, with_index };
            let errors = errors_ms(&laser, usb, seed);
            worst = worst.max(rms(&errors));
            all.extend(errors.iter().map(|error| error.abs()));
        }
    }
    all.sort_by(f64::total_cmp);
    [worst, all[all.len() * 99 / 100], all[all.len() - 1]]
}

fn assert_all_within_a_millisecond(conditions: &[Condition]) {
    let mut beyond = Vec::new();
    for condition in conditions {
        for baud in RATES {
            let [worst, p99, largest] = measure(condition, baud, 0..2);
            println!(
                "| {} | {baud} | {} | {worst:.3} | {p99:.3} | {largest:.3} |",
                condition.name,
                if condition.with_index { "yes" } else { "no" }
            );
            if worst >= 1.0 {
                beyond.push(format!("{} at {baud} Bd: {worst:.3} ms", condition.name));
            }
        }
    }
    assert!(beyond.is_empty(), "{beyond:?}");
}

#[test]
fn usb_delays_and_latency_timers_leave_less_than_a_millisecond_whatever_the_mirror_drifts() {
    let warming = Mirror { ppm: 60.0, wander_ppm: 50.0, ..Mirror::TRUE };
    assert_all_within_a_millisecond(&[
        Condition { name: "chance", ..PLAIN },
        Condition { name: "chance, -100 ppm", mirror: ppm(-100.0), ..PLAIN },
        Condition { name: "chance, +100 ppm", mirror: ppm(100.0), ..PLAIN },
        Condition { name: "chance, -300 ppm", mirror: ppm(-300.0), ..PLAIN },
        Condition { name: "chance, +300 ppm", mirror: ppm(300.0), ..PLAIN },
        Condition { name: "chance, 10 to 110 ppm", mirror: warming, ..PLAIN },
        Condition {
            name: "chance, line 0.16 % fast",
            mirror: Mirror { line_fast: 0.0016, ..ppm(100.0) },
            ..PLAIN
        },
        Condition { name: "16 ms or 62 bytes, -100 ppm", usb: Usb::Timer, mirror: ppm(-100.0), ..PLAIN },
        Condition { name: "16 ms or 62 bytes, +100 ppm", usb: Usb::Timer, mirror: ppm(100.0), ..PLAIN },
        Condition { name: "16 ms or 62 bytes, +300 ppm", usb: Usb::Timer, mirror: ppm(300.0), ..PLAIN },
        Condition { name: "whole telegrams, -100 ppm", usb: Usb::Whole, mirror: ppm(-100.0), ..PLAIN },
        Condition { name: "whole telegrams, +100 ppm", usb: Usb::Whole, mirror: ppm(100.0), ..PLAIN },
        Condition { name: "16 ms ticks, -100 ppm", usb: Usb::Ticks, mirror: ppm(-100.0), ..PLAIN },
        Condition { name: "16 ms ticks, +100 ppm", usb: Usb::Ticks, mirror: ppm(100.0), ..PLAIN },
    ]);
}

#[test]
fn stalls_of_the_adapter_leave_less_than_a_millisecond_from_the_first_scan_on() {
    let early = Events { early_stall: true, ..Events::NONE };
    assert_all_within_a_millisecond(&[
        Condition { name: "usb-stall, -100 ppm", usb: Usb::Stall, mirror: ppm(-100.0), ..PLAIN },
        Condition { name: "usb-stall, +100 ppm", usb: Usb::Stall, mirror: ppm(100.0), ..PLAIN },
        Condition { name: "stall in the first scans", events: early, mirror: ppm(100.0), ..PLAIN },
        Condition { name: "the same", events: early, mirror: ppm(100.0), with_index: true, ..PLAIN },
    ]);
}

#[test]
fn scans_left_out_damaged_or_stopped_leave_less_than_a_millisecond() {
    let busy = Events { skip_share: 0.003, ..Events::NONE };
    let damaged = Events { damage_share: 0.03, ..Events::NONE };
    let stopped = Events { stop_every_s: 6.0, ..Events::NONE };
    for with_index in [false, true] {
        assert_all_within_a_millisecond(&[
            Condition { name: "scans left out", events: busy, mirror: ppm(100.0), with_index, ..PLAIN },
            Condition { name: "telegrams damaged", events: damaged, mirror: ppm(100.0), with_index, ..PLAIN },
            Condition { name: "stream stopped", events: stopped, mirror: ppm(100.0), with_index, ..PLAIN },
            Condition { name: "left out, 62 bytes", events: busy, usb: Usb::Timer, with_index, ..PLAIN },
            Condition { name: "damaged, usb-stall", events: damaged, usb: Usb::Stall, with_index, ..PLAIN },
        ]);
    }
}

#[test]
fn odometry_is_stamped_when_its_packet_left_also_by_a_base_that_does_not_keep_its_time() {
    let mut failed = false;
    for (name, usb, jitter_ms, max_ms) in [
        ("chance", Usb::Chance, 0.0, 0.2),
        ("chance, base late by up to 5 ms", Usb::Chance, 5.0, 2.0),
        ("16 ms or 62 bytes", Usb::Timer, 0.0, 1.0),
        ("16 ms ticks", Usb::Ticks, 0.0, 8.0),
        ("usb-stall", Usb::Stall, 0.0, 1.0),
    ] {
        for baud in [9600, 38_400] {
            let runs: Vec<Vec<f64>> =
                (0..6).map(|seed| base_errors_ms(baud, usb, 80.0, jitter_ms, seed)).collect();
            let worst = runs.iter().map(|errors| rms(errors)).fold(0.0, f64::max);
            let largest = runs.iter().flatten().fold(0.0_f64, |maximum, error| maximum.max(error.abs()));
            println!("| base: {name} | {baud} | no | {worst:.3} | | {largest:.3} |");
            failed |= worst >= max_ms;
        }
    }
    assert!(!failed, "a row is beyond its gate");
}
