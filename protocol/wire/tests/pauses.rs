//! What a pause on the line means to a deframer: an unfinished telegram is given up, and the next byte is in
//! step.

mod cases;

use biplane_wire::SkipReason;
use biplane_wire::lms::{self, DeviceDeframer};
use cases::pieces::{Piece, frames, mode_done, scan};

#[test]
fn an_acknowledgement_counts_only_where_a_telegram_could_start() {
    // Inside a telegram it is data; behind a telegram, at the start and after a pause it is an
    // acknowledgement.
    let cut = scan(20, 3)[..30].to_vec();
    let stream = [vec![lms::ACK], scan(20, 0x0606), vec![lms::ACK], cut, vec![lms::ACK, lms::NAK]].concat();
    let mut deframer = DeviceDeframer::new();
    let mut found = Vec::new();
    deframer.feed(&stream, |item| found.push(Piece::from(item)));
    deframer.abandon();
    deframer.feed(&[lms::NAK], |item| found.push(Piece::from(item)));
    let length = scan(20, 3).len() as u64;
    assert_eq!(
        found,
        [
            Piece::Control(0, lms::ACK),
            Piece::Frame(1, scan(20, 0x0606)),
            Piece::Control(1 + length, lms::ACK),
            Piece::Skipped(2 + length, 32, SkipReason::Abandoned),
            Piece::Control(34 + length, lms::NAK),
        ]
    );
    assert_eq!(deframer.counts().abandoned, 1);
}

#[test]
fn a_reply_behind_a_cut_scan_is_found_at_the_pause() {
    let stream = [scan(361, 11)[..300].to_vec(), vec![lms::ACK], mode_done()].concat();
    let mut deframer = DeviceDeframer::new();
    let mut found = Vec::new();
    deframer.feed(&stream, |item| found.push(Piece::from(item)));
    assert_eq!(found, []);
    assert_eq!(deframer.buffered(), stream.len());
    deframer.abandon();
    deframer.feed(&[], |item| found.push(Piece::from(item)));
    assert_eq!(found, [Piece::Skipped(0, 301, SkipReason::Abandoned), Piece::Frame(301, mode_done())]);
    // The next bytes are in step again.
    deframer.feed(&mode_done(), |item| found.push(Piece::from(item)));
    assert_eq!(found.len(), 3);
}

#[test]
fn a_pause_when_nothing_is_unfinished_changes_nothing() {
    let mut deframer = DeviceDeframer::new();
    let mut found = Vec::new();
    for _ in 0..3 {
        deframer.abandon();
        deframer.feed(&mode_done(), |item| found.push(Piece::from(item)));
        deframer.abandon();
    }
    assert_eq!(frames(&found).len(), 3);
    assert_eq!(deframer.counts().bytes(), 27);
    assert_eq!(deframer.counts().abandoned, 0);
}

#[test]
fn what_is_skipped_behind_a_pause_has_its_own_reason() {
    let mut deframer = DeviceDeframer::new();
    deframer.push(&scan(20, 3)[..30]);
    assert_eq!(deframer.next(), None);
    deframer.abandon();
    deframer.push(&[0; 7]);
    let mut found = Vec::new();
    deframer.feed(&[], |item| found.push(Piece::from(item)));
    assert_eq!(
        found,
        [Piece::Skipped(0, 30, SkipReason::Abandoned), Piece::Skipped(30, 7, SkipReason::Noise)]
    );
}
