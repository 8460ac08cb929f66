//! Sessions against scripted answers: who is asked what, and what is written.

use std::collections::VecDeque;

use biplane_wire::cola::{
    Channel, Dialect, Head, Kind, OutputRange, Scan, ScanConfig, ScanDataConfig, Telegram, Values, Width,
    emit_byte, emit_texts,
};

use crate::session::cola::ColaSession;
use crate::session::cola::settings::ColaSettings;
use crate::session::device_session::{Input, Output, Session};
use crate::session::testing::noise::{Noise, endure};

const MS: i64 = 1_000_000;

/// A device that answers at once, and what was said to and by the session.
struct Bench {
    session: ColaSession,
    dialect: Dialect,
    name: &'static str,
    is_mute: bool,
    /// Whether it lets nobody log in.
    is_locked: bool,
    now_ns: i64,
    data: ScanDataConfig,
    range: OutputRange,
    scan: ScanConfig,
    asked: Vec<String>,
    events: Vec<String>,
    scans: usize,
    connections: usize,
    pending: VecDeque<Vec<u8>>,
}

impl Bench {
    fn new(name: &'static str, dialect: Dialect, settings: ColaSettings) -> Self {
        Self {
            session: ColaSession::streaming(settings, 0),
            dialect,
            name,
            is_mute: false,
            is_locked: false,
            now_ns: 0,
            data: ScanDataConfig { channels: [1, 0], every: 1, ..ScanDataConfig::default() },
            range: OutputRange { step_e4deg: 5000, start_e4deg: -449_997, stop_e4deg: 2_249_997 },
            scan: ScanConfig {
                rate_chz: 5000,
                sectors: 1,
                step_e4deg: 5000,
                start_e4deg: -450_000,
                stop_e4deg: 2_250_000,
            },
            asked: Vec::new(),
            events: Vec::new(),
            scans: 0,
            connections: 1,
            pending: VecDeque::new(),
        }
    }

    /// Until nothing more happens before this time.
    fn run_to(&mut self, until_ns: i64) {
        loop {
            match self.session.poll() {
                Output::WaitUntil(_) if self.bytes_to_session() => {}
                Output::WaitUntil(wait_ns) if wait_ns > until_ns => break,
                Output::WaitUntil(wait_ns) => {
                    self.now_ns = wait_ns;
                    self.session.handle(wait_ns, Input::Time);
                }
                Output::Write(bytes) => self.answer(&bytes),
                Output::Reconnect => {
                    self.connections += 1;
                    self.now_ns += 250 * MS;
                    self.session.handle(self.now_ns, Input::PortBack);
                }
                Output::Event(event) => self.events.push(event.to_string()),
                Output::TimedScan => self.scans += 1,
                other => panic!("{other:?}"),
            }
        }
        self.now_ns = until_ns;
    }

    fn answer(&mut self, request: &[u8]) {
        let telegram = Telegram::parse(request).unwrap();
        if self.is_mute || telegram.dialect != self.dialect {
            return;
        }
        let name = String::from_utf8_lossy(telegram.name).into_owned();
        let (dialect, mut data) = (telegram.dialect, [0; 128]);
        let length = match (telegram.kind, name.as_str()) {
            (Kind::Read, "DeviceIdent") => emit_texts(&[self.name.as_bytes(), b"V1.80"], dialect, &mut data),
            (Kind::Read, "LMDscandatacfg") => self.data.emit_data(dialect, &mut data),
            (Kind::Read, "LMPoutputRange") => self.range.emit_data(dialect, &mut data),
            (Kind::Read, "LMPscancfg") => self.scan.emit_data(dialect, &mut data),
            (Kind::Write, "LMDscandatacfg") => {
                self.data = ScanDataConfig::parse(&telegram).unwrap();
                Ok(0)
            }
            (Kind::Write, "LMPoutputRange") => {
                self.range = OutputRange::parse(&telegram).unwrap();
                Ok(0)
            }
            (Kind::Method, "mLMPsetscancfg") => {
                self.scan = ScanConfig::parse(&telegram).unwrap();
                self.scan.emit_answer(0, dialect, &mut data)
            }
            (Kind::Method, "SetAccessMode") => emit_byte(u8::from(!self.is_locked), dialect, &mut data),
            (Kind::Method, "LMCstartmeas") => emit_byte(0, dialect, &mut data),
            _ => emit_byte(1, dialect, &mut data),
        };
        let length = length.unwrap();
        let kind = match telegram.kind {
            Kind::Read => Kind::ReadAnswer,
            Kind::Write => Kind::WriteAnswer,
            Kind::Method => Kind::MethodAnswer,
            _ => Kind::SubscribeAnswer,
        };
        self.asked.push(name);
        self.send(&Telegram { dialect, kind, name: telegram.name, data: Some(&data[..length]) });
    }

    fn send(&mut self, telegram: &Telegram<'_>) {
        let mut bytes = vec![0; telegram.encoded_len()];
        telegram.emit(&mut bytes).unwrap();
        self.pending.extend(bytes.chunks(100).map(<[u8]>::to_vec));
    }

    /// A scan of three beams that the device sent at this moment of its own.
    fn send_scan(&mut self, counter: u16, words: [u16; 3]) {
        let channel = Channel {
            name: *b"DIST1",
            scale: 2.0,
            offset: 0.0,
            start_e4deg: 0,
            step_e4deg: 3333,
            width: Width::Word,
            values: Values::Numbers(&words),
        };
        let head = Head { telegram_counter: counter, scan_frequency_chz: 5000, ..Head::default() };
        let scan = Scan {
            head: Head { scan_us: 20_000 * u32::from(counter), ..head },
            encoders: heapless::Vec::new(),
            channels: heapless::Vec::from_slice(&[channel]).unwrap(),
            position: None,
            name: None,
            comment: None,
            clock: None,
            event: None,
        };
        let mut data = [0; 256];
        let length = scan.emit_data(self.dialect, &mut data).unwrap();
        let (dialect, name) = (self.dialect, Scan::NAME);
        self.send(&Telegram { dialect, kind: Kind::Event, name, data: Some(&data[..length]) });
    }

    fn bytes_to_session(&mut self) -> bool {
        let Some(piece) = self.pending.pop_front() else { return false };
        self.session.handle(self.now_ns, Input::Bytes(&piece));
        true
    }
}

const NOTHING: ColaSettings = ColaSettings {
    rate_chz: None,
    step_e4deg: None,
    fov_e4deg: None,
    remission: None,
    login: false,
    save: false,
};

#[test]
fn a_laser_that_is_as_the_rig_asks_is_written_nothing_in_either_dialect() {
    for (dialect, settings) in [
        (Dialect::B, NOTHING),
        (
            Dialect::A,
            ColaSettings { rate_chz: Some(5000), fov_e4deg: Some(2_700_000), login: true, ..NOTHING },
        ),
    ] {
        let mut bench = Bench::new("LMS10x_FieldEval", dialect, settings);
        bench.run_to(2500 * MS);
        let asked = ["DeviceIdent", "LMPscancfg", "LMDscandatacfg", "LMPoutputRange", "LMDscandata"];
        assert_eq!(bench.asked, asked);
        bench.send_scan(7, [16, 0, 1]);
        bench.run_to(2600 * MS);
        assert_eq!(bench.scans, 1);
        let scan = bench.session.scan();
        // Twice 16 mm; no echo; dazzled. Zero of the device is on the right.
        assert_eq!((scan.ranges_m[0], scan.ranges_m[1], scan.dazzled), (0.032, f32::INFINITY, 1));
        assert!(scan.ranges_m[2].is_nan() && (scan.first_deg + 90.0).abs() < 1e-9);
        assert!((scan.step_deg - 1.0 / 3.0).abs() < 1e-12, "{}", scan.step_deg);
    }
}

#[test]
fn what_differs_is_said_and_only_written_where_the_rig_allows_to_log_in() {
    let asked = ColaSettings { rate_chz: Some(2500), step_e4deg: Some(2500), ..NOTHING };
    let mut bench = Bench::new("LMS111", Dialect::B, asked);
    bench.run_to(1000 * MS);
    assert!(!bench.asked.iter().any(|name| name == "SetAccessMode"), "{:?}", bench.asked);
    assert!(bench.events.iter().any(|event| event.contains("login = true")), "{:?}", bench.events);
    assert!(bench.session.health().differs);

    let login = ColaSettings { login: true, save: true, remission: Some(true), ..asked };
    let mut bench = Bench::new("LMS111", Dialect::B, login);
    bench.run_to(1000 * MS);
    let behind = [
        "SetAccessMode",
        "mLMPsetscancfg",
        "LMDscandatacfg",
        "LMPoutputRange",
        "mEEwriteall",
        "LMCstartmeas",
        "Run",
        "LMDscandata",
    ];
    assert_eq!(bench.asked[4..], behind);
    assert_eq!((bench.scan.rate_chz, bench.scan.step_e4deg, bench.range.step_e4deg), (2500, 2500, 2500));
    assert!(bench.data.remission && bench.data.is_remission_wide);
    // On the next connection it is as asked.
    bench.session.handle(bench.now_ns, Input::PortBack);
    bench.run_to(2000 * MS);
    assert_eq!(bench.asked.iter().filter(|name| *name == "SetAccessMode").count(), 1);
}

#[test]
fn a_laser_that_refuses_to_be_set_or_streams_otherwise_than_it_says_is_not_as_the_rig_asks() {
    let asked = ColaSettings { rate_chz: Some(2500), step_e4deg: Some(2500), login: true, ..NOTHING };
    let mut bench = Bench { is_locked: true, ..Bench::new("LMS111", Dialect::B, asked) };
    bench.run_to(1000 * MS);
    bench.send_scan(1, [100; 3]);
    bench.run_to(1100 * MS);
    assert!(bench.events.iter().any(|event| event.starts_with("refuses the login")), "{:?}", bench.events);
    assert!(bench.session.health().differs && bench.scans == 1);

    // Set as the rig asks by its own word; its scans come in steps of a third of a degree.
    let asked = ColaSettings { rate_chz: Some(5000), step_e4deg: Some(5000), ..NOTHING };
    let mut bench = Bench::new("LMS111", Dialect::B, asked);
    bench.run_to(1000 * MS);
    assert!(!bench.session.health().differs);
    for counter in 1..3 {
        bench.send_scan(counter, [100; 3]);
        let until_ns = bench.now_ns + 100 * MS;
        bench.run_to(until_ns);
    }
    let reported = "sends scans otherwise than the rig asks: 50 Hz in steps of 0.3333 degrees";
    assert_eq!(bench.events.iter().filter(|event| *event == reported).count(), 1, "{:?}", bench.events);
    assert!(bench.session.health().differs);
    // As the rig asks: nothing is said.
    let asked = ColaSettings { rate_chz: Some(5000), login: true, ..NOTHING };
    let mut bench = Bench::new("LMS111", Dialect::B, asked);
    bench.run_to(1000 * MS);
    bench.send_scan(1, [100; 3]);
    bench.run_to(1100 * MS);
    assert!(!bench.session.health().differs, "{:?}", bench.events);
}

#[test]
fn what_the_device_does_not_offer_is_refused_with_the_list_of_what_it_does() {
    let asked = ColaSettings { rate_chz: Some(7500), login: true, ..NOTHING };
    let mut bench = Bench::new("TIM561-2050101", Dialect::B, asked);
    bench.run_to(1000 * MS);
    let reported = "does not offer what the rig asks and stays as it is set: a TiM5xx offers up to 270 degrees and \
                15 Hz by 0.3333, 15 Hz by 1";
    assert!(bench.events.iter().any(|event| event == reported), "{:?}", bench.events);
    assert!(!bench.asked.iter().any(|name| name == "SetAccessMode" || name == "LMPscancfg"));
}

#[test]
fn a_stream_that_stops_leads_to_a_new_connection_and_a_gap_in_its_count_is_counted() {
    let mut bench = Bench::new("LMS511", Dialect::B, NOTHING);
    bench.run_to(100 * MS);
    for counter in [65_535, 0, 0, 3] {
        bench.send_scan(counter, [100; 3]);
        let until_ns = bench.now_ns + 20 * MS;
        bench.run_to(until_ns);
    }
    assert_eq!((bench.scans, bench.session.health().lost_telegrams), (3, 2));
    bench.run_to(1500 * MS);
    assert_eq!(bench.connections, 2, "{:?}", bench.events);
    assert_eq!(bench.asked.last().unwrap(), "LMDscandata");
    // A device that accepts connections and says nothing is asked for ever, on new ones.
    bench.is_mute = true;
    bench.run_to(20_000 * MS);
    assert!(bench.connections > 8, "{}", bench.connections);
    bench.is_mute = false;
    bench.run_to(22_000 * MS);
    assert_eq!(bench.asked.last().unwrap(), "LMDscandata");
}

#[test]
fn a_session_that_is_stopped_ends_the_stream_and_is_done() {
    let mut bench = Bench::new("LMS511", Dialect::B, NOTHING);
    bench.run_to(100 * MS);
    bench.session.handle(bench.now_ns, Input::Stop);
    bench.run_to(200 * MS);
    assert!(bench.session.is_done() && bench.asked.len() == 6, "{:?}", bench.asked);
}

#[test]
fn no_bytes_of_chance_end_a_session() {
    let mut noise = Noise::new(5);
    let mut session = ColaSession::streaming(NOTHING, 0);
    endure(&mut session, &mut noise, 3000, 300_000_000, |noise| {
        let count = noise.below(250);
        let mut bytes: Vec<u8> = (0..count).map(|_| noise.byte()).collect();
        if noise.below(3) == 0 {
            bytes.splice(0..0, *b"\x02\x02\x02\x02\x00\x00\x00\x20sSN LMDscandata ");
        }
        bytes.truncate(256);
        bytes
    });
    assert_eq!(session.overflowed(), 0);
}
