//! Messages byte for byte as others print them: the GoTo messages and the measurement with acceleration of
//! Xsens' documentation (MT0101P), the wake-up of Xsens' MTi 1-series example, and byte logs of an MTi-300
//! that the library xsens-mti (S. Cottam) keeps in its tests.

extern crate std;

use std::vec::Vec;

use super::{
    Command, Deframer, DeviceId, EVERY_SAMPLE, ErrorCode, ItemsWriter, Message, Output, Outputs, PREAMBLE,
    Precision, Report, Sample, checksum, quantity, status,
};
use crate::{Counts, Item, SkipReason, WireError};

const COMMANDS: [&str; 4] = [
    "FA FF 30 00 D1",
    "FA FF 10 00 F1",
    "FA FF C0 0C 40 20 00 64 80 20 00 64 C0 20 00 64 29",
    "FA FF C0 10 10 20 FF FF 10 60 FF FF 20 30 00 64 E0 20 FF FF E3",
];

const REPORTS: [&str; 9] = [
    "FA FF 3E 00 C3",
    "FA FF 31 00 D0",
    "FA FF 11 00 F0",
    "FA FF 8F 00 72",
    "FA FF C1 08 10 20 FF FF 10 60 FF FF 9C",
    "FA FF 13 0B 01 08 02 00 00 00 25 00 01 15 34 69",
    MEASUREMENT,
    SHAKEN,
    // Turn rates alone, in NWU axes.
    "FA FF 36 0F 80 40 0C 3B 8B BC 00 BB E2 4F 00 3B 4E 4A 00 AF",
];

/// The documentation's example.
const MEASUREMENT: &str = "FA FF 36 31 10 20 02 DF C5 10 60 04 00 45 9D A0 40 20 0C BE DC 9A FA 3F 54 9F 37 41 1C BB \
     70 80 20 0C BB AA 5C 80 3B 8C 55 01 BB 81 33 00 E0 20 04 00 00 00 81 45";

/// Of an MTi-300 that was shaken until sensors left their range; with items that are not known here.
const SHAKEN: &str = "FA FF 36 8B 10 20 02 FB 85 10 60 04 01 A4 98 DE 20 10 10 3F 2A 14 63 BE D7 EF A7 3C DE E5 08 3F \
     1D CE C9 40 20 0C C1 F2 46 C3 C1 EC E0 76 C2 8F 85 3F 40 10 0C BD 93 2C CC BD 92 0A 16 BE 3A 6E EC 40 30 0C \
     42 51 94 64 C2 7B 5A 5A C1 CC C0 AE 80 20 0C 40 85 4D 6D C1 25 55 9E C0 90 8E 1F 80 30 10 3F 7F F8 98 3B AA \
     9E E5 BC 53 9E C0 BB B9 06 0C C0 20 0C 3E DC 74 39 BE 75 2B 48 3F AF 9A 3F 30 10 04 00 01 86 DE E0 20 04 00 \
     48 14 01 8E";

fn bytes(line: &str) -> Vec<u8> {
    line.split_whitespace().map(|byte| u8::from_str_radix(byte, 16).expect("two hex digits")).collect()
}

fn all() -> Vec<Vec<u8>> {
    COMMANDS.iter().chain(&REPORTS).map(|line| bytes(line)).collect()
}

fn sample(line: &str) -> Sample {
    match Message::parse(&bytes(line)).and_then(|message| message.report()) {
        Ok(Report::Data(items)) => Sample::of(&items).expect("known items are whole"),
        other => panic!("{other:?}"),
    }
}

/// A message of this data, extended where it must be.
fn message(mid: u8, data: &[u8]) -> Vec<u8> {
    let mut out = std::vec![0; Message { mid, data }.encoded_len()];
    Message { mid, data }.emit(&mut out).expect("it fits");
    out
}

fn is_near(found: Option<[f64; 3]>, expected: [f64; 3]) -> bool {
    found.is_some_and(|found| found.iter().zip(expected).all(|(a, b)| (a - b).abs() <= 1e-7 * b.abs()))
}

#[test]
fn known_messages_mean_what_their_sources_say() {
    let measured = sample(MEASUREMENT);
    assert_eq!((measured.packet_counter, measured.time_fine), (Some(57_285), Some(4_562_336)));
    let acceleration = measured.acceleration_m_s2.expect("it is there");
    assert!((acceleration[2] - 9.795_76).abs() < 1e-5, "{acceleration:?}");
    assert!(is_near(measured.turn_rad_s, [-0.005_199_015_1, 0.004_282_594_2, -0.003_942_847_3]));
    let shaken = sample(SHAKEN);
    assert_eq!((shaken.packet_counter, shaken.time_fine), (Some(64_389), Some(27_564_254)));
    assert!(is_near(shaken.acceleration_m_s2, [-30.284_551_62, -29.609_600_07, -71.760_246_28]));
    assert!(is_near(shaken.turn_rad_s, [4.165_701_39, -10.333_402_63, -4.517_348_77]));
    let word = shaken.status_word.expect("it is there");
    assert!(word & status::CLIPPING != 0 && word & status::SELF_TEST != 0);
    fn report(line: &[u8]) -> Result<Report<'_>, WireError> {
        Message::parse(line).and_then(|message| message.report())
    }
    assert_eq!(
        report(&bytes(REPORTS[4])),
        Ok(Report::Outputs(Outputs::from_iter([
            Output { identifier: quantity::PACKET_COUNTER, rate_hz: EVERY_SAMPLE },
            Output { identifier: quantity::SAMPLE_TIME_FINE, rate_hz: EVERY_SAMPLE },
        ])))
    );
    // The number of that MTi-300, there in another message.
    let id = message(0x01, &[0x03, 0x70, 0x03, 0xF8]);
    assert_eq!(report(&id), Ok(Report::DeviceId(DeviceId::Short(0x0370_03F8))));
    let error = message(0x42, &[0x04]);
    assert_eq!(report(&error), Ok(Report::Error { code: ErrorCode(4), more: &[] }));
    let command = |line: &str| Message::parse(&bytes(line)).and_then(|message| message.command());
    assert_eq!(command(COMMANDS[0]), Ok(Command::GoToConfig));
    assert_eq!(command(COMMANDS[1]), Ok(Command::GoToMeasurement));
    let Ok(Command::SetOutputs(outputs)) = command(COMMANDS[2]) else { panic!("outputs") };
    assert_eq!(outputs[1], Output { identifier: quantity::RATE_OF_TURN, rate_hz: 100 });
}

#[test]
fn every_message_comes_back_as_it_was_in_all_its_forms() {
    let long: Vec<u8> = (0..300).map(|n| (n % 251) as u8).collect();
    let mut messages = all();
    messages.extend([254, 255, 300].map(|count| message(0x70, &long[..count])));
    for bytes in messages {
        let view = Message::parse(&bytes).expect("intact");
        let mut out = std::vec![0; bytes.len()];
        let report = view.report().expect("whole");
        assert_eq!((view.emit(&mut out), &out), (Ok(bytes.len()), &bytes));
        out.fill(0);
        assert_eq!((report.emit(&mut out), &out), (Ok(bytes.len()), &bytes));
        if let Ok(command) = view.command() {
            out.fill(0);
            assert_eq!((command.emit(&mut out), &out), (Ok(bytes.len()), &bytes));
        }
        assert_eq!(report.encoded_len(), bytes.len());
        for end in 0..bytes.len() {
            let cut = Message::parse(&bytes[..end]);
            assert!(matches!(cut, Err(WireError::TooShort { .. })), "{end}: {cut:?}");
            let small = report.emit(&mut out[..end]);
            assert!(matches!(small, Err(WireError::BufferTooSmall { .. })), "{end}: {small:?}");
        }
    }
}

#[test]
fn numbers_come_back_in_every_precision() {
    let (turns, forces) = ([0.5, -1.25, 3.0e-5], [9.806_65, -157.3, -0.0]);
    let steps = [1e-5, 1e-6, 3e-10, 0.0];
    for (precision, step) in Precision::ALL.into_iter().zip(steps) {
        let written = Sample {
            packet_counter: Some(65_535),
            time_fine: Some(u32::MAX),
            time_coarse_s: Some(429_496),
            acceleration_m_s2: Some(forces),
            turn_rad_s: Some(turns),
            status_word: Some(status::SELF_TEST),
        };
        let mut writer = ItemsWriter::default();
        written.write(precision, &mut writer).expect("there is room");
        let read = super::Items::parse(writer.bytes()).and_then(|items| Sample::of(&items)).expect("whole");
        let numbers = |sample: &Sample| {
            [sample.turn_rad_s.expect("there"), sample.acceleration_m_s2.expect("there")].concat()
        };
        for (a, b) in numbers(&read).into_iter().zip(numbers(&written)) {
            assert!((a - b).abs() <= step, "{precision:?}: {a} {b}");
        }
        let rest = Sample { turn_rad_s: None, acceleration_m_s2: None, ..written };
        assert_eq!(Sample { turn_rad_s: None, acceleration_m_s2: None, ..read }, rest);
        assert_eq!(Precision::of(quantity::ACCELERATION | precision.bits()), precision);
    }
    // -1.25 in fixed points: as the fraction first, then the whole.
    let item = |identifier: u16, data: &[u8]| {
        let mut bytes = identifier.to_be_bytes().to_vec();
        bytes.push(data.len() as u8);
        bytes.extend(data);
        super::Items::parse(&bytes).and_then(|items| Sample::of(&items)).map(|sample| sample.turn_rad_s)
    };
    let fixed = [0xC0, 0, 0, 0, 0xFF, 0xFE].repeat(3);
    assert_eq!(item(0x8022, &fixed), Ok(Some([-1.25; 3])));
    assert_eq!(item(0x8021, &[0xFF, 0xEC, 0, 0].repeat(3)), Ok(Some([-1.25; 3])));
    let short = item(0x8020, &[0; 11]);
    assert!(matches!(short, Err(WireError::TooShort { .. })), "{short:?}");
    assert!(matches!(item(0x8020, &[0; 16]), Err(WireError::TooLong { .. })));
}

/// What a stream in pieces of this size is cut into.
fn cut(stream: &[u8], size: usize) -> (Vec<Vec<u8>>, Counts) {
    let (mut line, mut frames) = (Deframer::new(), Vec::new());
    for chunk in stream.chunks(size) {
        line.feed(chunk, |item| {
            if let Item::Frame { bytes, .. } = item {
                frames.push(bytes.to_vec());
            }
        });
    }
    line.finish();
    while let Some(item) = line.next() {
        if let Item::Frame { bytes, .. } = item {
            frames.push(bytes.to_vec());
        }
    }
    (frames, line.counts())
}

#[test]
fn messages_come_out_whole_from_any_pieces_between_noise_and_damage() {
    let mut good = all();
    good.push(message(0x70, &[0xFA; 400]));
    let mut damaged = bytes(MEASUREMENT);
    damaged[20] ^= 0x10;
    let mut stream = bytes("00 FA FA 13 FF FA FF 36");
    for (index, message) in good.iter().enumerate() {
        stream.extend(message);
        if index % 3 == 1 {
            stream.extend(&damaged);
        }
    }
    for size in [1, 2, 3, 7, 64, 4096] {
        let (frames, counts) = cut(&stream, size);
        assert_eq!(frames, good, "pieces of {size}");
        assert_eq!(counts.bytes(), stream.len() as u64);
        assert!(counts.bad_checksums >= 4, "{counts:?}");
    }
}

#[test]
fn lengths_that_cannot_be_true_hold_nothing_up() {
    for extended in [[0x00, 0xFE], [0x08, 0x01], [0xFF, 0xFF]] {
        let mut stream = std::vec![PREAMBLE[0], PREAMBLE[1], 0x36, 0xFF, extended[0], extended[1]];
        let mut line = Deframer::new();
        line.push(&stream);
        let first = line.next();
        assert!(matches!(first, None | Some(Item::Skipped { reason: SkipReason::BadLength, .. })));
        stream.extend(bytes(REPORTS[0]));
        let (frames, counts) = cut(&stream, 64);
        assert_eq!(frames, [bytes(REPORTS[0])], "{extended:?}");
        assert_eq!(counts.bad_lengths, 1);
        stream.truncate(6);
        stream.extend([0; 300]);
        assert!(Message::parse(&stream).is_err());
    }
}

#[test]
fn random_data_behind_every_identifier_fails_or_comes_back_unchanged() {
    let mut state = 1_u64;
    let mut random = move || {
        state = state.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
        (state >> 33) as usize
    };
    let mut read = 0_u32;
    for round in 0..20_000 {
        let mid = [0x36, 0xC1, 0x01, 0x42, (round % 256) as u8][random() % 5];
        let data: Vec<u8> = (0..random() % 24)
            .map(|place| if place % 15 == 2 && random() % 2 == 0 { 12 } else { random() as u8 })
            .collect();
        let bytes = message(mid, &data);
        let view = Message::parse(&bytes).expect("the frame is good");
        let mut out = std::vec![0; bytes.len()];
        if let Ok(report) = view.report() {
            read += 1;
            assert_eq!((report.emit(&mut out), &out), (Ok(bytes.len()), &bytes));
            if let Report::Data(items) = report {
                let _ = Sample::of(&items);
                assert!(items.iter().map(|item| 3 + item.bytes.len()).sum::<usize>() == data.len());
            }
        }
        if let Ok(command) = view.command() {
            out.fill(0);
            assert_eq!((command.emit(&mut out), &out), (Ok(bytes.len()), &bytes));
        }
        let mut bent = bytes.clone();
        bent[random() % bytes.len()] ^= 1 << (random() % 8);
        assert!(Message::parse(&bent).is_err(), "one bit is always noticed");
    }
    assert!(read > 5_000, "{read}");
    assert_eq!(checksum(&[0xFF; 256]), 0);
}
