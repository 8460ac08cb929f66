//! A small language for sessions: what a device sends, what the session does, each with its time in
//! milliseconds.
//!
//! ```text
//!    0 = 38400                    the session sets its port's rate
//!    0 > 02 00 02 00 20 25 35 08  it sends
//!   80 < 02 80 03 00 A0 00 10 16 0A  the device sends (also `scan181`, `noise200`, `stump100`)
//!   80 ! answers at 38400 Bd      it says
//!  500 * 181 beams                it hands out a scan (or odometry)
//!  900 stop                       it is asked to stop
//!  920 lacks 500000               its port does not run at this rate
//!  930 gone                       its port goes: nobody asks it anything
//!  990 back                       its port is there again
//! ```
//! Only `<`, `stop`, `lacks`, `gone`, `back` and the last line's time are played; everything else must come
//! out just so.

use std::fmt::Write;

use biplane_wire::lms::{Scan, Status, Unit};

use crate::session::device_session::{Input, MAX_INPUT_BYTES, Output, Session};

const MS: i64 = 1_000_000;

/// Plays the script's inputs and compares everything that happens with the script.
#[track_caller]
pub(crate) fn check(session: &mut dyn Session, script: &str) {
    let wanted: Vec<String> = script.lines().map(squeeze).filter(|line| !line.is_empty()).collect();
    let played = play(session, &wanted);
    for (line, (wanted, played)) in wanted.iter().zip(&played).enumerate() {
        assert_eq!(wanted, played, "line {} of\n{}", line + 1, played_text(played, wanted, script));
    }
    assert_eq!(wanted.len(), played.len(), "played:\n{}", played.join("\n"));
}

fn played_text(played: &str, wanted: &str, script: &str) -> String {
    format!("{script}\nwanted: {wanted}\nplayed: {played}")
}

fn squeeze(line: &str) -> String {
    line.split_whitespace().collect::<Vec<_>>().join(" ")
}

/// The transcript of a script's inputs.
pub(crate) fn play(session: &mut dyn Session, lines: &[String]) -> Vec<String> {
    let mut transcript = Vec::new();
    let mut wait_ns = drain(session, 0, &mut transcript);
    for line in lines {
        let mut words = line.splitn(3, ' ');
        let (time, verb, rest) = (words.next(), words.next(), words.next().unwrap_or_default());
        let time_ms: i64 = time.and_then(|time| time.parse().ok()).expect("a time in milliseconds");
        let verb = verb.expect("a verb");
        if !matches!(verb, "<" | "stop" | "lacks" | "gone" | "back" | "end") {
            continue;
        }
        while wait_ns < time_ms * MS {
            let now_ns = wait_ns;
            session.handle(now_ns, Input::Time);
            wait_ns = drain(session, now_ns, &mut transcript);
            assert!(wait_ns > now_ns, "the session waits for a time that has come");
        }
        transcript.push(line.clone());
        match verb {
            "<" => {
                let bytes = device_bytes(rest);
                let whole = bytes.len().saturating_sub(1) / MAX_INPUT_BYTES * MAX_INPUT_BYTES;
                let (first, last) = bytes.split_at(whole);
                for chunk in first.chunks(MAX_INPUT_BYTES) {
                    session.handle(time_ms * MS, Input::Bytes(chunk));
                    drain(session, time_ms * MS, &mut transcript);
                }
                session.handle(time_ms * MS, Input::Bytes(last));
            }
            "stop" => session.handle(time_ms * MS, Input::Stop),
            "lacks" => session.handle(time_ms * MS, Input::RateRefused(rest.parse().expect("a rate"))),
            "back" => session.handle(time_ms * MS, Input::PortBack),
            "gone" => {
                wait_ns = i64::MAX;
                continue;
            }
            _ => session.handle(time_ms * MS, Input::Time),
        }
        wait_ns = drain(session, time_ms * MS, &mut transcript);
    }
    transcript
}

fn drain(session: &mut dyn Session, now_ns: i64, transcript: &mut Vec<String>) -> i64 {
    let ms = now_ns / MS;
    loop {
        transcript.push(match session.poll() {
            Output::Write(bytes) => format!("{ms} > {}", hex(&bytes)),
            Output::SetBaud(baud) => format!("{ms} = {baud}"),
            Output::Scan(scan) => format!("{ms} * {} beams", scan.ranges_m.len()),
            Output::Odometry(odometry) => {
                let pose = odometry.odom_from_base;
                format!("{ms} * {:.3} {:.3} {:.4}", pose.x_m, pose.y_m, pose.theta_rad)
            }
            Output::Inertial(sample) => {
                let ([x, y, z], [_, _, up]) = (sample.turn_rad_s, sample.force_m_s2);
                format!("{ms} * {} {x:.3} {y:.3} {z:.3} {up:.2}", sample.time.time_us)
            }
            Output::TimedScan => format!("{ms} * a scan"),
            Output::Reconnect => format!("{ms} > a new connection"),
            Output::Event(event) => format!("{ms} ! {event}"),
            Output::WaitUntil(wait_ns) => return wait_ns,
        });
    }
}

fn hex(bytes: &[u8]) -> String {
    let mut text = String::new();
    for (index, byte) in bytes.iter().enumerate() {
        let gap = if index == 0 { "" } else { " " };
        write!(text, "{gap}{byte:02X}").unwrap();
    }
    text
}

fn device_bytes(text: &str) -> Vec<u8> {
    let number = |name: &str| text.strip_prefix(name).and_then(|rest| rest.parse::<usize>().ok());
    if let Some(count) = number("scan") {
        return scan_telegram(count);
    }
    if let Some(count) = number("stump") {
        return scan_telegram(181)[..count].to_vec();
    }
    if let Some(count) = number("noise") {
        return (0..count).map(|i| (i * 37 + 11) as u8 | 0x80).collect();
    }
    text.split(' ').map(|byte| u8::from_str_radix(byte, 16).expect("hexadecimal bytes")).collect()
}

/// A scan of values 100, 101, ... centimeters.
pub(crate) fn scan_telegram(count: usize) -> Vec<u8> {
    let values = (0..count as u16).map(|i| 100 + i).collect();
    let scan = Scan { unit: Unit::Cm, values, status: Status::OK, ..Scan::default() };
    let mut bytes = vec![0; scan.encoded_len()];
    scan.emit(0x80, &mut bytes).unwrap();
    bytes
}
