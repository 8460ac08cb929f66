//! Four laws that hold for every telegram and every packet, from one table.

mod cases;

use std::fmt::Debug;
use std::rc::Rc;

use biplane_wire::lms::{Pairs, Reply, Request, S14Scan, Scan, Status, Telegram, checksum};
use biplane_wire::p2os::{self, Command, Packet, Report};
use biplane_wire::roboclaw::{Answer, Question, Request as Asked};
use biplane_wire::{WireError, lms, rflex, xsens};
use cases::Noise;
use cases::table::{
    answers, commands, pairs, questions, replies, reports, requests, rflex_commands, rflex_reports,
    s14_scans, scans, xsens_commands, xsens_reports,
};

type Written = Result<usize, WireError>;
type Same = Result<bool, WireError>;
/// Bytes read and written again in every form that they have; `None` when they are no telegram.
type Copies = Option<Vec<Vec<u8>>>;
type Emit = Box<dyn Fn(&mut [u8]) -> Written>;
type ReadsBack = Box<dyn Fn(&[u8]) -> Same>;
type Rewrite = Box<dyn Fn(&[u8]) -> Copies>;

/// One telegram under test: how to write it, whether its bytes read back as the same value, and what comes of
/// them when they are read without knowing the value.
struct Case {
    name: String,
    len: usize,
    emit: Emit,
    reads_back: ReadsBack,
    rewrite: Rewrite,
}

impl Case {
    fn bytes(&self) -> Vec<u8> {
        let mut out = vec![0; self.len];
        assert_eq!((self.emit)(&mut out), Ok(self.len), "{}", self.name);
        out
    }

    /// Bytes that are read in another way than [`rewritten`] does.
    fn rewritten_by(mut self, rewrite: impl Fn(&[u8]) -> Copies + 'static) -> Self {
        self.rewrite = Box::new(rewrite);
        self
    }
}

/// A case of each of these values, all written and read in the same way.
fn cases_of<V: Debug + 'static>(
    values: Vec<V>,
    len: fn(&V) -> usize,
    emit: fn(&V, &mut [u8]) -> Written,
    reads_back: fn(&V, &[u8]) -> Same,
) -> impl Iterator<Item = Case> {
    values.into_iter().map(Rc::new).map(move |value| Case {
        name: format!("{value:?}"),
        len: len(&value),
        emit: Box::new({
            let value = Rc::clone(&value);
            move |out| emit(&value, out)
        }),
        reads_back: Box::new(move |bytes| reads_back(&value, bytes)),
        rewrite: Box::new(rewritten),
    })
}

/// Whether these bytes are a telegram of a laser with such a reply and status.
fn is_reply(bytes: &[u8], same: impl Fn(Reply<'_>, Status) -> bool) -> Same {
    let telegram = Telegram::parse(bytes)?;
    Ok(same(telegram.reply()?, telegram.status().unwrap_or_default()))
}

fn lms_cases() -> impl Iterator<Item = Case> {
    let asked = cases_of(
        requests(),
        Request::encoded_len,
        |request, out| request.emit(0x05, out),
        |request, bytes| Ok(Telegram::parse(bytes)?.request()? == *request),
    );
    let answered = cases_of(
        replies(),
        Reply::encoded_len,
        |reply, out| reply.emit(0x81, Status(0x50), out),
        |reply, bytes| is_reply(bytes, |found, status| status == Status(0x50) && found == *reply),
    );
    asked.chain(answered).chain(scan_cases())
}

fn scan_cases() -> impl Iterator<Item = Case> {
    let of_pairs = cases_of(
        pairs(),
        Pairs::encoded_len,
        |scan, out| scan.emit(0x80, out),
        |scan, bytes| {
            is_reply(
                bytes,
                |reply, status| matches!(reply, Reply::Pairs(view) if view.to_owned(status) == *scan),
            )
        },
    );
    let of_s14 = cases_of(
        s14_scans(),
        S14Scan::encoded_len,
        |scan, out| scan.emit(0x80, out),
        |scan, bytes| {
            is_reply(
                bytes,
                |reply, status| matches!(reply, Reply::S14(view) if view.to_owned(status) == *scan),
            )
        },
    );
    let plain = cases_of(
        scans(),
        Scan::encoded_len,
        |scan, out| scan.emit(0x80, out),
        |scan, bytes| {
            is_reply(
                bytes,
                |reply, status| matches!(reply, Reply::Scan(view) if view.to_owned(status) == *scan),
            )
        },
    );
    of_pairs.chain(of_s14).chain(plain)
}

fn p2os_cases() -> impl Iterator<Item = Case> {
    let commanded = cases_of(commands(), Command::encoded_len, Command::emit, |command, bytes| {
        Ok(Packet::parse(bytes)?.command() == *command)
    });
    let reported = cases_of(reports(), Report::encoded_len, Report::emit, |report, bytes| {
        Ok(Packet::parse(bytes)?.report()? == *report)
    });
    commanded.chain(reported)
}

fn rflex_cases() -> impl Iterator<Item = Case> {
    let commanded = cases_of(
        rflex_commands(),
        rflex::Command::encoded_len,
        |command, out| command.emit(4, out),
        |command, bytes| Ok(rflex::Packet::parse(bytes)?.command() == *command),
    );
    let reported = cases_of(
        rflex_reports(),
        rflex::Report::encoded_len,
        |report, out| report.emit(0xFE, out),
        |report, bytes| Ok(rflex::Packet::parse(bytes)?.report()? == *report),
    );
    commanded.chain(reported)
}

fn xsens_cases() -> impl Iterator<Item = Case> {
    let commanded =
        cases_of(xsens_commands(), xsens::Command::encoded_len, xsens::Command::emit, |command, bytes| {
            Ok(xsens::Message::parse(bytes)?.command()? == *command)
        });
    let reported =
        cases_of(xsens_reports(), xsens::Report::encoded_len, xsens::Report::emit, |report, bytes| {
            Ok(xsens::Message::parse(bytes)?.report()? == *report)
        });
    commanded.chain(reported)
}

fn question_cases() -> impl Iterator<Item = Case> {
    cases_of(
        questions(),
        |asked| asked.encoded_len(),
        |asked, out| asked.emit(out),
        |asked, bytes| Ok(Asked::parse(bytes)? == *asked),
    )
    .map(|case| {
        case.rewritten_by(|bytes| {
            let mut out = [0xA5; 8];
            let count = Asked::parse(bytes).ok()?.emit(&mut out).ok()?;
            Some(vec![out[..count].to_vec()])
        })
    })
}

/// Answers of a controller are read as answers to their question only.
fn answer_cases() -> impl Iterator<Item = Case> {
    let written = cases_of(
        answers(),
        |(_, answer)| answer.encoded_len(),
        |&(question, answer), out| answer.emit(Asked { address: 0x82, question }, out),
        |(question, answer), bytes| {
            Ok(Answer::accept(Asked { address: 0x82, question: *question }, bytes)? == *answer)
        },
    );
    written
        .zip(answers())
        .map(|(case, (question, _))| case.rewritten_by(move |bytes| answered(question, bytes)))
}

/// An answer as bytes again; `None` when it is none to this question.
fn answered(question: Question, bytes: &[u8]) -> Copies {
    let answer = Answer::accept(Asked { address: 0x82, question }, bytes).ok()?;
    let mut out = [0xA5; 64];
    let count = answer.emit(Asked { address: 0x82, question }, &mut out).expect("it has been read");
    Some(vec![out[..count].to_vec()])
}

fn all_cases() -> impl Iterator<Item = Case> {
    let packets = p2os_cases().chain(rflex_cases()).chain(xsens_cases());
    lms_cases().chain(packets).chain(question_cases()).chain(answer_cases())
}

/// A packet or telegram, whichever the first byte says, as bytes again. `None` when it does not parse.
fn rewritten(bytes: &[u8]) -> Copies {
    let mut out = [0xA5; 2048];
    let mut copies = Vec::new();
    let mut keep = |written: Result<usize, WireError>, out: &[u8]| {
        copies.push(out[..written.expect("the buffer is large enough")].to_vec());
    };
    if bytes.first() == Some(&lms::STX) {
        let telegram = Telegram::parse(bytes).ok()?;
        keep(telegram.emit(&mut out), &out);
        if let Ok(request) = telegram.request() {
            keep(request.emit(telegram.address(), &mut out), &out);
        }
        if let (Ok(reply), Some(status)) = (telegram.reply(), telegram.status()) {
            keep(reply.emit(telegram.address(), status, &mut out), &out);
        }
    } else if bytes.first() == Some(&rflex::HEADER[0]) {
        let packet = rflex::Packet::parse(bytes).ok()?;
        keep(packet.emit(&mut out), &out);
        keep(packet.command().emit(packet.id, &mut out), &out);
        if let Ok(report) = packet.report() {
            keep(report.emit(packet.id, &mut out), &out);
        }
    } else if bytes.starts_with(&xsens::PREAMBLE) {
        let message = xsens::Message::parse(bytes).ok()?;
        keep(message.emit(&mut out), &out);
        if let Ok(command) = message.command() {
            keep(command.emit(&mut out), &out);
        }
        if let Ok(report) = message.report() {
            keep(report.emit(&mut out), &out);
        }
    } else {
        let packet = Packet::parse(bytes).ok()?;
        keep(packet.emit(&mut out), &out);
        keep(packet.command().emit(&mut out), &out);
        // An identity is read leniently, so it need not come back as it was.
        if let Ok(report) = packet.report()
            && !matches!(report, Report::Identity(_))
        {
            keep(report.emit(&mut out), &out);
        }
    }
    Some(copies)
}

#[test]
fn what_is_written_reads_back_as_the_same_value() {
    for case in all_cases() {
        assert_eq!((case.reads_back)(&case.bytes()), Ok(true), "{}", case.name);
    }
}

#[test]
fn what_is_read_writes_back_as_the_same_bytes() {
    for case in all_cases() {
        let bytes = case.bytes();
        for copy in (case.rewrite)(&bytes).expect("it is valid") {
            assert_eq!(copy, bytes, "{}", case.name);
        }
    }
}

#[test]
fn writing_fills_exactly_its_length_and_nothing_behind_it() {
    for case in all_cases() {
        let mut on_a5 = vec![0xA5; case.len + 9];
        let mut on_5a = vec![0x5A; case.len + 9];
        assert_eq!((case.emit)(&mut on_a5), Ok(case.len), "{}", case.name);
        assert_eq!((case.emit)(&mut on_5a), Ok(case.len), "{}", case.name);
        assert_eq!(on_a5[..case.len], on_5a[..case.len], "{}: a byte was left as it was", case.name);
        assert!(on_a5[case.len..].iter().all(|&byte| byte == 0xA5), "{}", case.name);
    }
}

#[test]
fn a_buffer_too_small_is_refused_with_the_size_it_needs() {
    for case in all_cases() {
        for found in 0..case.len {
            let refused = (case.emit)(&mut vec![0; found]);
            assert_eq!(refused, Err(WireError::BufferTooSmall { needed: case.len, found }), "{}", case.name);
        }
    }
}

#[test]
fn every_truncation_and_every_extension_is_an_error() {
    for case in all_cases() {
        let mut bytes = case.bytes();
        for length in 0..bytes.len() {
            let cut = (case.reads_back)(&bytes[..length]);
            assert!(matches!(cut, Err(WireError::TooShort { .. })), "{} cut to {length}: {cut:?}", case.name);
        }
        bytes.push(0);
        let extended = (case.reads_back)(&bytes);
        assert!(matches!(extended, Err(WireError::TooLong { .. })), "{}: {extended:?}", case.name);
    }
}

#[test]
fn every_single_bit_error_is_found() {
    for case in lms_cases().chain(rflex_cases()).chain(xsens_cases()).chain(answer_cases()) {
        let good = case.bytes();
        for bit in 0..good.len() * 8 {
            let mut bad = good.clone();
            bad[bit / 8] ^= 1 << (bit % 8);
            assert!((case.reads_back)(&bad).is_err(), "{} with bit {bit} flipped", case.name);
        }
    }
}

#[test]
fn random_bytes_never_panic() {
    let mut noise = Noise(1);
    for _ in 0..20_000 {
        let length = noise.below(64);
        let mut bytes = noise.bytes(length);
        if let Some(first) = bytes.first_mut() {
            *first = [lms::STX, p2os::HEADER[0], rflex::HEADER[0]][noise.below(3)];
        }
        rewritten(&bytes);
        let _ = Asked::parse(&bytes);
        for (question, _) in answers() {
            answered(question, &bytes);
        }
    }
}

#[test]
fn random_data_behind_every_lms_code_either_fails_or_comes_back_unchanged() {
    let mut noise = Noise(2);
    for code in 0..=255u8 {
        for length in (0..200).chain([802, 804, 806, 812]) {
            for address in [0x00, 0x80] {
                let mut bytes = vec![lms::STX, address];
                let counted = length + 1 + usize::from(address == 0x80);
                bytes.extend((counted as u16).to_le_bytes());
                bytes.push(code);
                let mut data = noise.bytes(length);
                // Let the count word of a whole scan be true now and then.
                if code == 0xB0 && length >= 2 {
                    data[..2].copy_from_slice(&((length as u16 - 2) / 2).to_le_bytes());
                }
                bytes.extend(data);
                bytes.extend((address == 0x80).then_some(0x10));
                bytes.extend(checksum(&bytes).to_le_bytes());
                for copy in rewritten(&bytes).expect("the frame is valid") {
                    assert_eq!(copy, bytes, "code {code:02X}, {length} data bytes");
                }
            }
        }
    }
}

#[test]
fn random_data_behind_every_p2os_number_either_fails_or_comes_back_unchanged() {
    let mut noise = Noise(3);
    for kind in 0..=255u8 {
        for length in 0..=252usize {
            let mut body = vec![kind];
            body.extend(noise.bytes(length));
            if let Some(argument) = body.get_mut(1).filter(|_| length < 8) {
                *argument = [0x3B, 0x1B, 0x2B][noise.below(3)];
            }
            let mut bytes = p2os::HEADER.to_vec();
            bytes.push(body.len() as u8 + 2);
            bytes.extend(&body);
            bytes.extend(p2os::checksum(&body).to_be_bytes());
            for copy in rewritten(&bytes).expect("the frame is valid") {
                assert_eq!(copy, bytes, "number {kind}, {length} bytes behind it");
            }
        }
    }
}

#[test]
fn random_data_behind_every_rflex_place_either_fails_or_comes_back_unchanged() {
    let mut noise = Noise(4);
    for port in 0..=7u8 {
        for opcode in 0..=40u8 {
            for length in (0..40).chain([254, 255]) {
                let mut body = vec![port, noise.byte(), opcode, length as u8];
                body.extend(noise.bytes(length));
                let mut bytes = [&rflex::HEADER[..], &body].concat();
                bytes.push(rflex::checksum(&body));
                bytes.extend(rflex::TRAILER);
                for copy in rewritten(&bytes).expect("the frame is valid") {
                    assert_eq!(copy, bytes, "port {port}, opcode {opcode}, {length} bytes");
                }
            }
        }
    }
}

#[test]
fn an_answer_is_none_to_another_question_or_of_another_address() {
    for (question, answer) in
        answers().into_iter().filter(|(question, _)| *question != Question::ResetEncoders)
    {
        let mut out = [0; 64];
        let count = answer.emit(Asked { address: 0x80, question }, &mut out).unwrap();
        for (other, _) in answers().into_iter().filter(|(other, _)| other.command() != question.command()) {
            assert!(
                Answer::accept(Asked { address: 0x80, question: other }, &out[..count]).is_err(),
                "{question:?} as {other:?}"
            );
            let same_form = std::mem::discriminant(&question) == std::mem::discriminant(&other);
            let written = answer.emit(Asked { address: 0x80, question: other }, &mut [0; 64]);
            assert_eq!(written.is_ok(), same_form, "{question:?} as {other:?}");
        }
        assert!(Answer::accept(Asked { address: 0x81, question }, &out[..count]).is_err(), "{question:?}");
    }
    assert!(Asked { address: 0x7F, question: Question::Encoders }.emit(&mut [0; 4]).is_err());
}

#[test]
fn an_address_of_the_wrong_direction_is_refused() {
    let mut out = [0; 64];
    assert_eq!(
        Request::Reset.emit(0x80, &mut out),
        Err(WireError::Direction { expect_reply: false, found: 0x80 })
    );
    assert_eq!(
        Reply::Refused.emit(0x00, Status::OK, &mut out),
        Err(WireError::Direction { expect_reply: true, found: 0 })
    );
    assert!(Command::Sync(3).emit(&mut out).is_err());
}

#[test]
fn the_steps_of_opening_are_the_bytes_of_pulse_open_and_close() {
    for (step, same) in [(0, Command::Pulse), (1, Command::Open), (2, Command::Close)] {
        let (mut left, mut right) = ([0; 6], [0; 6]);
        assert_eq!(Command::Sync(step).emit(&mut left), Ok(6));
        assert_eq!(same.emit(&mut right), Ok(6));
        assert_eq!(left, right);
        assert_eq!(Command::Sync(step).number(), same.number());
    }
}
