//! Stamping against a synthetic truth: a mirror that is off by a little, an adapter that is late by chance.

use super::*;

/// A small generator of its own (SplitMix64), so that the truth shares nothing with the code.
struct Random(u64);

impl Random {
    fn unit(&mut self) -> f64 {
        self.0 = self.0.wrapping_add(0x9E37_79B9_7F4A_7C15);
        let mut z = self.0;
        z = (z ^ (z >> 30)).wrapping_mul(0xBF58_476D_1CE4_E5B9);
        z = (z ^ (z >> 27)).wrapping_mul(0x94D0_49BB_1331_11EB);
        ((z ^ (z >> 31)) >> 11) as f64 / (1_u64 << 53) as f64
    }

    /// Lateness of a read, seconds: exponential with 0.3 ms mean, and up to 8 ms in 0.4 % of reads.
    fn late_s(&mut self) -> f64 {
        let usual = -0.000_3 * (1.0 - self.unit()).ln();
        if self.unit() < 0.004 { usual + 0.008 * self.unit() } else { usual }
    }
}

#[derive(Copy, Clone)]
enum Adapter {
    /// A read returns about every so many bytes, late by chance.
    Chunks(usize),
    /// A latency timer: a read returns at each of its ticks, with all that has arrived.
    Timer(f64),
}

struct Line {
    baud: u32,
    bytes: usize,
    turns: u8,
    period_turns: u32,
    drift_ppm: f64,
    adapter: Adapter,
}

/// Errors in seconds of the stamps of `scans` scans, in order.
fn errors_s(line: &Line, scans: u32, seed: u64) -> Vec<f64> {
    let mut random = Random(seed);
    let (mut arrivals, mut clock) = (Arrivals::default(), TurnClock::new(TurnClockParams::default()));
    let byte_s = 10.0 / f64::from(line.baud);
    let turn_s = 0.013_32 * (1.0 + line.drift_ppm * 1e-6);
    let (mut errors, mut last_read_s) = (Vec::new(), 0.0_f64);
    for scan in 0..scans {
        let departure_s = 100.0 + f64::from(scan * line.period_turns) * turn_s;
        let offset = u64::from(scan) * line.bytes as u64;
        for (bytes, read_s) in reads(line, departure_s, byte_s, &mut random) {
            last_read_s = read_s.max(last_read_s);
            arrivals.push(offset + bytes as u64, (last_read_s * 1e9).round() as i64);
        }
        let estimate = arrivals.departure_ns(offset, line.bytes, byte_time_ns(line.baud)).unwrap();
        let departure = Departure {
            time_ns: estimate,
            turns: line.turns,
            is_next: scan > 0,
            step_scans: i64::from(line.period_turns) / i64::from(line.turns),
        };
        errors.push(clock.smooth(departure) as f64 * 1e-9 - departure_s);
    }
    errors
}

/// Bytes so far and time of each read of one telegram.
fn reads(line: &Line, departure_s: f64, byte_s: f64, random: &mut Random) -> Vec<(usize, f64)> {
    let arrival_s = |bytes: usize| departure_s + bytes as f64 * byte_s;
    match line.adapter {
        Adapter::Chunks(chunk) => {
            let ends = (chunk..line.bytes).step_by(chunk).chain([line.bytes]);
            ends.map(|end| (end, arrival_s(end) + random.late_s())).collect()
        }
        Adapter::Timer(tick_s) => {
            let mut tick = (departure_s / tick_s).ceil() * tick_s;
            let mut out = Vec::new();
            while out.last().is_none_or(|&(bytes, _)| bytes < line.bytes) {
                let bytes = (((tick - departure_s) / byte_s) as usize).min(line.bytes);
                if bytes > 0 {
                    out.push((bytes, tick));
                }
                tick += tick_s;
            }
            out
        }
    }
}

fn rms_s(errors: &[f64]) -> f64 {
    (errors.iter().map(|e| e * e).sum::<f64>() / errors.len() as f64).sqrt()
}

const SLOW: Line = Line {
    baud: 38400,
    bytes: 732,
    turns: 2,
    period_turns: 16,
    drift_ppm: 0.0,
    adapter: Adapter::Chunks(1000),
};
const FAST: Line = Line {
    baud: 500_000,
    bytes: 372,
    turns: 1,
    period_turns: 1,
    drift_ppm: 0.0,
    adapter: Adapter::Chunks(1000),
};

#[test]
fn stamps_err_by_well_under_a_millisecond_with_chance_delays_and_a_mirror_that_is_off_by_100_ppm() {
    for drift_ppm in [-100.0, 0.0, 100.0] {
        for line in [Line { drift_ppm, ..SLOW }, Line { drift_ppm, ..FAST }] {
            for seed in 0..10 {
                let errors = errors_s(&line, 3000, seed);
                let rms = rms_s(&errors);
                assert!(rms < 0.000_3, "{} baud {drift_ppm} ppm: {rms} s", line.baud);
                let worst = errors.iter().skip(100).fold(0.0_f64, |a, e| a.max(e.abs()));
                assert!(worst < 0.002, "{} baud {drift_ppm} ppm: worst {worst} s", line.baud);
            }
        }
    }
}

#[test]
fn a_telegram_in_many_reads_is_stamped_from_its_promptest_read() {
    let line = Line { adapter: Adapter::Chunks(62), ..SLOW };
    let rms = rms_s(&errors_s(&line, 1000, 3));
    assert!(rms < 0.000_2, "{rms} s");
}

#[test]
fn a_latency_timer_of_16_ms_leaves_less_than_a_millisecond() {
    for drift_ppm in [-100.0, 100.0] {
        for line in [Line { drift_ppm, ..SLOW }, Line { drift_ppm, ..FAST }] {
            let line = Line { adapter: Adapter::Timer(0.016), ..line };
            let rms = rms_s(&errors_s(&line, 4000, 1)[50..]);
            assert!(rms < 0.001, "{} baud {drift_ppm} ppm: {rms} s", line.baud);
        }
    }
}

fn departure(time_ns: i64) -> Departure {
    Departure { time_ns, turns: 1, is_next: true, step_scans: 1 }
}

#[test]
fn a_stamp_is_never_later_than_the_departure_that_the_reads_allow() {
    let mut random = Random(9);
    let mut clock = TurnClock::new(TurnClockParams::default());
    for scan in 0..2000_i64 {
        let time_ns = scan * 13_320_000 + (random.late_s() * 1e9) as i64;
        let smooth_ns = clock.smooth(departure(time_ns));
        assert!(smooth_ns <= time_ns && time_ns - smooth_ns < 13_320_000);
    }
}

#[test]
fn the_phase_is_forgotten_after_a_gap_and_lifted_after_a_change() {
    let mut clock = TurnClock::new(TurnClockParams::default());
    assert_eq!(clock.smooth(departure(0)), 0);
    assert_eq!(clock.smooth(departure(6_000_000_000)), 6_000_000_000, "a gap of six seconds");
    let moved_ns = 6_000_000_000 + 5_000_000;
    let errors =
        (1..=100).map(|n| clock.smooth(departure(moved_ns + n * 13_320_000)) - moved_ns - n * 13_320_000);
    let last = errors.last().unwrap();
    assert!(last.abs() < 200_000, "the phase moved by 5 ms and is followed: {last}");
    assert_eq!(clock.smooth(departure(1_000)), 1_000, "a clock that stepped back starts anew");
}

#[test]
fn a_stall_of_the_adapter_moves_no_stamp_once_the_grid_is_trusted() {
    for (step_turns, stall_ns) in [(1_i64, 120_000_000), (8, 250_000_000)] {
        let step_ns = step_turns * 13_320_000;
        let mut clock = TurnClock::new(TurnClockParams::default());
        let stall_at_ns = 10 * step_ns;
        for scan in 0..80 {
            let true_ns = scan * step_ns;
            let is_held_back = (stall_at_ns..stall_at_ns + stall_ns).contains(&true_ns);
            let read_ns = if is_held_back { stall_at_ns + stall_ns } else { true_ns + 20_000 };
            let held = Departure { step_scans: step_turns, ..departure(read_ns) };
            let error_ns = clock.smooth(held) - true_ns;
            assert!(error_ns.abs() < 200_000, "scan {scan} of {step_turns} turns: {error_ns} ns");
        }
    }
}

#[test]
fn another_cadence_than_the_lines_is_believed_when_it_repeats_itself() {
    for assumed in [1, 7, 9, 30] {
        let mut clock = TurnClock::new(TurnClockParams::default());
        for scan in 0..40_i64 {
            let true_ns = scan * 8 * 13_320_000;
            let error_ns = clock.smooth(Departure { step_scans: assumed, ..departure(true_ns) }) - true_ns;
            assert!(scan < 8 || error_ns.abs() < 100_000, "assumed {assumed}, scan {scan}: {error_ns} ns");
        }
    }
}

#[test]
fn telegrams_that_keep_to_no_grid_keep_their_own_times() {
    let mut random = Random(4);
    for step_scans in [1, 8, 15] {
        let mut clock = TurnClock::new(TurnClockParams::default());
        let mut time_ns = 0;
        for _ in 0..3000 {
            // About 5 a second, as a log's stamps have it; now and then two close together.
            let interval_s = if random.unit() < 0.02 { 0.0075 } else { 0.155 + 0.05 * random.unit() };
            time_ns += (interval_s * 1e9) as i64;
            let early_ns = time_ns - clock.smooth(Departure { step_scans, ..departure(time_ns) });
            assert!((0..=2_000_000).contains(&early_ns), "step {step_scans}: {early_ns} ns early");
        }
    }
}

#[test]
fn a_device_that_skips_a_scan_now_and_then_is_followed_after_a_moment() {
    let mut clock = TurnClock::new(TurnClockParams::default());
    for scan in 0..200_i64 {
        let skipped = i64::from(scan >= 100);
        let true_ns = (scan + skipped) * 13_320_000;
        let error_ns = clock.smooth(departure(true_ns)) - true_ns;
        let is_settled = !(100..170).contains(&scan);
        assert!(!is_settled || error_ns.abs() < 200_000, "scan {scan}: {error_ns} ns");
    }
}

#[test]
fn lost_telegrams_leave_the_grid_alone() {
    let mut clock = TurnClock::new(TurnClockParams::default());
    for scan in (0..200_i64).filter(|scan| scan % 7 != 3) {
        let true_ns = scan * 8 * 13_320_000;
        let late_ns = if scan % 11 == 9 { 60_000_000 } else { 50_000 };
        let is_next = scan % 7 != 4;
        let error_ns =
            clock.smooth(Departure { is_next, step_scans: 8, ..departure(true_ns + late_ns) }) - true_ns;
        assert!(error_ns.abs() < 300_000, "scan {scan}: {error_ns} ns");
    }
}

#[test]
fn without_a_read_of_the_telegram_there_is_no_departure() {
    let mut arrivals = Arrivals::default();
    assert_eq!(arrivals.departure_ns(0, 10, 1000), None);
    arrivals.push(10, 5_000_000);
    assert_eq!(arrivals.departure_ns(10, 4, 1000), None);
    assert_eq!(arrivals.departure_ns(8, 4, 1000), Some(5_000_000 - 2 * 1000));
    assert_eq!(arrivals.departure_ns(0, 8, 1000), Some(5_000_000 - 8 * 1000));
}
