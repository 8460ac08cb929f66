//! Streams of the serial lines: every byte accounted for, the same frames at any cut, and what parses writes
//! back as it was.
//!
//! The first byte of an input says how it is taken: bit 0 which side speaks, bit 1 that checksums are mended
//! first (so that damage gets past them), bit 2 that every other frame is taken back, the others how the
//! stream is cut up.

use biplane_wire::framing::{Deframer, Framing, Measure};
use biplane_wire::lms::{self, Telegram};
use biplane_wire::p2os::{self, Packet, Report};
use biplane_wire::roboclaw::{Answer, Collector, Motor, Question, Request as Asked, StatusWidth};
use biplane_wire::{Item, WireError, cola, rflex, scip, xsens};

/// Bits of an input's first byte.
#[derive(Clone, Copy)]
struct How(u8);

impl How {
    fn is_host(self) -> bool {
        self.0 & 1 != 0
    }
    fn mended(self) -> bool {
        self.0 & 2 != 0
    }
    fn takes_back(self) -> bool {
        self.0 & 4 != 0
    }
    /// Longest piece that the stream comes in.
    fn piece(self) -> usize {
        1 + usize::from(self.0 >> 3) * 5
    }
}

/// SICK LMS telegrams, either way.
pub(super) fn lms(input: &[u8]) {
    let Some((how, bytes)) = input.split_first() else { return };
    let how = How(*how);
    let mend = |frame: &mut [u8]| {
        let at = frame.len() - 2;
        let sum = lms::checksum(&frame[..at]).to_le_bytes();
        frame[at..].copy_from_slice(&sum);
    };
    if how.is_host() {
        stream(lms::HostDeframer::new, how, bytes, mend, laser_frame);
    } else {
        stream(lms::DeviceDeframer::new, how, bytes, mend, laser_frame);
    }
}

/// CoLa telegrams, either dialect.
pub(super) fn cola(input: &[u8]) {
    let Some((how, bytes)) = input.split_first() else { return };
    let mend = |frame: &mut [u8]| {
        let at = frame.len() - 1;
        if frame[1] == 0x02 {
            frame[at] = cola::checksum(&frame[8..at]);
        }
    };
    stream(cola::Deframer::new, How(*how), bytes, mend, cola_frame);
}

/// A telegram is written back as it was; a scan reads back as the same, however its numbers were written.
fn cola_frame(bytes: &[u8]) {
    let Ok(telegram) = cola::Telegram::parse(bytes) else { return };
    let mut out = vec![0; telegram.encoded_len()];
    assert_eq!(telegram.emit(&mut out), Ok(bytes.len()));
    assert_eq!(out, bytes);
    let _ = telegram.error_code();
    let Ok(scan) = cola::Scan::parse(&telegram) else { return };
    for dialect in [cola::Dialect::A, cola::Dialect::B] {
        let mut data = vec![0; 16 * bytes.len() + 256];
        let length = scan.emit_data(dialect, &mut data).expect("there is room");
        let data = Some(&data[..length]);
        let again = cola::Telegram { dialect, kind: telegram.kind, name: telegram.name, data };
        let again = cola::Scan::parse(&again).expect("what was written reads");
        assert_eq!(format!("{:?}", again.head), format!("{:?}", scan.head));
        assert!(again.channels.iter().zip(&scan.channels).all(|(a, b)| a.values == b.values));
    }
}

/// Replies of Hokuyo lasers.
pub(super) fn scip(input: &[u8]) {
    let Some((how, bytes)) = input.split_first() else { return };
    stream(scip::Deframer::new, How(*how), bytes, mend_lines, scip_block);
    for line in bytes.split(|&byte| byte == b'\n') {
        let Ok(request) = scip::Request::parse(line) else { continue };
        let mut out = [0; 40];
        let length = request.emit(&mut out).expect("it was read");
        assert_eq!(&out[..length - 1], line);
    }
}

/// Gives each line behind the first its right sum.
fn mend_lines(block: &mut [u8]) {
    for line in block.split_mut(|&byte| byte == b'\n').skip(1) {
        if let Some((last, numbers)) = line.split_last_mut() {
            *last = scip::sum(numbers);
        }
    }
}

/// A reply is written back as it was, and so is its scan.
fn scip_block(bytes: &[u8]) {
    let Ok(block) = scip::Block::parse(bytes) else { return };
    let mut out = vec![0; block.encoded_len()];
    assert_eq!(block.emit(&mut out), Ok(bytes.len()));
    assert_eq!(out, bytes);
    let _ = (block.clock_ms(), block.values().count(), scip::Parameters::parse(&block));
    let Some(Ok(scan)) = scip::Scan::parse(&block) else { return };
    let mut lines = vec![0; bytes.len()];
    let length = scan.emit_lines(&mut lines).expect("it was read");
    assert_eq!(&lines[..length], block.lines);
    let readings: Vec<scip::Reading> = scan.values.iter().collect();
    assert!(readings.iter().filter(|reading| !reading.is_further).count() == scan.request.values());
}

/// P2OS packets.
pub(super) fn p2os(input: &[u8]) {
    let Some((how, bytes)) = input.split_first() else { return };
    let mend = |frame: &mut [u8]| {
        let at = frame.len() - 2;
        let sum = p2os::checksum(&frame[3..at]).to_be_bytes();
        frame[at..].copy_from_slice(&sum);
    };
    stream(p2os::Deframer::new, How(*how), bytes, mend, pioneer_frame);
}

/// rFLEX packets.
pub(super) fn rflex(input: &[u8]) {
    let Some((how, bytes)) = input.split_first() else { return };
    let mend = |frame: &mut [u8]| {
        let at = frame.len() - 3;
        frame[at] = rflex::checksum(&frame[2..at]);
        frame[at + 1..].copy_from_slice(&rflex::TRAILER);
    };
    stream(rflex::Deframer::new, How(*how), bytes, mend, rflex_frame);
}

/// Messages of Xsens inertial units.
pub(super) fn xsens(input: &[u8]) {
    let Some((how, bytes)) = input.split_first() else { return };
    let mend = |frame: &mut [u8]| {
        let at = frame.len() - 1;
        frame[at] = xsens::checksum(&frame[1..at]);
    };
    stream(xsens::Deframer::new, How(*how), bytes, mend, xsens_frame);
}

/// Answers of a RoboClaw to questions: an input is a row of a question's number, a count, and so many bytes.
pub(super) fn roboclaw(input: &[u8]) {
    const QUESTIONS: [Question; 7] = [
        Question::Encoders,
        Question::Encoder(Motor::M1),
        Question::Encoder(Motor::M2),
        Question::MainBattery,
        Question::Status(StatusWidth::Wide),
        Question::Status(StatusWidth::Narrow),
        Question::Firmware,
    ];
    let _ = Asked::parse(input).map(|asked| {
        let mut out = [0; 8];
        let count = asked.emit(&mut out).expect("it was read");
        assert_eq!(&out[..count], input);
    });
    let mut collector = Collector::new();
    let (mut rest, mut sent) = (input, 0);
    while let [number, count, behind @ ..] = rest {
        let (bytes, behind) = behind.split_at(usize::from(*count).min(behind.len()));
        rest = behind;
        let asked = Asked { address: 0x80, question: QUESTIONS[usize::from(*number) % QUESTIONS.len()] };
        if number & 0x80 == 0 {
            collector.ask(asked);
        }
        if let Ok(answer) = Answer::accept(asked, bytes) {
            let mut out = [0; 64];
            let count = answer.emit(asked, &mut out).expect("it was read");
            assert_eq!(&out[..count], bytes);
        }
        let _ = collector.take(bytes);
        sent += bytes.len() as u64;
        assert_eq!(collector.counts().bytes() + collector.buffered() as u64, sent);
    }
}

/// A stream whole and in pieces: the same frames, every byte accounted for.
fn stream<F: Framing, const N: usize>(
    new: fn() -> Deframer<F, N>,
    how: How,
    bytes: &[u8],
    mend: impl Fn(&mut [u8]),
    frame: fn(&[u8]),
) {
    let mut bytes = bytes.to_vec();
    if how.mended() {
        mend_all::<F>(&mut bytes, mend);
    }
    let whole = frames(new(), how, &[&bytes], frame);
    let pieces: Vec<&[u8]> = bytes.chunks(how.piece()).collect();
    assert_eq!(whole, frames(new(), how, &pieces, frame), "frames depend on how the stream is cut");
}

/// Gives every announced frame a checksum that fits.
fn mend_all<F: Framing>(bytes: &mut [u8], mend: impl Fn(&mut [u8])) {
    let mut at = 0;
    while at < bytes.len() {
        at += match F::measure(&bytes[at..]) {
            Measure::Frame(length)
                if F::is_start(bytes[at]) && length <= F::MAX_FRAME && at + length <= bytes.len() =>
            {
                mend(&mut bytes[at..at + length]);
                length
            }
            _ => 1,
        };
    }
}

/// Where frames and control bytes stand, of a stream that ends.
fn frames<F: Framing, const N: usize>(
    mut deframer: Deframer<F, N>,
    how: How,
    pieces: &[&[u8]],
    frame: fn(&[u8]),
) -> Vec<(u64, usize)> {
    let (mut found, mut seen, mut skipped, mut sent) = (Vec::new(), 0, 0, 0);
    // After the last piece the input ends; then all is drained once more.
    for piece in pieces.iter().copied().map(Some).chain([None]) {
        let mut rest = piece.unwrap_or_default();
        if piece.is_none() {
            deframer.finish();
        }
        loop {
            let taken = deframer.push(rest);
            assert!(taken > 0 || rest.is_empty(), "a drained deframer takes something");
            rest = &rest[taken..];
            sent += taken as u64;
            loop {
                let back = match deframer.next() {
                    None => break,
                    Some(Item::Frame { offset, bytes }) => {
                        frame(bytes);
                        seen += 1;
                        let back = how.takes_back() && seen % 2 == 0;
                        if !back {
                            found.push((offset, bytes.len()));
                        }
                        back
                    }
                    Some(Item::Control { offset, .. }) => {
                        found.push((offset, 0));
                        false
                    }
                    Some(Item::Skipped { count, .. }) => {
                        skipped += count as u64;
                        false
                    }
                };
                if back {
                    deframer.reject();
                }
            }
            assert_eq!(deframer.position(), sent);
            if rest.is_empty() {
                break;
            }
        }
    }
    let counts = deframer.counts();
    assert_eq!((counts.bytes(), deframer.buffered()), (sent, 0), "every byte is accounted for");
    assert_eq!(counts.skipped_bytes, skipped);
    let controls = found.iter().filter(|(_, length)| *length == 0).count();
    assert_eq!((counts.control_bytes, counts.frames), (controls as u64, (found.len() - controls) as u64));
    found
}

/// Panics unless what a writer put into `out` is `bytes`.
fn same(written: Result<usize, WireError>, out: &[u8], bytes: &[u8]) {
    assert_eq!(&out[..written.expect("it was read")], bytes);
}

fn laser_frame(bytes: &[u8]) {
    let mut out = [0xA5; 2048];
    let telegram = Telegram::parse(bytes).expect("a frame is a telegram");
    same(telegram.emit(&mut out), &out, bytes);
    if let Ok(request) = telegram.request() {
        same(request.emit(telegram.address(), &mut out), &out, bytes);
    }
    if let (Ok(reply), Some(status)) = (telegram.reply(), telegram.status()) {
        same(reply.emit(telegram.address(), status, &mut out), &out, bytes);
    }
}

fn pioneer_frame(bytes: &[u8]) {
    let mut out = [0xA5; 2048];
    let packet = Packet::parse(bytes).expect("a frame is a packet");
    same(packet.emit(&mut out), &out, bytes);
    same(packet.command().emit(&mut out), &out, bytes);
    match packet.report() {
        // Names may be followed by anything.
        Err(_) | Ok(Report::Identity(_)) => {}
        Ok(report) => same(report.emit(&mut out), &out, bytes),
    }
}

fn rflex_frame(bytes: &[u8]) {
    let mut out = [0xA5; 2048];
    let packet = rflex::Packet::parse(bytes).expect("a frame is a packet");
    same(packet.emit(&mut out), &out, bytes);
    same(packet.command().emit(packet.id, &mut out), &out, bytes);
    if let Ok(report) = packet.report() {
        same(report.emit(packet.id, &mut out), &out, bytes);
    }
}

fn xsens_frame(bytes: &[u8]) {
    let mut out = [0xA5; xsens::MAX_MESSAGE_BYTES];
    let message = xsens::Message::parse(bytes).expect("a frame is a message");
    same(message.emit(&mut out), &out, bytes);
    if let Ok(command) = message.command() {
        same(command.emit(&mut out), &out, bytes);
    }
    let Ok(report) = message.report() else { return };
    same(report.emit(&mut out), &out, bytes);
    if let xsens::Report::Data(items) = report {
        let _ = xsens::Sample::of(&items);
    }
}
