//! The engine against a mock Hokuyo laser in simulated time, found in every state in which one may be: at
//! another rate, in SCIP 1.1, with its clock being read, streaming, starting up. And what its scans hold.

use std::collections::BTreeMap;

use biplane_matcher::TrackerParams;
use biplane_mock::devices::device::Device;
use biplane_mock::devices::scip::{ScipDevice, ScipLink, ScipParams, ScipState};
use biplane_onboard::{Command, Engine, EngineOptions, Feed, Health, Sink};
use biplane_recording::messages::LaserScan;
use biplane_recording::rig::{Base, LaserProtocol, ScipLaser};
use biplane_recording::{Message, Port, Rig, Topic};

const MS: i64 = 1_000_000;
const S: i64 = 1000 * MS;
const STEP_NS: i64 = MS;

#[derive(Default)]
struct Scans(Vec<(i64, LaserScan)>);

impl Sink for Scans {
    fn message(&mut self, topic: Topic, now_ns: i64, _: i64, body: &[u8]) {
        if topic == Topic::ScanHorizontal {
            self.0.push((now_ns, LaserScan::decode(body).unwrap()));
        }
    }

    fn health(&mut self, _: i64, _: &Health) {}

    fn dropped(&self) -> u64 {
        0
    }
}

/// A laser on a line, and the engine at its other end.
struct Bench {
    engine: Engine<Scans>,
    device: ScipDevice,
    now_ns: i64,
    /// The rate of the engine's port; 0 on a network.
    baud: u32,
    events: Vec<String>,
    asked: Vec<String>,
    /// True time of each scan's first beam by its place.
    first_beams_ns: std::sync::Arc<std::sync::Mutex<Vec<i64>>>,
}

/// A laser on the line of its type, and what the rig asks of it.
fn bench(params: ScipParams, asked: &ScipLaser, baud: u32) -> Bench {
    let mut rig = Rig { vertical: None, base: Base::none(), ..Rig::default() };
    let is_network = params.link == ScipLink::Network;
    let address = is_network.then(|| "192.168.0.10:10940".to_owned());
    rig.horizontal.protocol = LaserProtocol::Scip(ScipLaser { address, ..asked.clone() });
    rig.horizontal.baud = baud;
    let options = EngineOptions { rig, matcher: TrackerParams::default(), feed: Feed::Live, raw: false };
    let first_beams_ns: std::sync::Arc<std::sync::Mutex<Vec<i64>>> = std::sync::Arc::default();
    let noted = std::sync::Arc::clone(&first_beams_ns);
    let source = move |fan: &biplane_mock::rig::fan::Fan| {
        noted.lock().unwrap().push(fan.first_beam_ns);
        (0..fan.count).map(|beam| if beam % 50 == 7 { 0 } else { 1500 + beam }).collect()
    };
    let mut device = ScipDevice::new(params, Box::new(source));
    device.connected(0);
    Bench {
        engine: Engine::new(&options, Scans::default(), 0),
        device,
        now_ns: 0,
        baud: if is_network { 0 } else { baud },
        events: Vec::new(),
        asked: Vec::new(),
        first_beams_ns,
    }
}

impl Bench {
    fn is_right_rate(&self) -> bool {
        [0, self.baud].contains(&self.device.baud())
    }

    fn run(&mut self, until_ns: i64) {
        while self.now_ns < until_ns {
            let mut out = Vec::new();
            let was_right = self.is_right_rate();
            self.device.poll(self.now_ns, &mut out);
            if !was_right {
                out.iter_mut().for_each(|byte| *byte = byte.wrapping_mul(31) | 0x80);
            }
            for piece in out.chunks(256) {
                self.engine.bytes(self.now_ns, Port::Horizontal, piece);
            }
            self.engine.advance(self.now_ns);
            while let Some((_, command)) = self.engine.next_command() {
                match command {
                    Command::Write(bytes) if self.is_right_rate() => {
                        self.asked.push(String::from_utf8_lossy(&bytes).trim_end().to_owned());
                        self.device.handle(self.now_ns, &bytes);
                    }
                    Command::Write(bytes) => self.device.handle_noise(self.now_ns, bytes.len()),
                    Command::SetBaud(baud) => self.baud = baud,
                    Command::Reconnect => {
                        self.device.disconnected(self.now_ns);
                        self.engine.port_lost(self.now_ns, Port::Horizontal);
                        self.now_ns += 250 * MS;
                        self.device.connected(self.now_ns);
                        self.engine.port_back(self.now_ns, Port::Horizontal);
                    }
                }
            }
            while let Some((_, event)) = self.engine.next_event() {
                self.events.push(event.to_string());
            }
            self.now_ns += STEP_NS;
        }
    }

    fn scans(&mut self) -> &[(i64, LaserScan)] {
        &self.engine.sink().0
    }
}

fn named(name: &str) -> ScipParams {
    ScipParams::of_name(name).unwrap()
}

#[test]
fn a_laser_streams_within_two_seconds_in_whatever_state_it_was_left() {
    let states = [ScipState::Idle, ScipState::Streaming, ScipState::Clock, ScipState::Scip1];
    let links = [
        ("UST-20LX", ScipLink::Network),
        ("UTM-30LX", ScipLink::Usb),
        ("URG-04LX", ScipLink::Serial(19_200)),
        ("URG-04LX", ScipLink::Serial(115_200)),
        ("URG-04LX", ScipLink::Serial(750_000)),
    ];
    let mut worst: BTreeMap<String, i64> = BTreeMap::new();
    for (name, link) in links {
        for state in states {
            for phase_ms in [0, 9, 17] {
                let params = ScipParams { link, state, phase_ns: phase_ms * MS, ..named(name) };
                let mut bench = bench(params, &ScipLaser::default(), 115_200);
                bench.run(6 * S);
                let case = format!("{name} {link:?} {state:?}");
                let first = bench.scans().first().map(|(at_ns, _)| *at_ns);
                let events = bench.events.clone();
                let first_ns = first.unwrap_or_else(|| panic!("{case}: {events:?}"));
                assert!(first_ns < 3 * S, "{case}: first scan after {} ms", first_ns / MS);
                // Left at 19200 Bd, an old laser with a scan on the line takes the longest.
                let whole = bench.scans().iter().filter(|(_, scan)| scan.ranges_m.len() > 500).count();
                assert!(whole > 15, "{case}: {whole} scans, {events:?}");
                let worst_ns = worst.entry(case).or_default();
                *worst_ns = (*worst_ns).max(first_ns);
            }
        }
    }
    for (case, worst_ns) in &worst {
        println!("{case}: first scan after {} ms at worst", worst_ns / MS);
    }
    assert!(worst.values().all(|worst_ns| *worst_ns < 2 * S), "{worst:?}");
}

#[test]
fn scans_have_the_directions_ranges_and_times_of_the_device() {
    let asked = ScipLaser {
        fov_deg: Some(180.0),
        resolution_deg: Some(0.5),
        scan_hz: Some(20.0),
        remission: Some(true),
        ..ScipLaser::default()
    };
    let mut bench = bench(named("UST-20LX"), &asked, 0);
    bench.run(20 * S);
    assert_eq!(bench.asked, ["QT", "VV", "PP", "ME0180090002100"], "{:?}", bench.events);
    let first_beams_ns = bench.first_beams_ns.lock().unwrap().clone();
    assert!(bench.scans().len() > 380, "{}", bench.scans().len());
    let mut sum = 0.0;
    for ((_, scan), true_ns) in bench.scans().iter().zip(&first_beams_ns) {
        assert_eq!((scan.ranges_m.len(), scan.intensities.len()), (361, 361));
        assert!((scan.angle_min_rad + std::f32::consts::FRAC_PI_2).abs() < 1e-6, "{}", scan.angle_min_rad);
        assert!((f64::from(scan.angle_increment_rad).to_degrees() - 0.5).abs() < 1e-6);
        assert!((scan.time_increment_s - 2.0 * 0.025 / 1440.0).abs() < 1e-9);
        assert!((scan.range_min_m - 0.02).abs() < 1e-6 && (scan.range_max_m - 60.0).abs() < 1e-6);
        // Two steps are one beam: the nearer of both, and where one has no echo the other one.
        assert_eq!((scan.ranges_m[0], scan.ranges_m[10], scan.intensities[10]), (1.5, 1.52, 1800.0));
        let error_ms = (scan.stamp_ns - true_ns) as f64 / MS as f64;
        sum += error_ms * error_ms;
        assert!(error_ms.abs() < 2.0, "{error_ms} ms");
    }
    let rms_ms = (sum / bench.scans().len() as f64).sqrt();
    println!("stamps against the true times of the first beams: RMS {rms_ms:.2} ms");
    // The mock sends at a tick of the millisecond, and the step of this test is one.
    assert!(rms_ms < 1.0, "{rms_ms}");
}

#[test]
fn codes_are_no_ranges_and_an_old_laser_is_asked_for_nothing_that_hangs_it() {
    let link = ScipLink::Serial(115_200);
    let asked = ScipLaser { remission: Some(true), ..ScipLaser::default() };
    let mut bench = bench(ScipParams { link, ..named("URG-04LX") }, &asked, 115_200);
    bench.run(4 * S);
    assert!(bench.events.iter().any(|event| event.contains("no remission")), "{:?}", bench.events);
    assert!(bench.asked.iter().any(|asked| asked == "MD0044072501000"), "{:?}", bench.asked);
    let (_, scan) = bench.scans().last().unwrap();
    assert_eq!((scan.ranges_m.len(), scan.intensities.len()), (682, 0));
    assert_eq!((scan.ranges_m[7], scan.ranges_m[8]), (f32::INFINITY, 1.508));
    let first_deg = f64::from(scan.angle_min_rad).to_degrees();
    assert!((first_deg + 340.0 * 360.0 / 1024.0).abs() < 1e-4, "{first_deg}");
}

#[test]
fn a_scan_that_our_stop_or_start_cuts_is_no_damage() {
    let links = [
        ("UST-20LX", ScipLink::Network, 0),
        ("UTM-30LX", ScipLink::Usb, 0),
        ("URG-04LX", ScipLink::Serial(115_200), 115_200),
    ];
    let states = [ScipState::Idle, ScipState::Streaming];
    let mut cut = [0; 3];
    for (at, (name, link, baud)) in links.into_iter().enumerate() {
        for (state, phase_ms) in states.into_iter().flat_map(|state| (0..12).map(move |ms| (state, 2 * ms))) {
            let params = ScipParams { link, state, phase_ns: phase_ms * MS, ..named(name) };
            let mut bench = bench(params, &ScipLaser::default(), baud);
            bench.run(4 * S);
            assert!(bench.scans().len() > 5, "{name}: {:?}", bench.events);
            bench.engine.stop(bench.now_ns);
            let end_ns = bench.now_ns + S;
            bench.run(end_ns);
            assert!(bench.engine.is_stopped(), "{name}: {:?}", bench.events);
            let (report, _) = bench.engine.finish(end_ns);
            let arrival = report.arrival;
            let case = format!("{name} {state:?} {phase_ms} ms: {arrival:?}");
            assert_eq!((arrival.damaged, arrival.skipped_bytes), (0, 0), "{case}");
            cut[at] += arrival.cut_by_us;
        }
    }
    // A line of 115200 Bd is never without a scan; the faster ones are busy for a millisecond of 25.
    assert!(cut[2] > 12, "{cut:?}");
}
