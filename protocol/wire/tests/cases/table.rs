//! One value of every form of telegram and packet, the corners of their fields included.

use biplane_wire::lms::{
    self, Baud, Config, ErrorList, MAX_PARTS, Mode, ModeResult, Pairs, RawRequest, Reply, Request, S14Scan,
    Scan, ScanKind, Selection, Span, Status, StatusFields, StatusReport, Text, Unit,
};
use biplane_wire::p2os::{self, Command, Identity, MotorState, Report, Sip};
use biplane_wire::rflex;
use biplane_wire::roboclaw::{
    Answer, EncoderFlags, MAX_ANSWER_BYTES, Motor, Question, Request as Asked, StatusBits, StatusWidth,
};
use biplane_wire::xsens;
use heapless::Vec as FixedVec;

fn leak<T: Clone>(values: &[T]) -> &'static [T] {
    Vec::leak(values.to_vec())
}

fn span(first: u16, last: u16) -> Span {
    Span { first, last }
}

fn spans<const N: usize>(spans: [(u16, u16); N]) -> FixedVec<Span, MAX_PARTS> {
    spans.into_iter().map(|(first, last)| span(first, last)).collect()
}

pub(crate) fn requests() -> Vec<Request> {
    let modes = [
        Mode::StreamSegmentMinima,
        Mode::TriggeredSegmentMinima,
        Mode::StreamVerticalMinimum,
        Mode::TriggeredVerticalMinimum,
        Mode::FieldValues(span(1, 181)),
        Mode::Pairs(spans([(1, 181)])),
        Mode::Pairs(spans([(1, 2), (3, 4), (5, 6), (7, 8), (9, 401)])),
        Mode::Segments,
        Mode::Navigation,
        Mode::Install { password: lms::PASSWORD },
        Mode::Diagnosis,
        Mode::StreamAll,
        Mode::OnRequest,
        Mode::MeanOf(250),
        Mode::SubRange { first: 1, last: 361 },
        Mode::MeanOfSubRange { count: 3, first: 2, last: 401 },
        Mode::StreamPartial,
        Mode::TestPassword { password: *b"12345678" },
        Mode::Reflectivity { first: 1, last: 181 },
        Mode::Other { sub_command: 0x31, arguments: FixedVec::new() },
        Mode::Other { sub_command: 0x2E, arguments: FixedVec::from_array([1]) },
        Mode::Other { sub_command: 0x28, arguments: FixedVec::from_array([3, 0, 1, 0, 2, 0]) },
    ];
    let mut requests = vec![
        Request::Reset,
        Request::RequestScan(ScanKind::All),
        Request::RequestScan(ScanKind::Partial),
        Request::RequestScan(ScanKind::MinVerticalDistance),
        Request::RequestScan(ScanKind::TaughtIn),
        Request::RequestScan(ScanKind::EverySecond),
        Request::RequestScan(ScanKind::EveryTwentieth),
        Request::RequestScan(ScanKind::Other(9)),
        Request::FieldValues(span(1, 10)),
        Request::MeanSubRange { count: 250, span: span(2, 361) },
        Request::SetPassword { password: *b"NEW_PASS" },
        Request::S14(span(1, 181)),
        Request::Pairs(spans([])),
        Request::Pairs(spans([(1, 401), (0x0202, 0x8080)])),
        Request::Cartesian(span(42, 370)),
        Request::ReadSecondConfig,
        Request::WriteSecondConfig((0..84).collect()),
        Request::Status,
        Request::Errors,
        Request::OperatingCounter { with_word: false },
        Request::OperatingCounter { with_word: true },
        Request::MeanScan { count: 2 },
        Request::SubRange { first: 1, last: 0x8169 },
        Request::Type,
        Request::Variant { angle_deg: 100, resolution_cdeg: 25 },
        Request::PermanentBaud(1),
        Request::ReadConfig,
        Request::WriteConfig(Config::factory()),
        Request::WriteConfig(Config::from_bytes(&[1; Config::MAX_BYTES]).unwrap()),
        Request::WriteConfig(Config::default()),
        Request::Raw(RawRequest { code: 0x3F, data: FixedVec::from_array([3, 0, 1, 0, 0x91, 1]) }),
    ];
    requests.extend(modes.map(Request::Mode));
    requests.extend(Baud::ALL.map(|baud| Request::Mode(Mode::Baud(baud))));
    requests
}

pub(crate) fn replies() -> Vec<Reply<'static>> {
    let report = leak(&StatusFields::default().encode());
    let text = Text(b"LMS211;30206;V02.30 ");
    vec![
        Reply::PowerOn { text },
        Reply::ResetDone,
        Reply::Refused,
        Reply::Mode(ModeResult::Done),
        Reply::Mode(ModeResult::WrongPassword),
        Reply::Mode(ModeResult::Fault),
        Reply::Mode(ModeResult::Other(9)),
        Reply::Status(StatusReport::new(report).unwrap()),
        Reply::Errors(ErrorList::new(&[])),
        Reply::Errors(ErrorList::new(&[[3, 12], [0x82, 7]])),
        Reply::OperatingCounter { half_hours: 60_000, switch_ons: 812 },
        Reply::Type { text },
        Reply::Variant { accepted: false, angle_deg: 180, resolution_cdeg: 100 },
        Reply::Config(Config::factory()),
        Reply::ConfigWritten { accepted: true, config: Config::factory() },
        Reply::FieldValues { data: &[1, 0, 2, 0, 3] },
        Reply::Cartesian { data: &[2, 0x80] },
        Reply::PasswordSet { result: 1 },
        Reply::PermanentBaud { result: 1 },
        Reply::SecondConfig { data: &[7; 84] },
        Reply::SecondConfigWritten { accepted: true, data: &[7; 84] },
        Reply::Raw { code: 0xCA, data: &[1, 1, 1] },
    ]
}

pub(crate) fn scans() -> Vec<Scan> {
    let selections = [
        Selection::All,
        Selection::Mean { count: 5 },
        Selection::SubRange { first: 10, last: 20 },
        Selection::MeanSubRange { count: 2, first: 1, last: 401 },
    ];
    let mut scans = Vec::new();
    for (which, selection) in selections.into_iter().enumerate() {
        for count in [0u16, 1, 181, 401] {
            scans.push(Scan {
                selection,
                unit: [Unit::Cm, Unit::Mm, Unit::TenCm][which % 3],
                partial: [None, Some(0), Some(3), None][which],
                values: (0..count).map(|value| value.wrapping_mul(40_503)).collect(),
                index: (count % 2 == 1).then_some((0x02, 0x80)),
                status: Status(0x11),
            });
        }
    }
    scans
}

/// Ranges with remission in one part and in five, with and without index bytes, up to the most that fit.
pub(crate) fn pairs() -> Vec<Pairs> {
    let of = |parts: &[u16], index| {
        let total: u16 = parts.iter().sum();
        let mut first = 1;
        let heads = parts.iter().map(|&count| {
            let head = (span(first, first + count - 1), Unit::Mm, count);
            first += count;
            head
        });
        Pairs {
            parts: heads.collect(),
            pairs: (0..total).map(|i| (i.wrapping_mul(40_503), 13_000 - i)).collect(),
            index,
            status: Status(0x11),
        }
    };
    vec![
        Pairs::default(),
        of(&[181], None),
        of(&[181], Some((0x80, 0x02))),
        of(&[1, 2, 3, 4, 391], Some((1, 1))),
    ]
}

pub(crate) fn s14_scans() -> Vec<S14Scan> {
    let of = |remissions: u16, index| S14Scan {
        unit: Unit::Cm,
        values: (0..181u16).map(|i| i.wrapping_mul(40_503)).collect(),
        span: span(1, remissions),
        remissions: (0..remissions).map(|i| i as u8).collect(),
        index,
        status: Status(0x90),
    };
    vec![of(181, None), of(0, None), of(10, Some((3, 4)))]
}

pub(crate) fn commands() -> Vec<Command> {
    vec![
        Command::Open,
        Command::Close,
        Command::Pulse,
        Command::Enable(true),
        Command::Enable(false),
        Command::Stop,
        Command::SetOrigin,
        Command::Sonar(false),
        Command::Config,
        Command::Encoder(2),
        Command::Velocity { mm_s: 250 },
        Command::Velocity { mm_s: i16::MIN },
        Command::RotationVelocity { deg_s: -30 },
        Command::HostBaud(2),
        Command::with_int(p2os::number::OPEN, 1),
        Command::with_int(5, -65_535),
    ]
}

pub(crate) fn reports() -> Vec<Report<'static>> {
    let sip = Sip {
        state: MotorState::Moving,
        x_raw: 32_600,
        y_raw: 3,
        theta_raw: -2048,
        left_raw: 200,
        right_raw: -200,
        battery_dv: 123,
        left_bumpers: 1,
        right_bumpers: 0x80,
        control_raw: -1,
        flags: 0x0401,
        compass: 90,
        sonar_count: 2,
        extra: FixedVec::from_slice(&[0, 0x10, 0x27, 5, 1, 2, 0xAA, 0xBB]).unwrap(),
    };
    let longest =
        Sip { sonar_count: 77, extra: [7; p2os::MAX_SIP_EXTRA].into_iter().collect(), ..sip.clone() };
    let text = |text: &'static [u8]| Text(text);
    vec![
        Report::Sync(0),
        Report::Sync(1),
        Report::Identity(Identity {
            name: text(b"Kurt"),
            class: text(b"Pioneer"),
            subclass: text(b"p3dx-sh"),
        }),
        Report::Sip(sip),
        Report::Sip(longest),
        Report::Sip(Sip::default()),
        Report::Config(b"Pioneer\0p3dx-sh\0"),
        Report::Encoder { left_counts: -5, right_counts: i32::MAX },
        Report::Raw { kind: 0xFF, data: &[] },
    ]
}

pub(crate) fn rflex_commands() -> Vec<rflex::Command> {
    use rflex::Command;
    vec![
        Command::Status,
        Command::MotionReports { period_us: 100_000, axes: rflex::BOTH_AXES },
        Command::MotionReports { period_us: 0, axes: 0 },
        Command::DigitalReports { period_us: 100_000 },
        Command::SetDefaults,
        Command::BrakeOn,
        Command::BrakeOff,
        Command::SetDirection(rflex::AxisMotion {
            axis: 1,
            speed: 0x1B02_1B03,
            acceleration: u32::MAX,
            torque: 30_000,
            direction: 1,
        }),
        Command::Raw(rflex::RawPacket { port: 4, opcode: 0, data: FixedVec::from_array([0x1B, 3, 0x1B, 2]) }),
        Command::Raw(rflex::RawPacket { port: 1, opcode: 0, data: [7; 255].into_iter().collect() }),
    ]
}

pub(crate) fn rflex_reports() -> Vec<rflex::Report<'static>> {
    use rflex::{DigitalReport, MotionReport, Report, SystemStatus};
    vec![
        Report::Motion(MotionReport {
            return_value: 1,
            time: 2,
            axis: rflex::ROTATION,
            position: i32::MIN,
            velocity: -1,
            acceleration: i32::MAX,
            torque: 0x1B03,
        }),
        Report::Motion(MotionReport::default()),
        Report::Status(SystemStatus { time: u32::MAX, centivolts: 2460, brake: 1 }),
        Report::Digital(DigitalReport { time: 5, address: 0x40, data: 0xFFFE }),
        Report::Raw { port: 4, opcode: 2, data: &[0x1B, 0x02, 0x1B, 0x03] },
        Report::Raw { port: 3, opcode: 0, data: &[] },
    ]
}

pub(crate) fn questions() -> Vec<Asked> {
    let questions = [
        Question::Firmware,
        Question::Encoder(Motor::M1),
        Question::Encoder(Motor::M2),
        Question::Encoders,
        Question::ResetEncoders,
        Question::MainBattery,
        Question::Status(StatusWidth::Wide),
    ];
    let ask = |address| questions.map(|question| Asked { address, question });
    [0x80, 0x87].into_iter().flat_map(ask).collect()
}

pub(crate) fn answers() -> Vec<(Question, Answer<'static>)> {
    let status = |width, bits| (Question::Status(width), Answer::Status(StatusBits { width, bits }));
    vec![
        (Question::Firmware, Answer::Firmware(Text(b"RoboClaw 2x15a v4.1.34\n"))),
        (Question::Firmware, Answer::Firmware(Text(b""))),
        (Question::Firmware, Answer::Firmware(Text(&[b'x'; MAX_ANSWER_BYTES - 3]))),
        (Question::Encoder(Motor::M1), Answer::Encoder { counts: -2, flags: EncoderFlags(3) }),
        (Question::Encoder(Motor::M2), Answer::Encoder { counts: i32::MAX, flags: EncoderFlags(0) }),
        (Question::Encoders, Answer::Encoders { m1_counts: i32::MIN, m2_counts: 77 }),
        (Question::ResetEncoders, Answer::Done),
        (Question::MainBattery, Answer::MainBattery { decivolts: 0x1234 }),
        status(StatusWidth::Wide, 0xDEAD_BEEF),
        status(StatusWidth::Narrow, 0xBEEF),
    ]
}

pub(crate) fn xsens_commands() -> Vec<xsens::Command> {
    let output = |identifier, rate_hz| xsens::Output { identifier, rate_hz };
    vec![
        xsens::Command::AskDeviceId,
        xsens::Command::GoToConfig,
        xsens::Command::GoToMeasurement,
        xsens::Command::WakeUpAcknowledge,
        xsens::Command::Reset,
        xsens::Command::AskOutputs,
        xsens::Command::SetOutputs(
            [output(xsens::quantity::PACKET_COUNTER, xsens::EVERY_SAMPLE), output(0x4023, 400)]
                .into_iter()
                .collect(),
        ),
        xsens::Command::Raw(xsens::RawMessage { mid: 0x18, data: FixedVec::from_array([2]) }),
    ]
}

/// Measurements in every precision, and whatever else a unit says.
pub(crate) fn xsens_reports() -> Vec<xsens::Report<'static>> {
    let sample = xsens::Sample {
        packet_counter: Some(u16::MAX),
        time_fine: Some(0),
        time_coarse_s: Some(7),
        acceleration_m_s2: Some([0.1, -2.5, 9.8]),
        turn_rad_s: Some([1e-3, -0.25, 4.0]),
        status_word: Some(xsens::status::CLIPPING),
    };
    let measurements = xsens::Precision::ALL.map(|precision| {
        let mut items = xsens::ItemsWriter::default();
        sample.write(precision, &mut items).expect("there is room");
        xsens::Report::Data(xsens::Items::parse(leak(items.bytes())).expect("whole items"))
    });
    let mut reports = vec![
        xsens::Report::WakeUp,
        xsens::Report::DeviceId(xsens::DeviceId::Short(0x0370_03F8)),
        xsens::Report::DeviceId(xsens::DeviceId::Long([0, 0x80, 7, 7, 0xFA, 0xFF, 0, 1])),
        xsens::Report::ConfigState,
        xsens::Report::MeasuringState,
        xsens::Report::Resets,
        xsens::Report::Outputs(xsens::Outputs::default()),
        xsens::Report::Error { code: xsens::ErrorCode(0x21), more: &[1] },
        xsens::Report::Raw { mid: 0x13, data: &[1, 8, 2] },
        xsens::Report::Raw { mid: 0x70, data: leak(&[0xFA; 300]) },
    ];
    reports.extend(measurements);
    reports
}
