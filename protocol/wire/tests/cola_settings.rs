//! CoLa: settings as real clients write them, in both dialects.

use biplane_wire::cola::{
    Dialect, Family, OutputRange, ScanConfig, ScanDataConfig, Telegram, emit_login, parse_login, parse_texts,
};

const LOGIN: &str = "02020202 00000017 734d4e20 5365744163636573734d6f6465 20 03f4724744 b3";

fn bytes(hex: &str) -> Vec<u8> {
    let digits: Vec<char> = hex.chars().filter(|letter| !letter.is_whitespace()).collect();
    digits.chunks(2).map(|pair| u8::from_str_radix(&pair.iter().collect::<String>(), 16).unwrap()).collect()
}

/// A telegram of CoLa A.
fn text(body: &str) -> Vec<u8> {
    [b"\x02", body.as_bytes(), b"\x03"].concat()
}

// Writes of three real lasers, and one of the manual; checksums behind.
const WRITES: [&str; 4] = [
    "02020202 00000020 73574e204c4d447363616e6461746163666720 0100 01 00 00 0000 00 00 00 01 0001 42",
    "02020202 00000020 73574e204c4d447363616e6461746163666720 0100 01 01 00 0000 00 00 00 01 0001 43",
    "02020202 00000021 73574e204c4d506f757470757452616e676520 0001 00000683 ffff3cb0 001c3a90 c5",
    "02020202 00000025 734d4e206d4c4d50736574736361 6e63666720 00001388 0001 00001388 fff92230 00225510 21",
];

/// What settings of a telegram are when they are read and written again, in this dialect.
fn rewritten(telegram: &Telegram<'_>, dialect: Dialect) -> Vec<u8> {
    let mut out = vec![0; 100];
    let length = match telegram.name {
        ScanDataConfig::NAME => ScanDataConfig::parse(telegram).unwrap().emit_data(dialect, &mut out),
        OutputRange::NAME => OutputRange::parse(telegram).unwrap().emit_data(dialect, &mut out),
        _ => ScanConfig::parse(telegram).unwrap().emit_data(dialect, &mut out),
    };
    out.truncate(length.unwrap());
    out
}

#[test]
fn settings_are_written_as_real_clients_write_them_and_read_alike_in_both_dialects() {
    for hex in WRITES {
        let frame = bytes(hex);
        let telegram = Telegram::parse(&frame).unwrap();
        assert_eq!(Some(&rewritten(&telegram, Dialect::B)[..]), telegram.data, "{hex}");
        let text = rewritten(&telegram, Dialect::A);
        let in_text = Telegram { dialect: Dialect::A, data: Some(&text), ..telegram };
        assert_eq!(Some(&rewritten(&in_text, Dialect::B)[..]), telegram.data, "{hex}");
        for end in 0..telegram.data.unwrap().len() {
            let cut = Telegram { data: Some(&telegram.data.unwrap()[..end]), ..telegram };
            let is_read = match telegram.name {
                ScanDataConfig::NAME => ScanDataConfig::parse(&cut).is_ok(),
                OutputRange::NAME => OutputRange::parse(&cut).is_ok(),
                _ => ScanConfig::parse(&cut).is_ok(),
            };
            assert!(!is_read, "{hex} up to {end}");
        }
    }
    // Of the manual: what a laser answers to the last one, as text, and its signed twin.
    let answer = text("sAN mLMPsetscancfg 0 1388 1 1388 FFF92230 225510");
    let (code, now) = ScanConfig::parse_answer(&Telegram::parse(&answer).unwrap()).unwrap();
    let asked = text("sMN mLMPsetscancfg +5000 +1 +5000 -450000 +2250000");
    assert_eq!((code, now), (0, ScanConfig::parse(&Telegram::parse(&asked).unwrap()).unwrap()));
    assert_eq!((now.rate_chz, now.start_e4deg), (5000, -450_000));
}

#[test]
fn a_login_is_that_of_the_captures_and_a_name_tells_the_family() {
    let frame = bytes(LOGIN);
    let telegram = Telegram::parse(&frame).unwrap();
    assert_eq!(parse_login(&telegram), Ok((3, 0xF472_4744)));
    let mut out = [0; 16];
    let length = emit_login(0xF472_4744, Dialect::B, &mut out).unwrap();
    assert_eq!(Some(&out[..length]), telegram.data);
    let length = emit_login(0xF472_4744, Dialect::A, &mut out).unwrap();
    assert_eq!(&out[..length], b"03 F4724744");
    let ident = text("sRA DeviceIdent 10 LMS10x_FieldEval 10 V1.36-21.10.2010");
    let [name, version] = parse_texts(&Telegram::parse(&ident).unwrap());
    assert_eq!((name, version), (&b"LMS10x_FieldEval"[..], &b"V1.36-21.10.2010"[..]));
    assert_eq!(Family::of_name(name), Some(Family::Lms1xx));
    assert_eq!(Family::of_name(b"E TIM561-2050101"), Some(Family::Tim5xx));
    assert_eq!(Family::of_name(b"LMS291"), None);
    for family in Family::ALL {
        let shots = |offer: &biplane_wire::cola::Offer| 3600 * offer.rate_chz / offer.step_e4deg * 10;
        assert!(family.offers().iter().all(|offer| shots(offer) <= 54_020), "{family:?}");
    }
}
