//! Scripted sessions with a RoboClaw. Requests and the firmware's answer are the wire's golden bytes; other
//! answers are put together here with the manual's own loop for the CRC.

use biplane_recording::rig::BaseProtocol;

use crate::session::base::{BaseSession, BaseSettings};
use crate::session::device_session::{Input, Output, Session};
use crate::session::testing::noise::{Noise, endure};
use crate::session::testing::script::{check, play};

/// A tenth of a millimeter a count, wheels 0.4 m apart.
const SETTINGS: BaseSettings = BaseSettings {
    baud: 38400,
    protocol: BaseProtocol::RoboClaw {
        address: 0x80,
        wheel_base_m: 0.4,
        metres_per_count_left: 1e-4,
        metres_per_count_right: 1e-4,
    },
};

const FIRMWARE: &str = "80 15";
const ENCODERS: &str = "80 4E";
const BATTERY: &str = "80 18";
const STATUS: &str = "80 5A";
const VERSION: &str = "52 6F 62 6F 43 6C 61 77 20 32 78 31 35 61 20 76 34 2E 31 2E 33 34 0A 00 6A 6B";
const VOLTS_12_3: &str = "00 7B F8 06";

fn crc(bytes: &[u8]) -> u16 {
    bytes.iter().fold(0, |crc: u16, &byte| {
        (0..8).fold(crc ^ u16::from(byte) << 8, |crc, _| {
            (crc << 1) ^ if crc & 0x8000 != 0 { 0x1021 } else { 0 }
        })
    })
}

fn answer(command: u8, data: &[u8]) -> String {
    let sum = crc(&[&[0x80, command], data].concat()).to_be_bytes();
    [data, &sum].concat().iter().map(|byte| format!("{byte:02X}")).collect::<Vec<_>>().join(" ")
}

fn counts(left: i32, right: i32) -> String {
    answer(78, &[left.to_be_bytes(), right.to_be_bytes()].concat())
}

/// Found at 10 ms, battery asked and told at once, first counts at 20 ms.
fn found(left: i32, right: i32) -> String {
    format!(
        "0 = 38400\n0 > {FIRMWARE}\n10 < {VERSION}\n10 ! is a RoboClaw 2x15a v4.1.34\n10 ! streams\n10 > {BATTERY}\n\
         14 < {VOLTS_12_3}\n14 > {ENCODERS}\n20 < {}\n20 * 0.000 0.000 0.0000",
        counts(left, right)
    )
}

#[test]
fn counts_are_asked_for_every_20_ms_and_become_arcs() {
    // 10 mm with both wheels; then the right wheel alone 40 mm: a tenth of a radian about the left one.
    let script = format!(
        "{}\n30 > {ENCODERS}\n36 < {}\n36 * 0.010 0.000 0.0000\n50 > {ENCODERS}\n56 < {}\n56 * 0.030 0.001 0.1000\n\
         60 stop\n60 ! left idle\n70 end",
        found(500, -300),
        counts(600, -200),
        counts(600, 200),
    );
    let mut session = BaseSession::streaming(SETTINGS, 0);
    check(&mut session, &script);
    assert!(session.is_done());
    assert_eq!((session.info().class.as_str(), session.info().name.as_str()), ("RoboClaw 2x15a", "v4.1.34"));
}

#[test]
fn a_line_of_2400_bd_is_asked_no_more_often_than_it_can_carry() {
    let slow = BaseSettings { baud: 2400, ..SETTINGS };
    let mut session = BaseSession::streaming(slow, 0);
    let mut lines = vec![format!("100 < {VERSION}"), format!("150 < {VOLTS_12_3}")];
    lines.extend((2..10).map(|k| format!("{} < {}", 100 * k, counts(0, 0))));
    lines.push("900 end".to_owned());
    let transcript = play(&mut session, &lines);
    let asked = transcript.iter().filter(|line| line.ends_with(&format!("> {ENCODERS}"))).count();
    assert!((7..=9).contains(&asked), "{transcript:#?}");
}

#[test]
fn a_damaged_answer_is_asked_for_again_when_the_line_is_quiet() {
    let good = counts(1500, 1500);
    let bad = good.replacen("05", "04", 1);
    let script = format!(
        "{}\n30 > {ENCODERS}\n36 < {bad}\n51 > {BATTERY}\n54 < {VOLTS_12_3}\n69 > {ENCODERS}\n75 < {good}\n75 * 0.100 0.000 0.0000\n75 > {ENCODERS}\n76 end",
        found(500, 500)
    );
    check(&mut BaseSession::streaming(SETTINGS, 0), &script);
}

#[test]
fn an_answer_that_comes_too_late_is_not_taken_for_the_next_one() {
    let script = format!(
        "{}\n30 > {ENCODERS}\n108 > {BATTERY}\n110 < {}\n125 > {BATTERY}\n128 < {VOLTS_12_3}\n143 > {ENCODERS}\n149 < {}\n\
         149 * 0.100 0.000 0.0000\n150 end",
        found(500, 500),
        counts(600, 600),
        counts(1500, 1500),
    );
    check(&mut BaseSession::streaming(SETTINGS, 0), &script);
}

#[test]
fn a_silent_controller_is_said_within_a_second_and_asked_who_it_is() {
    let mut session = BaseSession::streaming(SETTINGS, 0);
    let lines: Vec<String> = format!("{}\n1700 end", found(0, 0)).lines().map(str::to_owned).collect();
    let transcript = play(&mut session, &lines);
    let reported: Vec<&String> = transcript.iter().filter(|line| line.contains('!')).skip(2).collect();
    assert_eq!(reported.len(), 2, "{transcript:#?}");
    assert_eq!(reported[0], "820 ! silent for 800 ms, starting again");
    assert!(
        reported[1].ends_with("! no answer yet, asking on (is it switched on and connected?)"),
        "{reported:?}"
    );
    assert!(!session.is_streaming());
}

#[test]
fn the_answer_that_is_under_way_at_the_stop_still_counts_as_it_will_in_a_replay() {
    let script = format!(
        "{}\n30 > {ENCODERS}\n31 stop\n36 < {}\n36 * 0.010 0.000 0.0000\n36 ! left idle\n200 end",
        found(500, -300),
        counts(600, -200),
    );
    check(&mut BaseSession::streaming(SETTINGS, 0), &script);
    let late = format!("{}\n30 > {ENCODERS}\n31 stop\n93 ! left idle\n200 end", found(500, -300));
    check(&mut BaseSession::streaming(SETTINGS, 0), &late);
}

#[test]
fn a_controller_that_was_switched_off_and_on_goes_on_where_it_was() {
    // 90 mm, then off for a second; back and near zero, then 10 mm more.
    let lines = [
        found(500, 500),
        format!("36 < {}", counts(1400, 1400)),
        format!("1000 < {VERSION}"),
        format!("1020 < {}", counts(2, 1)),
        format!("1040 < {}", counts(102, 101)),
        "1041 end".to_owned(),
    ];
    let lines: Vec<String> = lines.join("\n").lines().map(str::to_owned).collect();
    let mut session = BaseSession::streaming(SETTINGS, 0);
    let transcript = play(&mut session, &lines);
    let odometry: Vec<&String> = transcript.iter().filter(|line| line.contains('*')).collect();
    let poses = ["20 * 0.000", "36 * 0.090", "1020 * 0.090", "1040 * 0.100"];
    assert_eq!(odometry.len(), poses.len(), "{transcript:#?}");
    assert!(odometry.iter().zip(poses).all(|(line, pose)| line.starts_with(pose)), "{transcript:#?}");
    assert!(transcript.contains(&"1020 ! counts its odometry from zero again".to_owned()), "{transcript:#?}");
}

#[test]
fn one_wild_reading_with_a_good_sum_moves_nothing() {
    let script = format!(
        "{}\n30 > {ENCODERS}\n36 < {}\n36 > {ENCODERS}\n42 < {}\n42 * 0.001 0.000 0.0000\n43 end",
        found(500, 500),
        counts(1_234_567, -7),
        counts(510, 510),
    );
    check(&mut BaseSession::streaming(SETTINGS, 0), &script);
}

#[test]
fn trouble_is_said_in_words_when_it_comes_and_when_it_goes() {
    let status = |bits: u32| answer(90, &bits.to_be_bytes());
    let mut session = BaseSession::probing(SETTINGS, 0);
    let script = format!(
        "0 = 38400\n0 > {FIRMWARE}\n10 < {VERSION}\n10 ! is a RoboClaw 2x15a v4.1.34\n10 > {STATUS}\n\
         14 < {}\n14 ! reports emergency stop, main battery low\n15 end",
        status(0x0008_0001)
    );
    check(&mut session, &script);
    assert!(session.is_done());
    assert_eq!(session.info().has_fault, Some(true));
}

#[test]
fn the_two_bytes_of_an_older_firmware_are_asked_for_as_such() {
    let mut session = BaseSession::probing(SETTINGS, 0);
    let script = format!(
        "0 = 38400\n0 > {FIRMWARE}\n10 < {VERSION}\n10 ! is a RoboClaw 2x15a v4.1.34\n10 > {STATUS}\n\
         14 < 08 04 8D 1A\n87 > {STATUS}\n90 < 08 04 8D 1A\n90 ! reports emergency stop, main battery low\n91 end"
    );
    check(&mut session, &script);
    assert!(session.is_done());
}

#[test]
fn a_recording_is_read_question_by_question() {
    let mut session = BaseSession::listening(SETTINGS, 0);
    let bytes = |text: &str| -> Vec<u8> {
        text.split(' ').map(|byte| u8::from_str_radix(byte, 16).unwrap()).collect()
    };
    let mut odometry = 0;
    let mut hear = |session: &mut BaseSession, ms: i64, text: &str| {
        session.handle(ms * 1_000_000, Input::Bytes(&bytes(text)));
        loop {
            match session.poll() {
                Output::Odometry(_) => odometry += 1,
                Output::WaitUntil(_) => return odometry,
                _ => {}
            }
        }
    };
    // Without its question an answer is nothing, and an answer to another address's question is nothing.
    assert_eq!(hear(&mut session, 0, &counts(1, 1)), 0);
    session.host_sent(10_000_000, &bytes("81 4E"));
    assert_eq!(hear(&mut session, 12, &counts(1, 1)), 0);
    session.host_sent(20_000_000, &bytes(ENCODERS));
    assert_eq!(hear(&mut session, 22, &counts(1, 1)), 1);
    // As late as a live session would have given it up.
    session.host_sent(25_000_000, &bytes(ENCODERS));
    assert_eq!(hear(&mut session, 25 + 64, &counts(1, 1)), 1);
    session.host_sent(100_000_000, &bytes(STATUS));
    assert_eq!(hear(&mut session, 102, &counts(1, 1)), 1);
}

#[test]
fn random_bytes_never_panic_and_no_question_is_asked_faster_than_the_line_gets_quiet() {
    let mut noise = Noise::new(7);
    for _ in 0..10 {
        let mut session = BaseSession::streaming(SETTINGS, 0);
        endure(&mut session, &mut noise, 500, 40_000_000, |noise| {
            (0..noise.below(256)).map(|_| noise.byte()).collect()
        });
    }
}

#[test]
fn a_controller_behind_a_port_that_comes_back_is_asked_on_and_old_answers_are_not_taken() {
    let gone = format!("{}\n30 > {ENCODERS}\n40 gone\n2000 back\n2000 = 38400\n", found(500, 500));
    let on = format!(
        "2003 < {}\n2018 > {BATTERY}\n2020 < {VOLTS_12_3}\n2035 > {ENCODERS}\n2040 < {}\n2040 * 0.100 0.000 0.0000\n2041 end",
        counts(600, 600),
        counts(1500, 1500)
    );
    check(&mut BaseSession::streaming(SETTINGS, 0), &format!("{gone}{on}"));
    let off = format!("2015 > {BATTERY}\n2078 < 00\n2350 end");
    let lines: Vec<String> = format!("{gone}{off}").lines().map(str::to_owned).collect();
    let transcript = play(&mut BaseSession::streaming(SETTINGS, 0), &lines);
    assert!(transcript.iter().any(|line| line.starts_with("2350 ! ")), "{transcript:#?}");
}
