//! Four laws that hold for every telegram and every packet, from one table.

mod cases;

use biplane_wire::lms::{Reply, Request, Status, Telegram, checksum};
use biplane_wire::p2os::{self, Command, Packet, Report};
use biplane_wire::roboclaw::{Question, Request as Asked};
use biplane_wire::{WireError, lms, rflex};
use cases::Noise;
use cases::table::{
    answers, commands, pairs, questions, replies, reports, requests, rflex_commands, rflex_reports,
    s14_scans, scans,
};

type Emit = Box<dyn Fn(&mut [u8]) -> Result<usize, WireError>>;
type ReadsBack = Box<dyn Fn(&[u8]) -> Result<bool, WireError>>;
/// Bytes read and written again in every form that they have; `None` when they are no telegram.
type Rewrite = Box<dyn Fn(&[u8]) -> Option<Vec<Vec<u8>>>>;

/// One telegram under test: how to write it, whether its bytes read back as the same value, and what comes of them when
/// they are read without knowing the value.
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
}

fn lms_cases() -> Vec<Case> {
    let mut cases = Vec::new();
    for request in requests() {
        let copy = request.clone();
        cases.push(Case {
            name: format!("{request:?}"),
            len: request.encoded_len(),
            emit: Box::new(move |out| request.emit(0x05, out)),
            reads_back: Box::new(move |bytes| Ok(Telegram::parse(bytes)?.request()? == copy)),
            rewrite: Box::new(rewritten),
        });
    }
    for reply in replies() {
        let copy = reply.clone();
        cases.push(Case {
            name: format!("{reply:?}"),
            len: reply.encoded_len(),
            emit: Box::new(move |out| reply.emit(0x81, Status(0x50), out)),
            reads_back: Box::new(move |bytes| {
                let telegram = Telegram::parse(bytes)?;
                Ok(telegram.status() == Some(Status(0x50)) && telegram.reply()? == copy)
            }),
            rewrite: Box::new(rewritten),
        });
    }
    for scan in pairs() {
        let copy = scan.clone();
        cases.push(Case {
            name: format!("{scan:?}"),
            len: scan.encoded_len(),
            emit: Box::new(move |out| scan.emit(0x80, out)),
            reads_back: Box::new(move |bytes| {
                let telegram = Telegram::parse(bytes)?;
                let Reply::Pairs(view) = telegram.reply()? else { return Ok(false) };
                Ok(view.to_owned(telegram.status().unwrap_or_default()) == copy)
            }),
            rewrite: Box::new(rewritten),
        });
    }
    for scan in s14_scans() {
        let copy = scan.clone();
        cases.push(Case {
            name: format!("{scan:?}"),
            len: scan.encoded_len(),
            emit: Box::new(move |out| scan.emit(0x80, out)),
            reads_back: Box::new(move |bytes| {
                let telegram = Telegram::parse(bytes)?;
                let Reply::S14(view) = telegram.reply()? else { return Ok(false) };
                Ok(view.to_owned(telegram.status().unwrap_or_default()) == copy)
            }),
            rewrite: Box::new(rewritten),
        });
    }
    for scan in scans() {
        let copy = scan.clone();
        cases.push(Case {
            name: format!("{scan:?}"),
            len: scan.encoded_len(),
            emit: Box::new(move |out| scan.emit(0x80, out)),
            reads_back: Box::new(move |bytes| {
                let telegram = Telegram::parse(bytes)?;
                let Reply::Scan(view) = telegram.reply()? else { return Ok(false) };
                Ok(view.to_owned(telegram.status().unwrap_or_default()) == copy)
            }),
            rewrite: Box::new(rewritten),
        });
    }
    cases
}

fn p2os_cases() -> Vec<Case> {
    let mut cases = Vec::new();
    for command in commands() {
        let copy = command.clone();
        cases.push(Case {
            name: format!("{command:?}"),
            len: command.encoded_len(),
            emit: Box::new(move |out| command.emit(out)),
            reads_back: Box::new(move |bytes| Ok(Packet::parse(bytes)?.command() == copy)),
            rewrite: Box::new(rewritten),
        });
    }
    for report in reports() {
        let copy = report.clone();
        cases.push(Case {
            name: format!("{report:?}"),
            len: report.encoded_len(),
            emit: Box::new(move |out| report.emit(out)),
            reads_back: Box::new(move |bytes| Ok(Packet::parse(bytes)?.report()? == copy)),
            rewrite: Box::new(rewritten),
        });
    }
    cases
}

fn rflex_cases() -> Vec<Case> {
    let mut cases = Vec::new();
    for command in rflex_commands() {
        let copy = command.clone();
        cases.push(Case {
            name: format!("{command:?}"),
            len: command.encoded_len(),
            emit: Box::new(move |out| command.emit(4, out)),
            reads_back: Box::new(move |bytes| Ok(rflex::Packet::parse(bytes)?.command() == copy)),
            rewrite: Box::new(rewritten),
        });
    }
    for report in rflex_reports() {
        cases.push(Case {
            name: format!("{report:?}"),
            len: report.encoded_len(),
            emit: Box::new(move |out| report.emit(0xFE, out)),
            reads_back: Box::new(move |bytes| Ok(rflex::Packet::parse(bytes)?.report()? == report)),
            rewrite: Box::new(rewritten),
        });
    }
    cases
}

/// Answers of a controller are read as answers to their question only.
fn roboclaw_cases() -> Vec<Case> {
    let mut cases = Vec::new();
    for asked in questions() {
        cases.push(Case {
            name: format!("{asked:?}"),
            len: asked.encoded_len(),
            emit: Box::new(move |out| asked.emit(out)),
            reads_back: Box::new(move |bytes| Ok(Asked::parse(bytes)? == asked)),
            rewrite: Box::new(|bytes| {
                let mut out = [0xA5; 8];
                let count = Asked::parse(bytes).ok()?.emit(&mut out).ok()?;
                Some(vec![out[..count].to_vec()])
            }),
        });
    }
    for (question, answer) in answers() {
        cases.push(Case {
            name: format!("{answer:?}"),
            len: answer.encoded_len(),
            emit: Box::new(move |out| answer.emit(Asked { address: 0x82, question }, out)),
            reads_back: Box::new(move |bytes| Ok(question.accept(0x82, bytes)? == answer)),
            rewrite: Box::new(move |bytes| answered(question, bytes)),
        });
    }
    cases
}

/// An answer as bytes again; `None` when it is none to this question.
fn answered(question: Question, bytes: &[u8]) -> Option<Vec<Vec<u8>>> {
    let answer = question.accept(0x82, bytes).ok()?;
    let mut out = [0xA5; 64];
    let count = answer.emit(Asked { address: 0x82, question }, &mut out).expect("it has been read");
    Some(vec![out[..count].to_vec()])
}

fn all_cases() -> Vec<Case> {
    lms_cases().into_iter().chain(p2os_cases()).chain(rflex_cases()).chain(roboclaw_cases()).collect()
}

/// A packet or telegram, whichever the first byte says, as bytes again. `None` when it does not parse.
fn rewritten(bytes: &[u8]) -> Option<Vec<Vec<u8>>> {
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
    let answers = roboclaw_cases().into_iter().skip(questions().len());
    for case in lms_cases().into_iter().chain(rflex_cases()).chain(answers) {
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
            assert!(other.accept(0x80, &out[..count]).is_err(), "{question:?} as {other:?}");
            let same_form = std::mem::discriminant(&question) == std::mem::discriminant(&other);
            let written = answer.emit(Asked { address: 0x80, question: other }, &mut [0; 64]);
            assert_eq!(written.is_ok(), same_form, "{question:?} as {other:?}");
        }
        assert!(question.accept(0x81, &out[..count]).is_err(), "{question:?}");
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
