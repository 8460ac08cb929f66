//! Scripted sessions with a base. Packets are those that AriaCoda and Player send, or by hand with their
//! sums.

use biplane_recording::rig::BaseProtocol;

use crate::session::base::{BaseSession, BaseSettings};
use crate::session::device_session::Session;
use crate::session::testing::noise::{Noise, endure};
use crate::session::testing::script::{check, play};

const SETTINGS: BaseSettings =
    BaseSettings { baud: 9600, protocol: BaseProtocol::P2os { metres_per_tick: Some(0.001) } };

const SYNC0: &str = "FA FB 03 00 00 00";
/// Before whatever may wake a base in an open session.
const STOP: &str = "FA FB 03 1D 00 1D";
const SYNC1: &str = "FA FB 03 01 00 01";
const SYNC2: &str = "FA FB 03 02 00 02";
/// OPEN and CLOSE without an argument, and PULSE, have the bytes of the three SYNCs.
const OPEN: &str = SYNC1;
const CLOSE: &str = SYNC2;
const PULSE: &str = SYNC0;
/// Body 02, `Bob`, `Pioneer`, `p3dx-sh`, each closed with 00; sum of its words, the odd last byte xored.
const IDENTITY: &str = "FA FB 17 02 42 6F 62 00 50 69 6F 6E 65 65 72 00 70 33 64 78 2D 73 68 00 CE A3";
/// Stopped at x 32600, 12.3 V (accepted by two real clients).
const AT_32600: &str = "FA FB 22 32 58 7F 00 00 00 00 00 00 00 00 7B 00 00 00 00 00 00 00 00 00 00 00 00 00 7B 00 00 00 00 00 00 B2 4E";

fn sip(x_raw: u16, y_raw: u16, theta_raw: i16) -> String {
    let mut body = vec![0x33];
    for word in [x_raw, y_raw, theta_raw as u16] {
        body.extend_from_slice(&word.to_le_bytes());
    }
    body.extend_from_slice(&[0; 13]);
    let mut packet = vec![0xFA, 0xFB, body.len() as u8 + 2];
    packet.extend_from_slice(&body);
    let sum = body
        .chunks_exact(2)
        .fold(0_u16, |sum, pair| sum.wrapping_add(u16::from_be_bytes([pair[0], pair[1]])));
    packet.extend_from_slice(&sum.to_be_bytes());
    packet.iter().map(|byte| format!("{byte:02X}")).collect::<Vec<_>>().join(" ")
}

/// The same after the time for which a session only listens: all but the rate of its port.
fn after_listening(script: &str) -> String {
    let later = |line: &str| {
        let (time, rest) = line.split_once(' ').expect("a time and a verb");
        let time_ms: i64 = time.parse().expect("milliseconds");
        if rest.starts_with("= 9600") && time_ms == 0 {
            line.to_owned()
        } else {
            format!("{} {rest}", time_ms + 250)
        }
    };
    script.lines().map(str::trim).filter(|line| !line.is_empty()).map(later).collect::<Vec<_>>().join("\n")
}

fn opened() -> String {
    format!(
        "0 = 9600\n0 > {SYNC0}\n20 < {SYNC0}\n20 > {SYNC1}\n40 < {SYNC1}\n40 > {SYNC2}\n60 < {IDENTITY}\n\
         60 ! is a p3dx-sh\n60 > {OPEN}\n60 > {PULSE}\n160 < {AT_32600}\n160 ! streams\n160 * -0.168 0.000 0.0000"
    )
}

#[test]
fn a_fresh_base_is_synchronized_opened_and_pulsed() {
    let script = format!(
        "{}\n500 < {AT_32600}\n500 * -0.168 0.000 0.0000\n960 > {PULSE}\n1000 < {AT_32600}\n\
         1000 * -0.168 0.000 0.0000\n1760 > {PULSE}\n1800 stop\n1800 > {CLOSE}\n1800 ! left idle\n1900 end",
        opened()
    );
    let mut session = BaseSession::streaming(SETTINGS, 0);
    check(&mut session, &after_listening(&script));
    assert!(session.is_done());
    assert_eq!((session.info().name.as_str(), session.info().class.as_str()), ("Bob", "Pioneer"));
}

#[test]
fn a_session_left_open_is_stopped_and_closed_before_anything_else_is_sent() {
    let at = "* -0.168 0.000 0.0000";
    let found = format!(
        "0 = 9600\n30 < {AT_32600}\n30 {at}\n30 ! had a session open, closing it first\n30 > {STOP}\n30 > {CLOSE}\n\
         100 < {AT_32600}\n100 {at}\n"
    );
    let script = format!("{found}280 > {SYNC0}\n300 < {SYNC0}\n300 > {SYNC1}\n301 end");
    check(&mut BaseSession::streaming(SETTINGS, 0), &script);
    // Reports go on: it did not hear that.
    let script =
        format!("{found}200 < {AT_32600}\n200 {at}\n280 > {STOP}\n280 > {CLOSE}\n530 > {SYNC0}\n531 end");
    check(&mut BaseSession::streaming(SETTINGS, 0), &script);
}

#[test]
fn a_silent_base_is_asked_four_times_then_again_behind_zeros() {
    // The longest packet has 258 bytes.
    let zeros = format!("2500 > {}\n", "00 ".repeat(64)).repeat(5);
    let script = format!(
        "0 = 9600\n0 > {SYNC0}\n500 > {SYNC0}\n1000 > {SYNC0}\n1500 > {SYNC0}\n\
         2000 ! no answer yet, asking on (is it switched on and connected?)\n{zeros}2500 > {SYNC0}\n2501 end"
    );
    check(&mut BaseSession::streaming(SETTINGS, 0), &after_listening(&script));
}

#[test]
fn a_base_that_falls_silent_is_synchronized_anew_within_a_second() {
    let script = format!(
        "{}\n960 > {PULSE}\n1060 ! silent for 900 ms, starting again\n1060 > {SYNC0}\n1200 end",
        opened()
    );
    check(&mut BaseSession::streaming(SETTINGS, 0), &after_listening(&script));
}

#[test]
fn a_session_that_is_still_open_after_a_silence_goes_on() {
    let script = format!(
        "{}\n960 > {PULSE}\n1060 ! silent for 900 ms, starting again\n1060 > {SYNC0}\n1300 < {AT_32600}\n\
         1300 ! streams\n1300 * -0.168 0.000 0.0000\n1400 end",
        opened()
    );
    check(&mut BaseSession::streaming(SETTINGS, 0), &after_listening(&script));
}

#[test]
fn positions_go_on_over_the_15_bit_border_and_headings_are_units_of_a_4096th_turn() {
    let mut session = BaseSession::listening(SETTINGS, 0);
    let script = format!(
        "0 < {}\n0 * -0.168 0.000 0.0000\n100 < {}\n100 * -0.001 0.000 1.5708\n200 < {}\n200 * 0.100 -0.002 -1.5708\n\
         300 < {}\n300 * -0.010 -0.002 3.1416",
        sip(32600, 0, 0),
        sip(32767, 0, 1024),
        sip(100, 32766, -1024),
        sip(32758, 32766, 2048),
    );
    check(&mut session, &script);
}

#[test]
fn a_base_that_counts_from_zero_again_goes_on_where_it_was() {
    let mut session = BaseSession::listening(SETTINGS, 0);
    let script = format!(
        "0 < {}\n0 * 5.000 0.000 1.5708\n100 < {}\n100 ! counts its odometry from zero again\n\
         100 * 5.000 0.000 1.5708\n200 < {}\n200 * 5.000 0.100 1.5708",
        sip(5000, 0, 1024),
        sip(0, 0, 0),
        sip(100, 0, 0),
    );
    check(&mut session, &script);
}

#[test]
fn noise_instead_of_packets_is_told_from_silence() {
    let script = format!(
        "{}\n700 < noise200\n960 > {PULSE}\n1060 ! no intact telegram for 900 ms, starting again\n1060 > {SYNC0}\n\
         1200 end",
        opened()
    );
    check(&mut BaseSession::streaming(SETTINGS, 0), &after_listening(&script));
}

/// `Bob` of `Pioneer` as another subclass; the checksum by the rule.
fn identity(subclass: &str) -> String {
    let body = format!("\x02Bob\0Pioneer\0{subclass}\0").into_bytes();
    let pairs = body.chunks_exact(2);
    let odd = pairs.remainder().iter().fold(0, |_, &last| u16::from(last));
    let sum = pairs.fold(0_u16, |sum, pair| sum.wrapping_add(u16::from_be_bytes([pair[0], pair[1]]))) ^ odd;
    let mut packet = vec![0xFA, 0xFB, body.len() as u8 + 2];
    packet.extend(body);
    packet.extend(sum.to_be_bytes());
    packet.iter().map(|byte| format!("{byte:02X}")).collect::<Vec<_>>().join(" ")
}

#[test]
fn units_go_by_the_subclass_unless_the_rig_says_them() {
    let by_subclass = BaseSettings { protocol: BaseProtocol::P2os { metres_per_tick: None }, ..SETTINGS };
    // Subclass, settings, what is said, where 1000 units ahead and 512 of heading are.
    let table = [
        ("p3dx-sh", by_subclass, "", "1.000 0.000 0.7854"),
        ("p3dx", by_subclass, "", "0.485 0.000 0.7854"),
        ("pion1m", by_subclass, "", "0.051 0.000 3.1416"),
        (
            "own-built",
            by_subclass,
            "20 ! unknown subclass: one unit of its position is taken as 1 mm\n",
            "1.000 0.000 0.7854",
        ),
        ("p3dx", SETTINGS, "", "1.000 0.000 0.7854"),
        ("own-built", SETTINGS, "", "1.000 0.000 0.7854"),
    ];
    for (subclass, settings, reported, pose) in table {
        let script = format!(
            "10 < {}\n10 ! is a {subclass}\n20 < {packet}\n{reported}20 * {pose}\n30 < {packet}\n30 * {pose}",
            identity(subclass),
            packet = sip(1000, 0, 512),
        );
        check(&mut BaseSession::listening(settings, 0), &script);
    }
}

#[test]
fn motors_are_never_enabled() {
    let mut session = BaseSession::streaming(SETTINGS, 0);
    let lines: Vec<String> = format!("{}\n9000 stop", opened()).lines().map(str::to_owned).collect();
    let transcript = play(&mut session, &lines);
    assert!(transcript.iter().any(|line| line.contains('>')));
    assert!(!transcript.iter().any(|line| line.contains("> FA FB 06 04") || line.contains("> FA FB 03 04")));
}

#[test]
fn a_process_that_stood_still_stops_the_base_before_it_wakes_it() {
    let mut session = BaseSession::streaming(SETTINGS, 0);
    check(&mut session, &after_listening(&opened()));
    session.watchdog_missed();
    let later = format!("{{at}} < {AT_32600}\n{{at}} * -0.168 0.000 0.0000\n");
    let [first, second, third] = ["700", "1300", "1800"].map(|at| later.replace("{at}", at));
    let script = format!("{first}960 > {STOP}\n960 > {PULSE}\n{second}1760 > {PULSE}\n{third}");
    check(&mut session, &after_listening(&script));
}

#[test]
fn probing_closes_after_the_names() {
    let script = format!(
        "0 = 9600\n0 > {SYNC0}\n20 < {SYNC0}\n20 > {SYNC1}\n40 < {SYNC1}\n40 > {SYNC2}\n60 < {IDENTITY}\n\
         60 ! is a p3dx-sh\n60 > {CLOSE}\n100 end"
    );
    let mut session = BaseSession::probing(SETTINGS, 0);
    check(&mut session, &after_listening(&script));
    assert!(session.is_done());
}

#[test]
fn random_bytes_never_panic() {
    let mut noise = Noise::new(7);
    for _ in 0..10 {
        let mut session = BaseSession::streaming(SETTINGS, 0);
        endure(&mut session, &mut noise, 500, 400_000_000, |noise| {
            (0..noise.below(256)).map(|_| [0xFA, 0xFB, 3, noise.byte()][noise.below(4)]).collect()
        });
    }
}

#[test]
fn a_base_that_reports_on_behind_a_port_that_comes_back_is_told_at_once_that_its_host_lives() {
    let gone = format!("{}\n300 gone\n3000 back\n3000 = 9600\n3000 > {STOP}\n3000 > {PULSE}\n", opened());
    let on = format!("3080 < {AT_32600}\n3080 * -0.168 0.000 0.0000\n3800 > {PULSE}\n3801 end");
    check(&mut BaseSession::streaming(SETTINGS, 0), &after_listening(&format!("{gone}{on}")));
    let off = format!("3350 ! silent for 3190 ms, starting again\n3350 > {SYNC0}\n3351 end");
    check(&mut BaseSession::streaming(SETTINGS, 0), &after_listening(&format!("{gone}{off}")));
}

#[test]
fn a_base_that_is_silent_when_the_run_ends_is_told_to_close_again_and_if_it_stays_silent_that_is_said() {
    let silent = format!(
        "{}\n960 > {PULSE}\n1060 ! silent for 900 ms, starting again\n1060 > {SYNC0}\n1100 stop\n1100 > {CLOSE}\n",
        opened()
    );
    let script = format!(
        "{silent}1350 > {CLOSE}\n1600 > {CLOSE}\n1850 > {CLOSE}\n\
         2100 ! did not answer when asked to stop: it may be streaming\n2200 end"
    );
    let mut session = BaseSession::streaming(SETTINGS, 0);
    check(&mut session, &after_listening(&script));
    assert!(session.is_done());
    let script = format!(
        "{silent}1350 > {CLOSE}\n1400 < {AT_32600}\n1400 * -0.168 0.000 0.0000\n1400 > {CLOSE}\n1400 ! left idle\n2200 end"
    );
    check(&mut BaseSession::streaming(SETTINGS, 0), &after_listening(&script));
}

#[test]
fn a_packet_whose_rest_comes_late_is_a_report_all_the_same() {
    let (head, rest) = AT_32600.split_at(29);
    let script = format!(
        "{}\n260 < {head}\n960 > {PULSE}\n1060 ! silent for 900 ms, starting again\n1060 > {SYNC0}\n1300 <{rest}\n\
         1300 ! streams\n1300 * -0.168 0.000 0.0000\n1301 end",
        opened()
    );
    check(&mut BaseSession::streaming(SETTINGS, 0), &after_listening(&script));
}
