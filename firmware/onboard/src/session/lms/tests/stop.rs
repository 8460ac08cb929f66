//! The end of a session, and failures that repeat for ever.

use super::*;

#[test]
fn a_stop_while_the_device_is_looked_for_asks_every_rate_until_one_answers() {
    let script = format!(
        "0 = 38400\n0 {STOP}\n20 stop\n150 {STOP}\n300 = 9600\n300 {STOP}\n450 {STOP}\n600 = 500000\n600 {STOP}\n\
         680 {MODE_DONE}\n680 ! left idle at 500000 Bd\n900 end"
    );
    let mut session = streaming(HALF);
    check(&mut session, &script);
    assert!(session.is_done());
}

#[test]
fn a_stop_that_nobody_answers_ends_within_two_seconds_and_says_so() {
    let lines = ["20 stop".to_owned(), "2019 end".to_owned()];
    let mut session = streaming(HALF);
    let before = play(&mut session, &lines).join("\n");
    for baud in [38400, 9600, 500_000, 19200] {
        assert!(before.contains(&format!("= {baud}\n")), "{before}");
    }
    assert!(!session.is_done());
    let after = play(&mut session, &["3000 end".to_owned()]).join("\n");
    assert_eq!(after, "2020 ! did not answer when asked to stop: it may be streaming\n3000 end");
    assert!(session.is_done());
}

#[test]
fn a_stop_while_the_rate_is_confirmed_is_awaited_too() {
    let script = format!(
        "0 = 38400\n0 {STOP}\n80 {MODE_DONE}\n80 {ASK_TYPE}\n85 stop\n85 {STOP}\n90 {TYPE}\n90 ! is a LMS291;S05;X01.27\n\
         165 {MODE_DONE}\n165 ! left idle at 38400 Bd\n900 end"
    );
    check(&mut streaming(HALF), &script);
}

const REFUSED: &str = "92";

/// A session with a device that answers each question after 50 ms as the table says, for 30 s; it never sends
/// a scan.
fn asked(session: &mut LaserSession, answers: &[(&[u8], &str)]) -> Vec<String> {
    let mut transcript = Vec::new();
    let (mut now_ns, mut reply): (i64, Option<(i64, Vec<u8>)>) = (0, None);
    while now_ns < 30_000_000_000 {
        let wait_ns = loop {
            match session.poll() {
                Output::WaitUntil(wait_ns) => break wait_ns,
                Output::Event(event) => transcript.push(event.to_string()),
                Output::Write(bytes) if session.baud() == 38400 => {
                    let answer = answers.iter().find(|(body, _)| bytes[4..].starts_with(body));
                    reply = answer.map(|(_, text)| (now_ns + 50_000_000, words(text)));
                    transcript.push(format!("> {:02X?}", &bytes[4..bytes.len() - 2]));
                }
                _ => {}
            }
        };
        match reply.take_if(|(at_ns, _)| *at_ns <= wait_ns) {
            Some((at_ns, bytes)) => {
                now_ns = at_ns;
                session.handle(now_ns, Input::Bytes(&bytes));
            }
            None => {
                now_ns = wait_ns;
                session.handle(now_ns, Input::Time);
            }
        }
    }
    transcript
}

/// The bytes of an answer of the script's; the listing's "not accepted" for `92`.
fn words(text: &str) -> Vec<u8> {
    let text = if text == REFUSED { "< 02 80 02 00 92 10 7F 33" } else { text };
    text.trim_start_matches("< ").split(' ').map(|byte| u8::from_str_radix(byte, 16).unwrap()).collect()
}

fn count(transcript: &[String], words: &str) -> usize {
    transcript.iter().filter(|line| line.starts_with(words)).count()
}

const ANSWERS: [(&[u8], &str); 5] =
    [(&[0x20, 0x25], MODE_DONE), (&[0x3A], TYPE), (&[0x74], CONFIG), (&[0x31], STATUS), (&[0x32], NO_FAULTS)];

#[test]
fn a_device_that_never_starts_is_asked_for_ever_and_said_to_refuse_once() {
    let answers = [&ANSWERS[..], &[(&[0x20, 0x24], REFUSED)]].concat();
    let transcript = asked(&mut streaming(HALF), &answers);
    assert!(count(&transcript, "> [20, 24]") >= 40, "{transcript:#?}");
    assert_eq!(count(&transcript, "answers at"), 1, "{transcript:#?}");
    assert_eq!(count(&transcript, "refused while starting"), 4, "{transcript:#?}");
    assert_eq!(count(&transcript, "no answer while starting"), 3, "{transcript:#?}");
    assert_eq!(count(&transcript, "gave up starting"), 1, "{transcript:#?}");
}

#[test]
fn a_variant_that_is_never_taken_is_said_so_once_over_restarts() {
    let answers = [&ANSWERS[..], &[(&[0x3B], REFUSED), (&[0x20, 0x24], MODE_DONE)]].concat();
    let transcript = asked(&mut streaming(LaserSettings { resolution_cdeg: 100, ..HALF }), &answers);
    assert!(count(&transcript, "streams") >= 10, "{transcript:#?}");
    assert_eq!(count(&transcript, "gave up setting"), 1, "{transcript:#?}");
    assert_eq!(count(&transcript, "refused while setting"), 3, "{transcript:#?}");
    assert_eq!(count(&transcript, "keeps 180 degrees"), 1, "{transcript:#?}");
}
