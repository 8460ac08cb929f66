//! An inertial unit through engine and mock device in simulated time, with faults of its line and of its
//! power. The truth of a stamp travels in the sample: its turn rate about x is when it was taken.
//!
//! `cargo test -p biplane-onboard --test inertial -- --nocapture` prints the errors.

use biplane_matcher::TrackerParams;
use biplane_mock::devices::device::Device;
use biplane_mock::devices::inertial::feed::InertialFeed;
use biplane_mock::devices::inertial::outputs::Outputs;
use biplane_mock::devices::inertial::{XsensDevice, XsensParams};
use biplane_mock::faults::device::power_cycle::PowerCycle;
use biplane_mock::faults::episodes::Episode;
use biplane_mock::faults::{Faults, Preset};
use biplane_mock::line::Channel;
use biplane_mock::rig::inertial::InertialSample;
use biplane_onboard::{Command, Engine, EngineOptions, Feed, Health, RunReport, Sink};
use biplane_recording::messages::{Imu, Message};
use biplane_recording::rig::{Base, InertialUnit};
use biplane_recording::{Port, Rig, Topic};
use biplane_wire::Item;
use biplane_wire::xsens::{Deframer, Message as Xbus, Report, Sample};

const MS: i64 = 1_000_000;
const S: i64 = 1_000 * MS;
const END_NS: i64 = 30 * S;
/// From the end of a sample to its message the mock takes 1.5 ms, and the recorder reckons with 1 ms.
const LATENCY_ERROR_MS: f64 = 0.5;

/// Says when it was asked for: f32 has room for 30 s in steps of 2 microseconds.
struct Clock;

impl InertialFeed for Clock {
    fn sample(&mut self, middle_ns: i64, _period_ns: i64) -> Option<InertialSample> {
        let turn_rad_s = [middle_ns as f64 * 1e-9, 0.25, -0.5];
        Some(InertialSample { time_ns: middle_ns, turn_rad_s, force_m_s2: [0.0, 0.0, 9.75] })
    }
}

/// What of it is recorded.
#[derive(Default)]
struct Recorded {
    samples: Vec<Imu>,
}

impl Sink for Recorded {
    fn message(&mut self, topic: Topic, _log_time_ns: i64, publish_time_ns: i64, cdr: &[u8]) {
        if topic == Topic::Imu {
            let sample = Imu::decode(cdr).expect("a message");
            assert_eq!((sample.stamp_ns, sample.frame_id.as_str()), (publish_time_ns, "imu"));
            self.samples.push(sample);
        }
    }

    fn health(&mut self, _now_ns: i64, _health: &Health) {}

    fn dropped(&self) -> u64 {
        0
    }
}

/// What came of a run.
struct Outcome {
    report: RunReport,
    samples: Vec<Imu>,
    /// Whole measurements among the bytes that arrived.
    intact: u64,
    /// What was reported.
    reported: Vec<String>,
}

impl Outcome {
    /// Stamps less the truth, milliseconds, from this time on.
    fn errors_ms(&self, from_ns: i64) -> Vec<f64> {
        let of = |sample: &Imu| sample.stamp_ns as f64 * 1e-6 - sample.angular_rad_s[0] * 1e3;
        self.samples.iter().filter(|sample| sample.stamp_ns >= from_ns).map(of).collect()
    }

    /// The longest time without a sample, milliseconds.
    fn longest_gap_ms(&self) -> i64 {
        self.samples.windows(2).map(|pair| (pair[1].stamp_ns - pair[0].stamp_ns) / MS).max().unwrap_or(0)
    }
}

fn unit(rate_hz: u16) -> InertialUnit {
    InertialUnit { rate_hz, baud: 230_400, ..InertialUnit::xsens("imu") }
}

fn rig(rate_hz: u16) -> Rig {
    Rig { imu: Some(unit(rate_hz)), base: Base::none(), vertical: None, ..Rig::default() }
}

/// Whole outputs at 50 Hz, as an earlier client left them.
fn left_measuring() -> XsensParams {
    let words = [0x1020, 0xFFFF, 0x1060, 0xFFFF, 0x4020, 50, 0x8020, 50, 0xE020, 0xFFFF_u16];
    let bytes: Vec<u8> = words.into_iter().flat_map(u16::to_be_bytes).collect();
    // The clock comes round after ten seconds.
    let first_ticks = u32::MAX - 100_000;
    XsensParams { outputs: Outputs::parse(&bytes, 400), baud: 230_400, first_ticks, ..XsensParams::default() }
}

/// Runs unit and engine for half a minute; `silent` is a time in which no byte passes.
fn run(device: Box<dyn Device>, rate_hz: u16, (faults, silent): (&Faults, Option<Episode>)) -> Outcome {
    let options =
        EngineOptions { rig: rig(rate_hz), matcher: TrackerParams::default(), feed: Feed::Live, raw: false };
    let mut engine = Engine::new(&options, Recorded::default(), 0);
    let mut device = device;
    let mut lines: [Channel; 2] = [faults.channel(6), faults.channel(7)];
    let (mut deframer, mut intact, mut reported) = (Deframer::new(), 0, Vec::new());
    let mut now_ns = 0;
    while now_ns < END_NS {
        let is_silent = silent.is_some_and(|silent| (silent.from_ns..silent.to_ns).contains(&now_ns));
        let mut bytes = Vec::new();
        let device_ns = device.poll(now_ns, &mut bytes);
        lines[0].push(now_ns, if is_silent { &[] } else { &bytes });
        bytes.clear();
        lines[0].take(now_ns, &mut bytes);
        if bytes.is_empty() {
            engine.advance(now_ns);
        } else {
            deframer.feed(&bytes, |item| {
                intact += u64::from(matches!(item, Item::Frame { bytes, .. } if is_whole(bytes)));
            });
            engine.bytes(now_ns, Port::Imu, &bytes);
        }
        while let Some((port, command)) = engine.next_command() {
            if let (Port::Imu, Command::Write(bytes)) = (port, command) {
                lines[1].push(now_ns, if is_silent { &[] } else { &bytes });
            }
        }
        bytes.clear();
        lines[1].take(now_ns, &mut bytes);
        if !bytes.is_empty() {
            device.handle(now_ns, &bytes);
        }
        while let Some((port, event)) = engine.next_event() {
            if port == Port::Imu {
                reported.push(format!("{:.2} {event}", now_ns as f64 * 1e-9));
            }
        }
        let due_ns = lines.iter().filter_map(Channel::next_due_ns).chain([device_ns, engine.wake_ns()]).min();
        now_ns = due_ns.unwrap_or(END_NS).max(now_ns + 1000);
    }
    let (report, recorded) = engine.finish(END_NS);
    Outcome { report, samples: recorded.samples, intact, reported }
}

fn is_whole(frame: &[u8]) -> bool {
    let Ok(Report::Data(items)) = Xbus::parse(frame).and_then(|message| message.report()) else {
        return false;
    };
    Sample::of(&items).is_ok_and(|sample| sample.turn_rad_s.is_some() && sample.time_fine.is_some())
}

fn worst(errors_ms: &[f64]) -> f64 {
    errors_ms.iter().fold(0.0, |worst, error| f64::max(worst, (error - LATENCY_ERROR_MS).abs()))
}

#[test]
fn every_sample_is_recorded_at_its_time_at_every_rate_also_where_the_units_clock_comes_round() {
    for rate_hz in [25, 100, 400] {
        let device = Box::new(XsensDevice::new(left_measuring(), Box::new(Clock)));
        let outcome = run(device, rate_hz, (&Faults::default(), None));
        let recorded = outcome.report.recorded.inertial;
        assert_eq!(
            (recorded, outcome.samples.len() as u64),
            (outcome.intact, outcome.intact),
            "{rate_hz} Hz"
        );
        let expected = u64::from(rate_hz) * 30;
        assert!(recorded.abs_diff(expected) <= u64::from(rate_hz) / 2, "{rate_hz} Hz: {recorded}");
        assert_eq!((outcome.report.losses.lost, outcome.report.arrival.lost_samples), (0, 0));
        let worst_ms = worst(&outcome.errors_ms(S));
        println!("{rate_hz} Hz: {recorded} samples, stamps off by {worst_ms:.3} ms at most");
        assert!(worst_ms < 0.25, "{rate_hz} Hz: {worst_ms} ms");
        assert!(!outcome.reported.iter().any(|line| line.contains("switched on")), "{:?}", outcome.reported);
    }
}

#[test]
fn faults_of_the_line_lose_no_intact_sample_and_no_stamp() {
    for preset in [Preset::BitNoise, Preset::LooseConnector, Preset::UsbStall] {
        let (mut worst_ms, mut recorded, mut rejected) = (0.0_f64, 0, 0);
        for seed in 1..=6 {
            let device = Box::new(XsensDevice::new(left_measuring(), Box::new(Clock)));
            let outcome = run(device, 100, (&Faults::new(&[preset], seed), None));
            // One in 256 damaged messages passes the checksum: its numbers or its time may be wrong.
            let accepted = outcome.intact - outcome.report.arrival.rejected;
            assert!(outcome.report.recorded.inertial.abs_diff(accepted) <= 1, "{preset:?} {seed}");
            assert_eq!(outcome.report.losses.lost, 0, "{preset:?} {seed}");
            let mut errors_ms = outcome.errors_ms(S);
            errors_ms.sort_by(f64::total_cmp);
            let share = errors_ms.len() / 500;
            worst_ms = worst_ms.max(worst(&errors_ms[share..errors_ms.len() - share]));
            recorded += outcome.report.recorded.inertial;
            rejected += outcome.report.arrival.rejected;
        }
        println!("{preset:?}: {recorded} samples, {rejected} rejected, 99.6 % within {worst_ms:.3} ms");
        assert!(worst_ms < 0.5, "{preset:?}: {worst_ms} ms");
    }
}

#[test]
fn a_unit_that_loses_its_power_is_set_anew_and_one_that_is_not_heard_goes_on() {
    let dark = Episode { from_ns: 10 * S, to_ns: 12 * S };
    let device = Box::new(XsensDevice::new(left_measuring(), Box::new(Clock)));
    let outcome = run(Box::new(PowerCycle::given(device, &[dark])), 100, (&Faults::default(), None));
    // 0.6 s to start, and what setting it takes.
    let gap_ms = outcome.longest_gap_ms();
    assert!((2_500..3_500).contains(&gap_ms), "{gap_ms} ms, {:?}", outcome.reported);
    assert!(worst(&outcome.errors_ms(14 * S)) < 0.5, "{:?}", outcome.errors_ms(14 * S));
    assert!(outcome.reported.iter().any(|line| line.contains("silent")), "{:?}", outcome.reported);

    let device = Box::new(XsensDevice::new(left_measuring(), Box::new(Clock)));
    let outcome = run(device, 100, (&Faults::default(), Some(dark)));
    let gap_ms = outcome.longest_gap_ms();
    assert!((2_000..3_000).contains(&gap_ms), "{gap_ms} ms, {:?}", outcome.reported);
    assert!(worst(&outcome.errors_ms(14 * S)) < 0.5, "{:?}", outcome.errors_ms(14 * S));
}

#[test]
fn one_that_was_left_idle_and_one_with_other_outputs_are_set() {
    let factory = XsensParams { baud: 230_400, ..XsensParams::default() };
    for params in [XsensParams { left_idle: true, ..factory.clone() }, factory] {
        let device = Box::new(XsensDevice::new(params, Box::new(Clock)));
        let outcome = run(device, 100, (&Faults::default(), None));
        assert!(outcome.samples.len() > 2_900, "{}", outcome.samples.len());
        assert_eq!(outcome.report.losses.lost, 0);
        let last = outcome.samples.last().expect("there are some");
        assert_eq!(last.angular_rad_s[1..], [0.25, -0.5]);
        assert_eq!((last.acceleration_m_s2, last.orientation_covariance[0]), ([0.0, 0.0, 9.75], -1.0));
    }
}
