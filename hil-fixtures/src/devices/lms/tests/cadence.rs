//! When scans leave: every n-th scan as the line allows, the first byte on a boundary between mirror turns.

use super::{Bench, MS};
use crate::devices::device::Device;
use crate::devices::lms::LmsParams;
use crate::devices::lms::scans::feed::Mirror;
use crate::devices::lms::settings::{ConfigBlock, Variant};
use crate::line::transfer_ns;

const ALL: &str = "02 00 02 00 20 24 34 08";

fn streaming(baud: u32, variant: Variant) -> LmsParams {
    let mirror = Mirror { phase_ns: 4 * MS, ..Bench::mirror() };
    LmsParams { baud, variant, mirror, left_streaming: true, ..LmsParams::default() }
}

#[test]
fn scans_come_as_often_as_a_real_lms_sends_them_at_each_rate() {
    // Rate, step in hundredths of a degree, period in ms: transfer time rounded up to whole scans (telegram
    // listing's table).
    let cases = [
        (500_000, 100, 13.32),
        (500_000, 50, 26.64),
        (38_400, 100, 106.56),
        (38_400, 50, 213.12),
        (19_200, 50, 399.6),
        (9_600, 50, 772.56),
        (9_600, 100, 399.6),
    ];
    for (baud, resolution_cdeg, period_ms) in cases {
        let mut bench = Bench::new(streaming(baud, Variant::of(180, resolution_cdeg)));
        bench.run_ms(8000);
        let starts: Vec<i64> = bench.telegrams().iter().map(|(at_ns, _)| *at_ns).collect();
        assert!(starts.len() >= 9, "{baud} {resolution_cdeg}: {}", starts.len());
        for pair in starts.windows(2) {
            let period = (pair[1] - pair[0]) as f64 * 1e-6;
            assert!((period - period_ms).abs() < 1e-6, "{baud} Bd, {resolution_cdeg}: {period} ms");
        }
    }
}

#[test]
fn the_first_byte_leaves_on_a_boundary_between_scans() {
    let mut bench = Bench::new(streaming(38_400, Variant::of(180, 50)));
    bench.run_ms(3000);
    for (at_ns, _) in bench.telegrams() {
        let left_ns = at_ns - transfer_ns(1, 38_400);
        assert_eq!((left_ns - 4 * MS).rem_euclid(2 * Mirror::TURN_NS), 0);
    }
}

#[test]
fn a_half_degree_telegram_at_500000_pauses_after_508_bytes() {
    let mut bench = Bench::new(streaming(500_000, Variant::of(180, 50)));
    bench.run_ms(60);
    let bytes = &bench.received[..732];
    let start_ns = bytes[0].0 - 20_000;
    assert!(bytes[507].0 - start_ns <= 11 * MS);
    assert!(bytes[508].0 - start_ns >= Mirror::TURN_NS);
    assert!(
        (bytes[731].0 - start_ns - (Mirror::TURN_NS + 224 * 20_000)).abs() < 1_000,
        "{}",
        bytes[731].0 - start_ns
    );
}

#[test]
fn indices_count_mirror_turns_and_telegrams() {
    let mut config = ConfigBlock::default();
    config.0[4] = 2;
    let mut bench = Bench::new(LmsParams { config, ..streaming(38_400, Variant::of(180, 50)) });
    bench.run_ms(3000);
    let indices: Vec<(u8, u8)> =
        bench.telegrams().iter().map(|(_, t)| (t[t.len() - 5], t[t.len() - 4])).collect();
    assert!(indices.len() > 10);
    for pair in indices.windows(2) {
        assert_eq!(pair[1].0.wrapping_sub(pair[0].0), 16);
        assert_eq!(pair[1].1.wrapping_sub(pair[0].1), 1);
    }
}

#[test]
fn a_request_cuts_the_telegram_that_is_being_sent() {
    let mut bench = Bench::new(streaming(38_400, Variant::of(180, 50)));
    bench.run_ms(300);
    let before = bench.received.len();
    bench.device.handle(bench.now_ns, &super::hex("02 00 02 00 20 25 35 08"));
    bench.run_ms(500);
    let after: Vec<u8> = bench.bytes()[before..].to_vec();
    assert_eq!(after, super::hex("06 02 80 03 00 a0 00 10 16 0a"));
    assert_eq!(bench.device.counts().cut, 1);
    assert!(!bench.device.is_streaming());
}

#[test]
fn a_mean_of_five_comes_every_ten_turns_or_a_multiple_of_that() {
    let mut bench =
        Bench::new(LmsParams { left_streaming: false, ..streaming(38_400, Variant::of(180, 50)) });
    bench.say("02 00 03 00 20 26 05 79 3e");
    bench.run_ms(3000);
    let starts: Vec<i64> = bench.telegrams()[1..].iter().map(|(at_ns, _)| *at_ns).collect();
    assert!(starts.len() > 5);
    assert!(starts.windows(2).all(|pair| pair[1] - pair[0] == 20 * Mirror::TURN_NS));
}

#[test]
fn a_caller_that_is_held_up_gets_bytes_late_but_the_schedule_stays() {
    let mut bench = Bench::new(streaming(38_400, Variant::of(180, 100)));
    bench.run_ms(1000);
    let first_ns = bench.telegrams()[0].0;
    for _ in 0..20 {
        bench.now_ns += 37 * MS;
        bench.run_ms(150);
    }
    bench.received.clear();
    bench.run_ms(1000);
    for (at_ns, _) in bench.telegrams() {
        assert_eq!((at_ns - first_ns).rem_euclid(8 * Mirror::TURN_NS), 0);
    }
}

#[test]
fn every_nth_scan_is_sent_with_the_n_of_the_listings_table() {
    // SICK telegram listing 8007954, table of lost scans: 100/0.25, 180/0.5, 180/1 and the S14's ranges with
    // remission; scans of 4, 2, 1 and 1 turns.
    let table = [(9600, [16, 29, 30, 44]), (19_200, [8, 15, 15, 22]), (38_400, [4, 8, 8, 11])];
    let s14 = LmsParams::of_type("LMS291;S14;X01.27 ");
    for (baud, every) in table {
        let whole = [(100, 25), (180, 50), (180, 100)].map(|(fov_deg, step)| Variant::of(fov_deg, step));
        let whole =
            whole.map(|variant| (LmsParams { variant, ..LmsParams::default() }, variant.turns(), ALL));
        let remission = (s14.clone(), 1, "02 00 06 00 20 50 01 00 b5 00 68 b6");
        for ((params, turns, stream), every) in whole.into_iter().chain([remission]).zip(every) {
            let mut bench = Bench::new(LmsParams { baud, ..params });
            bench.say(stream);
            bench.run_ms(6000);
            let starts: Vec<i64> = bench.telegrams()[1..].iter().map(|(at_ns, _)| *at_ns).collect();
            assert!(starts.len() >= 5, "{baud} Bd, {turns} turns: {}", starts.len());
            for pair in starts.windows(2) {
                assert_eq!(pair[1] - pair[0], every * turns * Mirror::TURN_NS, "{baud} Bd, {turns} turns");
            }
        }
    }
}

#[test]
fn a_mirror_that_drifts_takes_its_scans_along() {
    for (ppm, turn_ns) in [(100.0, 13_321_332), (-100.0, 13_318_668)] {
        let mirror = Mirror::of_ppm(4 * MS, ppm);
        let mut bench = Bench::new(LmsParams { mirror, ..streaming(500_000, Variant::of(180, 100)) });
        bench.run_ms(2000);
        let starts: Vec<i64> = bench.telegrams().iter().map(|(at_ns, _)| *at_ns).collect();
        assert!(starts.len() > 140 && starts.windows(2).all(|pair| pair[1] - pair[0] == turn_ns), "{ppm}");
    }
}
