//! Scripted sessions with a laser. Telegrams are those of the listing and of logs of real devices, by hand.

pub(crate) mod bench;
pub(crate) mod search;
pub(crate) mod stop;
pub(crate) mod telegrams;
pub(crate) mod types;
pub(crate) mod write;

use biplane_wire::lms::{Config, Reply, Scan, Status, Unit};

use super::*;
use crate::session::device_session::MAX_INPUT_BYTES;
use crate::session::event::Event;
use crate::session::lms::scan::ranges::ScanIndex;
use crate::session::lms::scan::ranges::ScanReading;
use crate::session::lms::scan::scan_geometry::ScanGeometry;
use crate::session::testing::noise::{Noise, endure};
use crate::session::testing::script::{check, play, scan_telegram};

/// Centimeters every half degree, all else as it is set.
pub(crate) const HALF: LaserSettings = LaserSettings {
    baud: 38400,
    fov_deg: 180,
    resolution_cdeg: 50,
    unit: Unit::Cm,
    range_max_m: None,
    index_bytes: None,
    remission: false,
    dazzle_tolerant: None,
};

const STOP: &str = "> 02 00 02 00 20 25 35 08";
const MODE_DONE: &str = "< 02 80 03 00 A0 00 10 16 0A";
const ASK_TYPE: &str = "> 02 00 01 00 3A 1E 12";
const TYPE: &str = "< 02 80 14 00 BA 4C 4D 53 32 39 31 3B 53 30 35 3B 58 30 31 2E 32 37 20 10 3D 00";
const ASK_CONFIG: &str = "> 02 00 01 00 74 50 12";
/// Measuring mode 00, centimeters.
const CONFIG: &str = "< 02 80 24 00 F4 00 00 46 00 00 00 00 00 00 02 02 02 00 00 0A 0A 50 64 00 0A 0A 50 64 00 0A 0A 50 64 00 00 00 00 02 00 10 AA 4F";
const ASK_STATUS: &str = "> 02 00 01 00 31 15 12";
/// 180 degrees in steps of a half, 38400 Bd.
const STATUS: &str = "< 02 80 9A 00 B1 58 30 31 2E 32 37 20 25 00 00 00 40 00 00 00 00 00 00 64 00 65 00 66 00 67 00 68 00 69 00 6A 00 6B 00 6C 00 6D 00 6E 00 6F 00 70 00 71 00 72 00 73 00 74 00 75 00 76 00 77 00 78 00 79 00 7A 00 7B 00 94 00 00 00 50 00 50 00 50 00 50 00 50 00 50 00 50 00 50 00 50 00 50 00 50 00 50 00 50 00 50 00 50 00 00 00 00 00 00 00 B4 00 32 00 02 02 00 00 00 19 80 02 00 00 01 00 01 56 30 32 2E 31 30 20 00 00 00 00 00 00 00 00 00 00 00 00 00 00 00 00 00 00 00 00 00 00 10 43 FF";
const ASK_FAULTS: &str = "> 02 00 01 00 32 16 12";
const NO_FAULTS: &str = "< 02 80 02 00 B2 10 3F 13";
const STREAM: &str = "> 02 00 02 00 20 24 34 08";

fn streaming(settings: LaserSettings) -> LaserSession {
    LaserSession::streaming(settings, 0)
}

/// What follows when the rate is found, from a time on, 10 ms a step.
fn settings_read(from_ms: i64) -> String {
    let [a, b, c, d, e] = [0, 10, 20, 30, 40].map(|step| from_ms + step);
    format!(
        "{a} {TYPE}\n{a} ! is a LMS291;S05;X01.27\n{a} ! answers at 38400 Bd\n{a} {ASK_CONFIG}\n\
         {b} {CONFIG}\n{b} {ASK_STATUS}\n{c} {STATUS}\n{c} {ASK_FAULTS}\n{d} {NO_FAULTS}\n{d} {STREAM}\n\
         {e} {MODE_DONE}\n{e} ! streams"
    )
}

#[test]
fn a_device_at_the_configured_rate_streams_after_six_questions() {
    let script = format!(
        "0 = 38400\n0 {STOP}\n80 < 06\n80 {MODE_DONE}\n80 {ASK_TYPE}\n{}\n200 < scan361\n200 * 361 beams",
        settings_read(90)
    );
    check(&mut streaming(HALF), &script);
}

#[test]
fn a_refused_variant_is_tried_three_times_then_the_device_keeps_its_own() {
    let settings = LaserSettings { resolution_cdeg: 100, ..HALF };
    let set = "> 02 00 05 00 3B B4 00 64 00 97 49";
    let refused = "< 02 80 02 00 92 10 7F 33";
    let reported = "! refused while setting field of view and resolution";
    let script = format!(
        "0 = 38400\n0 {STOP}\n80 {MODE_DONE}\n80 {ASK_TYPE}\n90 {TYPE}\n90 ! is a LMS291;S05;X01.27\n\
         90 ! answers at 38400 Bd\n90 {ASK_CONFIG}\n100 {CONFIG}\n100 {ASK_STATUS}\n105 {STATUS}\n105 {ASK_FAULTS}\n110 {NO_FAULTS}\n110 {set}\n\
         120 {refused}\n120 {reported}\n180 {set}\n190 {refused}\n190 {reported}\n250 {set}\n\
         260 {refused}\n260 {reported}\n320 ! gave up setting field of view and resolution\n\
         320 ! keeps 180 degrees in steps of 0.50, not what is configured\n320 {STREAM}\n330 {MODE_DONE}\n\
         330 ! streams\n400 < scan361\n400 * 361 beams"
    );
    check(&mut streaming(settings), &script);
}

#[test]
fn silence_while_streaming_starts_the_search_again() {
    let script = format!(
        "0 = 38400\n0 {STOP}\n80 {MODE_DONE}\n80 {ASK_TYPE}\n{}\n200 < scan361\n200 * 361 beams\n\
         1100 ! silent for 900 ms, starting again\n1100 = 38400\n1100 {STOP}\n1200 end",
        settings_read(90)
    );
    check(&mut streaming(HALF), &script);
}

#[test]
fn a_stop_leaves_the_device_idle_and_a_lost_answer_is_asked_for_again() {
    let script = format!(
        "0 = 38400\n0 {STOP}\n80 {MODE_DONE}\n80 {ASK_TYPE}\n{}\n200 stop\n200 {STOP}\n450 {STOP}\n\
         450 ! no answer while stopping continuous output, attempt 2\n620 {MODE_DONE}\n620 ! left idle at 38400 Bd\n700 end",
        settings_read(90)
    );
    let mut session = streaming(HALF);
    check(&mut session, &script);
    assert!(session.is_done());
}

#[test]
fn a_scan_that_was_held_back_until_after_the_stop_is_kept() {
    let script = format!(
        "0 = 38400\n0 {STOP}\n80 {MODE_DONE}\n80 {ASK_TYPE}\n{}\n200 stop\n200 {STOP}\n210 < scan361\n210 * 361 beams\n\
         260 {MODE_DONE}\n260 ! left idle at 38400 Bd\n700 end",
        settings_read(90)
    );
    check(&mut streaming(HALF), &script);
}

/// Three times in vain, from `at` on: 250 ms and 160 bytes' time each.
fn asked_in_vain(at_ns: i64, question: &str, words: &str) -> String {
    let after = |times: i64| (at_ns + times * (250_000_000 + 160 * 260_416)) / 1_000_000;
    let mut script = format!("{} {question}\n", after(0));
    for attempt in [2, 3] {
        let time = after(attempt - 1);
        script += &format!("{time} {question}\n{time} ! no answer while {words}, attempt {attempt}\n");
    }
    script + &format!("{} ! gave up {words}\n", after(3))
}

#[test]
fn a_configuration_that_cannot_be_read_leaves_13_bits_and_is_said() {
    let script = format!(
        "0 = 38400\n0 {STOP}\n80 {MODE_DONE}\n80 {ASK_TYPE}\n90 {TYPE}\n90 ! is a LMS291;S05;X01.27\n\
         90 ! answers at 38400 Bd\n{}{}1839 {ASK_FAULTS}\n1850 {NO_FAULTS}\n\
         1850 > 02 00 05 00 3B B4 00 32 00 3B 1F\n1900 < 02 80 07 00 BB 01 B4 00 32 00 10 03 9D\n1900 {STREAM}\n\
         1910 {MODE_DONE}\n1910 ! streams\n2000 < scan361\n\
         2000 ! configuration not known, ranges read with measuring mode 00 (13 bits)\n2000 * 361 beams",
        asked_in_vain(90_000_000, ASK_CONFIG, "reading the configuration"),
        asked_in_vain(964_999_680, ASK_STATUS, "reading the status"),
    );
    check(&mut streaming(HALF), &script);
}

#[test]
fn without_a_configuration_the_status_report_tells_the_measuring_mode() {
    let lines = format!(
        "80 {MODE_DONE}\n90 {TYPE}\n1000 {STATUS}\n1010 {NO_FAULTS}\n1020 {MODE_DONE}\n1100 < scan361\n1101 end"
    );
    let lines: Vec<String> = lines.lines().map(str::to_owned).collect();
    let transcript = play(&mut streaming(HALF), &lines).join("\n");
    assert!(transcript.contains("1100 * 361 beams") && !transcript.contains("not known"), "{transcript}");
}

#[test]
fn probing_changes_nothing_and_ends() {
    let settings = LaserSettings { baud: 9600, resolution_cdeg: 100, unit: Unit::Mm, fov_deg: 100, ..HALF };
    let mut session = LaserSession::probing(settings, 0);
    let script = format!(
        "0 = 9600\n0 {STOP}\n150 {STOP}\n300 = 38400\n300 {STOP}\n380 {MODE_DONE}\n380 {ASK_TYPE}\n400 {TYPE}\n\
         400 ! is a LMS291;S05;X01.27\n400 ! answers at 38400 Bd\n400 {ASK_CONFIG}\n610 {CONFIG}\n\
         610 {ASK_STATUS}\n620 {STATUS}\n620 {ASK_FAULTS}\n640 < 02 80 04 00 B2 03 0C 13 7B 26\n640 ! reports error 12\n700 end"
    );
    check(&mut session, &script);
    assert!(session.is_done());
    let info = session.info();
    assert_eq!((info.variant, info.found_baud), (Some((180, 50)), Some(38400)));
    assert_eq!(info.firmware.as_str(), "X01.27");
}

#[test]
fn listening_may_begin_inside_a_telegram_and_asks_nothing() {
    let mut session = LaserSession::listening(HALF, 0);
    let scan = scan_telegram(361);
    let mut bytes = scan[500..].to_vec();
    bytes.extend_from_slice(&scan);
    bytes.extend_from_slice(&scan[..300]);
    let mut scans = 0;
    for (index, chunk) in bytes.chunks(MAX_INPUT_BYTES).enumerate() {
        session.handle(index as i64 * 60_000_000, Input::Bytes(chunk));
        loop {
            match session.poll() {
                Output::WaitUntil(at_ns) => {
                    assert_eq!(at_ns, i64::MAX);
                    break;
                }
                Output::Scan(scan) => {
                    scans += 1;
                    assert_eq!((scan.offset, scan.length), (232, 732));
                    assert_eq!(&scan.ranges_m[..2], &[1.0, 1.01]);
                    assert_eq!(
                        scan.geometry,
                        ScanGeometry { first_cdeg: -9000, step_cdeg: 50, beams: 361, turns: 2 }
                    );
                }
                Output::Event(Event::ModeAssumed) => {}
                other => panic!("{other:?}"),
            }
        }
    }
    session.finish();
    assert_eq!(scans, 1);
    let counts = session.counts();
    assert_eq!(counts.bytes(), bytes.len() as u64);
}

#[test]
fn listening_takes_the_measuring_mode_from_a_configuration_in_the_stream() {
    // A real LMS 200's block: measuring mode 06 (15 bits), millimeters; its checksum is in no log, so it is
    // computed.
    let mut config = Config::factory();
    config.set_measuring_mode(biplane_wire::lms::MeasuringMode::FieldA);
    let mut reply = [0; 64];
    let length = Reply::Config(config).emit(0x80, Status::OK, &mut reply).expect("it fits");
    let mut session = LaserSession::listening(HALF, 0);
    session.handle(0, Input::Bytes(&reply[..length]));
    let values = [20_000, 32767, 32759, 32766].into_iter().cycle().take(361).collect();
    let scan = Scan { unit: Unit::Mm, values, ..Default::default() };
    let mut bytes = vec![0; scan.encoded_len()];
    scan.emit(0x80, &mut bytes).expect("it fits");
    for chunk in bytes.chunks(MAX_INPUT_BYTES) {
        session.handle(0, Input::Bytes(chunk));
    }
    let Output::Scan(scan) = session.poll() else { panic!("a scan") };
    assert_eq!(&scan.ranges_m[..3], &[20.0, f32::INFINITY, f32::INFINITY]);
    assert!(scan.ranges_m[3].is_nan());
}

/// What a session that listens makes of a telegram: its scan, or nothing.
fn received(session: &mut LaserSession, bytes: &[u8]) -> Option<ScanReading> {
    let mut scan = None;
    for chunk in bytes.chunks(MAX_INPUT_BYTES) {
        session.handle(0, Input::Bytes(chunk));
        while let output @ (Output::Scan(_) | Output::Event(_)) = session.poll() {
            if let Output::Scan(reading) = output {
                scan = Some(reading);
            }
        }
    }
    scan
}

#[test]
fn index_bytes_are_read_where_the_device_sends_them() {
    let values = [100; 361].into_iter().collect();
    let scan = Scan { unit: Unit::Cm, values, index: Some((254, 7)), ..Default::default() };
    let mut bytes = vec![0; scan.encoded_len()];
    scan.emit(0x80, &mut bytes).expect("it fits");
    let reading = received(&mut LaserSession::listening(HALF, 0), &bytes).expect("a scan");
    assert_eq!(reading.index, Some(ScanIndex { scan: 254, telegram: 7 }));
    assert!(reading.intensities.is_empty());
    let without = received(&mut LaserSession::listening(HALF, 0), &scan_telegram(361)).expect("a scan");
    assert_eq!(without.index, None);
}

#[test]
fn however_many_telegrams_end_in_one_input_nothing_of_what_they_lead_to_is_lost() {
    let mut session = streaming(HALF);
    while !matches!(session.poll(), Output::WaitUntil(_)) {}
    session.handle(80_000_000, Input::Bytes(&[0x02, 0x80, 0x03, 0x00, 0xA0, 0x00, 0x10, 0x16, 0x0A]));
    while !matches!(session.poll(), Output::WaitUntil(_)) {}
    // The shortest telegram that is answered by words: the device refuses.
    let mut refusal = [0; 8];
    assert_eq!(Reply::Refused.emit(0x80, Status::OK, &mut refusal).expect("it fits"), refusal.len());
    session.handle(90_000_000, Input::Bytes(&refusal.repeat(MAX_INPUT_BYTES / refusal.len())));
    let mut refused = 0;
    loop {
        match session.poll() {
            Output::Event(Event::Refused { .. }) => refused += 1,
            Output::WaitUntil(_) => break,
            other => panic!("{other:?}"),
        }
    }
    assert_eq!((refused, session.overflowed(), session.counts().frames), (32, 0, 33));
}

#[test]
fn random_bytes_never_panic_in_any_state() {
    let mut noise = Noise::new(1);
    for round in 0..20 {
        let mut session = if round % 2 == 0 { streaming(HALF) } else { LaserSession::listening(HALF, 0) };
        endure(&mut session, &mut noise, 400, 300_000_000, |noise| match noise.below(4) {
            0 => scan_telegram(361)[..MAX_INPUT_BYTES].to_vec(),
            1 => [0x02, 0x80, 0x03, 0x00, 0xA0, 0x00, 0x10, 0x16, 0x0A].to_vec(),
            _ => (0..noise.below(256)).map(|_| [0x02, 0x80, noise.byte()][noise.below(3)]).collect(),
        });
    }
}
