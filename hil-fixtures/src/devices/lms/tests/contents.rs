//! What the telegrams hold, byte for byte: the layouts of the SICK telegram listing (sections 7.6, 7.29,
//! 7.37) written by hand, walls at 3 m all around.

use super::{Bench, MS, hex};
use crate::devices::lms::frame::checksum;
use crate::devices::lms::scans::feed::{Mirror, MirrorFeed, Timeline};
use crate::devices::lms::settings::{ConfigBlock, OLD_CONFIG_BYTES, Variant};
use crate::devices::lms::{LmsDevice, LmsParams};
use crate::rig::source::{ScanSource, ScanWords};
use biplane_wire::lms::{Reply, Telegram};

const DONE: &str = "02 80 03 00 a0 00 10 16 0a";
const REFUSED: &str = "02 80 02 00 92 10 7f 33";

fn request(body: &[u8]) -> String {
    let mut bytes = vec![2, 0, u8::try_from(body.len()).expect("short"), 0];
    bytes.extend(body);
    bytes.extend(checksum(&bytes).to_le_bytes());
    bytes.iter().map(|byte| format!("{byte:02x} ")).collect()
}

fn s14() -> LmsParams {
    LmsParams::of_type("LMS291;S14;X01.27 ")
}

/// Telegrams that follow a request within two seconds, at 38400 Bd.
fn answers(params: LmsParams, reported: &str) -> Vec<Vec<u8>> {
    let mut bench = Bench::new(LmsParams { baud: 38_400, ..params });
    bench.say(reported);
    bench.run_ms(2000);
    bench.telegrams().into_iter().map(|(_, telegram)| telegram).collect()
}

#[test]
fn one_telegram_on_request_has_the_bytes_of_its_layout() {
    let b7 = "02 80 0c 00 b7 05 00 06 00 02 00 2c 01 2c 01 10 4c 3a";
    let bf = "02 80 0d 00 bf 03 01 00 02 00 02 00 2c 01 2c 01 10 a2 0f";
    let f5 = "02 80 0e 00 f5 01 00 69 01 69 01 01 00 2c 01 b2 0c 10 07 b4";
    for (reported, received) in [
        ("02 00 05 00 37 05 00 06 00 14 0a", b7),
        ("02 00 06 00 3f 03 01 00 02 00 dc 6e", bf),
        ("02 00 07 00 75 01 00 69 01 69 01 cc 6e", f5),
    ] {
        assert_eq!(answers(LmsParams::default(), reported), [hex(received)], "{reported}");
    }
}

#[test]
fn parts_that_stream_have_the_bytes_of_their_layouts() {
    let bf = "02 80 0d 00 bf 02 01 00 02 00 02 00 2c 01 2c 01 10 b9 87";
    let f5 = "02 80 1c 00 f5 02 00 01 00 02 00 02 00 2c 01 b2 0c 2c 01 b2 0c 05 00 05 00 01 00 2c 01 b2 0c 10 81 13";
    for (reported, received) in [
        ("02 00 07 00 20 28 02 01 00 02 00 29 94", bf),
        ("02 00 08 00 20 28 02 00 01 00 02 00 61 bc", bf),
        ("02 00 0c 00 20 2b 02 00 01 00 02 00 05 00 05 00 9c 5a", f5),
    ] {
        let telegrams = answers(LmsParams::default(), reported);
        assert_eq!(telegrams[..3], [hex(DONE), hex(received), hex(received)], "{reported}");
    }
}

#[test]
fn whole_scans_means_and_thinned_scans_have_their_lengths_and_heads() {
    // Length of the telegram, code and what stands before the first value.
    for (reported, length, head) in [
        ("02 00 02 00 30 01 31 18", 732, "b0 69 01 2c 01"),
        ("02 00 02 00 30 06 36 18", 372, "b0 b5 00 2c 01"),
        ("02 00 02 00 30 07 37 18", 48, "b0 13 00 2c 01"),
        ("02 00 02 00 36 05 39 1e", 733, "b6 05 69 01 2c 01"),
    ] {
        let telegrams = answers(LmsParams::default(), reported);
        let head = hex(head);
        assert_eq!(telegrams.len(), 1, "{reported}");
        assert_eq!((telegrams[0].len(), &telegrams[0][4..4 + head.len()]), (length, &head[..]), "{reported}");
        assert_eq!(telegrams[0][length - 5..length - 2], [0x2C, 0x01, 0x10], "{reported}");
    }
    // One turn: whole degrees or the halves between them.
    let turn = &answers(LmsParams::default(), "02 00 02 00 30 08 38 18")[0];
    assert!([[0xB0, 0xB5, 0x20], [0xB0, 0xB4, 0x30]].contains(&[turn[4], turn[5], turn[6]]));
    assert_eq!(turn.len(), if turn[5] == 0xB5 { 372 } else { 370 });
}

#[test]
fn an_s14_has_181_values_in_each_turn_and_their_remissions() {
    let telegrams = answers(s14(), "02 00 05 00 44 03 00 04 00 1a 8f");
    // All ranges, then two remissions: 3 m is 3250 of 13000, 63 of 255.
    let mut data = hex("c4 b5 00");
    data.extend([0x2C, 0x01].repeat(181));
    data.extend(hex("02 00 03 00 04 00 3f 3f 10"));
    assert_eq!(telegrams.len(), 1);
    assert_eq!(telegrams[0][4..telegrams[0].len() - 2], data);

    let mut bench = Bench::new(LmsParams { baud: 500_000, ..s14() });
    bench.say("02 00 06 00 20 50 01 00 b5 00 68 b6");
    bench.run_ms(1000);
    let telegrams = &bench.telegrams()[1..];
    assert!(telegrams.len() > 60);
    assert!(telegrams.iter().all(|(_, telegram)| telegram.len() == 559));
    assert!(telegrams.windows(2).all(|pair| pair[1].0 - pair[0].0 == Mirror::TURN_NS));
    let refused: [&[u8]; 4] =
        [&[0x3B, 0xB4, 0, 0x32, 0], &[0x20, 0x2A], &[0x30, 8], &[0x20, 0x50, 1, 0, 182, 0]];
    for body in refused {
        assert_eq!(answers(s14(), &request(body)), [hex(REFUSED)], "{body:02x?}");
    }
    // And what only an S14 knows, others refuse.
    assert_eq!(answers(LmsParams::default(), "02 00 05 00 44 03 00 04 00 1a 8f"), [hex(REFUSED)]);
    assert_eq!(answers(LmsParams::default(), "02 00 06 00 20 50 03 00 04 00 1a 0e"), [hex(REFUSED)]);
}

#[test]
fn unit_mode_and_indices_of_the_configuration_shape_the_values() {
    let part = "02 00 05 00 37 01 00 02 00 3c 1e";
    // Availability, measuring mode, unit; the telegram.
    for (availability, mode, unit, received) in [
        (2, 0, 1, "02 80 0e 00 b7 01 00 02 00 02 40 b8 0b b8 0b 01 01 10"),
        (0, 6, 1, "02 80 0c 00 b7 01 00 02 00 02 40 b8 0b b8 0b 10"),
        (0, 0x0D, 0, "02 80 0c 00 b7 01 00 02 00 02 00 2c 01 2c 01 10"),
        (0, 0x0F, 1, "02 80 0c 00 b7 01 00 02 00 02 40 b8 0b b8 0b 10"),
        (0, 0x3F, 0, "02 80 0c 00 b7 01 00 02 00 02 00 b2 0c b2 0c 10"),
    ] {
        let mut config = ConfigBlock::default();
        config.0[4..7].copy_from_slice(&[availability, mode, unit]);
        let telegrams = answers(LmsParams { config, ..LmsParams::default() }, part);
        assert_eq!(telegrams[0][..telegrams[0].len() - 2], hex(received), "{mode:02x}");
    }
}

#[test]
fn every_reply_that_carries_values_is_read_back_by_the_wire_crate() {
    let mut config = ConfigBlock::default();
    config.0[4] = 2;
    let params = |text: &str| LmsParams { config, ..LmsParams::of_type(text) };
    let bodies: [&[u8]; 8] = [
        &[0x30, 1],
        &[0x30, 8],
        &[0x36, 2],
        &[0x37, 1, 0, 9, 0],
        &[0x3F, 2, 1, 0, 9, 0],
        &[0x75, 1, 0, 1, 0, 181, 0],
        &[0x44, 1, 0, 181, 0],
        &[0x20, 0x24],
    ];
    for body in bodies {
        let text = if body[0] == 0x44 { "LMS291;S14;X01.27 " } else { "LMS291;S05;X01.27 " };
        let telegrams = answers(params(text), &request(body));
        let frame = telegrams.last().expect("an answer");
        let telegram = Telegram::parse(frame).expect("a telegram");
        let reply = telegram.reply().expect("a reply");
        let index = match &reply {
            Reply::Scan(scan) => scan.index(),
            Reply::Pairs(pairs) => pairs.index(),
            Reply::S14(scan) => scan.index(),
            other => panic!("{body:02x?}: {other:?}"),
        };
        assert!(index.is_some(), "{body:02x?}");
    }
}

#[test]
fn what_no_source_tells_the_layout_of_is_refused() {
    let bodies: [&[u8]; 14] = [
        &[0x20, 0x20],
        &[0x20, 0x21],
        &[0x20, 0x22],
        &[0x20, 0x23],
        &[0x20, 0x29, 1, 0, 9, 0],
        &[0x20, 0x2C],
        &[0x20, 0x2E],
        &[0x30, 2],
        &[0x30, 3],
        &[0x37, 1, 0, 2, 0x80],
        &[0x3E, 1, 0, 9, 0],
        &[0x42, b'S', b'I', b'C', b'K', b'_', b'L', b'M', b'T'],
        &[0x76, 1, 0, 9, 0],
        &[0x20, 0x26, 251],
    ];
    for body in bodies {
        assert_eq!(answers(LmsParams::default(), &request(body)), [hex(REFUSED)], "{body:02x?}");
    }
}

#[test]
fn faults_are_listed_and_told_in_status_byte_and_report_until_a_reset() {
    let errors = vec![(2, 0x0B), (0x83, 5)];
    let mut bench = Bench::new(LmsParams { errors, ..LmsParams::default() });
    assert_eq!(bench.ask("02 00 01 00 32 16 12"), hex("06 02 80 06 00 b2 02 0b 83 05 12 99 8d"));
    let report = bench.ask("02 00 01 00 31 15 12");
    // Behind the ACK and four bytes of head the code stands at offset 0: mode at 8, fault at 9.
    assert_eq!(report[5 + 8..5 + 10], [0x25, 1]);
    bench.ask("02 00 01 00 10 34 12");
    bench.run_ms(3000);
    assert_eq!(bench.ask("02 00 01 00 32 16 12"), hex("06 02 80 02 00 b2 10 3f 13"));
    let report = bench.ask("02 00 01 00 31 15 12");
    assert_eq!(report[5 + 9], 0);
}

#[test]
fn the_hours_are_asked_for_with_a_word_by_outdoor_types_only() {
    for (text, word) in [("LMS200;30106;V02.10 ", false), ("LMS291;S05;X01.27 ", true)] {
        let with = &answers(LmsParams::of_type(text), "02 00 03 00 35 00 00 64 32")[0];
        let without = &answers(LmsParams::of_type(text), "02 00 01 00 35 11 12")[0];
        assert_eq!((with[4] == 0xB5, without[4] == 0xB5), (word, !word), "{text}");
    }
}

#[test]
fn an_old_firmware_has_a_block_of_32_bytes() {
    let params = LmsParams { config_bytes: OLD_CONFIG_BYTES, ..LmsParams::default() };
    let mut bench = Bench::new(params);
    let read = bench.ask("02 00 01 00 74 50 12");
    assert_eq!((read.len(), read[5]), (1 + 6 + 34, 0xF4));
    bench.ask("02 00 0a 00 20 00 53 49 43 4b 5f 4c 4d 53 be c5");
    let mut write = vec![0x77];
    write.extend(&ConfigBlock::default().with_units(true, 0).0[..32]);
    let written = bench.ask(&request(&write));
    assert_eq!((written.len(), written[5], written[6]), (1 + 6 + 35, 0xF7, 1));
    write.extend([0, 0]);
    assert_eq!(bench.ask(&request(&write))[5..7], [0xF7, 0]);
    assert_eq!(bench.device.eeprom_writes(), 1);
}

#[test]
fn the_second_block_is_84_bytes_and_is_kept() {
    let mut bench = Bench::new(LmsParams::default());
    let read = bench.ask("02 00 01 00 7b 5f 12");
    assert_eq!((read.len(), read[5]), (1 + 6 + 86, 0xFB));
    assert_eq!(bench.ask(&request(&[0x7C, 1, 2])), hex("06 02 80 02 00 92 10 7f 33"));
    bench.ask("02 00 0a 00 20 00 53 49 43 4b 5f 4c 4d 53 be c5");
    assert_eq!(bench.ask(&request(&[0x7C, 1, 2]))[5..9], [0xFC, 1, 1, 2]);
    assert_eq!(bench.ask("02 00 01 00 7b 5f 12")[5..9], [0xFB, 1, 2, 0]);
}

/// Scan n (of one turn, up to 59) has the value 100 n everywhere, a turn 10 n + its quarter.
struct Counting;

impl ScanSource for Counting {
    fn scan(&mut self, t0_ns: i64, _: u16, _: u16, _: bool) -> Option<ScanWords> {
        let n = u16::try_from(t0_ns / Mirror::TURN_NS).ok()?;
        Some(std::iter::repeat_n(100 * (n % 60), 181).collect())
    }

    fn turn(&mut self, t0_ns: i64, quarter: u8, _: bool) -> Option<ScanWords> {
        let n = u16::try_from(t0_ns / Mirror::TURN_NS).ok()?;
        Some(std::iter::repeat_n(10 * n + u16::from(quarter), if quarter == 0 { 181 } else { 180 }).collect())
    }
}

impl Timeline for Counting {
    fn world_ns(&self, device_ns: i64) -> i64 {
        device_ns
    }
}

fn counting(variant: Variant) -> Bench {
    let params = LmsParams { baud: 500_000, variant, ..LmsParams::default() };
    let feed = MirrorFeed::new(Box::new(Counting), Box::new(Counting));
    let device = LmsDevice::new(params, Box::new(feed));
    Bench::of(device)
}

#[test]
fn a_mean_is_that_of_the_scans_before_it() {
    let mut bench = counting(Variant::of(180, 100));
    bench.say(&request(&[0x36, 3]));
    bench.run_ms(300);
    let (first_ns, telegram) = bench.telegrams()[0].clone();
    let start_ns = first_ns - 20_000;
    let n = start_ns / Mirror::TURN_NS;
    assert_eq!((start_ns % Mirror::TURN_NS, n % 3), (0, 0));
    // The last three scans are n - 3, n - 2 and n - 1.
    let value = u16::from_le_bytes([telegram[8], telegram[9]]);
    assert_eq!(i64::from(value), 100 * (n - 2));
}

#[test]
fn single_turns_come_each_turn_with_the_beams_of_their_own_quarter() {
    for (resolution_cdeg, fov_deg, quarters) in [(25, 100, 4), (50, 180, 2), (100, 180, 1)] {
        let mut bench = counting(Variant::of(fov_deg, resolution_cdeg));
        bench.say("02 00 02 00 20 2a 3a 08");
        bench.run_ms(500);
        let telegrams = &bench.telegrams()[1..];
        assert!(telegrams.len() > 25);
        for (at_ns, telegram) in telegrams {
            let turn = (at_ns - 20_000) / Mirror::TURN_NS - 1;
            let quarter = turn % quarters * (4 / quarters);
            let word = u16::from_le_bytes([telegram[5], telegram[6]]);
            let count = if quarter == 0 { 181 } else { 180 };
            assert_eq!(i64::from(word), 0x2000 | quarter << 11 | count, "turn {turn}");
            assert_eq!(i64::from(u16::from_le_bytes([telegram[7], telegram[8]])), 10 * turn + quarter);
        }
        assert!(telegrams.windows(2).all(|pair| pair[1].0 - pair[0].0 == Mirror::TURN_NS));
    }
}

#[test]
fn a_mean_of_250_scans_comes_after_all_of_them_and_nobody_waits_inside_a_call() {
    let mut bench = counting(Variant::of(180, 100));
    bench.say(&request(&[0x20, 0x26, 250]));
    bench.run_ms(9000);
    let telegrams = bench.telegrams();
    assert_eq!(telegrams.len(), 3);
    assert_eq!(telegrams[2].0 - telegrams[1].0, 250 * Mirror::TURN_NS);
    assert!(telegrams[1].0 < 250 * Mirror::TURN_NS + 100 * MS);
}
