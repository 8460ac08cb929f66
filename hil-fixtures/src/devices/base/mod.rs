//! A mock Pioneer base (P2OS) without any input or output: SYNC, OPEN, odometry each 100 ms, watchdog, CLOSE.
//!
//! Sources: Pioneer 3 manual; transcripts of AriaCoda and Player. It stands what they do: a modem string
//! first, OPEN with and without an argument, an argument type without an argument, several commands in one
//! write. Times are nanoseconds, positions in ticks.
//!
//! It drives where its world drives it: speed commands are taken and not obeyed.

pub mod base_encoder;
pub mod counters;
pub mod feed;
pub mod packet;
pub mod report;
pub mod rflex;
pub mod roboclaw;
#[cfg(test)]
mod tests;

use crate::devices::device::{Device, DeviceCounts};
use crate::devices::pacing::{Kind, Line};
use feed::{Sip, SipAnswer, SipFeed};
use packet::{Command, PacketParser, packet};
use report::{Identity, Odometer, config_body, encoder_body, identity_body, sip_body};

const MS: i64 = 1_000_000;

/// How often a base that has nothing to do wants to be asked.
const IDLE_NS: i64 = 1_000 * MS;

/// A strict base drops what comes so soon after a SYNC out of turn.
const DROPS_NS: i64 = 50 * MS;

/// How a mock base is made.
#[derive(Clone, Debug)]
pub struct BaseParams {
    /// How it introduces itself.
    pub identity: Identity,
    /// Rate at the start, in Bd.
    pub baud: u32,
    /// Whether an earlier client left it open.
    pub left_open: bool,
    /// The speed that this client had commanded when it fell silent, millimeters a second; other than 0, its
    /// motors are on.
    pub left_mm_s: i32,
    /// Whether any packet before SYNC0 is taken for a SYNC out of turn, as AMRISim does: then it starts
    /// afresh, and what follows at once is lost.
    pub strict: bool,
    /// From a command to its answer.
    pub reply_ns: i64,
    /// Silence of the host after which the base stops. Larger forgives slower clients.
    pub watchdog_ns: i64,
    /// From power-on until it hears anything.
    pub boot_ns: i64,
}

impl Default for BaseParams {
    fn default() -> Self {
        Self {
            identity: Identity::default(),
            baud: 9600,
            left_open: false,
            left_mm_s: 0,
            strict: false,
            reply_ns: 2 * MS,
            watchdog_ns: 2_000 * MS,
            boot_ns: 1_000 * MS,
        }
    }
}

/// How far a client has come.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Stage {
    /// This SYNC is expected next.
    Sync(u8),
    /// All three came; OPEN is expected.
    Synchronized,
    /// Packets flow.
    Open,
}

/// Whether encoder packets follow the standard ones (ENCODER 0, 1, 2).
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Encoders {
    Off,
    Once,
    Stream,
}

/// A mock base.
pub struct BaseDevice {
    params: BaseParams,
    feed: Box<dyn SipFeed>,
    parser: PacketParser,
    line: Line,
    stage: Stage,
    baud: u32,
    switch_baud: Option<u32>,
    odometer: Odometer,
    motors_enabled: bool,
    /// Speed that was commanded last, millimeters a second: obeyed while the watchdog is content and the
    /// motors are on.
    setpoint_mm_s: i32,
    encoders: Encoders,
    /// Last packet of the host; `None` once the watchdog has run out: then the base stands until it hears any
    /// command.
    host_received_ns: Option<i64>,
    ask_ns: i64,
    /// What comes before is dropped: it starts, or has heard a SYNC out of turn.
    drops_until_ns: i64,
    counts: DeviceCounts,
}

impl BaseDevice {
    /// A base whose packets come from `feed`.
    #[must_use]
    pub fn new(params: BaseParams, feed: Box<dyn SipFeed>) -> Self {
        Self {
            stage: if params.left_open { Stage::Open } else { Stage::Sync(0) },
            baud: params.baud,
            motors_enabled: params.left_open && params.left_mm_s != 0,
            setpoint_mm_s: params.left_mm_s,
            params,
            feed,
            parser: PacketParser::default(),
            line: Line::default(),
            switch_baud: None,
            odometer: Odometer::default(),
            encoders: Encoders::Off,
            host_received_ns: None,
            ask_ns: i64::MIN,
            drops_until_ns: i64::MIN,
            counts: DeviceCounts::default(),
        }
    }

    /// The speed that it would drive at, millimeters a second: a base that its watchdog has stopped resumes
    /// its last speed at any command.
    #[must_use]
    pub fn driven_mm_s(&self) -> i32 {
        let drives = self.stage == Stage::Open && self.motors_enabled && self.host_received_ns.is_some();
        if drives { self.setpoint_mm_s } else { 0 }
    }

    fn obey(&mut self, now_ns: i64, command: Command) {
        if self.is_out_of_turn(command) {
            self.drops_until_ns = now_ns + DROPS_NS;
            self.counts.refused += 1;
            return self.close();
        }
        self.counts.requests += 1;
        self.host_received_ns = Some(now_ns);
        match (self.stage, command.number, command.argument) {
            (Stage::Open, number, argument) => self.obey_open(now_ns, number, argument),
            (_, 2, Some(_)) => self.close(),
            (Stage::Synchronized, 1, _) => {
                self.stage = Stage::Open;
                self.ask_ns = now_ns;
            }
            (_, 0, _) => self.synchronize(now_ns, 0),
            (Stage::Sync(expected), number, None) if number == expected => self.synchronize(now_ns, number),
            _ => {}
        }
    }

    /// Whether a strict base takes this for a SYNC with a wrong number.
    fn is_out_of_turn(&self, command: Command) -> bool {
        match self.stage {
            Stage::Sync(expected) => self.params.strict && command.number != expected,
            Stage::Synchronized | Stage::Open => false,
        }
    }

    fn synchronize(&mut self, now_ns: i64, number: u8) {
        let body = if number == 2 { identity_body(&self.params.identity) } else { vec![number] };
        self.stage = if number == 2 { Stage::Synchronized } else { Stage::Sync(number + 1) };
        self.reply(now_ns, &body);
    }

    fn obey_open(&mut self, now_ns: i64, number: u8, argument: Option<i32>) {
        match number {
            2 => self.close(),
            4 => self.motors_enabled = argument == Some(1),
            7 => self.odometer.set_zero(),
            11 => self.setpoint_mm_s = argument.unwrap_or(0),
            19 => {
                self.encoders = match argument {
                    Some(1) => Encoders::Once,
                    Some(2..) => Encoders::Stream,
                    _ => Encoders::Off,
                }
            }
            18 => self.reply(now_ns, &config_body(&self.params.identity)),
            29 => self.setpoint_mm_s = 0,
            50 => {
                let rates = [9600, 19_200, 38_400, 57_600, 115_200];
                self.switch_baud =
                    argument.and_then(|index| rates.get(usize::try_from(index).ok()?)).copied();
            }
            _ => {}
        }
    }

    fn close(&mut self) {
        self.stage = Stage::Sync(0);
        self.encoders = Encoders::Off;
        self.motors_enabled = false;
        self.setpoint_mm_s = 0;
    }

    fn reply(&mut self, now_ns: i64, body: &[u8]) {
        self.line.send(now_ns + self.params.reply_ns, self.baud, Kind::Reply, packet(body), None);
    }

    fn watch(&mut self, now_ns: i64) {
        let silent =
            self.host_received_ns.is_some_and(|received_ns| now_ns - received_ns > self.params.watchdog_ns);
        if self.stage == Stage::Open && silent {
            self.counts.watchdog += 1;
            self.host_received_ns = None;
        }
    }

    /// Puts the next packet on the line when it is due and the line is free; returns whether it did.
    fn offer_sip(&mut self, now_ns: i64) -> bool {
        if self.stage != Stage::Open || !self.line.is_idle() || now_ns < self.ask_ns {
            return false;
        }
        let sip = match self.feed.next(now_ns) {
            SipAnswer::Now(sip) => sip,
            SipAnswer::Later(at_ns) => {
                self.ask_ns = at_ns.max(now_ns + 1);
                return false;
            }
            SipAnswer::Ended => {
                self.ask_ns = now_ns + 20 * MS;
                return false;
            }
        };
        let (body, sample) = match sip {
            Sip::Recorded(body) => (body, None),
            Sip::Odometry(sample) => {
                self.odometer.follow(sample);
                (sip_body(self.odometer.reported(), &sample, self.motors_enabled), Some(sample))
            }
        };
        self.line.send(now_ns, self.baud, Kind::Stream, packet(&body), None);
        if let Some(sample) = sample.filter(|_| self.encoders != Encoders::Off) {
            self.line.send(now_ns, self.baud, Kind::Reply, packet(&encoder_body(&sample)), None);
            if self.encoders == Encoders::Once {
                self.encoders = Encoders::Off;
            }
        }
        true
    }
}

impl Device for BaseDevice {
    fn handle(&mut self, now_ns: i64, bytes: &[u8]) {
        self.counts.bytes_received += bytes.len() as u64;
        for &byte in bytes {
            if now_ns < self.drops_until_ns {
                return;
            }
            if let Some(command) = self.parser.hear(byte) {
                self.obey(now_ns, command);
            }
        }
    }

    fn handle_noise(&mut self, _now_ns: i64, count: usize) {
        self.counts.receive_noise(count);
        self.parser.forget();
    }

    fn poll(&mut self, now_ns: i64, out: &mut Vec<u8>) -> i64 {
        let before = out.len();
        self.watch(now_ns);
        loop {
            if self.line.is_idle() && out.is_empty() {
                self.baud = self.switch_baud.take().unwrap_or(self.baud);
            }
            match self.line.take(now_ns, out) {
                Some(kind) => self.counts.telegrams += u64::from(kind == Kind::Stream),
                None if self.offer_sip(now_ns) => {}
                None => break,
            }
        }
        self.counts.bytes_sent += (out.len() - before) as u64;
        let asks = self.stage == Stage::Open && self.line.is_idle();
        let due_ns = self.line.next_due_ns().or(asks.then_some(self.ask_ns)).unwrap_or(i64::MAX);
        due_ns.clamp(now_ns, now_ns + IDLE_NS)
    }

    /// Rate and name are in its flash memory; the session is not, and it counts its way from where it stands.
    fn power_on(&mut self, now_ns: i64) {
        self.close();
        self.line.clear(now_ns);
        self.parser.forget();
        self.baud = self.params.baud;
        self.switch_baud = None;
        self.host_received_ns = None;
        self.odometer = Odometer::zero_at_first();
        if let Some(sample) = self.feed.place(now_ns) {
            self.odometer.follow(sample);
        }
        self.drops_until_ns = now_ns + self.params.boot_ns;
    }

    fn baud(&self) -> u32 {
        self.baud
    }

    fn is_streaming(&self) -> bool {
        self.stage == Stage::Open
    }

    fn counts(&self) -> DeviceCounts {
        let noise_bytes = self.counts.noise_bytes + self.parser.dropped_bytes;
        DeviceCounts { noise_bytes, bad_checksums: self.parser.bad_checksums, ..self.counts }
    }
}
