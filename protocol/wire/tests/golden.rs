//! What known-good bytes mean, and that they come back unchanged. The meanings are written by hand from the
//! manufacturers' descriptions.

mod cases;

use std::path::{Path, PathBuf};

use biplane_wire::lms::{
    Baud, Config, Fault, Flags, MeasuringMode, Mode, ModeResult, Reply, Request, STATUS_REPORT_BYTES,
    ScanKind, Selection, Severity, Span, Status, StatusFields, StatusReport, Telegram, Unit, Value, decode,
};
use biplane_wire::p2os::{Argument, Command, MotorState, Packet, Report};
use biplane_wire::roboclaw::{self, Answer, Motor, Question};
use biplane_wire::{Text, rflex};
use cases::bytes;

/// Reads a telegram to the bottom and writes every form of it; all are the bytes again.
fn check_lms(bytes: &[u8]) {
    let mut out = [0xA5; 1024];
    let telegram = Telegram::parse(bytes).unwrap_or_else(|error| panic!("{bytes:02X?}: {error}"));
    let count = telegram.emit(&mut out).unwrap();
    assert_eq!(out[..count], *bytes);
    let count = match telegram.status() {
        None => telegram.request().unwrap().emit(telegram.address(), &mut out).unwrap(),
        Some(status) => telegram.reply().unwrap().emit(telegram.address(), status, &mut out).unwrap(),
    };
    assert_eq!(out[..count], *bytes);
}

fn check_p2os(bytes: &[u8]) {
    let mut out = [0xA5; 300];
    let packet = Packet::parse(bytes).unwrap_or_else(|error| panic!("{bytes:02X?}: {error}"));
    let count = packet.command().emit(&mut out).unwrap();
    assert_eq!(out[..count], *bytes);
    // A command's number may be a report's type: HOSTBAUD is 32h, as is the information packet.
    if let Ok(report) = packet.report() {
        let count = report.emit(&mut out).unwrap();
        assert_eq!(out[..count], *bytes);
    }
}

fn request(line: &str) -> Request {
    Telegram::parse(&bytes(line)).unwrap().request().unwrap()
}

#[test]
fn every_known_telegram_reads_and_writes_back_unchanged() {
    for line in cases::LMS_REQUESTS.iter().chain(cases::LMS_REPLIES) {
        check_lms(&bytes(line));
    }
    for line in cases::P2OS_COMMANDS.iter().chain([&cases::P2OS_SIP]) {
        check_p2os(&bytes(line));
    }
}

#[test]
fn requests_mean_what_the_listing_says() {
    let table = [
        ("02 00 01 00 10 34 12", Request::Reset),
        ("02 00 02 00 20 24 34 08", Request::Mode(Mode::StreamAll)),
        ("02 00 02 00 20 25 35 08", Request::Mode(Mode::OnRequest)),
        ("02 00 02 00 20 2A 3A 08", Request::Mode(Mode::StreamPartial)),
        ("02 00 02 00 20 40 50 08", Request::Mode(Mode::Baud(Baud::B38400))),
        ("02 00 02 00 20 41 51 08", Request::Mode(Mode::Baud(Baud::B19200))),
        ("02 00 02 00 20 42 52 08", Request::Mode(Mode::Baud(Baud::B9600))),
        ("02 00 02 00 20 48 58 08", Request::Mode(Mode::Baud(Baud::B500000))),
        ("02 00 03 00 20 26 05 79 3E", Request::Mode(Mode::MeanOf(5))),
        ("02 00 06 00 20 27 1B 00 2B 01 FF FE", Request::Mode(Mode::SubRange { first: 27, last: 299 })),
        (
            "02 00 0A 00 20 00 53 49 43 4B 5F 4C 4D 53 BE C5",
            Request::Mode(Mode::Install { password: *b"SICK_LMS" }),
        ),
        ("02 00 02 00 30 01 31 18", Request::RequestScan(ScanKind::All)),
        ("02 00 05 00 3B B4 00 32 00 3B 1F", Request::Variant { angle_deg: 180, resolution_cdeg: 50 }),
        ("02 00 05 00 3B 64 00 19 00 E7 72", Request::Variant { angle_deg: 100, resolution_cdeg: 25 }),
        ("02 00 02 00 66 00 9C 4E", Request::PermanentBaud(0)),
        ("02 00 01 00 35 11 12", Request::OperatingCounter { with_word: false }),
        ("02 00 05 00 44 01 00 B5 00 68 37", Request::S14(Span { first: 1, last: 181 })),
        (
            "02 00 07 00 75 01 00 01 00 91 01 7D B6",
            Request::Pairs([Span { first: 1, last: 401 }].into_iter().collect()),
        ),
        ("02 00 05 00 76 01 00 2A 01 72 BA", Request::Cartesian(Span { first: 1, last: 298 })),
        ("02 00 01 00 7B 5F 12", Request::ReadSecondConfig),
        ("02 00 06 00 20 50 01 00 B5 00 68 B6", Request::Mode(Mode::Reflectivity { first: 1, last: 181 })),
        ("02 00 01 00 74 50 12", Request::ReadConfig),
    ];
    for (line, expected) in table {
        assert_eq!(request(line), expected, "{line}");
    }
}

#[test]
fn a_short_configuration_write_keeps_its_length() {
    let Request::WriteConfig(config) = request("02 00 08 00 77 00 00 46 00 00 01 01 A2 4E") else {
        panic!("a configuration");
    };
    assert_eq!(config.as_bytes(), [0x00, 0x00, 0x46, 0x00, 0x00, 0x01, 0x01]);
    assert_eq!(config.measuring_mode(), Some(MeasuringMode::Reflector8));
    assert_eq!(config.unit(), Some(Unit::Mm));
    assert_eq!(config.multiple_evaluation(), None);
}

#[test]
fn replies_mean_what_the_listing_says() {
    let telegrams: Vec<_> = cases::LMS_REPLIES.iter().map(|line| bytes(line)).collect();
    let telegrams: Vec<_> = telegrams.iter().map(|bytes| Telegram::parse(bytes).unwrap()).collect();
    let reply = |index: usize| telegrams[index].reply().unwrap();
    let Reply::PowerOn { text } = reply(0) else { panic!("power-on") };
    assert_eq!(text.as_str(), Some("LMS200;301063;V02.10"));
    assert_eq!(telegrams[1].status().map(Status::severity), Some(Severity::Error));
    assert_eq!(telegrams[1].address(), 0x81);
    assert_eq!(reply(2), Reply::ResetDone);
    assert_eq!(reply(3), Reply::Refused);
    assert_eq!(reply(4), Reply::Mode(ModeResult::Done));
    assert!(matches!(reply(6), Reply::Errors(errors) if errors.pairs().is_empty()));
    assert_eq!(reply(7), Reply::OperatingCounter { half_hours: 0, switch_ons: 1 });
    let Reply::Type { text } = reply(8) else { panic!("type") };
    assert_eq!(text.to_string(), "LMS291;S05;X01.27");
    assert_eq!(reply(9), Reply::Variant { accepted: true, angle_deg: 180, resolution_cdeg: 50 });
    assert!(matches!(reply(12), Reply::Raw { code: 0xCA, data: [1, 1, 1] }));
    let Reply::Config(config) = reply(13) else { panic!("configuration") };
    assert_eq!(config.as_bytes().len(), Config::BYTES);
    assert_eq!(config.unit(), Some(Unit::Cm));
    assert_eq!(config.restart(), Some(2));
    let Reply::ConfigWritten { accepted: true, config } = reply(14) else { panic!("written") };
    assert_eq!(
        (config.threshold_mv(), config.unit(), config.blanking_cm()),
        (Some(0x70), Some(Unit::Mm), Some(0))
    );
}

#[test]
fn a_sub_range_holds_its_positions_and_values() {
    let line = cases::LMS_REPLIES.iter().find(|line| line.starts_with("02 80 1C 00 B7")).unwrap();
    let bytes = bytes(line);
    let Reply::Scan(scan) = Telegram::parse(&bytes).unwrap().reply().unwrap() else { panic!("a scan") };
    assert_eq!(scan.selection(), Selection::SubRange { first: 1, last: 10 });
    assert_eq!((scan.unit(), scan.count(), scan.index()), (Unit::Cm, 10, None));
    assert!(scan.values().eq([302, 304, 305, 307, 309, 310, 312, 314, 316, 317]));
}

/// A reply of these data; the checksum is computed, since no printed example has one.
fn reply_of(code: u8, data: &[u8], status: u8) -> Vec<u8> {
    let mut bytes = vec![0x02, 0x80];
    bytes.extend((data.len() as u16 + 2).to_le_bytes());
    bytes.push(code);
    bytes.extend(data);
    bytes.push(status);
    bytes.extend(biplane_wire::lms::checksum(&bytes).to_le_bytes());
    bytes
}

#[test]
fn an_s14_s_ranges_and_remissions_stand_as_its_driver_reads_them() {
    // 559 bytes, and the first ranges: a driver's session with an LMS291-S14. Remissions count up by three.
    let mut data = vec![0xB5, 0x00, 0x30, 0x01, 0x2E, 0x01, 0x2C, 0x01];
    data.resize(2 + 2 * 181, 0x01);
    data.extend([0xB5, 0x00, 0x01, 0x00, 0xB5, 0x00]);
    data.extend((0..181u32).map(|i| (i * 3) as u8));
    let bytes = reply_of(0xC4, &data, 0x10);
    assert_eq!((bytes.len(), &bytes[..5]), (559, &[0x02, 0x80, 0x29, 0x02, 0xC4][..]));
    let Reply::S14(view) = Telegram::parse(&bytes).unwrap().reply().unwrap() else { panic!("an S14 scan") };
    assert_eq!((view.unit, view.span, view.index()), (Unit::Cm, Span { first: 1, last: 181 }, None));
    assert!(view.values().take(3).eq([304, 302, 300]));
    assert_eq!((view.values().len(), view.remissions()[60]), (181, 180));
}

#[test]
fn ranges_and_remissions_of_two_parts_stand_in_their_order() {
    let data = [
        2, 0, // parts
        1, 0, 2, 0, 0x02, 0x40, 0x10, 0x27, 0xC8, 0x32, 0x11, 0x27, 0, 0, // 1..2, two pairs, mm
        9, 0, 9, 0, 0x01, 0x40, 0xFF, 0x1F, 1, 0, // 9..9
        7, 8, // index bytes
    ];
    let bytes = reply_of(0xF5, &data, 0x10);
    let Reply::Pairs(view) = Telegram::parse(&bytes).unwrap().reply().unwrap() else { panic!("pairs") };
    let parts: Vec<_> =
        view.parts().map(|part| (part.span, part.unit, part.pairs().collect::<Vec<_>>())).collect();
    assert_eq!(parts[0], (Span { first: 1, last: 2 }, Unit::Mm, vec![(10_000, 13_000), (10_001, 0)]));
    assert_eq!(parts[1], (Span { first: 9, last: 9 }, Unit::Mm, vec![(8191, 1)]));
    assert_eq!((parts.len(), view.index()), (2, Some((7, 8))));
    // 181 pairs make the 740 bytes of the listing's table.
    let mut whole = vec![1, 0, 1, 0, 0xB5, 0, 0xB5, 0];
    whole.resize(8 + 4 * 181, 0);
    assert_eq!(reply_of(0xF5, &whole, 0x10).len(), 740);
}

#[test]
fn counts_that_cannot_be_are_refused_before_anything_is_kept() {
    for (code, data) in [
        (0xF5, &[6, 0][..]),
        (0xF5, &[1, 0, 1, 0, 2, 0, 0x92, 0x01]),
        (0xF5, &[1, 0, 1, 0, 2, 0, 1, 0xC0, 0, 0, 0, 0]),
        (0xC4, &[0xFF, 0x03]),
        (0xC4, &[0, 0, 0xFF, 0x03, 1, 0, 2, 0]),
        (0xF5, &[0, 0, 9]),
    ] {
        let bytes = reply_of(code, data, 0x10);
        assert!(Telegram::parse(&bytes).unwrap().reply().is_err(), "{data:02X?}");
    }
}

#[test]
fn faults_are_told_apart_by_severity_and_whether_they_are_over() {
    let bytes = reply_of(0xB2, &[0x03, 0x15, 0x81, 0x02], 0x13);
    let Reply::Errors(list) = Telegram::parse(&bytes).unwrap().reply().unwrap() else { panic!("faults") };
    let faults: Vec<Fault> = list.faults().collect();
    assert_eq!(faults[0], Fault { severity: Severity::Error, is_current: true, number: 0x15 });
    assert_eq!(faults[1], Fault { severity: Severity::Info, is_current: false, number: 2 });
}

#[test]
fn the_status_report_s_fields_stand_where_drivers_read_them() {
    let bytes = bytes(cases::LMS_STATUS);
    let Reply::Status(report) = Telegram::parse(&bytes).unwrap().reply().unwrap() else { panic!("status") };
    assert_eq!(report.version().as_str(), Some("X01.27"));
    assert_eq!(report.operating_mode(), 0x25);
    assert!(!report.has_fault() && report.laser_on() && !report.permanent_baud());
    assert_eq!(report.pollution(), [100, 101, 102, 103, 104, 105, 106, 107]);
    assert_eq!(report.mirror_turn_90th_us(), 148);
    assert_eq!(report.measuring_mode(), MeasuringMode::FieldsAbDazzle);
    assert_eq!((report.angle_deg(), report.resolution_cdeg()), (180, 50));
    assert_eq!((report.restart_mode(), report.restart_time_s(), report.evaluations()), (2, 2, 2));
    assert_eq!(report.baud(), Ok(Baud::B38400));
    assert_eq!((report.address(), report.field_set()), (0, 1));
    assert_eq!(report.unit(), Ok(Unit::Cm));
    assert_eq!(report.boot_version().as_str(), Some("V02.10"));
}

#[test]
fn a_simulated_status_report_is_the_known_one_but_for_what_it_leaves_out() {
    let fields = StatusFields { baud: Baud::B38400, ..StatusFields::default() };
    let telegram = bytes(cases::LMS_STATUS);
    let mut known = telegram[5..5 + STATUS_REPORT_BYTES].to_vec();
    // By the listing's offsets, which count the code: reserved, pollution, reference and calibration,
    // signals.
    for left_out in [10..18, 19..67, 69..102] {
        known[left_out.start - 1..left_out.end - 1].fill(0);
    }
    for pollution in known[18..34].chunks_mut(2) {
        pollution[0] = 100;
    }
    assert_eq!(fields.encode()[..], known);
}

#[test]
fn every_field_of_a_simulated_status_report_is_read_back() {
    let fields = StatusFields {
        version: *b"V02.30 ",
        operating_mode: 0x24,
        has_fault: true,
        variant: 3,
        pollution: [1, 2, 3, 4, 5, 6, 7, 800],
        measuring_mode: MeasuringMode::FieldsAb,
        angle_deg: 100,
        resolution_cdeg: 25,
        baud: Baud::B500000,
        permanent_baud: true,
        address: 5,
        unit: Unit::Mm,
        laser_on: false,
        boot_version: *b"V01.00 ",
    };
    let data = fields.encode();
    let report = StatusReport::new(&data).unwrap();
    assert_eq!(report.version().0, fields.version);
    assert_eq!((report.operating_mode(), report.variant()), (0x24, 3));
    assert!(report.has_fault() && report.permanent_baud() && !report.laser_on());
    assert_eq!(report.pollution(), fields.pollution);
    assert_eq!(report.measuring_mode(), MeasuringMode::FieldsAb);
    assert_eq!((report.angle_deg(), report.resolution_cdeg()), (100, 25));
    assert_eq!((report.baud(), report.unit(), report.address()), (Ok(Baud::B500000), Ok(Unit::Mm), 5));
    assert_eq!(report.boot_version().0, fields.boot_version);
}

#[test]
fn partial_scans_say_their_offset() {
    // Count words of a driver's session: 100/0.25 variant, offsets .25, .50, .75, then 180 degrees, .00.
    for (word, count, quarters) in [(0x28B4u16, 180, 1), (0x30B4, 180, 2), (0x38B4, 180, 3), (0x20B5, 181, 0)]
    {
        let mut bytes = vec![0x02, 0x80];
        bytes.extend((2 * count as u16 + 4).to_le_bytes());
        bytes.push(0xB0);
        bytes.extend(word.to_le_bytes());
        bytes.extend(vec![0x01; 2 * count]);
        bytes.push(0x10);
        bytes.extend(biplane_wire::lms::checksum(&bytes).to_le_bytes());
        let Reply::Scan(scan) = Telegram::parse(&bytes).unwrap().reply().unwrap() else { panic!("a scan") };
        assert_eq!(scan.partial_offset_quarters(), Some(quarters));
        assert_eq!((scan.count(), scan.unit()), (count, Unit::Cm));
        assert_eq!(scan.to_owned(Status::OK).count_word(), word);
    }
}

#[test]
fn commands_mean_what_the_manual_says() {
    let table = [
        ("FA FB 03 00 00 00", Command::Pulse),
        ("FA FB 03 01 00 01", Command::Open),
        ("FA FB 03 02 00 02", Command::Close),
        ("FA FB 06 04 3B 01 00 05 3B", Command::Enable(true)),
        ("FA FB 06 1C 3B 00 00 1C 3B", Command::Sonar(false)),
        ("FA FB 06 0B 1B C8 00 D3 1B", Command::Velocity { mm_s: -200 }),
        ("FA FB 06 15 3B 1E 00 33 3B", Command::RotationVelocity { deg_s: 30 }),
        ("FA FB 06 12 3B 01 00 13 3B", Command::Config),
        ("FA FB 06 13 3B 02 00 15 3B", Command::Encoder(2)),
        ("FA FB 06 32 3B 02 00 34 3B", Command::HostBaud(2)),
        ("FA FB 03 1D 00 1D", Command::Stop),
        ("FA FB 03 07 00 07", Command::SetOrigin),
        ("FA FB 06 01 3B 01 00 02 3B", Command::with_int(1, 1)),
        ("FA FB 06 05 1B 2C 01 31 1C", Command::with_int(5, -300)),
    ];
    for (line, expected) in table {
        assert_eq!(Packet::parse(&bytes(line)).unwrap().command(), expected, "{line}");
    }
    let malformed = Packet::parse(&bytes("FA FB 04 07 3B 07 3B")).unwrap().command();
    assert_eq!((malformed.number(), malformed.argument()), (7, Argument::Malformed(&[0x3B])));
    // A negative zero is a zero, but other bytes.
    let zero = bytes("FA FB 06 0B 1B 00 00 0B 1B");
    check_p2os(&zero);
    assert_eq!(Packet::parse(&zero).unwrap().command().argument(), Argument::Int(0));
}

#[test]
fn the_information_packet_reads_as_two_drivers_read_it() {
    let bytes = bytes(cases::P2OS_SIP);
    let Report::Sip(sip) = Packet::parse(&bytes).unwrap().report().unwrap() else { panic!("a SIP") };
    assert_eq!(sip.state, MotorState::Stopped);
    assert_eq!((sip.x_raw, sip.y_raw, sip.theta_raw), (32_600, 0, 0));
    assert_eq!((sip.battery_dv, sip.sonar_count, sip.sonar().count()), (123, 0, 0));
    assert_eq!(sip.tail()[5], 0x7B, "battery word of a newer base: 12.3 V again");
    assert!(!sip.motors_moving() && !sip.motors_enabled() && !sip.stalled());
}

/// The folder of third-party data: `BIPLANE_DATA`, or `shared/data` beside a parent folder of this crate. It
/// may be missing, except on a build server.
fn data_folder() -> Option<PathBuf> {
    let here = Path::new(env!("CARGO_MANIFEST_DIR"));
    let beside = here.ancestors().map(|parent| parent.join("shared/data"));
    let found = std::env::var_os("BIPLANE_DATA")
        .map(PathBuf::from)
        .into_iter()
        .chain(beside)
        .find(|path| path.is_dir());
    if found.is_none() {
        println!("skipped: no data folder");
        assert!(std::env::var_os("CI").is_none_or(|ci| ci != "true"), "CI=true, but there is no data folder");
    }
    found
}

fn data_lines(path: &Path) -> Vec<Vec<u8>> {
    let text = std::fs::read_to_string(path).unwrap_or_else(|error| panic!("{}: {error}", path.display()));
    text.lines().map(bytes).filter(|bytes| !bytes.is_empty()).collect()
}

#[test]
fn all_collected_telegrams_read_and_write_back_unchanged() {
    let Some(folder) = data_folder() else { return };
    for (file, min_lines) in [("telegrams.txt", 40), ("manual_vectors.txt", 11)] {
        let lines = data_lines(&folder.join("sick").join(file));
        assert!(lines.len() >= min_lines, "{file}: {} lines", lines.len());
        lines.iter().for_each(|bytes| check_lms(bytes));
    }
    let packets = data_lines(&folder.join("sick/p2os_packets.txt"));
    assert!(packets.len() >= 17);
    packets.iter().for_each(|bytes| check_p2os(bytes));
}

#[test]
fn a_device_s_own_scan_reads_and_writes_back_unchanged() {
    let Some(folder) = data_folder() else { return };
    let bytes = std::fs::read(folder.join("sick/usick_sim361.bin")).unwrap();
    check_lms(&bytes);
    let telegram = Telegram::parse(&bytes).unwrap();
    let Reply::Scan(view) = telegram.reply().unwrap() else { panic!("a scan") };
    let scan = view.to_owned(telegram.status().unwrap());
    assert_eq!((scan.unit, scan.values.len(), scan.index, scan.partial), (Unit::Mm, 361, None, None));
    assert_eq!(scan.values[..3], [0x08CB, 0x08CB, 0x08C2]);
    let mut out = [0xA5; 1024];
    let count = scan.emit(telegram.address(), &mut out).unwrap();
    assert_eq!(out[..count], bytes);
    assert!(scan.values.iter().any(|&value| value > 0x1FFF), "values use more than 13 bits");
    let far = decode(*scan.values.iter().max().unwrap(), MeasuringMode::FieldsAb);
    assert_eq!(far.flags, Flags::default());
    assert!(matches!(far.value, Value::Range(_)), "{far:?}");
}

#[test]
fn every_known_rflex_packet_reads_and_writes_back_unchanged() {
    let mut out = [0xA5; 300];
    for line in cases::RFLEX_COMMANDS.iter().chain(cases::RFLEX_REPORTS) {
        let bytes = bytes(line);
        let packet = rflex::Packet::parse(&bytes).unwrap_or_else(|error| panic!("{line}: {error}"));
        let count = packet.command().emit(packet.id, &mut out).unwrap();
        assert_eq!(out[..count], bytes);
    }
}

#[test]
fn rflex_packets_mean_what_the_sheet_says() {
    use rflex::{AxisMotion, Command, Report};
    let command = |line: &str| rflex::Packet::parse(&bytes(line)).unwrap().command();
    let commands = [
        Command::MotionReports { period_us: 100_000, axes: 3 },
        Command::BrakeOff,
        Command::SetDefaults,
        Command::DigitalReports { period_us: 100_000 },
        Command::Status,
        Command::SetDirection(AxisMotion {
            axis: 0,
            speed: 0,
            acceleration: 1000,
            torque: 30_000,
            direction: 1,
        }),
    ];
    for (line, expected) in cases::RFLEX_COMMANDS.iter().zip(commands) {
        assert_eq!(command(line), expected, "{line}");
    }
    let reports = cases::RFLEX_REPORTS.iter().map(|line| bytes(line)).collect::<Vec<_>>();
    let report = |index: usize| rflex::Packet::parse(&reports[index]).unwrap().report().unwrap();
    let motion = rflex::MotionReport { time: 250_000, position: -5, velocity: 1200, ..Default::default() };
    assert_eq!(report(0), Report::Motion(motion));
    assert_eq!(report(1), Report::Status(rflex::SystemStatus { time: 99, centivolts: 2460, brake: 1 }));
    assert_eq!(report(2), Report::Digital(rflex::DigitalReport { time: 99, address: 0x40, data: 3 }));
}

#[test]
fn a_controllers_answers_mean_what_the_manual_says() {
    use roboclaw::{EncoderFlags, StatusBits, StatusWidth};
    let expected = [
        Answer::Firmware(Text(b"RoboClaw 2x15a v4.1.34\n")),
        Answer::Encoders { m1_counts: 1000, m2_counts: -1 },
        Answer::Encoders { m1_counts: 1000, m2_counts: -1 },
        Answer::Encoder { counts: i32::MAX, flags: EncoderFlags(2) },
        Answer::Encoder { counts: 0, flags: EncoderFlags(5) },
        Answer::MainBattery { decivolts: 123 },
        Answer::Status(StatusBits { width: StatusWidth::Wide, bits: 0x0008_0001 }),
        Answer::Done,
    ];
    for ((asked, answer), expected) in cases::ROBOCLAW.iter().zip(expected) {
        let request = roboclaw::Request::parse(&bytes(asked)).unwrap();
        let (answer, mut out) = (bytes(answer), [0xA5; 64]);
        assert_eq!(Answer::accept(request, &answer), Ok(expected), "{asked}");
        let count = expected.emit(request, &mut out).unwrap();
        assert_eq!(out[..count], answer, "{asked}");
        let count = request.emit(&mut out).unwrap();
        assert_eq!(out[..count], bytes(asked));
    }
    assert_eq!(roboclaw::Request::parse(&bytes("80 10")).unwrap().question, Question::Encoder(Motor::M1));
    let narrow = Question::Status(StatusWidth::Narrow);
    let bits = StatusBits { width: StatusWidth::Narrow, bits: 0x0804 };
    assert_eq!(
        Answer::accept(roboclaw::Request { address: 0x80, question: narrow }, &bytes("08 04 8D 1A")),
        Ok(Answer::Status(bits))
    );
}
