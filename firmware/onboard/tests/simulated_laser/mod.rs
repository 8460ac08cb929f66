//! A laser on a serial line behind an adapter, reduced to what stamps depend on: which bytes arrive when.

use biplane_matcher::TrackerParams;
use biplane_mock::devices::telegrams;
use biplane_mock::faults::{Faults, Preset};
use biplane_mock::line::{Adapter, ReadParams, SerialRead, laser_byte_ns, scans_per_telegram, transfer_ns};
use biplane_mock::rig::source::OdometrySample;
use biplane_mock::rng::Rng;
use biplane_onboard::{Engine, EngineOptions, Feed, Health, Sink};
use biplane_recording::{Port, Rig, Topic};
use biplane_wire::lms::{REPLY_ADDRESS, Scan, Status, Unit};

/// Nominal mirror turn, nanoseconds.
const TURN_NS: i64 = 13_320_000;
/// What a laser answers when its stream is stopped or started: acknowledgement and mode reply (SICK telegram
/// listing).
const MODE_REPLY: [u8; 10] = [0x06, 0x02, 0x80, 0x03, 0x00, 0xA0, 0x00, 0x10, 0x16, 0x0A];
/// Of [`Usb::Ticks`].
const TICK_NS: i64 = 16_000_000;

/// How bytes come from the line to the computer.
#[derive(Copy, Clone, PartialEq, Eq, Debug)]
pub(crate) enum Usb {
    /// Up to 32 bytes a read, late by 0.3 ms on average (exponential), by up to 8 ms more in 0.4 % of reads.
    Chance,
    /// When 62 bytes are there or 16 ms are over (the mock's latency timer of an FTDI adapter), then late as
    /// `Chance`.
    Timer,
    /// As `Chance`, and only at multiples of 16 ms.
    Ticks,
    /// As `Chance`, but a whole telegram in each read.
    Whole,
    /// The mock's preset `usb-stall`: as `Chance`, and every few seconds nothing for up to 300 ms.
    Stall,
}

/// How the device's clocks differ from ours.
#[derive(Copy, Clone, Debug)]
pub(crate) struct Mirror {
    /// A turn takes so many millionths longer.
    pub ppm: f64,
    /// And this much more or less in the course of ten minutes.
    pub wander_ppm: f64,
    /// Share by which the line is faster than nominal.
    pub line_fast: f64,
}

impl Mirror {
    /// As nominal.
    pub(crate) const TRUE: Self = Self { ppm: 0.0, wander_ppm: 0.0, line_fast: 0.0 };
}

/// What happens to the stream.
#[derive(Copy, Clone, Debug)]
pub(crate) struct Events {
    /// Share of telegrams after which the laser leaves out 1 to 12 scans more.
    pub skip_share: f64,
    /// Share of telegrams that arrive damaged.
    pub damage_share: f64,
    /// The stream is stopped so often, for up to a second; 0: never.
    pub stop_every_s: f64,
    /// The adapter holds back everything for 100 to 300 ms within the first second.
    pub early_stall: bool,
}

impl Events {
    /// Nothing.
    pub(crate) const NONE: Self =
        Self { skip_share: 0.0, damage_share: 0.0, stop_every_s: 0.0, early_stall: false };
}

/// A laser and its line.
#[derive(Copy, Clone, Debug)]
pub(crate) struct Laser {
    pub fov_deg: u16,
    pub resolution_cdeg: u16,
    /// Mirror turns of a scan.
    pub turns: i64,
    pub baud: u32,
    pub mirror: Mirror,
    pub events: Events,
    pub with_index: bool,
}

/// Bytes that leave one after another from a time on.
struct Sent {
    start_ns: i64,
    bytes: Vec<u8>,
    /// The truth that its stamp has to meet, for one that arrives intact: when the first beam was taken, or
    /// the odometry.
    first_beam_ns: Option<i64>,
}

impl Laser {
    fn duration_s(&self) -> f64 {
        if self.baud > 100_000 { 20.0 } else { 60.0 }
    }

    /// When the mirror has made so many turns.
    fn turn_ns(&self, turn: i64, phase: f64) -> i64 {
        let nominal_s = (turn * TURN_NS) as f64 * 1e-9;
        let (period_s, circle) = (600.0, std::f64::consts::TAU);
        let swing = |s: f64| (circle * (s / period_s + phase)).sin();
        let wander_s = self.mirror.wander_ppm * 1e-6 * period_s / circle * (swing(nominal_s) - swing(0.0));
        100_000_000_000
            + ((nominal_s * (1.0 + self.mirror.ppm * 1e-6) + wander_s + 0.05 * phase) * 1e9) as i64
    }

    fn telegram(&self, turn: i64, telegram: u8) -> Vec<u8> {
        let beams = usize::from(self.fov_deg) * 100 / usize::from(self.resolution_cdeg) + 1;
        let mut scan = Scan { unit: Unit::Cm, status: Status(0x10), ..Scan::default() };
        let _ = scan.values.resize(beams, 300);
        scan.index = self.with_index.then_some((turn.rem_euclid(256) as u8, telegram));
        let mut bytes = vec![0; 1024];
        let length = scan.emit(REPLY_ADDRESS, &mut bytes).expect("fits");
        bytes.truncate(length);
        bytes
    }

    /// All that it puts on the line.
    fn sends(&self, seed: u64) -> Vec<Sent> {
        let mut rng = Rng::new(seed, 0x57A3, 0);
        let (phase, events) = (rng.unit(), self.events);
        let (mut turn, mut sent, mut next_stop_s) = (self.turns, Vec::new(), events.stop_every_s);
        for number in 0_u64.. {
            let mut bytes = self.telegram(turn, number as u8);
            let scans = scans_per_telegram(bytes.len(), self.baud, self.turns * TURN_NS);
            let is_damaged = rng.unit() < events.damage_share;
            if is_damaged {
                let at = 8 + (rng.unit() * (bytes.len() - 12) as f64) as usize;
                bytes[at] ^= 0x20;
            }
            let first_beam_ns = (!is_damaged).then(|| self.turn_ns(turn - self.turns, phase));
            sent.push(Sent { start_ns: self.turn_ns(turn, phase), bytes, first_beam_ns });
            turn += scans * self.turns;
            if rng.unit() < events.skip_share {
                turn += self.turns * (1 + (rng.unit() * 12.0) as i64);
            }
            let now_s = (turn * TURN_NS) as f64 * 1e-9;
            if events.stop_every_s > 0.0 && now_s > next_stop_s {
                let start_ns = self.turn_ns(turn, phase);
                sent.push(Sent { start_ns, bytes: MODE_REPLY.to_vec(), first_beam_ns: None });
                turn += 4 + (rng.unit() * 75.0) as i64;
                next_stop_s += events.stop_every_s;
            }
            if now_s > self.duration_s() {
                break;
            }
        }
        sent
    }
}

/// Calls `byte` with each byte and when it has arrived, until the end.
fn each_byte(sent: &[Sent], laser: &Laser, mut byte: impl FnMut(i64, u8)) {
    for Sent { start_ns, bytes, .. } in sent {
        for (index, &value) in bytes.iter().enumerate() {
            let line_ns = laser_byte_ns(index, laser.baud) as f64 / (1.0 + laser.mirror.line_fast);
            byte(start_ns + line_ns as i64, value);
        }
    }
}

fn reads(sent: &[Sent], laser: &Laser, usb: Usb, seed: u64) -> Vec<SerialRead> {
    let mut reads = match usb {
        Usb::Stall => stalled_reads(sent, laser, seed),
        Usb::Chance | Usb::Ticks | Usb::Timer | Usb::Whole => {
            let timer_ms = if usb == Usb::Timer { 16.0 } else { 0.0 };
            let max_bytes = if usb == Usb::Whole { 1_000_000 } else { 32 };
            let params = ReadParams { hiccup_share: 0.004, timer_ms, max_bytes, ..ReadParams::default() };
            let byte_ns = transfer_ns(1, laser.baud);
            let mut adapter = Adapter::new(params, seed, 1);
            each_byte(sent, laser, |time_ns, byte| adapter.push(byte, time_ns, byte_ns));
            adapter.finish()
        }
    };
    if usb == Usb::Ticks {
        for read in &mut reads {
            read.time_ns = (read.time_ns + TICK_NS - 1) / TICK_NS * TICK_NS;
        }
    }
    if laser.events.early_stall {
        hold_back(&mut reads, sent[0].start_ns, seed);
    }
    reads
}

fn stalled_reads(sent: &[Sent], laser: &Laser, seed: u64) -> Vec<SerialRead> {
    let mut channel = Faults::new(&[Preset::UsbStall], seed).channel(1);
    let mut reads = Vec::new();
    let mut arrive = |channel: &mut biplane_mock::line::Channel, until_ns: i64| {
        while let Some(due_ns) = channel.next_due_ns().filter(|due_ns| *due_ns <= until_ns) {
            let mut bytes = Vec::new();
            channel.take(due_ns, &mut bytes);
            if !bytes.is_empty() {
                reads.push(SerialRead { time_ns: due_ns, bytes });
            }
        }
    };
    let mut portion = Vec::new();
    let mut last_ns = sent[0].start_ns;
    each_byte(sent, laser, |time_ns, byte| {
        if portion.len() >= 16 || (time_ns - last_ns > 5_000_000 && !portion.is_empty()) {
            arrive(&mut channel, last_ns);
            channel.push(last_ns, &std::mem::take(&mut portion));
        }
        portion.push(byte);
        last_ns = time_ns;
    });
    channel.push(last_ns, &portion);
    arrive(&mut channel, i64::MAX);
    reads
}

/// All of a time within the first second comes at its end.
fn hold_back(reads: &mut [SerialRead], start_ns: i64, seed: u64) {
    let mut rng = Rng::new(seed, 0x57A11, 0);
    let begin_ns = start_ns + (rng.between(0.01, 0.9) * 1e9) as i64;
    let end_ns = begin_ns + (rng.between(0.1, 0.3) * 1e9) as i64;
    for read in reads.iter_mut().filter(|read| (begin_ns..end_ns).contains(&read.time_ns)) {
        read.time_ns = end_ns;
    }
}

/// Keeps the stamps of vertical scans (these are not matched, which would take longer than all else) and of
/// odometry.
#[derive(Default)]
struct Stamps(Vec<i64>);

impl Sink for Stamps {
    fn message(&mut self, topic: Topic, _: i64, stamp_ns: i64, _: &[u8]) {
        if matches!(topic, Topic::ScanVertical | Topic::Odom) {
            self.0.push(stamp_ns);
        }
    }

    fn health(&mut self, _: i64, _: &Health) {}

    fn dropped(&self) -> u64 {
        0
    }
}

/// The error of each scan's stamp, milliseconds. Every intact telegram must have become a scan.
pub(crate) fn errors_ms(laser: &Laser, usb: Usb, seed: u64) -> Vec<f64> {
    let mut rig = Rig::default();
    let vertical = rig.vertical.as_mut().expect("the default rig has one");
    (vertical.baud, vertical.fov_deg) = (laser.baud, laser.fov_deg);
    vertical.resolution_deg = f64::from(laser.resolution_cdeg) / 100.0;
    let sent = laser.sends(seed);
    let reads = reads(&sent, laser, usb, seed);
    stamp_errors_ms(rig, Port::Vertical, &sent, &reads)
}

/// The error of each odometry stamp of a Pioneer, milliseconds: a packet every 100 ms, later by chance by up
/// to `jitter_ms`.
pub(crate) fn base_errors_ms(baud: u32, usb: Usb, ppm: f64, jitter_ms: f64, seed: u64) -> Vec<f64> {
    let mut rig = Rig::default();
    rig.base.baud = baud;
    let mut rng = Rng::new(seed, 0xBA5E, 0);
    let packet = |number: i64| {
        let late_ms = rng.between(0.0, jitter_ms + 1e-9);
        let time_s = 100.0 + number as f64 * 0.1 * (1.0 + ppm * 1e-6) + late_ms * 1e-3;
        let start_ns = (time_s * 1e9) as i64;
        let sample = OdometrySample { x_raw: (number % 1000) as u16, ..OdometrySample::default() };
        let bytes = telegrams::odometry(&sample).expect("a packet");
        Sent { start_ns, bytes, first_beam_ns: Some(start_ns) }
    };
    let sent: Vec<Sent> = (0..600).map(packet).collect();
    let line = Laser { baud, ..LINE };
    stamp_errors_ms(rig, Port::Base, &sent, &reads(&sent, &line, usb, seed))
}

/// Any line; only its rate matters.
const LINE: Laser = Laser {
    fov_deg: 180,
    resolution_cdeg: 100,
    turns: 1,
    baud: 9600,
    mirror: Mirror::TRUE,
    events: Events::NONE,
    with_index: false,
};

fn stamp_errors_ms(rig: Rig, port: Port, sent: &[Sent], reads: &[SerialRead]) -> Vec<f64> {
    let options = EngineOptions { rig, matcher: TrackerParams::default(), feed: Feed::Recorded, raw: false };
    let mut engine = Engine::new(&options, Stamps::default(), reads[0].time_ns);
    for read in reads {
        engine.bytes(read.time_ns, port, &read.bytes);
        while engine.next_command().is_some() {}
        while engine.next_event().is_some() {}
    }
    let end_ns = reads.last().map_or(0, |read| read.time_ns);
    let (_, Stamps(stamps_ns)) = engine.finish(end_ns);
    let truth: Vec<i64> = sent.iter().filter_map(|sent| sent.first_beam_ns).collect();
    assert_eq!(stamps_ns.len(), truth.len(), "{port:?}");
    stamps_ns.iter().zip(&truth).map(|(stamp_ns, true_ns)| (stamp_ns - true_ns) as f64 * 1e-6).collect()
}
