//! Five client programs, as recorded talking to a scripted laser (`sessions.txt`): every start-up order of theirs is met with the bytes
//! that they accepted.

use super::{Bench, MS, hex};
use crate::device::Device;
use crate::lms_device::LmsParams;
use crate::lms_device::settings::{ConfigBlock, Variant};

const SESSIONS: &str = include_str!("sessions.txt");

/// A reply comes within this time; writing the EEPROM takes longest.
const PATIENCE_MS: i64 = 700;

fn bytes(text: &str) -> Vec<u8> {
    let pairs = text.as_bytes().chunks(2).map(|pair| String::from_utf8_lossy(pair).into_owned());
    hex(&pairs.collect::<Vec<_>>().join(" "))
}

/// Sessions by their names, each with its lines.
fn sessions() -> Vec<(&'static str, Vec<Vec<&'static str>>)> {
    let mut sessions: Vec<(&str, Vec<Vec<&str>>)> = Vec::new();
    for line in SESSIONS.lines().filter(|line| !line.is_empty() && !line.starts_with('#')) {
        match line.strip_prefix("session ") {
            Some(name) => sessions.push((name, Vec::new())),
            None => {
                let (_, lines) = sessions.last_mut().expect("a session first");
                lines.push(line.split(' ').collect());
            }
        }
    }
    sessions
}

/// The laser that a session finds.
fn device(words: &[&str]) -> LmsParams {
    let ["device", baud, fov_deg, step, rest @ ..] = words else { panic!("{words:?}") };
    let left_streaming = rest.first() == Some(&"streaming");
    let type_text = rest[usize::from(left_streaming)..].join(" ");
    LmsParams {
        type_text,
        baud: baud.parse().expect("a rate"),
        left_streaming,
        variant: Variant::of(fov_deg.parse().expect("degrees"), step.parse().expect("a step")),
        config: ConfigBlock::default(),
        ..LmsParams::default()
    }
}

/// A session being played.
struct Play {
    bench: Bench,
    /// When the event before ended.
    event_ns: i64,
    at: String,
}

impl Play {
    fn wait_until(&mut self, due_ns: i64) {
        let wait_ns = due_ns - self.bench.now_ns;
        if wait_ns > 0 {
            self.bench.run_ms((wait_ns + MS - 1) / MS);
        }
    }

    fn after(&mut self, pause_ms: &str) {
        let pause_ms: i64 = pause_ms.parse().expect("milliseconds");
        self.wait_until(self.event_ns + pause_ms * MS);
        self.event_ns = self.bench.now_ns;
    }

    /// Runs until `done`, at most `most_ms`.
    fn run_until(&mut self, most_ms: i64, done: impl Fn(&Bench) -> bool) {
        for _ in 0..most_ms {
            if done(&self.bench) {
                return;
            }
            self.bench.run_ms(1);
        }
        let (at, heard) = (&self.at, self.bench.bytes());
        panic!("{at}: not within {most_ms} ms; heard {} bytes: {heard:02x?}", heard.len());
    }

    fn hear(&mut self, reply: &str) {
        let mut expected = vec![0x06];
        expected.extend(bytes(reply));
        let length = expected.len();
        let asked_ns = self.event_ns;
        self.run_until(PATIENCE_MS, |bench| bench.heard.len() >= length);
        assert!(self.bench.heard[0].0 - asked_ns < 60 * MS, "{}: a late ACK", self.at);
        let mut heard = self.bench.bytes()[..length].to_vec();
        if expected[5] == 0xB1 {
            // The scripted laser told the configuration of its start; ours tells the one in force (measuring mode, restart, evaluations, unit).
            for offset in [102, 111, 112, 118, 122, 153, 154] {
                heard[5 + offset] = expected[5 + offset];
            }
        }
        assert_eq!(heard, expected, "{}", self.at);
        self.event_ns = self.bench.now_ns;
    }

    fn scans(&mut self, length: &str, head: &str) {
        self.run_until(3000, |bench| bench.telegrams().len() >= 5);
        let (length, head) = (length.parse().ok(), bytes(head));
        // The first one is the reply to the change of mode.
        for (_, telegram) in &self.bench.telegrams()[1..] {
            assert!(length.is_none_or(|length: usize| length == telegram.len()), "{}", self.at);
            assert_eq!(telegram[4..4 + head.len()], head, "{}", self.at);
        }
        self.event_ns = self.bench.now_ns;
    }

    fn line(&mut self, words: &[&str]) {
        match *words {
            ["say", pause_ms, request] => {
                self.after(pause_ms);
                self.bench.heard.clear();
                self.bench.device.handle(self.bench.now_ns, &bytes(request));
            }
            ["deaf", pause_ms, request] => {
                self.after(pause_ms);
                self.bench.device.handle_noise(self.bench.now_ns, bytes(request).len());
            }
            ["hear", reply] => self.hear(reply),
            ["rate", baud] => {
                let baud: u32 = baud.parse().expect("a rate");
                self.run_until(60, |bench| bench.device.baud() == baud);
            }
            ["scans", length, head] => self.scans(length, head),
            ["power-on", telegram] => {
                let expected = bytes(telegram);
                self.run_until(3000, |bench| bench.bytes().ends_with(&expected));
                self.event_ns = self.bench.now_ns;
            }
            _ => panic!("{}: {words:?}", self.at),
        }
    }
}

#[test]
fn every_session_of_five_clients_is_answered_with_the_bytes_that_they_accepted() {
    let sessions = sessions();
    assert_eq!(sessions.len(), 16);
    for (name, lines) in sessions {
        let bench = Bench::new(device(&lines[0]));
        let mut play = Play { bench, event_ns: 0, at: String::new() };
        for (number, words) in lines.iter().enumerate().skip(1) {
            play.at = format!("{name}, line {number} ({} ...)", words[0]);
            play.line(words);
        }
        assert_eq!(play.bench.device.counts().bad_checksums, 0, "{name}");
        assert_eq!(play.bench.device.counts().refused, 0, "{name}");
    }
}

#[test]
fn carmen_asks_for_the_status_right_behind_the_rate_and_gets_both() {
    let mut bench = Bench::new(LmsParams::default());
    bench.run_ms(100);
    bench.say("02 00 02 00 20 48 58 08 02 00 01 00 31 15 12");
    bench.run_ms(1000);
    let codes: Vec<u8> = bench.telegrams().iter().map(|(_, telegram)| telegram[4]).collect();
    assert_eq!(codes, [0xA0, 0xB1]);
    assert_eq!(bench.device.baud(), 500_000);
}
