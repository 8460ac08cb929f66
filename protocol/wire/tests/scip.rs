//! Replies of Hokuyo lasers as three real devices sent them and as Hokuyo's paper prints them, and damage.

mod cases;

use biplane_wire::scip::{
    Block, Command, Deframer, Delivery, KeyValue, Parameters, Reading, Request, Scan, ScanRequest, Status,
    TimeStep, Values, emit_clock, emit_key_values, sum,
};
use biplane_wire::{SkipReason, WireError};
use cases::Noise;
use cases::pieces::{Piece, frames, pieces};

/// Replies that devices sent: a URG-04LX, a UTM-30LX, a UXM-30LX-E.
const SENT: &[&str] = &[
    "VV\n00P\nVEND:Hokuyo Automatic Co.,Ltd.;[\nPROD:SOKUIKI Sensor URG-04LX;[\nFIRM:3.1.04(02/Aug./2007);a\n\
     PROT:SCIP 2.0;N\nSERI:H0706400;F\n\n",
    "PP\n00P\nMODL:URG-04LX(Hokuyo Automatic Co.,Ltd.);N\nDMIN:20;4\nDMAX:5600;_\nARES:1024;\\\nAMIN:44;7\n\
     AMAX:725;o\nAFRT:384;6\nSCAN:600;e\n\n",
    "PP\n00P\nMODL:UTM-30LX(Hokuyo Automatic Co.,Ltd.);U\nDMIN:23;7\nDMAX:60000;J\nARES:1440;^\nAMIN:0;?\n\
     AMAX:1080;Z\nAFRT:540;0\nSCAN:2400;U\n\n",
    "II\n00P\nMODL:URG-04LX(Hokuyo Automatic Co.,Ltd.);N\nLASR:ON;9\n\
     SCSP:Initial(600[rpm])<-Default setting by user;A\nMESM:CLASSIC;^\n\
     SBPS:19200[bps]<-Default setting by user;A\nTIME:6A5404;]\nSTAT:Sensor works well.;8\n\n",
    "BM\n02R\n\n",
    "CR00\n03S\n\n",
    "CR00\n04T\n\n",
    "TM0\n00P\n\n",
    "TM1\n00P\n<SfkP\n\n",
    "TM1\n00P\n<SflQ\n\n",
    "QT\nE\n\n",
    "SCIP2.0\n0\n\n",
    "MD0000108001000\n00P\n\n",
    "QT;my text 1.0\n00P\n\n",
];

/// A scan of 25 values 1000 + 37 k at the time 123456h, worked out by hand.
const RAMP: &str = "MD0000002401000\n99b\n4SAF>\n0?X0@=0@b0AG0Al0BQ0C60C[0D@0De0EJ0Eo0FT0G90G^0HC0Hh0IM0J20JW0K<0I\n\
                    Ka0LF0Lk0MPR\n\n";
/// The beginnings of real scans, each with the values that its first line gives.
const FIRST_LINE: &str = "06806806706105m05m05h05c05c05c05`05]05Z05W05W05U05S05O05S05P05P0_";
const SECOND_LINE: &str = "5P05P05K05G05G05F05D05D05D05A05A05>05>05?05?05?05?05?05<05>05k";
const INTENSITY_LINE: &str = "00]0LA00`0Kd00a0L000b0KB00a0Kc00b0K@00h0KR00h0K^00h0Jm00h0KG00g07";

fn scan_of(text: &[u8]) -> (ScanRequest, u32, Vec<Reading>) {
    let block = Block::parse(text).unwrap();
    let scan = Scan::parse(&block).unwrap().unwrap();
    (scan.request, scan.clock_ms, scan.values.iter().collect())
}

fn emitted(block: &Block<'_>) -> Vec<u8> {
    let mut out = vec![0; block.encoded_len()];
    assert_eq!(block.emit(&mut out), Ok(out.len()));
    out
}

/// A reply with a scan.
fn reply(scan: &Scan<'_>) -> Vec<u8> {
    let mut lines = vec![0; 1 << 15];
    let length = scan.emit_lines(&mut lines).unwrap();
    let status = if scan.request.delivery == Delivery::Once { Status::OK } else { Status::STREAMED };
    let request = Command::Scans(scan.request).into();
    emitted(&Block { request, status, lines: &lines[..length] })
}

fn stream_request(all_echoes: bool, with_intensity: bool, last_step: u16, cluster: u8) -> ScanRequest {
    let delivery = Delivery::Stream { skip: 0, count: 0 };
    ScanRequest { delivery, all_echoes, with_intensity, first_step: 0, last_step, cluster }
}

#[test]
fn what_devices_sent_reads_and_is_written_back_and_every_cut_is_an_error() {
    for text in SENT.iter().copied().chain([RAMP]) {
        let block = Block::parse(text.as_bytes()).unwrap_or_else(|error| panic!("{error}: {text}"));
        assert_eq!(emitted(&block), text.as_bytes(), "{text}");
        for cut in 0..text.len() {
            assert!(Block::parse(&text.as_bytes()[..cut]).is_err(), "{cut} of {text}");
        }
        let longer = [text.as_bytes(), b"M"].concat();
        assert!(matches!(Block::parse(&longer), Err(WireError::TooLong { .. })), "{text}");
    }
}

#[test]
fn geometry_names_and_clocks_are_those_that_the_devices_told() {
    let parameters = |text: &str| Parameters::parse(&Block::parse(text.as_bytes()).unwrap()).unwrap();
    let urg = parameters(SENT[1]).unwrap();
    assert_eq!((urg.min_mm, urg.max_mm, urg.steps_per_turn, urg.rpm), (20, 5600, 1024, 600));
    assert_eq!((urg.first_step, urg.last_step, urg.front_step), (44, 725, 384));
    let utm = parameters(SENT[2]).unwrap();
    assert_eq!((utm.max_mm, utm.last_step, utm.front_step), (60_000, 1080, 540));
    assert!((utm.turn_ns() - 25e6).abs() < 1e-6 && (utm.step_deg() - 0.25).abs() < 1e-12);
    // A number that cannot be true, one that is missing, one whose sum is wrong.
    for (from, to) in [("SCAN:2400;U", "SCAN:0;?"), ("ARES:1440;^\n", ""), ("AMAX:1080;Z", "AMAX:1080;Y")] {
        assert!(parameters(&SENT[2].replace(from, to)).is_err(), "{to}");
    }
    let version = Block::parse(SENT[0].as_bytes()).unwrap();
    assert_eq!(version.value(b"SERI"), Some(&b"H0706400"[..]));
    // The sum with the `;` in it, a `;` in the value, and a line that is none (from a URG-04LX).
    let counted = char::from(sum(b"SERI:H07;"));
    let text = format!("VV\n00P\nI\nSERI:H07;{counted}\nTIME:j;o[;H\n\n");
    let odd = Block::parse(text.as_bytes()).unwrap();
    assert_eq!((odd.value(b"TIME"), odd.value(b"SERI")), (Some(&b"j;o["[..]), Some(&b"H07"[..])));
    assert_eq!(Block::parse(SENT[8].as_bytes()).unwrap().clock_ms(), Some(3_292_603));
    assert_eq!(Block::parse(SENT[9].as_bytes()).unwrap().clock_ms(), Some(3_292_604));
    assert_eq!(Block::parse(SENT[10].as_bytes()).unwrap().status, Status::Scip1(b'E'));
}

#[test]
fn ranges_are_those_of_real_and_worked_out_scans() {
    let (request, clock_ms, values) = scan_of(RAMP.as_bytes());
    assert_eq!((request.last_step, request.values(), clock_ms), (24, 25, 0x12_3456));
    let ramp: Vec<u32> = (0..25).map(|k| 1000 + 37 * k).collect();
    assert_eq!(values.iter().map(|value| value.range_mm).collect::<Vec<_>>(), ramp);
    // Of a URG-04LX: value 21 lies across two lines.
    let two_lines = format!("GD0044008401\n00P\nJUGnD\n{FIRST_LINE}\n{}\n\n", with_sum(&SECOND_LINE[..59]));
    let (request, clock_ms, values) = scan_of(two_lines.as_bytes());
    assert_eq!((request.values(), values.len(), clock_ms), (41, 41, 6_968_830));
    let ranges: Vec<u32> = values.iter().map(|value| value.range_mm).collect();
    assert_eq!(ranges[..10], [392, 392, 391, 385, 381, 381, 376, 371, 371, 371]);
    assert_eq!(ranges[21], 352);
    // Of a UTM-30LX: range and intensity; ten whole pairs and a cut one stand in its first line.
    let pairs = format!("ME0000000901101\n99b\nBI9YM\n{}\n\n", with_sum(&INTENSITY_LINE[..60]));
    let (_, clock_ms, values) = scan_of(pairs.as_bytes());
    let pairs: Vec<_> = values.iter().map(|value| (value.range_mm, value.intensity.unwrap())).collect();
    assert_eq!(clock_ms, 4_821_609);
    assert_eq!(pairs[..6], [(45, 1809), (48, 1780), (49, 1792), (50, 1746), (49, 1779), (50, 1744)]);
    // Several echoes.
    let echoes = "ND0000000201000\n99b\n4SAF>\n0?X0O@&0W40^h&0`L&0b07\n\n";
    let (_, _, values) = scan_of(echoes.as_bytes());
    let found: Vec<_> = values.iter().map(|value| (value.is_further, value.range_mm)).collect();
    let further = |range| (true, range);
    assert_eq!(
        found,
        [(false, 1000), (false, 2000), further(2500), (false, 3000), further(3100), further(3200)]
    );
}

fn with_sum(line: &str) -> String {
    format!("{line}{}", char::from(sum(line.as_bytes())))
}

#[test]
fn scans_of_any_form_are_written_and_read_back_and_written_as_the_same_bytes() {
    let mut noise = Noise(3);
    for round in 0..400 {
        let (all_echoes, with_intensity) = (round % 2 == 0, round % 3 == 0);
        let cluster = (round % 5) as u8;
        let request = stream_request(all_echoes, with_intensity, noise.below(1081) as u16, cluster);
        let mut readings = Vec::new();
        for _ in 0..request.values() {
            let echoes = if all_echoes { 1 + noise.below(3) } else { 1 };
            readings.extend((0..echoes).map(|echo| Reading {
                is_further: echo > 0,
                range_mm: noise.word() & 0x3_FFFF,
                intensity: with_intensity.then_some(noise.word() & 0x3_FFFF),
            }));
        }
        let clock_ms = noise.word() & 0xFF_FFFF;
        let bytes = reply(&Scan { request, clock_ms, values: Values::Numbers(&readings) });
        assert_eq!(scan_of(&bytes), (request, clock_ms, readings));
        let block = Block::parse(&bytes).unwrap();
        assert_eq!(reply(&Scan::parse(&block).unwrap().unwrap()), bytes);
    }
}

#[test]
fn a_scan_with_other_values_than_were_asked_for_is_an_error() {
    for (from, to) in [
        ("MD00000024", "MD00000025"),
        ("MD00000024", "MD00000023"),
        ("MD00000024", "MD00240000"),
        // A mark of a further echo where there is none.
        ("Ka0LF0Lk0MPR", "Ka0LF0Lk&0MPx"),
        ("Ka0LF0Lk0MPR", "Ka0LF0Lk0MP&x"),
    ] {
        let text = RAMP.replace(from, to);
        if let Ok(block) = Block::parse(text.as_bytes()) {
            assert!(Scan::parse(&block).unwrap().is_err(), "{to}");
        } else {
            assert!(text.contains('&'), "{to}");
        }
    }
}

#[test]
fn requests_are_read_and_written_as_clients_write_them() {
    let table: &[(&str, Command)] = &[
        ("SS115200\n", Command::Baud(115_200)),
        ("SS019200\n", Command::Baud(19_200)),
        ("CR03\n", Command::Motor(3)),
        ("HS1\n", Command::Sensitivity(1)),
        ("TM2\n", Command::Time(TimeStep::Leave)),
        ("SCIP2.0\n", Command::Scip2),
        ("MD0000108001000\n", Command::Scans(stream_request(false, false, 1080, 1))),
        ("NE0000108001000\n", Command::Scans(stream_request(true, true, 1080, 1))),
    ];
    for (text, command) in table {
        let request = Request::from(*command);
        let mut out = [0; 40];
        let length = request.emit(&mut out).unwrap();
        assert_eq!(&out[..length], text.as_bytes());
        assert_eq!(Request::parse(text.trim_end().as_bytes()), Ok(request));
    }
    for wrong in
        ["", "X", "MD", "MD00001080010000", "GD00001080010", "SS12345", "QT;#", "QT;0123456789abcdefg", "MDx"]
    {
        assert!(Request::parse(wrong.as_bytes()).is_err(), "{wrong}");
    }
}

#[test]
fn keys_and_clocks_are_written_as_devices_write_them() {
    let mut out = [0; 128];
    let line =
        |key: &'static str, value: &'static str| KeyValue { key: key.as_bytes(), value: value.as_bytes() };
    let length = emit_key_values(&[line("DMIN", "20"), line("ARES", "1024")], &mut out).unwrap();
    assert_eq!(&out[..length], b"DMIN:20;4\nARES:1024;\\\n");
    let length = emit_clock(3_292_603, &mut out).unwrap();
    assert_eq!(&out[..length], b"<SfkP\n");
}

/// A stream of replies and scans.
fn conversation() -> Vec<Vec<u8>> {
    let mut all: Vec<Vec<u8>> = SENT.iter().map(|text| text.as_bytes().to_vec()).collect();
    for number in 0..6 {
        let readings: Vec<Reading> = (0..1081)
            .map(|step| Reading { range_mm: 500 + step * 37 % 9000, ..Reading::default() })
            .collect();
        let request = stream_request(false, false, 1080, 1);
        let scan = Scan { request, clock_ms: 25 * number, values: Values::Numbers(&readings) };
        all.push(reply(&scan));
    }
    all
}

#[test]
fn a_stream_gives_the_same_replies_however_it_is_cut_up() {
    let replies = conversation();
    let stream = replies.concat();
    let (whole, counts) = pieces(Deframer::new(), [&stream[..]]);
    assert_eq!(frames(&whole), replies);
    assert_eq!((counts.skipped_bytes, counts.bad_checksums), (0, 0));
    for size in [1, 2, 3, 7, 64, 255, 256, 1000] {
        assert_eq!(pieces(Deframer::new(), stream.chunks(size)), (whole.clone(), counts), "{size}");
    }
}

#[test]
fn one_byte_lost_added_or_changed_costs_the_reply_that_it_is_in_and_no_other() {
    let replies = conversation();
    let mut noise = Noise(11);
    for round in 0..600 {
        let place = noise.below(replies.len());
        let at = noise.below(replies[place].len());
        let mut damaged = replies.clone();
        match round % 3 {
            0 => drop(damaged[place].remove(at)),
            1 => damaged[place].insert(at, noise.byte()),
            _ => damaged[place][at] ^= 1 << noise.below(8),
        }
        let (found, _) = pieces(Deframer::new(), [&damaged.concat()[..]]);
        let found = frames(&found);
        let mut left = found.iter();
        for (number, reply) in replies.iter().enumerate() {
            let is_there = left.any(|frame| frame == reply);
            // A line feed that is lost or added at a reply's end may cost a reply without a sum of its own.
            assert!(is_there || number == place, "reply {number} after damage to {place} at {at}, {round}");
            if !is_there {
                left = found.iter();
            }
        }
    }
}

#[test]
fn rubbish_in_front_of_a_reply_and_a_second_empty_line_are_skipped() {
    let stream = [&b"\xFF\x00 5P0\n\n"[..], SENT[4].as_bytes(), b"\n", SENT[7].as_bytes()].concat();
    let (found, _) = pieces(Deframer::new(), [&stream[..]]);
    assert_eq!(found[0], Piece::Skipped(0, 8, SkipReason::Noise));
    assert_eq!(found[2], Piece::Skipped(16, 1, SkipReason::Noise));
    assert_eq!(frames(&found).len(), 2);
}

#[test]
fn noise_is_never_a_scan_and_never_a_panic() {
    let mut noise = Noise(5);
    let mut line = noise.bytes(200_000);
    // Text of the right letters, too.
    line.extend((0..400_000).map(|_| *b"MD0019Tb\n\n\n5QV".get(noise.below(13)).unwrap()));
    let (found, counts) = pieces(Deframer::new(), line.chunks(97));
    for frame in frames(&found) {
        let block = Block::parse(&frame).unwrap();
        assert!(Scan::parse(&block).is_none(), "{}", String::from_utf8_lossy(&frame));
    }
    assert_eq!(counts.bytes(), 600_000);
}
