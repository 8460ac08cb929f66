//! Manners of the device: what it refuses, ignores, forgets and remembers.

use super::{Bench, MS, hex};
use crate::devices::device::Device;
use crate::devices::lms::LmsParams;
use crate::devices::lms::frame::checksum;
use crate::devices::lms::settings::Variant;

const DONE: &str = "06 02 80 03 00 a0 00 10 16 0a";
const REFUSED: &str = "06 02 80 02 00 92 10 7f 33";

#[test]
fn a_wrong_checksum_is_answered_with_nak_alone() {
    let mut bench = Bench::new(LmsParams::default());
    assert_eq!(bench.ask("02 00 01 00 31 15 13"), [0x15]);
    assert_eq!(bench.device.counts().bad_checksums, 1);
}

#[test]
fn a_request_for_another_address_is_met_with_silence() {
    let mut bench = Bench::new(LmsParams { address: 3, ..LmsParams::default() });
    let to = |address: u8| {
        let mut request = vec![2, address, 1, 0, 0x32];
        request.extend(checksum(&request).to_le_bytes());
        request.iter().map(|byte| format!("{byte:02x} ")).collect::<String>()
    };
    assert_eq!(bench.ask(&to(1)), [0_u8; 0]);
    assert_eq!(bench.ask(&to(3))[..3], [0x06, 0x02, 0x83]);
    assert_eq!(bench.ask(&to(0))[..3], [0x06, 0x02, 0x83]);
}

#[test]
fn bytes_too_far_apart_are_no_request() {
    let mut bench = Bench::new(LmsParams::default());
    for byte in hex("02 00 01 00 31 15 12") {
        bench.device.handle(bench.now_ns, &[byte]);
        bench.run_ms(7);
    }
    assert_eq!(bench.bytes(), [0_u8; 0]);
}

#[test]
fn a_configuration_is_written_in_installation_mode_only() {
    let mut bench = Bench::new(LmsParams::default());
    let write = "02 00 08 00 77 00 00 46 00 00 01 01 a2 4e";
    assert_eq!(bench.ask(write), hex(REFUSED));
    assert_eq!(bench.device.eeprom_writes(), 0);
    let request = |body: &[u8]| {
        let mut bytes = vec![2, 0, u8::try_from(body.len()).expect("short"), 0];
        bytes.extend(body);
        bytes.extend(checksum(&bytes).to_le_bytes());
        bytes.iter().map(|byte| format!("{byte:02x} ")).collect::<String>()
    };
    assert_eq!(bench.ask(&request(b"\x20\x00SICK_LMT"))[1..7], hex("02 80 03 00 a0 01"));
    assert_eq!(bench.ask(write), hex(REFUSED));
    assert_eq!(bench.ask(&request(b"\x20\x00SICK_LMS")), hex(DONE));
    assert_eq!(bench.ask(write)[5..7], [0xF7, 1]);
    assert_eq!(bench.device.eeprom_writes(), 1);
    assert!(bench.device.config().is_mm());
}

#[test]
fn commands_that_it_does_not_know_are_refused() {
    let mut bench = Bench::new(LmsParams::default());
    assert_eq!(bench.ask("02 00 02 00 20 2e 3e 08"), hex(REFUSED));
    assert_eq!(bench.device.counts().refused, 1);
}

#[test]
fn a_quarter_degree_over_180_degrees_is_refused_and_the_old_variant_stays() {
    let mut bench = Bench::new(LmsParams::default());
    let mut request = hex("02 00 05 00 3b b4 00 19 00");
    request.extend(checksum(&request).to_le_bytes());
    bench.device.handle(bench.now_ns, &request);
    bench.run_ms(300);
    assert_eq!(bench.bytes()[5..11], [0xBB, 0, 180, 0, 50, 0]);
    assert_eq!(bench.device.variant(), Variant::of(180, 50));
}

#[test]
fn a_question_during_streaming_is_answered_and_the_scans_go_on() {
    let mut bench = Bench::new(LmsParams { baud: 500_000, left_streaming: true, ..LmsParams::default() });
    bench.run_ms(105);
    bench.say("02 00 01 00 31 15 12");
    bench.run_ms(400);
    let codes: Vec<u8> = bench.telegrams().iter().map(|(_, telegram)| telegram[4]).collect();
    assert_eq!(codes[..3], [0xB1, 0xB0, 0xB0]);
}

#[test]
fn one_scan_is_sent_on_request_and_no_more() {
    let mut bench = Bench::new(LmsParams::default());
    bench.say("02 00 02 00 30 01 31 18");
    bench.run_ms(3000);
    let telegrams = bench.telegrams();
    assert_eq!(telegrams.iter().map(|(_, t)| (t[4], t.len())).collect::<Vec<_>>(), [(0xB0, 732)]);
    assert!(telegrams[0].0 < 60 * MS, "{}", telegrams[0].0);
}

#[test]
fn noise_inside_a_request_spoils_it() {
    let mut bench = Bench::new(LmsParams::default());
    bench.device.handle(0, &hex("02 00 01"));
    bench.device.handle_noise(0, 2);
    bench.device.handle(0, &hex("00 31 15 12"));
    bench.run_ms(300);
    assert_eq!(bench.bytes(), [0_u8; 0]);
    assert_eq!(bench.device.counts().noise_bytes, 9);
}

#[test]
fn a_reset_stops_the_scans_keeps_the_fields_and_says_so_at_9600() {
    let mut bench = Bench::new(LmsParams {
        baud: 38_400,
        left_streaming: true,
        variant: Variant::of(180, 100),
        ..LmsParams::default()
    });
    bench.run_ms(1000);
    bench.say("02 00 01 00 10 34 12");
    bench.run_ms(1000);
    assert_eq!(bench.bytes(), hex("06 02 80 02 00 91 10 79 30"));
    assert_eq!(bench.device.baud(), 9600);
    bench.say("02 00 01 00 31 15 12");
    bench.run_ms(1500);
    assert_eq!(bench.telegrams().iter().map(|(_, t)| t[4]).collect::<Vec<_>>(), [0x90]);
    assert_eq!(bench.device.variant(), Variant::of(180, 100));
}

#[test]
fn a_rate_made_permanent_is_there_after_a_reset() {
    let mut bench = Bench::new(LmsParams { baud: 38_400, ..LmsParams::default() });
    let mut request = hex("02 00 02 00 66 01");
    request.extend(checksum(&request).to_le_bytes());
    bench.device.handle(bench.now_ns, &request);
    bench.run_ms(300);
    assert_eq!(bench.bytes()[5..7], [0xE6, 1]);
    bench.ask("02 00 01 00 10 34 12");
    bench.run_ms(2500);
    assert_eq!(bench.device.baud(), 38_400);
}

#[test]
fn the_rate_changes_a_moment_after_the_reply_at_the_old_one() {
    let mut bench = Bench::new(LmsParams::default());
    bench.say("02 00 02 00 20 40 50 08");
    while bench.received.len() < 10 {
        bench.run_ms(1);
    }
    assert_eq!(bench.device.baud(), 9600);
    bench.run_ms(15);
    assert_eq!(bench.device.baud(), 9600);
    bench.run_ms(10);
    assert_eq!(bench.device.baud(), 38_400);
}

#[test]
fn a_request_cuts_the_reply_on_the_line_and_the_announced_rate_comes_all_the_same() {
    let mut bench = Bench::new(LmsParams::default());
    bench.say("02 00 02 00 20 40 50 08");
    while bench.received.len() < 5 {
        bench.run_ms(1);
    }
    bench.device.handle(bench.now_ns, &hex("02 00 01 00 32 16 12"));
    bench.run_ms(300);
    assert_eq!(bench.device.baud(), 38_400);
    assert!(bench.bytes().len() < 10 + 9);
    assert_eq!(bench.telegrams().iter().map(|(_, t)| t[4]).collect::<Vec<_>>(), [0xB2]);
}

#[test]
fn a_laser_just_switched_on_says_who_it_is() {
    let mut bench = Bench::new(LmsParams { power_on_message: true, ..LmsParams::default() });
    bench.run_ms(100);
    let expected = "02 80 14 00 90 4c 4d 53 32 39 31 3b 53 30 35 3b 58 30 31 2e 32 37 20 10 d7 f7";
    assert_eq!(bench.bytes(), hex(expected));
}

#[test]
fn random_bytes_neither_stop_nor_change_the_device() {
    let mut rng = crate::rng::Rng::new(5, 0, 0);
    let mut bench = Bench::new(LmsParams::default());
    for _ in 0..2000 {
        let bytes: Vec<u8> = (0..50).map(|_| rng.bits().to_le_bytes()[3]).collect();
        bench.device.handle(bench.now_ns, &bytes);
        bench.run_ms(10);
    }
    bench.run_ms(1000);
    assert_eq!(bench.ask("02 00 02 00 20 25 35 08"), hex(DONE));
}
