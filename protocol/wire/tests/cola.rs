//! CoLa: telegrams as devices send them, both dialects, damage, and captures of real lasers where they are.

use std::fs;
use std::path::PathBuf;

use biplane_wire::cola::{
    Channel, Clock, Deframer, Dialect, Event, Head, Kind, Scan, Telegram, Values, Width,
};
use biplane_wire::{Item, WireError};

fn bytes(hex: &str) -> Vec<u8> {
    let digits: Vec<char> = hex.chars().filter(|letter| !letter.is_whitespace()).collect();
    digits.chunks(2).map(|pair| u8::from_str_radix(&pair.iter().collect::<String>(), 16).unwrap()).collect()
}

fn emitted(telegram: &Telegram<'_>) -> Vec<u8> {
    let mut out = vec![0; telegram.encoded_len()];
    assert_eq!(telegram.emit(&mut out), Ok(out.len()));
    for shorter in 0..out.len() {
        let error = telegram.emit(&mut vec![0; shorter]);
        assert_eq!(error, Err(WireError::BufferTooSmall { needed: out.len(), found: shorter }));
    }
    out
}

/// A telegram and the same once more, written by its parts.
fn text(kind: Kind, name: &str, data: Option<&str>) -> Vec<u8> {
    let (name, data) = (name.as_bytes(), data.map(str::as_bytes));
    emitted(&Telegram { dialect: Dialect::A, kind, name, data })
}

/// Frames of a stream that comes in pieces of this length; all bytes are accounted for.
fn frames(stream: &[u8], piece: usize) -> Vec<Vec<u8>> {
    let (mut deframer, mut found) = (Box::new(Deframer::new()), Vec::new());
    let mut take = |item: Item<'_>| {
        if let Item::Frame { bytes, .. } = item {
            found.push(bytes.to_vec());
        }
    };
    stream.chunks(piece).for_each(|chunk| deframer.feed(chunk, &mut take));
    deframer.finish();
    while let Some(item) = deframer.next() {
        take(item);
    }
    assert_eq!(deframer.counts().bytes(), stream.len() as u64);
    found
}

// Bytes of the manual and of captures, written out by hand.
const LOGIN: &str = "02020202 00000017 734d4e20 5365744163636573734d6f6465 20 03f4724744 b3";
const REFUSAL: &str = "02020202 00000005 734641 000a 7e";

#[test]
fn telegrams_of_captures_are_what_they_say() {
    let login = bytes(LOGIN);
    let telegram = Telegram::parse(&login).unwrap();
    assert_eq!(
        (telegram.dialect, telegram.kind, telegram.name),
        (Dialect::B, Kind::Method, &b"SetAccessMode"[..])
    );
    assert_eq!(telegram.data, Some(&[3, 0xF4, 0x72, 0x47, 0x44][..]));
    assert_eq!(emitted(&telegram), login);
    let refusal = bytes(REFUSAL);
    let telegram = Telegram::parse(&refusal).unwrap();
    assert_eq!((telegram.kind, telegram.error_code()), (Kind::Error, Some(10)));
    assert_eq!(emitted(&telegram), refusal);
    let text = b"\x02sFA 1A\x03";
    let telegram = Telegram::parse(text).unwrap();
    assert_eq!((telegram.dialect, telegram.error_code()), (Dialect::A, Some(0x1A)));
    assert_eq!(emitted(&telegram), text);
}

#[test]
fn a_blank_behind_the_name_is_kept_and_none_is_made() {
    for body in ["sRN ODoprh", "sWA EIHstCola ", "sMN mLMPsetscancfg +5000 +1 +5000 -450000 +2250000"] {
        let frame = [&[2], body.as_bytes(), &[3]].concat();
        let telegram = Telegram::parse(&frame).unwrap();
        assert_eq!(telegram.data.is_some(), body.matches(' ').count() > 1, "{body}");
        assert_eq!(emitted(&telegram), frame);
    }
}

#[test]
fn every_truncation_and_every_flipped_bit_of_a_binary_telegram_is_an_error() {
    let login = bytes(LOGIN);
    for end in 0..login.len() {
        assert!(Telegram::parse(&login[..end]).is_err(), "{end}");
    }
    for bit in 0..login.len() * 8 {
        let mut damaged = login.clone();
        damaged[bit / 8] ^= 1 << (bit % 8);
        assert!(Telegram::parse(&damaged).is_err(), "{bit}");
    }
    let longer = [login, vec![0]].concat();
    assert!(matches!(Telegram::parse(&longer), Err(WireError::TooLong { .. })));
}

fn head() -> Head {
    Head {
        version: 1,
        device: 1,
        serial: 0x0114_097A,
        telegram_counter: 0xF77B,
        scan_counter: 0x17,
        scan_us: 0x742E_543D,
        sent_us: 0x742E_6048,
        outputs: [4, 0],
        scan_frequency_chz: 5000,
        shot_frequency_100hz: 360,
        ..Head::default()
    }
}

fn ranges<'a>(name: &[u8; 5], width: Width, numbers: &'a [u16]) -> Channel<'a> {
    Channel {
        name: *name,
        scale: 1.0,
        offset: 0.0,
        start_e4deg: -450_000,
        step_e4deg: 5000,
        width,
        values: Values::Numbers(numbers),
    }
}

fn scan<'a>(numbers: &'a [u16], remissions: &'a [u16]) -> Scan<'a> {
    let channels = [ranges(b"DIST1", Width::Word, numbers), ranges(b"RSSI1", Width::Byte, remissions)];
    Scan {
        head: head(),
        encoders: heapless::Vec::new(),
        channels: channels.into_iter().collect(),
        position: None,
        name: Some(b"front one"),
        comment: None,
        clock: Some(Clock { year: 1970, month: 1, day: 1, hour: 2, minute: 55, second: 35, us: 272_000 }),
        event: Some(None),
    }
}

#[test]
fn a_scan_of_text_is_that_of_an_lms111_as_it_was_pasted() {
    let data = "1 1 114097A 0 0 F77B 17 742E543D 742E6048 0 0 4 0 0 1388 168 0 1 DIST1 3F800000 00000000 FFF92230 \
        1388 5 5E 51 4D 53 0 0 0 0 0 0 0";
    let frame = text(Kind::Event, "LMDscandata", Some(data));
    let telegram = Telegram::parse(&frame).unwrap();
    let scan = Scan::parse(&telegram).unwrap();
    assert_eq!(scan.head, head());
    assert_eq!(scan.channels[0].values.iter().collect::<Vec<u16>>(), [0x5E, 0x51, 0x4D, 0x53, 0]);
    assert_eq!((scan.channels[0].start_e4deg, scan.channels[0].scale), (-450_000, 1.0));
    assert_eq!((scan.event, scan.clock), (Some(None), None));
    let mut out = [0; 300];
    let length = scan.emit_data(Dialect::A, &mut out).unwrap();
    assert_eq!(std::str::from_utf8(&out[..length]).unwrap(), data);
}

#[test]
fn numbers_of_a_text_may_be_decimal_with_a_sign() {
    let scan_of = |frame: &[u8]| {
        let scan = Scan::parse(&Telegram::parse(frame).unwrap());
        scan.map(|scan| {
            (scan.head.scan_frequency_chz, scan.channels[0].start_e4deg, scan.channels[0].step_e4deg)
        })
    };
    let data = |frequency: &str, start: &str, step: &str| {
        let data = format!(
            "1 1 1 0 0 1 1 1 1 0 0 0 0 0 {frequency} 168 0 1 DIST1 3F800000 00000000 {start} {step} 0 0 0 0 0 0 0"
        );
        text(Kind::Event, "LMDscandata", Some(&data))
    };
    assert_eq!(scan_of(&data("+5000", "-450000", "+5000")), Ok((5000, -450_000, 5000)));
    assert_eq!(scan_of(&data("1388", "FFF92230", "1388")), Ok((5000, -450_000, 5000)));
    for (frequency, start, step) in
        [("-1", "0", "1"), ("1", "+4294967296", "1"), ("1", "0", "10000"), ("x", "0", "1")]
    {
        let error = scan_of(&data(frequency, start, step)).unwrap_err();
        assert!(matches!(error, WireError::Value { .. }), "{frequency} {start} {step}: {error}");
    }
}

#[test]
fn a_scan_reads_back_as_it_was_written_in_both_dialects() {
    let (numbers, remissions) = ([0, 1, 16, 0xFFFF, 4711], [0, 1, 254, 255, 7]);
    let mut full = scan(&numbers, &remissions);
    full.event = Some(Some(Event { name: *b"FDIN", numbers: [1, 2, u32::MAX] }));
    for scan in [scan(&numbers, &remissions), scan(&[], &[]), full] {
        for dialect in [Dialect::A, Dialect::B] {
            let mut out = [0; 600];
            let length = scan.emit_data(dialect, &mut out).unwrap();
            let data = &out[..length];
            let telegram = |data| Telegram { dialect, kind: Kind::Event, name: Scan::NAME, data: Some(data) };
            assert_eq!(Scan::parse(&telegram(data)).as_ref(), Ok(&scan), "{dialect:?}");
            // A text may end behind any digit of its last number, and old firmware leaves the last block out.
            let whole = length - if dialect == Dialect::A { 40 } else { 2 };
            for end in 0..whole.min(length) {
                let cut = Scan::parse(&telegram(&data[..end]));
                assert!(cut.is_err() || cut.is_ok_and(|cut| cut != scan), "{dialect:?} {end}");
            }
        }
    }
}

#[test]
fn counts_that_promise_more_than_there_is_are_errors() {
    let (numbers, remissions) = ([7; 5], [9; 5]);
    let mut out = [0; 600];
    let length = scan(&numbers, &remissions).emit_data(Dialect::B, &mut out).unwrap();
    // Behind the head of 36 bytes: encoders; then channels; then the count of values of the first one.
    for place in [36, 38, 59] {
        let mut damaged = out[..length].to_vec();
        damaged[place..place + 2].copy_from_slice(&[0xFF, 0xFF]);
        let data = Some(damaged.as_slice());
        let telegram = Telegram { dialect: Dialect::B, kind: Kind::Event, name: Scan::NAME, data };
        let error = Scan::parse(&telegram).unwrap_err();
        assert!(matches!(error, WireError::Capacity { .. } | WireError::TooShort { .. }), "{place}: {error}");
    }
}

#[test]
fn telegrams_are_found_among_noise_in_any_pieces_and_across_a_change_of_dialect() {
    let (login, refusal) = (bytes(LOGIN), bytes(REFUSAL));
    let pasted = text(Kind::ReadAnswer, "SCdevicestate", Some("1"));
    let mut broken = login.clone();
    broken[12] ^= 1;
    let noise = [2, 2, 2, 2, 0xFF, 0xFF, 0xFF, 0xFF, b's', 3, 2, b's', b'X', 3];
    let stream = [&noise[..], &login, &pasted, &broken, &[2, 2], &refusal, &pasted, &login[..9]].concat();
    for piece in [1, 2, 7, 1000] {
        assert_eq!(frames(&stream, piece), [login.as_slice(), &pasted, &refusal, &pasted], "{piece}");
    }
}

/// Captures of real lasers, which are not part of the sources: `BIPLANE_DATA`, or the folder beside them.
fn captures() -> Vec<(String, String)> {
    let names = ["lms111", "lms511", "tim871s"];
    names.iter().filter_map(|name| Some((name.to_string(), data(name)?))).collect()
}

fn data(name: &str) -> Option<String> {
    let beside = concat!(env!("CARGO_MANIFEST_DIR"), "/../../../shared/data");
    let data = std::env::var_os("BIPLANE_DATA").map_or_else(|| PathBuf::from(beside), PathBuf::from);
    fs::read_to_string(data.join(format!("cola/{name}.txt"))).ok()
}

/// What another decoder says of a scan's channel, in its own words.
fn words_of(channel: &Channel<'_>, prefix: &str) -> Vec<(String, String)> {
    let values: Vec<u16> = channel.values.iter().collect();
    let list = |values: &[u16]| values.iter().map(u16::to_string).collect::<Vec<_>>().join(" ");
    let sum: u64 = values.iter().map(|value| u64::from(*value)).sum();
    let bits = if channel.width == Width::Word { 16 } else { 8 };
    let [start, step] = [f64::from(channel.start_e4deg) / 1e4, f64::from(channel.step_e4deg) / 1e4];
    let (scale, offset, count) = (channel.scale, channel.offset, values.len());
    let shape = format!(
        "bits {bits} scale {scale:.1} offset {offset:.1} start {start:?} step {step:?} count {count}"
    );
    let few = [&values[..values.len().min(10)], &values[values.len().saturating_sub(5)..]];
    vec![
        (prefix.to_owned(), shape),
        (format!("{prefix}_raw_sum"), sum.to_string()),
        (format!("{prefix}_raw_first"), list(few[0])),
        (format!("{prefix}_raw_last"), list(few[1])),
    ]
}

#[test]
fn scans_are_what_another_decoder_makes_of_them() {
    let Some(golden) = data("telegrams") else { return };
    let (mut scans, mut telegrams) = (0, 0);
    for block in golden.split("\n\n") {
        let field = |name: &str| block.lines().find_map(|line| line.strip_prefix(name)?.strip_prefix(' '));
        let Some(hex) = field("hex") else { continue };
        let (name, frame) = (field("name").unwrap(), bytes(hex));
        if let Some(expected) = field("telegrams_ok") {
            assert_eq!(frames(&frame, 100).len().to_string(), expected, "{name}");
            continue;
        }
        let telegram = Telegram::parse(&frame).unwrap_or_else(|error| panic!("{name}: {error}"));
        assert_eq!(emitted_once(&telegram), frame, "{name}");
        telegrams += 1;
        if field("dist1_raw_sum").is_none() {
            continue;
        }
        let scan = Scan::parse(&telegram).unwrap_or_else(|error| panic!("{name}: {error}"));
        let head = scan.head;
        let mut words = vec![
            ("telegram_counter".to_owned(), head.telegram_counter.to_string()),
            ("scan_counter".to_owned(), head.scan_counter.to_string()),
            ("t_start_us".to_owned(), head.scan_us.to_string()),
            ("t_transmit_us".to_owned(), head.sent_us.to_string()),
            ("status".to_owned(), format!("{} {}", head.status[0], head.status[1])),
            ("outputs".to_owned(), format!("{} {}", head.outputs[0], head.outputs[1])),
        ];
        for channel in &scan.channels {
            words.extend(words_of(channel, &String::from_utf8_lossy(&channel.name).to_lowercase()));
        }
        for (key, found) in words {
            assert_eq!(field(&key), Some(found.as_str()), "{name}: {key}");
        }
        scans += 1;
    }
    assert!(scans >= 6 && telegrams >= 60, "{scans} scans of {telegrams} telegrams");
}

#[test]
fn every_telegram_of_three_real_lasers_is_written_back_byte_for_byte() {
    for (name, capture) in captures() {
        let telegrams: Vec<Vec<u8>> =
            capture.lines().filter_map(|line| line.split(' ').nth(2)).map(bytes).collect();
        let (mut scans, mut counters) = (0, Vec::new());
        for bytes in &telegrams {
            let telegram = Telegram::parse(bytes).unwrap();
            assert_eq!(&emitted_once(&telegram), bytes, "{name}");
            if telegram.kind == Kind::Event && telegram.name == Scan::NAME {
                let scan = Scan::parse(&telegram).unwrap();
                let mut out = vec![0; bytes.len()];
                let length = scan.emit_data(Dialect::B, &mut out).unwrap();
                assert_eq!(Some(&out[..length]), telegram.data, "{name}");
                counters.push(scan.head.telegram_counter);
                scans += 1;
            }
        }
        counters.dedup();
        assert!(counters.windows(2).all(|pair| pair[1] == pair[0].wrapping_add(1)), "{name}");
        let expected = [("lms111", 277, 175), ("lms511", 277, 174), ("tim871s", 278, 150)];
        assert!(expected.contains(&(name.as_str(), telegrams.len(), scans)), "{name}: {scans}");
        for piece in [1460, 3] {
            assert_eq!(frames(&telegrams.concat(), piece), telegrams, "{name}");
        }
    }
}

fn emitted_once(telegram: &Telegram<'_>) -> Vec<u8> {
    let mut out = vec![0; telegram.encoded_len()];
    assert_eq!(telegram.emit(&mut out), Ok(out.len()));
    out
}
