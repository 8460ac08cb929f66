//! Scripted sessions with a laser. Telegrams are those of the listing and of logs of real devices, by hand.

use biplane_wire::lms::{Reply, Unit};

use super::*;
use crate::session::script::{check, play, scan_telegram};
use crate::session::{Event, MAX_INPUT_BYTES};

const HALF: LaserSettings = LaserSettings { baud: 38400, fov_deg: 180, resolution_cdeg: 50, unit: Unit::Cm };

const STOP: &str = "> 02 00 02 00 20 25 35 08";
const MODE_DONE: &str = "< 02 80 03 00 A0 00 10 16 0A";
const ASK_TYPE: &str = "> 02 00 01 00 3A 1E 12";
const TYPE: &str = "< 02 80 14 00 BA 4C 4D 53 32 39 31 3B 53 30 35 3B 58 30 31 2E 32 37 20 10 3D 00";
const ASK_CONFIG: &str = "> 02 00 01 00 74 50 12";
/// Measuring mode 00, centimetres.
const CONFIG: &str = "< 02 80 24 00 F4 00 00 46 00 00 00 00 00 00 02 02 02 00 00 0A 0A 50 64 00 0A 0A 50 64 00 0A 0A 50 64 00 00 00 00 02 00 10 AA 4F";
const ASK_STATUS: &str = "> 02 00 01 00 31 15 12";
/// 180 degrees in steps of a half, 38400 Bd.
const STATUS: &str = "< 02 80 9A 00 B1 58 30 31 2E 32 37 20 25 00 00 00 40 00 00 00 00 00 00 64 00 65 00 66 00 67 00 68 00 69 00 6A 00 6B 00 6C 00 6D 00 6E 00 6F 00 70 00 71 00 72 00 73 00 74 00 75 00 76 00 77 00 78 00 79 00 7A 00 7B 00 94 00 00 00 50 00 50 00 50 00 50 00 50 00 50 00 50 00 50 00 50 00 50 00 50 00 50 00 50 00 50 00 50 00 00 00 00 00 00 00 B4 00 32 00 02 02 00 00 00 19 80 02 00 00 01 00 01 56 30 32 2E 31 30 20 00 00 00 00 00 00 00 00 00 00 00 00 00 00 00 00 00 00 00 00 00 00 10 43 FF";
const STREAM: &str = "> 02 00 02 00 20 24 34 08";

fn streaming(settings: LaserSettings) -> LaserSession {
    LaserSession::streaming(settings, 0)
}

/// What follows when the rate is found, from a time on, 10 ms a step.
fn settings_read(from_ms: i64) -> String {
    let [a, b, c, d] = [0, 10, 20, 30].map(|step| from_ms + step);
    format!(
        "{a} {TYPE}\n{a} ! is a LMS291;S05;X01.27\n{a} ! answers at 38400 Bd\n{a} {ASK_CONFIG}\n\
         {b} {CONFIG}\n{b} {ASK_STATUS}\n{c} {STATUS}\n{c} {STREAM}\n{d} {MODE_DONE}\n{d} ! streams"
    )
}

#[test]
fn a_device_at_the_configured_rate_streams_after_five_questions() {
    let script = format!(
        "0 = 38400\n0 {STOP}\n80 < 06\n80 {MODE_DONE}\n80 {ASK_TYPE}\n{}\n200 < scan361\n200 * 361 beams",
        settings_read(90)
    );
    check(&mut streaming(HALF), &script);
}

#[test]
fn a_device_at_its_power_on_rate_is_found_and_taken_to_the_configured_one() {
    let script = format!(
        "0 = 38400\n0 {STOP}\n250 {STOP}\n500 = 9600\n500 {STOP}\n580 {MODE_DONE}\n580 {ASK_TYPE}\n\
         600 {TYPE}\n600 ! is a LMS291;S05;X01.27\n600 ! answers at 9600 Bd\n600 > 02 00 02 00 20 40 50 08\n\
         680 < 06\n680 {MODE_DONE}\n680 = 38400\n780 {ASK_TYPE}\n800 {TYPE}\n800 ! runs at 38400 Bd\n\
         800 {ASK_CONFIG}\n810 {CONFIG}\n810 {ASK_STATUS}\n820 {STATUS}\n820 {STREAM}\n830 {MODE_DONE}\n\
         830 ! streams\n1000 end"
    );
    check(&mut streaming(HALF), &script);
}

#[test]
fn a_device_left_streaming_is_stopped_and_its_answer_found_behind_the_cut_scan() {
    let script = format!(
        "0 = 38400\n0 {STOP}\n3 < stump150\n30 {MODE_DONE}\n70 {ASK_TYPE}\n{}\n200 end",
        settings_read(140)
    );
    check(&mut streaming(HALF), &script);
    let later = format!("0 = 38400\n0 {STOP}\n3 < stump150\n80 {MODE_DONE}\n80 {ASK_TYPE}\n81 end");
    check(&mut streaming(HALF), &later);
}

#[test]
fn a_silent_device_is_looked_for_at_every_rate_again_and_again_with_growing_patience() {
    let mut script = String::new();
    for (at, baud) in [(0, 38400), (500, 9600), (1000, 19200), (1500, 500_000)] {
        script += &format!("{at} = {baud}\n{at} {STOP}\n{} {STOP}\n", at + 250);
    }
    script +=
        &format!("2000 ! no answer (round 1), asking on\n2000 = 38400\n2000 {STOP}\n2500 {STOP}\n2900 end");
    check(&mut streaming(HALF), &script);
}

#[test]
fn a_refused_variant_is_tried_three_times_then_the_device_keeps_its_own() {
    let settings = LaserSettings { resolution_cdeg: 100, ..HALF };
    let set = "> 02 00 05 00 3B B4 00 64 00 97 49";
    let refused = "< 02 80 02 00 92 10 7F 33";
    let said = "! refused while setting field of view and resolution";
    let again = "! no answer while setting field of view and resolution, attempt";
    let script = format!(
        "0 = 38400\n0 {STOP}\n80 {MODE_DONE}\n80 {ASK_TYPE}\n90 {TYPE}\n90 ! is a LMS291;S05;X01.27\n\
         90 ! answers at 38400 Bd\n90 {ASK_CONFIG}\n100 {CONFIG}\n100 {ASK_STATUS}\n110 {STATUS}\n110 {set}\n\
         120 {refused}\n120 {said}\n180 {set}\n180 {again} 2\n190 {refused}\n190 {said}\n250 {set}\n250 {again} 3\n\
         260 {refused}\n260 {said}\n320 ! gave up setting field of view and resolution\n\
         320 ! keeps 180 degrees in steps of 0.50, not what is configured\n320 {STREAM}\n330 {MODE_DONE}\n\
         330 ! streams\n400 < scan361\n400 * 361 beams"
    );
    check(&mut streaming(settings), &script);
}

#[test]
fn other_units_are_written_once_in_installation_mode() {
    let settings = LaserSettings { unit: Unit::Mm, ..HALF };
    let mut session = streaming(settings);
    let start = format!("80 {MODE_DONE}\n90 {TYPE}\n100 {CONFIG}\n110 {STATUS}\n120 {MODE_DONE}\n500 end");
    let lines: Vec<String> = start.lines().map(str::to_owned).collect();
    let transcript = play(&mut session, &lines).join("\n");
    assert!(transcript.contains("110 > 02 00 0A 00 20 00 53 49 43 4B 5F 4C 4D 53 BE C5"), "{transcript}");
    // The configuration as read, but for byte 6: millimetres (checksum as in the transcripts of real clients).
    let write = "120 > 02 00 23 00 77 00 00 46 00 00 00 01 00 00 02 02 02 00 00 0A 0A 50 64 00 0A 0A 50 64 00 0A 0A 50 64 00 00 00 00 02 00";
    assert!(transcript.contains(write), "{transcript}");
    assert_eq!(transcript.matches("> 02 00 23 00 77").count(), 1, "{transcript}");
}

#[test]
fn silence_while_streaming_starts_the_search_again() {
    let script = format!(
        "0 = 38400\n0 {STOP}\n80 {MODE_DONE}\n80 {ASK_TYPE}\n{}\n200 < scan361\n200 * 361 beams\n\
         1200 ! silent for 1000 ms, starting again\n1200 = 38400\n1200 {STOP}\n1300 end",
        settings_read(90)
    );
    check(&mut streaming(HALF), &script);
}

#[test]
fn the_rate_of_a_lost_laser_is_asked_before_each_other_one_and_its_absence_said_once() {
    let mut script = format!(
        "0 = 38400\n0 {STOP}\n80 {MODE_DONE}\n80 {ASK_TYPE}\n{}\n200 < scan361\n200 * 361 beams\n\
         1200 ! silent for 1000 ms, starting again\n",
        settings_read(90)
    );
    let round = [38400, 9600, 38400, 19200, 38400, 500_000];
    for (index, baud) in round.iter().cycle().take(18).enumerate() {
        let at = 1200 + 500 * index;
        if index == 6 {
            script += &format!("{at} ! no answer (round 1), asking on\n");
        }
        script += &format!("{at} = {baud}\n{at} {STOP}\n{} {STOP}\n", at + 250);
    }
    script += "10199 end";
    check(&mut streaming(HALF), &script);
}

#[test]
fn a_power_cycle_is_seen_as_garbage_then_the_device_is_found_at_its_power_on_rate() {
    let script = format!(
        "0 = 38400\n0 {STOP}\n80 {MODE_DONE}\n80 {ASK_TYPE}\n{}\n700 < noise20\n\
         1120 ! no intact telegram for 1000 ms, starting again\n1120 = 38400\n1120 {STOP}\n1370 {STOP}\n\
         1620 = 9600\n1620 {STOP}\n1700 {MODE_DONE}\n1700 {ASK_TYPE}\n1720 {TYPE}\n1720 ! answers at 9600 Bd\n\
         1720 > 02 00 02 00 20 40 50 08\n1730 end",
        settings_read(90)
    );
    check(&mut streaming(HALF), &script);
}

#[test]
fn a_power_on_telegram_while_streaming_starts_again_at_once() {
    let settings = LaserSettings { baud: 9600, ..HALF };
    let power_on = "< 02 80 17 00 90 4C 4D 53 32 30 30 3B 33 30 31 30 36 33 3B 56 30 32 2E 31 30 20 10 63 5E";
    let mut session = streaming(settings);
    let script = format!(
        "80 {MODE_DONE}\n90 {TYPE}\n100 {CONFIG}\n110 {STATUS}\n120 {MODE_DONE}\n500 {power_on}\n501 end"
    );
    let lines: Vec<String> = script.lines().map(str::to_owned).collect();
    let transcript = play(&mut session, &lines).join("\n");
    let tail = format!("500 ! was switched on or reset, starting again\n500 = 9600\n500 {STOP}\n501 end");
    assert!(transcript.ends_with(&tail), "{transcript}");
}

#[test]
fn a_refused_acknowledge_is_answered_by_the_same_question_after_a_pause() {
    let script = format!("0 = 38400\n0 {STOP}\n10 < 15\n70 {STOP}\n80 {MODE_DONE}\n80 {ASK_TYPE}\n81 end");
    check(&mut streaming(HALF), &script);
}

#[test]
fn a_stop_leaves_the_device_idle_and_a_lost_answer_is_asked_for_three_times() {
    let script = format!(
        "0 = 38400\n0 {STOP}\n80 {MODE_DONE}\n80 {ASK_TYPE}\n{}\n200 stop\n200 {STOP}\n600 {STOP}\n\
         600 ! no answer while stopping continuous output, attempt 2\n620 {MODE_DONE}\n620 ! left idle\n700 end",
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
         260 {MODE_DONE}\n260 ! left idle\n700 end",
        settings_read(90)
    );
    check(&mut streaming(HALF), &script);
}

#[test]
fn a_configuration_that_cannot_be_read_leaves_13_bits_and_is_said() {
    let mut script = format!(
        "0 = 38400\n0 {STOP}\n80 {MODE_DONE}\n80 {ASK_TYPE}\n90 {TYPE}\n90 ! is a LMS291;S05;X01.27\n\
         90 ! answers at 38400 Bd\n90 {ASK_CONFIG}\n"
    );
    for (at, attempt) in [(690, 2), (1290, 3)] {
        script += &format!(
            "{at} {ASK_CONFIG}\n{at} ! no answer while reading the configuration, attempt {attempt}\n"
        );
    }
    script += &format!(
        "1890 ! gave up reading the configuration\n1890 {ASK_STATUS}\n1900 {STATUS}\n1900 {STREAM}\n\
         1910 {MODE_DONE}\n1910 ! streams\n2000 < scan361\n\
         2000 ! configuration not known, ranges read with measuring mode 00 (13 bits)\n2000 * 361 beams"
    );
    check(&mut streaming(HALF), &script);
}

#[test]
fn probing_changes_nothing_and_ends() {
    let settings = LaserSettings { baud: 9600, resolution_cdeg: 100, unit: Unit::Mm, fov_deg: 100 };
    let mut session = LaserSession::probing(settings, 0);
    let script = format!(
        "0 = 9600\n0 {STOP}\n250 {STOP}\n500 = 38400\n500 {STOP}\n580 {MODE_DONE}\n580 {ASK_TYPE}\n600 {TYPE}\n\
         600 ! is a LMS291;S05;X01.27\n600 ! answers at 38400 Bd\n600 {ASK_CONFIG}\n610 {CONFIG}\n\
         610 {ASK_STATUS}\n620 {STATUS}\n700 end"
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
                    assert_eq!(scan.fan, Fan { first_cdeg: -9000, step_cdeg: 50, beams: 361, turns: 2 });
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
    // A real LMS 200's block: measuring mode 06 (15 bits), millimetres; its checksum is in no log, so it is computed.
    let mut config = biplane_wire::lms::Config::factory();
    config.set_measuring_mode(biplane_wire::lms::MeasuringMode::FieldA);
    let mut reply = [0; 64];
    let length =
        Reply::Config(config).emit(0x80, biplane_wire::lms::Status::OK, &mut reply).expect("it fits");
    let mut session = LaserSession::listening(HALF, 0);
    session.handle(0, Input::Bytes(&reply[..length]));
    let values = [20_000, 32767, 32759, 32766].into_iter().cycle().take(361).collect();
    let scan = biplane_wire::lms::Scan { unit: Unit::Mm, values, ..Default::default() };
    let mut bytes = vec![0; scan.encoded_len()];
    scan.emit(0x80, &mut bytes).expect("it fits");
    for chunk in bytes.chunks(MAX_INPUT_BYTES) {
        session.handle(0, Input::Bytes(chunk));
    }
    let Output::Scan(scan) = session.poll() else { panic!("a scan") };
    assert_eq!(&scan.ranges_m[..3], &[20.0, f32::INFINITY, f32::INFINITY]);
    assert!(scan.ranges_m[3].is_nan());
}

#[test]
fn index_bytes_are_read_where_the_device_sends_them() {
    let mut session = LaserSession::listening(HALF, 0);
    let values = [100; 361].into_iter().collect();
    let scan =
        biplane_wire::lms::Scan { unit: Unit::Cm, values, index: Some((254, 7)), ..Default::default() };
    let mut bytes = vec![0; scan.encoded_len()];
    scan.emit(0x80, &mut bytes).expect("it fits");
    bytes.extend(scan_telegram(361));
    let mut indices = Vec::new();
    for chunk in bytes.chunks(MAX_INPUT_BYTES) {
        session.handle(0, Input::Bytes(chunk));
        while let output @ (Output::Scan(_) | Output::Event(_)) = session.poll() {
            if let Output::Scan(scan) = output {
                assert!(scan.intensities.is_empty());
                indices.push(scan.index);
            }
        }
    }
    assert_eq!(indices, [Some(ScanIndex { scan: 254, telegram: 7 }), None]);
}

#[test]
fn random_bytes_never_panic_in_any_state() {
    let mut state = 1_u64;
    let mut random = move || {
        state = state.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
        (state >> 33) as u32
    };
    for round in 0..20 {
        let mut session = if round % 2 == 0 { streaming(HALF) } else { LaserSession::listening(HALF, 0) };
        let mut now_ns = 0;
        for _ in 0..400 {
            now_ns += i64::from(random() % 300_000_000);
            let kind = random() % 4;
            let bytes: Vec<u8> = match kind {
                0 => scan_telegram(361)[..MAX_INPUT_BYTES].to_vec(),
                1 => [0x02, 0x80, 0x03, 0x00, 0xA0, 0x00, 0x10, 0x16, 0x0A].to_vec(),
                _ => {
                    (0..random() % 256).map(|_| [0x02, 0x80, random() as u8][random() as usize % 3]).collect()
                }
            };
            session.handle(now_ns, Input::Bytes(&bytes));
            while !matches!(session.poll(), Output::WaitUntil(_)) {}
        }
    }
}
