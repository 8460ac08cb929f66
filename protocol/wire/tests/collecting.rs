//! Headerless answers: only ever taken as the answer to the question asked, however they arrive.

mod cases;

use biplane_wire::roboclaw::{Answer, Collector, MAX_ANSWER_BYTES, Question, Request};
use cases::{Noise, bytes};

const ENCODERS: Request = Request { address: 0x80, question: Question::Encoders };
const FIRMWARE: Request = Request { address: 0x80, question: Question::Firmware };

fn known(asked: &str) -> Vec<u8> {
    let (_, answer) = cases::ROBOCLAW.iter().find(|(request, _)| *request == asked).expect("it is listed");
    bytes(answer)
}

/// Whether the answer was good, for each that ended.
fn take(collector: &mut Collector, bytes: &[u8]) -> Option<bool> {
    collector.take(bytes).map(|received| received.is_ok())
}

#[test]
fn an_answer_is_whole_however_it_is_cut() {
    for (asked, answer) in cases::ROBOCLAW {
        let (request, answer) = (Request::parse(&bytes(asked)).unwrap(), bytes(answer));
        for size in 1..=answer.len() {
            let mut collector = Collector::new();
            collector.take(&[1, 2, 3]);
            collector.ask(request);
            let mut ended = 0;
            for chunk in answer.chunks(size) {
                if let Some(received) = collector.take(chunk) {
                    let received = received.unwrap();
                    assert_eq!((received.offset, received.length), (3, answer.len()), "{asked}");
                    ended += 1;
                }
            }
            assert_eq!(ended, 1, "{asked} in pieces of {size}");
            assert_eq!(collector.counts().frame_bytes, answer.len() as u64);
            assert_eq!(collector.counts().skipped_bytes, 3);
        }
    }
}

#[test]
fn without_a_question_nothing_is_an_answer() {
    let mut collector = Collector::new();
    assert_eq!(take(&mut collector, &known("80 4E")), None);
    collector.ask(ENCODERS);
    assert_eq!(take(&mut collector, &known("80 4E")), Some(true));
    // Answered once: the same bytes again are nothing.
    assert_eq!(take(&mut collector, &known("80 4E")), None);
    assert_eq!((collector.counts().frames, collector.counts().skipped_bytes), (1, 20));
}

#[test]
fn an_answer_that_comes_after_its_time_does_not_answer_the_next_question() {
    let mut collector = Collector::new();
    collector.ask(ENCODERS);
    assert_eq!(take(&mut collector, &known("80 4E")[..7]), None);
    assert_eq!(collector.buffered(), 7);
    collector.abandon();
    assert_eq!(take(&mut collector, &known("80 4E")[7..]), None);
    collector.ask(FIRMWARE);
    assert_eq!(take(&mut collector, &known("80 15")), Some(true));
    assert_eq!(collector.counts().abandoned, 1);
    assert_eq!(collector.counts().bytes(), collector.position());
}

#[test]
fn a_byte_too_many_in_front_spoils_the_answer_and_one_behind_does_not() {
    let mut collector = Collector::new();
    collector.ask(ENCODERS);
    assert_eq!(take(&mut collector, &[&[0xEE][..], &known("80 4E")].concat()), Some(false));
    collector.ask(ENCODERS);
    let longer = [&known("80 4E")[..], &[0xEE]].concat();
    let received = collector.take(&longer).expect("an end").expect("good");
    assert_eq!((received.length, received.surplus), (10, 1));
    assert_eq!((collector.counts().bad_checksums, collector.counts().skipped_bytes), (1, 12));
}

#[test]
fn a_text_without_an_end_is_given_up_at_the_longest_answer() {
    let mut collector = Collector::new();
    collector.ask(FIRMWARE);
    assert_eq!(take(&mut collector, &[b'x'; MAX_ANSWER_BYTES - 1]), None);
    assert_eq!(take(&mut collector, b"x"), Some(false));
}

#[test]
fn every_byte_is_accounted_for_and_random_answers_are_taken_as_rarely_as_the_crc_allows() {
    let (mut collector, mut noise) = (Collector::new(), Noise(9));
    let (mut asked, mut accepted) = (0_u32, 0_u32);
    for _ in 0..300_000 {
        if noise.below(3) == 0 {
            collector.ask(if noise.below(8) == 0 { FIRMWARE } else { ENCODERS });
            asked += 1;
        }
        let count = 1 + noise.below(12);
        let bytes = noise.bytes(count);
        if let Some(Ok(received)) = collector.take(&bytes) {
            assert!(matches!(received.answer, Answer::Encoders { .. } | Answer::Firmware(_)));
            accepted += 1;
        }
        let held = collector.buffered() as u64;
        assert_eq!(collector.counts().bytes() + held, collector.position());
    }
    // One in 65536 of about 100 000: 1.5 expected, more than 9 comes once in 10^5 such runs.
    assert!(asked > 90_000 && accepted < 10, "{accepted} of {asked}");
}
