//! What holds for every type: what is encoded decodes to the same; a cut message is an error at every length;
//! bytes of any kind never panic, and never make the decoder believe a length.

use biplane_recording::messages::{
    ByteArray, DiagnosticArray, DiagnosticStatus, KeyValue, LaserScan, Odometry, PoseWithCovarianceStamped,
    TfMessage, TransformStamped,
};
use biplane_recording::{AnyMessage, CdrError, Message};

/// Encoded samples with their types; strings of all lengths modulo 8, so that every padding occurs.
fn samples() -> Vec<(&'static str, AnyMessage, Vec<u8>)> {
    let mut all = Vec::new();
    for length in 0..9 {
        let text = "abcdefgh"[..length].to_owned();
        let transform = TransformStamped {
            stamp_ns: 5,
            frame_id: text.clone(),
            child_frame_id: "é".into(),
            ..TransformStamped::default()
        };
        let values = vec![KeyValue { key: text.clone(), value: "1".into() }; length];
        let status = DiagnosticStatus { level: 1, name: text.clone(), values, ..DiagnosticStatus::default() };
        let frame_id = text.clone();
        let ranges_m = vec![1.5; length];
        all.push(sample(LaserScan { frame_id, ranges_m, ..LaserScan::default() }, AnyMessage::Scan));
        all.push(sample(
            Odometry { child_frame_id: text.clone(), ..Odometry::default() },
            AnyMessage::Odometry,
        ));
        let pose =
            PoseWithCovarianceStamped { frame_id: text.clone(), ..PoseWithCovarianceStamped::default() };
        all.push(sample(pose, AnyMessage::Pose));
        all.push(sample(TfMessage { transforms: vec![transform; length] }, AnyMessage::Tf));
        let array = DiagnosticArray { stamp_ns: -7, frame_id: text.clone(), status: vec![status; length] };
        all.push(sample(array, AnyMessage::Diagnostics));
        all.push(sample(ByteArray { data: text.into_bytes() }, AnyMessage::Bytes));
    }
    all
}

fn sample<M: Message>(message: M, any: fn(M) -> AnyMessage) -> (&'static str, AnyMessage, Vec<u8>) {
    let mut bytes = Vec::new();
    message.encode(&mut bytes);
    (M::TYPE, any(message), bytes)
}

/// Numerical Recipes' generator: enough to be anything.
struct Noise(u32);

impl Noise {
    fn next(&mut self) -> u32 {
        self.0 = self.0.wrapping_mul(1_664_525).wrapping_add(1_013_904_223);
        self.0 >> 8
    }
}

#[test]
fn what_is_encoded_decodes_to_the_same() {
    for (type_name, message, bytes) in samples() {
        assert_eq!(AnyMessage::decode(type_name, &bytes), Ok(message), "{type_name} {bytes:02x?}");
    }
}

#[test]
fn a_message_cut_anywhere_is_an_error() {
    for (type_name, _, bytes) in samples() {
        for length in 0..bytes.len() {
            let decoded = AnyMessage::decode(type_name, &bytes[..length]);
            assert!(decoded.is_err(), "{type_name} cut to {length} of {}", bytes.len());
        }
    }
}

#[test]
fn padding_at_the_end_is_accepted_and_more_is_not() {
    for (type_name, message, mut bytes) in samples() {
        let offset = bytes.len();
        for _ in 0..3 {
            bytes.push(0);
            assert_eq!(AnyMessage::decode(type_name, &bytes).as_ref(), Ok(&message));
        }
        bytes.push(0);
        assert_eq!(AnyMessage::decode(type_name, &bytes), Err(CdrError::Trailing { offset, count: 4 }));
    }
}

#[test]
fn changed_and_random_bytes_never_panic() {
    let mut noise = Noise(1);
    for (type_name, _, bytes) in samples() {
        for _ in 0..300 {
            let mut changed = bytes.clone();
            for _ in 0..=noise.next() % 4 {
                let place = noise.next() as usize % changed.len();
                changed[place] = [0, 1, 0x7F, 0xFF, noise.next() as u8][noise.next() as usize % 5];
            }
            let _ = AnyMessage::decode(type_name, &changed);
            let length = noise.next() as usize % 200;
            let mut random: Vec<u8> = vec![0, 1, 0, 0];
            random.extend((0..length).map(|_| noise.next() as u8 & noise.next() as u8 & 0x0F));
            let _ = AnyMessage::decode(type_name, &random);
        }
    }
}

#[test]
fn a_length_that_promises_more_than_is_left_is_an_error_before_anything_is_allocated() {
    // Each: header, then the first length field of the type set to the highest value.
    let scan = [&[0, 1, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0][..], &[0xFF; 4], &[0; 100]].concat();
    let first = [&[0, 1, 0, 0][..], &[0xFF; 4], &[0; 100]].concat();
    let found = LaserScan::decode(&scan);
    assert_eq!(found, Err(CdrError::Short { offset: 16, needed: 0xFFFF_FFFF, left: 100 }));
    assert!(matches!(TfMessage::decode(&first), Err(CdrError::Short { offset: 8, left: 100, .. })));
    assert!(matches!(ByteArray::decode(&first), Err(CdrError::Short { offset: 8, left: 100, .. })));
}

#[test]
fn another_encoding_is_named() {
    let big_endian = [0, 0, 0, 0, 0, 0, 0, 1];
    let error = ByteArray::decode(&big_endian).unwrap_err();
    assert_eq!(error, CdrError::Header { found: vec![0, 0, 0, 0] });
    assert!(matches!(ByteArray::decode(&[]), Err(CdrError::Header { .. })));
    assert_eq!(AnyMessage::decode("std_msgs/msg/String", b"anything"), Ok(AnyMessage::Other));
}

#[test]
fn strings_that_are_none_are_refused_by_place() {
    let text = |letters: &[u8]| {
        let mut bytes = vec![0, 1, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, letters.len() as u8, 0, 0, 0];
        bytes.extend(letters);
        LaserScan::decode(&bytes).unwrap_err()
    };
    assert_eq!(text(b"abc"), CdrError::Text { offset: 16, what: "no NUL at its end" });
    assert_eq!(text(&[0xC3, 0]), CdrError::Text { offset: 16, what: "not UTF-8" });
}

#[test]
fn times_that_do_not_fit_become_the_nearest_that_does() {
    let through = |stamp_ns| {
        let mut bytes = Vec::new();
        LaserScan { stamp_ns, ..LaserScan::default() }.encode(&mut bytes);
        LaserScan::decode(&bytes).unwrap().stamp_ns
    };
    for stamp_ns in [0, -1, 1, 1_700_000_000_123_456_789, -1_000_000_001] {
        assert_eq!(through(stamp_ns), stamp_ns);
    }
    assert_eq!(through(i64::MAX), i64::from(i32::MAX) * 1_000_000_000 + 999_999_999);
    assert_eq!(through(i64::MIN), i64::from(i32::MIN) * 1_000_000_000);
}
