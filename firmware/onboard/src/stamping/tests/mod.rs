//! Stamping against a synthetic truth: a mirror that is off by a little, an adapter that is late by chance.

use crate::stamping::arrivals::Arrivals;
use crate::stamping::arrivals::Extent;
use crate::stamping::arrivals::Pace;
use crate::stamping::cycle_clock::CycleClock;
use crate::stamping::cycle_params::CycleClockParams;
use crate::stamping::departure::Departure;
use crate::stamping::departure::HostState;
use crate::stamping::envelope::Envelope;
use crate::stamping::envelope::EnvelopeParams;
use crate::types::byte_time::byte_time_ns;

pub(crate) mod overdue;
pub(crate) mod reads;

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

const TURN_NS: i64 = 13_320_000;

fn turn_clock() -> CycleClock {
    CycleClock::new(CycleClockParams::default(), TURN_NS)
}

fn extent(offset: u64, length: usize, byte_ns: i64) -> Extent {
    Extent { offset, length, byte_ns, burst: usize::MAX, spacing_ns: TURN_NS }
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
    let (mut arrivals, mut clock) = (Arrivals::default(), turn_clock());
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
        let telegram = extent(offset, line.bytes, byte_time_ns(line.baud));
        let bound = arrivals.departure(&telegram).unwrap();
        let departure = Departure {
            time_ns: bound.time_ns,
            pace: bound.pace,
            unit: i64::from(line.turns),
            is_next: scan > 0,
            min_cycles: i64::from(line.period_turns),
            index: None,
            host: HostState::Listening,
        };
        errors.push(clock.smooth(&departure) as f64 * 1e-9 - departure_s);
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
    Departure {
        time_ns,
        pace: Pace::Line,
        unit: 1,
        is_next: true,
        min_cycles: 1,
        index: None,
        host: HostState::Listening,
    }
}

#[test]
fn a_stamp_is_never_later_than_the_departure_that_the_reads_allow() {
    let mut random = Random(9);
    let mut clock = turn_clock();
    for scan in 0..2000_i64 {
        let time_ns = scan * 13_320_000 + (random.late_s() * 1e9) as i64;
        let smooth_ns = clock.smooth(&departure(time_ns));
        assert!(smooth_ns <= time_ns && time_ns - smooth_ns < 13_320_000);
    }
}

#[test]
fn the_phase_is_forgotten_after_a_gap_and_lifted_after_a_change() {
    let mut clock = turn_clock();
    assert_eq!(clock.smooth(&departure(0)), 0);
    assert_eq!(clock.smooth(&departure(6_000_000_000)), 6_000_000_000, "a gap of six seconds");
    let moved_ns = 6_000_000_000 + 5_000_000;
    let errors =
        (1..=100).map(|n| clock.smooth(&departure(moved_ns + n * 13_320_000)) - moved_ns - n * 13_320_000);
    let last = errors.last().unwrap();
    assert!(last.abs() < 200_000, "the phase moved by 5 ms and is followed: {last}");
    assert_eq!(clock.smooth(&departure(1_000)), 1_000, "a clock that stepped back starts anew");
}

#[test]
fn a_stall_of_the_adapter_moves_no_stamp_once_the_grid_is_trusted() {
    for (step_turns, stall_ns) in [(1_i64, 120_000_000), (8, 250_000_000)] {
        let step_ns = step_turns * 13_320_000;
        let mut clock = turn_clock();
        let stall_at_ns = 10 * step_ns;
        for scan in 0..80 {
            let true_ns = scan * step_ns;
            let is_held_back = (stall_at_ns..stall_at_ns + stall_ns).contains(&true_ns);
            let read_ns = if is_held_back { stall_at_ns + stall_ns } else { true_ns + 20_000 };
            let pace = if is_held_back { Pace::AtOnce } else { Pace::Line };
            let held = Departure { min_cycles: step_turns, pace, ..departure(read_ns) };
            let error_ns = clock.smooth(&held) - true_ns;
            assert!(error_ns.abs() < 200_000, "scan {scan} of {step_turns} turns: {error_ns} ns");
        }
    }
}

#[test]
fn another_cadence_than_the_lines_is_believed_when_it_repeats_itself() {
    for assumed in [1, 7, 9, 30] {
        let mut clock = turn_clock();
        for scan in 0..40_i64 {
            let true_ns = scan * 8 * 13_320_000;
            let error_ns = clock.smooth(&Departure { min_cycles: assumed, ..departure(true_ns) }) - true_ns;
            assert!(scan < 8 || error_ns.abs() < 100_000, "assumed {assumed}, scan {scan}: {error_ns} ns");
        }
    }
}

#[test]
fn telegrams_that_keep_to_no_grid_keep_their_own_times() {
    let mut random = Random(4);
    for min_cycles in [1, 8, 15] {
        let mut clock = turn_clock();
        let mut time_ns = 0;
        for _ in 0..3000 {
            // About 5 a second, as a log's stamps have it; now and then two close together.
            let interval_s = if random.unit() < 0.02 { 0.0075 } else { 0.155 + 0.05 * random.unit() };
            time_ns += (interval_s * 1e9) as i64;
            let early_ns = time_ns - clock.smooth(&Departure { min_cycles, ..departure(time_ns) });
            assert!((0..=2_000_000).contains(&early_ns), "step {min_cycles}: {early_ns} ns early");
        }
    }
}

#[test]
fn a_device_that_skips_a_scan_now_and_then_is_followed_after_a_moment() {
    let mut clock = turn_clock();
    for scan in 0..200_i64 {
        let skipped = i64::from(scan >= 100);
        let true_ns = (scan + skipped) * 13_320_000;
        let error_ns = clock.smooth(&departure(true_ns)) - true_ns;
        let is_settled = !(100..170).contains(&scan);
        assert!(!is_settled || error_ns.abs() < 200_000, "scan {scan}: {error_ns} ns");
    }
}

#[test]
fn lost_telegrams_leave_the_grid_alone() {
    let mut clock = turn_clock();
    for scan in (0..200_i64).filter(|scan| scan % 7 != 3) {
        let true_ns = scan * 8 * 13_320_000;
        let late_ns = if scan % 11 == 9 { 60_000_000 } else { 50_000 };
        let (is_next, min_cycles) = if scan % 7 == 4 { (false, 16) } else { (true, 8) };
        let pace = if late_ns > 1_000_000 { Pace::AtOnce } else { Pace::Line };
        let error_ns =
            clock.smooth(&Departure { is_next, min_cycles, pace, ..departure(true_ns + late_ns) }) - true_ns;
        assert!(error_ns.abs() < 300_000, "scan {scan}: {error_ns} ns");
    }
}

/// Departures of a device that lets scans out, with its index or without, and the error of each stamp.
fn skip_errors_ns(with_index: bool, skips: &[(i64, i64)], pace: Pace) -> Vec<(i64, i64)> {
    let mut clock = turn_clock();
    let (mut cycle, mut errors) = (0, Vec::new());
    for scan in 0..300_i64 {
        cycle += 8 + skips.iter().filter(|(at, _)| *at == scan).map(|(_, cycles)| cycles).sum::<i64>();
        let true_ns = cycle * TURN_NS;
        let index = with_index.then_some((cycle & 255) as u8);
        let smooth_ns =
            clock.smooth(&Departure { min_cycles: 8, index, pace, ..departure(true_ns + 30_000) });
        errors.push((scan, smooth_ns - true_ns));
    }
    errors
}

#[test]
fn scans_left_out_move_no_stamp_when_their_telegrams_came_at_pace_or_carry_an_index() {
    let skips = [(40, 1), (90, 13), (140, 300), (200, 2)];
    for (with_index, pace) in [(false, Pace::Line), (true, Pace::Line), (true, Pace::AtOnce)] {
        for (scan, error_ns) in skip_errors_ns(with_index, &skips, pace) {
            assert!(error_ns.abs() < 200_000, "index {with_index}, {pace:?}, scan {scan}: {error_ns} ns");
        }
    }
}

#[test]
fn scans_left_out_by_a_device_whose_telegrams_come_in_one_read_are_noticed_by_the_third_telegram_after() {
    for (scan, error_ns) in skip_errors_ns(false, &[(140, 13)], Pace::AtOnce) {
        assert!((140..142).contains(&scan) || error_ns.abs() < 200_000, "scan {scan}: {error_ns} ns");
    }
}

#[test]
fn an_index_that_counts_something_else_is_left_out_of_account() {
    let mut clock = turn_clock();
    for scan in 0..100_i64 {
        let true_ns = scan * 8 * TURN_NS;
        let departure = Departure { min_cycles: 8, index: Some(scan as u8), ..departure(true_ns) };
        let error_ns = clock.smooth(&departure) - true_ns;
        assert!(error_ns.abs() < 100_000, "scan {scan}: {error_ns} ns");
    }
}

#[test]
fn a_stream_that_was_stopped_for_a_while_goes_on_with_the_mirrors_phase() {
    let mut clock = turn_clock();
    let mut random = Random(5);
    for (begin, turns) in [(0_i64, 600_i64), (631, 600)] {
        for turn in begin..begin + turns {
            let true_ns = (turn as f64 * 13_318_668.0) as i64;
            let late_ns = (random.late_s() * 1e9) as i64;
            let error_ns = clock.smooth(&departure(true_ns + late_ns)) - true_ns;
            let is_settled = turn % 631 > 100;
            assert!(!is_settled || error_ns.abs() < 200_000, "turn {turn}: {error_ns} ns");
        }
    }
}

#[test]
fn the_envelope_learns_the_rate_and_keeps_the_phase() {
    for ppm in [-300.0, -100.0, 0.0, 40.0, 300.0] {
        let mut random = Random(17);
        let mut envelope = Envelope::new(EnvelopeParams::default(), TURN_NS, 0);
        let turn_ns = TURN_NS as f64 * (1.0 + ppm * 1e-6);
        let mut worst_ns = 0;
        for event in (8..8 * 600_i64).step_by(8) {
            let true_ns = (event as f64 * turn_ns) as i64;
            envelope.add(event, true_ns + (random.late_s() * 1e9) as i64);
            if event > 8 * 300 {
                worst_ns = worst_ns.max((envelope.at_ns(event) - true_ns).abs());
            }
        }
        let learned_ppm = (envelope.period_ns() / TURN_NS as f64 - 1.0) * 1e6;
        assert!(
            (learned_ppm - ppm).abs() < 10.0 && worst_ns < 200_000,
            "{ppm}: {learned_ppm} ppm, {worst_ns} ns"
        );
    }
}

#[test]
fn whatever_the_times_nothing_panics_and_no_stamp_is_later_than_its_departure() {
    let mut random = Random(77);
    for round in 0..200 {
        let (mut clock, mut arrivals) = (turn_clock(), Arrivals::default());
        let mut offset = 0;
        for _ in 0..200 {
            // Mostly a stream, now and then a time from anywhere that the engine lets through.
            let wild = random.unit() < 0.05;
            let span = if wild { i64::MAX as f64 / 2.0 } else { 1e9 * f64::from(round) };
            let time_ns = ((random.unit() * 2.0 - 1.0) * span) as i64;
            let length = 1 + (random.unit() * 900.0) as usize;
            offset += (random.unit() * 900.0) as u64;
            arrivals.push(offset + length as u64, time_ns);
            let telegram = Extent { spacing_ns: i64::MAX / 4, ..extent(offset, length, 1_041_666) };
            let Some(bound) = arrivals.departure(&telegram) else { continue };
            let smooth_ns = clock.smooth(&Departure {
                time_ns: bound.time_ns,
                pace: [Pace::AtOnce, Pace::Spread, Pace::Line][(random.unit() * 3.0) as usize],
                unit: 1 << (random.unit() * 3.0) as u32,
                min_cycles: if wild { i64::MAX } else { 8 },
                is_next: random.unit() < 0.8,
                index: (random.unit() < 0.5).then_some((random.unit() * 256.0) as u8),
                host: HostState::Listening,
            });
            assert!(smooth_ns <= bound.time_ns);
        }
    }
}
