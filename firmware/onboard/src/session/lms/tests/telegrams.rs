//! What becomes of telegrams with measured values of every form: published, or counted and said once.

use biplane_wire::lms::{Pairs, S14Scan, Selection, Span};

use super::*;
use crate::session::lms::scan::ranges::ScanReading;

/// Events and scans that telegrams lead to in a session that listens.
fn received_all(telegrams: &[Vec<u8>]) -> (LaserSession, Vec<String>, Vec<ScanReading>) {
    let mut session = LaserSession::listening(HALF, 0);
    let (mut reported, mut scans) = (Vec::new(), Vec::new());
    for (place, telegram) in telegrams.iter().enumerate() {
        for chunk in telegram.chunks(MAX_INPUT_BYTES) {
            session.handle(place as i64 * 100_000_000, Input::Bytes(chunk));
            loop {
                match session.poll() {
                    Output::Scan(scan) => scans.push(scan),
                    Output::Event(Event::ModeAssumed) => {}
                    Output::Event(event) => reported.push(event.to_string()),
                    _ => break,
                }
            }
        }
    }
    (session, reported, scans)
}

fn scan(selection: Selection, count: u16, partial: Option<u8>) -> Vec<u8> {
    let values = (0..count).map(|i| 500 + i).collect();
    let scan = Scan { selection, values, partial, ..Scan::default() };
    let mut bytes = vec![0; scan.encoded_len()];
    scan.emit(0x80, &mut bytes).expect("it fits");
    bytes
}

fn pairs(parts: &[(u16, u16)]) -> Vec<u8> {
    let heads = parts.iter().map(|&(first, last)| (Span { first, last }, Unit::Mm, last + 1 - first));
    let positions = parts.iter().flat_map(|&(first, last)| first..=last);
    let pairs = Pairs {
        parts: heads.collect(),
        pairs: positions.map(|i| (1000 + i, i)).collect(),
        ..Pairs::default()
    };
    let mut bytes = vec![0; pairs.encoded_len()];
    pairs.emit(0x80, &mut bytes).expect("it fits");
    bytes
}

#[test]
fn means_and_parts_of_scans_are_counted_and_each_kind_is_said_once() {
    let mean = scan(Selection::Mean { count: 5 }, 361, None);
    let part = scan(Selection::SubRange { first: 1, last: 100 }, 100, None);
    let mean_part = scan(Selection::MeanSubRange { count: 2, first: 1, last: 361 }, 361, None);
    let (session, reported, scans) =
        received_all(&[mean.clone(), part.clone(), mean_part, mean, part, scan(Selection::All, 77, None)]);
    assert!(scans.is_empty());
    // A form that the device did not have before is believed when it comes again, also the first one then.
    assert_eq!((session.not_kept(), session.health().rejected), (4, 2));
    let [means, rejected, parts] = &reported[..] else { panic!("{reported:?}") };
    assert_eq!(means, "sends means of several scans: not recorded as scans, only counted");
    assert!(rejected.starts_with("a telegram was damaged"), "{rejected}");
    assert_eq!(parts, "sends parts of a scan: not recorded as scans, only counted");
}

#[test]
fn telegrams_whose_form_is_not_understood_are_counted_and_said_once() {
    let raw = |code: u8| {
        let mut bytes = [0; 64];
        let reply = if code == 0xBE {
            Reply::FieldValues { data: &[1, 0, 9, 0] }
        } else {
            Reply::Cartesian { data: &[1, 0, 9, 0, 5, 0] }
        };
        let length = reply.emit(0x80, Status::OK, &mut bytes).expect("it fits");
        bytes[..length].to_vec()
    };
    let (session, reported, _) = received_all(&[raw(0xBE), raw(0xF6), raw(0xBE)]);
    assert_eq!(session.not_kept(), 3);
    assert_eq!(reported.len(), 2, "{reported:?}");
    assert!(reported[1].contains("telegrams F6h"), "{reported:?}");
}

#[test]
fn pairs_are_a_scan_when_their_parts_cover_the_fan_without_a_gap() {
    for parts in
        [&[(1, 361)][..], &[(1, 100), (101, 361)], &[(1, 1), (2, 2), (3, 200), (201, 360), (361, 361)]]
    {
        let (_, _, scans) = received_all(&[pairs(parts)]);
        let scan = &scans[0];
        assert_eq!(
            (scan.ranges_m.len(), scan.intensities.len(), scan.geometry.turns),
            (361, 361, 2),
            "{parts:?}"
        );
        assert_eq!((scan.ranges_m[360], scan.intensities[360]), (1.361, 361));
    }
    for parts in [&[(1, 180)][..], &[(2, 361)], &[(1, 100), (102, 361)], &[(1, 100), (100, 360)]] {
        let (session, reported, scans) = received_all(&[pairs(parts)]);
        assert_eq!((scans.len(), session.not_kept()), (0, 1), "{parts:?}");
        assert_eq!(reported, ["sends parts of a scan: not recorded as scans, only counted"]);
    }
}

#[test]
fn a_part_that_does_not_end_where_it_says_is_no_whole_fan() {
    let scan = Pairs {
        parts: [(Span { first: 1, last: 300 }, Unit::Cm, 361)].into_iter().collect(),
        pairs: (0..361).map(|i| (1000 + i, i)).collect(),
        ..Pairs::default()
    };
    let mut bytes = vec![0; scan.encoded_len()];
    scan.emit(0x80, &mut bytes).expect("it fits");
    let (session, _, scans) = received_all(&[bytes]);
    assert_eq!((scans.len(), session.not_kept()), (0, 1));
}

#[test]
fn turns_of_an_interlaced_scan_are_scans_of_their_own() {
    let turns = [(181, 0), (180, 1), (180, 2), (180, 3), (181, 0), (180, 1)];
    let telegrams: Vec<_> =
        turns.iter().map(|&(count, quarter)| scan(Selection::All, count, Some(quarter))).collect();
    let (session, _, scans) = received_all(&telegrams);
    assert_eq!((scans.len(), session.not_kept(), session.health().rejected), (6, 0, 0));
    let firsts: Vec<_> = scans.iter().map(|scan| scan.geometry.first_cdeg).collect();
    assert_eq!(firsts, [-9000, -8975, -8950, -8925, -9000, -8975]);
    assert!(scans.iter().all(|scan| scan.geometry.turns == 1 && scan.geometry.step_cdeg == 100));
}

#[test]
fn remissions_of_a_part_of_an_s14_s_fan_are_left_out_and_its_ranges_kept() {
    for (first, count, kept) in [(1, 181, 181), (1, 90, 0), (2, 180, 0)] {
        let scan = S14Scan {
            unit: Unit::Cm,
            values: [8190; 181].into_iter().collect(),
            span: Span { first, last: first + count - 1 },
            remissions: (0..count).map(|i| i as u8).collect(),
            index: None,
            status: Status::OK,
        };
        let mut bytes = vec![0; scan.encoded_len()];
        scan.emit(0x80, &mut bytes).expect("it fits");
        let (session, _, scans) = received_all(&[bytes]);
        assert_eq!((scans[0].ranges_m.len(), scans[0].intensities.len()), (181, kept));
        assert!(scans[0].ranges_m.iter().all(|range_m| range_m.is_nan()));
        assert_eq!(session.health().dazzled_values, 181);
    }
}

#[test]
fn a_device_that_refuses_remission_twice_streams_without() {
    let settings = LaserSettings { remission: true, fov_deg: 90, ..HALF };
    let refused = "< 02 80 02 00 92 10 7F 33";
    let s14 = "< 02 80 14 00 BA 4C 4D 53 32 39 31 3B 53 31 34 3B 58 30 31 2E 32 37 20 10 37 06";
    let ask = "> 02 00 06 00 20 50 01 00 B5 00 68 B6";
    let lines = format!(
        "80 {MODE_DONE}\n90 {s14}\n100 {CONFIG}\n110 {STATUS}\n120 {NO_FAULTS}\n130 {refused}\n200 {refused}\n\
         210 {MODE_DONE}\n220 < scan181\n230 end"
    );
    let lines: Vec<String> = lines.lines().map(str::to_owned).collect();
    let transcript = play(&mut streaming(settings), &lines).join("\n");
    assert_eq!(transcript.matches(ask).count(), 2, "{transcript}");
    let tail = format!(
        "200 ! refused while starting continuous output\n\
         200 ! does not send remission, ranges alone are recorded\n200 {STREAM}\n210 {MODE_DONE}\n210 ! streams\n\
         220 < scan181\n220 * 181 beams\n230 end"
    );
    assert!(transcript.ends_with(&tail), "{transcript}");
}

#[test]
fn a_scan_format_that_changes_in_mid_stream_loses_no_scan() {
    let whole = |count: u16| scan(Selection::All, count, None);
    let turn = |(count, quarter): (u16, u8)| scan(Selection::All, count, Some(quarter));
    let mut telegrams: Vec<_> = [181, 181, 401, 401, 361, 361, 361].into_iter().map(whole).collect();
    telegrams.extend([(181, 0), (180, 1), (180, 2), (180, 3), (181, 0)].map(turn));
    telegrams.extend([whole(181), whole(181)]);
    let (session, reported, scans) = received_all(&telegrams);
    let counts: Vec<_> = scans.iter().map(|scan| scan.ranges_m.len()).collect();
    assert_eq!(counts, [181, 181, 401, 401, 361, 361, 361, 181, 180, 180, 180, 181, 181, 181]);
    assert!(scans.windows(2).all(|pair| pair[0].offset < pair[1].offset));
    assert_eq!((session.not_kept(), session.health().rejected), (0, 0));
    assert!(!reported.iter().any(|event| event.contains("damaged")), "{reported:?}");
}

#[test]
fn a_scan_of_a_new_format_with_others_behind_it_is_counted_as_not_kept() {
    let telegrams: Vec<_> =
        [181, 361, 181, 361, 181, 361].map(|count| scan(Selection::All, count, None)).into();
    let (session, _, scans) = received_all(&telegrams);
    assert_eq!((scans.len(), session.not_kept(), session.health().rejected), (5, 1, 0));
    // One that never comes again was damaged.
    let telegrams: Vec<_> = [181, 361, 181, 181].map(|count| scan(Selection::All, count, None)).into();
    let (session, reported, scans) = received_all(&telegrams);
    assert_eq!((scans.len(), session.not_kept(), session.health().rejected), (3, 0, 1));
    assert_eq!(reported.iter().filter(|event| event.contains("damaged")).count(), 1, "{reported:?}");
}

#[test]
fn of_formats_that_change_at_random_every_scan_is_recorded_or_counted() {
    const TELEGRAMS: usize = 200;
    let formats: Vec<_> = [(181, None), (361, None), (401, None), (181, Some(0)), (180, Some(2))]
        .map(|(count, quarter)| scan(Selection::All, count, quarter))
        .into();
    // Each format at least twice in a row, or once.
    for min_run in [2, 1] {
        for seed in 1..=20 {
            let mut noise = Noise::new(seed);
            let mut telegrams = Vec::new();
            while telegrams.len() < TELEGRAMS {
                let format = &formats[noise.below(5)];
                telegrams.extend(std::iter::repeat_n(format.clone(), min_run + noise.below(4)));
            }
            let (session, _, scans) = received_all(&telegrams);
            let (not_kept, rejected) = (session.not_kept(), session.health().rejected);
            let counted = (scans.len() as u64, not_kept + rejected);
            assert_eq!(counted.0 + counted.1, telegrams.len() as u64, "seed {seed}");
            assert!(min_run == 1 || counted.1 == 0, "seed {seed}: {not_kept} not kept, {rejected} rejected");
        }
    }
}
