//! What each device of a simulated rig puts on its line during the capture.

use super::times::Times;
use super::{SimulateError, SimulateOptions};
use crate::capture::file::LineReads;
use crate::devices::base::base_encoder::{BaseEncoder, EncodedPacket};
use crate::devices::lms::scans::feed::{Mirror, Offer, STATUS_OK, source_scale};
use crate::devices::lms::scans::stream::Content;
use crate::devices::lms::scans::telegram::{Numbers, telegram};
use crate::devices::lms::scans::value_words::{Scale, recode};
use crate::devices::lms::settings;
use crate::devices::telegrams;
use crate::faults::Faults;
use crate::line::Channel;
use crate::line::{Adapter, SerialRead, laser_byte_ns, scans_per_telegram, transfer_ns};
use crate::rig::scanner::{NO_ECHO, TURN_NS, Variant};
use crate::rig::simulated::{LaserRole, SimulatedLaser, SimulatedRig, counts_mm, measuring_mode, variant_of};
use crate::rig::source::{OdometrySource, ScanWords};
use crate::rng::Rng;
use biplane_recording::Port;
use biplane_recording::rig::Laser;
use std::convert::identity;
use std::thread::Builder;

/// Time between two packets of the base.
const ODOMETRY_PERIOD_NS: i64 = 100_000_000;
/// Time between two questions to a base that has to be asked.
const ASKING_PERIOD_NS: i64 = 50_000_000;
/// From a question to its answer.
const THINKING_NS: i64 = 1_000_000;
/// Time between two replies of a start-up.
const REPLY_PERIOD_NS: i64 = 100_000_000;
/// A laser's part of the capture.
pub(crate) struct LaserRun {
    /// Its bytes, and what it was asked where its line knows.
    pub(crate) lines: Vec<LineReads>,
    /// First beams of the scans, device time.
    pub(crate) first_beams_ns: Vec<i64>,
    /// Values that are ranges.
    pub(crate) echoes: usize,
}

pub(crate) fn record_laser(
    source: &SimulatedLaser,
    laser: &Laser,
    times: &Times,
    options: &SimulateOptions,
) -> Result<LaserRun, SimulateError> {
    let expected = "a variant that the LMS has";
    let unsupported =
        || SimulateError::Unsupported { what: "fov_deg", found: laser.fov_deg.to_string(), expected };
    let variant = variant_of(laser).ok_or_else(unsupported)?;
    let (port, line) = place_of(source.role());
    let output = LaserOutput::new(laser, variant, times, options, line);
    let first_beams_ns = output.first_beams_ns(times);
    let measured = source_scale(output.scale);
    let mut scans = in_parallel(&first_beams_ns, |t0_ns| source.measure(*t0_ns, variant, measured.mm));
    let echoes = scans.iter().flatten().filter(|word| **word < NO_ECHO - 8).count();
    scans.iter_mut().flatten().for_each(|word| *word = recode(*word, measured, output.scale));
    let statuses = spoil(&mut scans, &first_beams_ns, output.scale, &options.faults, line);
    let byte_ns = transfer_ns(1, laser.baud);
    let mut adapter = Adapter::new(options.reads, options.seed, line);
    if options.start_up {
        send_replies(&mut adapter, &telegrams::laser_start_up(laser, variant)?, laser.baud);
    }
    for (number, (t0_ns, words)) in first_beams_ns.iter().zip(&scans).enumerate() {
        let start_ns = t0_ns + output.delay_ns;
        let telegram = output.telegram(number, *t0_ns, words, statuses[number]);
        for (index, byte) in telegram.into_iter().enumerate() {
            adapter.push(byte, start_ns + laser_byte_ns(index, laser.baud), byte_ns);
        }
    }
    let reads = through_faults(adapter.finish(), &options.faults, line);
    Ok(LaserRun { lines: vec![LineReads::received(port, reads)], first_beams_ns, echoes })
}

/// A laser's line, and its place in the rig.
pub(crate) fn place_of(role: LaserRole) -> (Port, u64) {
    match role {
        LaserRole::Horizontal => (Port::Horizontal, 0),
        LaserRole::Vertical => (Port::Vertical, 1),
    }
}

/// What a laser of the rig sends, and when.
struct LaserOutput {
    content: Content,
    scale: Scale,
    indices: bool,
    mirror: Mirror,
    scan_ns: i64,
    /// From one telegram's first beam to the next one's.
    period_ns: i64,
    /// From a scan's first beam to its telegram's first byte.
    delay_ns: i64,
    /// From a scan's first beam to its telegram's last byte.
    whole_ns: i64,
}

impl LaserOutput {
    fn new(laser: &Laser, variant: Variant, times: &Times, options: &SimulateOptions, line: u64) -> Self {
        let phase_ns = (Rng::new(options.seed, 0x9A5E, line.cast_signed()).unit() * TURN_NS as f64) as i64;
        let ppm = if line == 0 { options.lasers.mirror_ppm[0] } else { options.lasers.mirror_ppm[1] };
        let mirror = Mirror::of_ppm(times.stream_ns + phase_ns, ppm);
        let device_variant = settings::Variant::of(variant.fov_deg(), variant.resolution_cdeg());
        let scan_ns = device_variant.turns() * mirror.turn_ns;
        let mut output = Self {
            content: Content::whole(laser.remission, device_variant),
            // Without the start-up nobody tells the mode, and 00 is what is taken for granted.
            scale: Scale {
                mode: if options.start_up { measuring_mode(laser) } else { 0 },
                mm: counts_mm(laser),
            },
            indices: laser.index_bytes == Some(true),
            mirror,
            scan_ns,
            period_ns: 0,
            delay_ns: scan_ns + (laser.delay_ms * 1e6).round() as i64,
            whole_ns: 0,
        };
        let blank = std::iter::repeat_n(0, usize::from(variant.beam_count())).collect();
        let bytes = output.telegram(0, 0, &blank, STATUS_OK).len();
        output.period_ns = scans_per_telegram(bytes, laser.baud, scan_ns) * scan_ns;
        output.whole_ns = output.delay_ns + laser_byte_ns(bytes - 1, laser.baud);
        output
    }

    /// First beams of the scans that are sent.
    fn first_beams_ns(&self, times: &Times) -> Vec<i64> {
        let first_beams_ns = (0..).map(|n| self.mirror.phase_ns + n * self.period_ns);
        first_beams_ns.take_while(|t0_ns| t0_ns + self.whole_ns <= times.end_ns).collect()
    }

    fn telegram(&self, number: usize, t0_ns: i64, words: &ScanWords, status: u8) -> Vec<u8> {
        let start_ns = t0_ns + self.scan_ns;
        let turn = self.mirror.turn_before(start_ns).rem_euclid(256);
        let indices = (u8::try_from(turn).unwrap_or(0), (number % 256) as u8);
        let numbers = Numbers {
            address: 0,
            scale: self.scale,
            indices: self.indices.then_some(indices),
            quarter: 0,
            status,
        };
        let offer = Offer { start_ns, words: words.clone(), status, skipped: 0 };
        telegram(self.content, &offer, &numbers)
    }
}

/// Takes all scans, on all processors; the result does not depend on how many there are.
pub(crate) fn in_parallel<A: Sync, T: Send>(asked: &[A], take: impl Fn(&A) -> T + Sync) -> Vec<T> {
    let workers = std::thread::available_parallelism().map_or(1, usize::from);
    let share = asked.len().div_ceil(workers).max(1);
    let take = &|part: &[A]| part.iter().map(&take).collect::<Vec<_>>();
    std::thread::scope(|scope| {
        let parts: Vec<_> = asked
            .chunks(share)
            // A thread that the system refuses is none that is needed.
            .map(|part| Builder::new().spawn_scoped(scope, move || take(part)).map_err(|_refused| take(part)))
            .collect();
        let taken =
            parts.into_iter().map(|part| part.map_or_else(identity, |part| part.join().unwrap_or_default()));
        taken.flatten().collect()
    })
}

fn send_replies(adapter: &mut Adapter, replies: &[Vec<u8>], baud: u32) {
    let byte_ns = transfer_ns(1, baud);
    let mut free_ns = 0;
    for (n, reply) in replies.iter().enumerate() {
        let start_ns = (n as i64 * REPLY_PERIOD_NS).max(free_ns);
        for (index, byte) in reply.iter().enumerate() {
            free_ns = start_ns + transfer_ns(index + 1, baud);
            adapter.push(*byte, free_ns, byte_ns);
        }
    }
}

/// A base's part of the capture.
pub(crate) struct BaseRun {
    /// Its bytes, and what it was asked where it has to be.
    pub(crate) lines: Vec<LineReads>,
    /// Odometry reports.
    pub(crate) reports: usize,
}

/// A base on its line, with the host that asks it where it has to be asked.
struct BaseLine {
    encoder: BaseEncoder,
    adapter: Adapter,
    asked: Vec<SerialRead>,
    baud: u32,
}

impl BaseLine {
    /// The first byte of what the base says leaves at `start_ns`; the question has arrived a moment before.
    fn say(&mut self, packet: EncodedPacket, start_ns: i64) {
        if !packet.asked.is_empty() {
            let time_ns = start_ns - THINKING_NS - transfer_ns(packet.asked.len(), self.baud);
            self.asked.push(SerialRead { time_ns, bytes: packet.asked });
        }
        let byte_ns = transfer_ns(1, self.baud);
        for (index, byte) in packet.answer.into_iter().enumerate() {
            self.adapter.push(byte, start_ns + transfer_ns(index + 1, self.baud), byte_ns);
        }
    }
}

pub(crate) fn record_base(
    rig: &SimulatedRig,
    times: &Times,
    options: &SimulateOptions,
) -> Result<BaseRun, SimulateError> {
    let base = &rig.rig().base;
    let adapter = Adapter::new(options.reads, options.seed, 2);
    let encoder = BaseEncoder::new(base.protocol);
    let exchange_ns = transfer_ns(encoder.exchange_bytes(), base.baud);
    let mut line = BaseLine { encoder, adapter, asked: Vec::new(), baud: base.baud };
    if options.start_up {
        for (packet, n) in line.encoder.start_up()?.into_iter().zip(0..) {
            line.say(packet, (n + 1) * REPLY_PERIOD_NS);
        }
    }
    let mut source = rig.base();
    let phase_ns = (Rng::new(options.seed, 0x9A5E, 2).unit() * ODOMETRY_PERIOD_NS as f64) as i64;
    let mut sample_ns = times.stream_ns + phase_ns;
    let mut reports = 0;
    loop {
        let packet = line.encoder.odometry(&source.sample(sample_ns), sample_ns)?;
        let end_ns = sample_ns + transfer_ns(packet.answer.len(), base.baud);
        if end_ns > times.end_ns {
            break;
        }
        let was_asked = !packet.asked.is_empty();
        line.say(packet, sample_ns);
        reports += 1;
        let period_ns = if was_asked { ASKING_PERIOD_NS.max(2 * exchange_ns) } else { ODOMETRY_PERIOD_NS };
        sample_ns += period_ns.max(end_ns - sample_ns);
    }
    let reads = through_faults(line.adapter.finish(), &options.faults, 2);
    let mut lines = vec![LineReads::received(Port::Base, reads)];
    if !line.asked.is_empty() {
        lines.insert(0, LineReads::sent(Port::Base, line.asked));
    }
    Ok(BaseRun { lines, reports })
}

/// What the faults of the measurement make of the scans; the status byte of each.
fn spoil(
    scans: &mut [ScanWords],
    first_beams_ns: &[i64],
    scale: Scale,
    faults: &Faults,
    place: u64,
) -> Vec<u8> {
    let mut faults = faults.measurement(place);
    let spoiled = scans.iter_mut().zip(first_beams_ns).map(|(words, t0_ns)| {
        faults.iter_mut().fold(STATUS_OK, |status, fault| status | fault.touch(*t0_ns, scale, words))
    });
    spoiled.collect()
}

/// What the faults of a line make of its reads.
pub(crate) fn through_faults(reads: Vec<SerialRead>, faults: &Faults, place: u64) -> Vec<SerialRead> {
    let mut channel = faults.channel(2 * place);
    if channel.is_faultless() {
        return reads;
    }
    let mut arrived = Vec::with_capacity(reads.len());
    let mut take = |channel: &mut Channel, until_ns: i64| {
        while let Some(time_ns) = channel.next_due_ns().filter(|due_ns| *due_ns <= until_ns) {
            let mut bytes = Vec::new();
            channel.take(time_ns, &mut bytes);
            if !bytes.is_empty() {
                arrived.push(SerialRead { time_ns, bytes });
            }
        }
    };
    for read in reads {
        take(&mut channel, read.time_ns);
        channel.push(read.time_ns, &read.bytes);
    }
    take(&mut channel, i64::MAX);
    arrived
}
