//! Faults of all kinds at random for as long as is asked: of bytes, devices, plugs, the host and its disk, on
//! all lines of one run.
//!
//! Live in simulated time, with the host's threads and buffers as `rig/host.rs` has them, into a recording in
//! parts on the real disk; each part is read back, held against what was written, and deleted. Every two
//! minutes, in a quiet moment, what arrived intact is held against what was recorded, and what was kept of it
//! is forgotten, so that memory stays flat here too. `BIPLANE_FAULT_SOAK_S=86400` runs a day, in a process of
//! its own; otherwise it is four minutes.

use std::collections::BTreeMap;
use std::path::{Path, PathBuf};

use biplane_mock::devices::base::BaseParams;
use biplane_mock::devices::inertial::XsensParams;
use biplane_mock::devices::lms::LmsParams;
use biplane_mock::faults::{Faults, Preset};
use biplane_mock::rng::Rng;
use biplane_onboard::test_support::diagnostics_message;
use biplane_onboard::{Event, Health, Sink};
use biplane_recording::messages::Message;
use biplane_recording::{PartsWriter, Port, Reader, Rotation, Topic, WriterOptions};

use crate::accuracy::recorded::folder;
use crate::faults::fault::Fault;
use crate::rig::devices::foreign::ForeignDevice;
use crate::rig::devices::{idle_lines, rig_at, with_inertial_unit};
use crate::rig::disk::SlowDisk;
use crate::rig::host::{Host, Stalls, THREADS};
use crate::rig::line::byte_faults::Harm;
use crate::rig::plan::Plan;
use crate::rig::verdict::inertial::{inertial_account, sent_samples};
use crate::rig::verdict::truth::{
    Account, LONGEST_PROMISE_NS, Telegram, laser_account, pioneer_account, sent_scans,
};
use crate::rig::verdict::witness::Witness;
use crate::rig::{MS, PORTS, ReportedEvent, S, SimRig, place};
use crate::soak::own_process;
use crate::soak::own_process::{memory_bytes, quarters};

/// Two and a half scans a second of each laser, so that a day takes minutes.
const BAUD: u32 = 9600;
/// The inertial unit's line, and its measurements a second: the least that it makes.
const UNIT: (u32, u16) = (38_400, 25);
/// The disk's thread looks so often.
const LOOK_NS: i64 = 50 * MS;
/// From one quiet moment to the next; the last 25 s are without new faults.
const EPOCH_NS: i64 = 120 * S;
const QUIET_NS: i64 = 25 * S;
/// What may still be under way at a quiet moment.
const UNDER_WAY_NS: i64 = 2 * S;
/// Parts of the recording.
const PART_NS: i64 = 300 * S;
/// The queue before the disk, as `record` has it.
const QUEUE_BYTES: usize = 32 << 20;
/// Memory that a flat run may gain from its first to its last quarter.
const FLAT_BYTES: i64 = 8 << 20;
/// Everything has been used once.
const WARM_EPOCHS: usize = 1;

/// Writes parts, and keeps what is held against the truth.
struct Recording {
    writer: Option<PartsWriter>,
    witness: Witness,
    written: BTreeMap<&'static str, u64>,
    max_waiting: [usize; 2],
    dropped: u64,
    unreported: u64,
    cdr: Vec<u8>,
}

impl Recording {
    fn write(&mut self, topic: Topic, log_ns: i64, publish_ns: i64, cdr: &[u8]) {
        *self.written.entry(topic.name()).or_default() += 1;
        if let Some(writer) = &mut self.writer {
            writer.write_encoded(topic, log_ns, publish_ns, cdr).unwrap();
        }
    }
}

impl Sink for Recording {
    fn message(&mut self, topic: Topic, log_ns: i64, publish_ns: i64, cdr: &[u8]) {
        self.write(topic, log_ns, publish_ns, cdr);
        self.witness.message(topic, log_ns, publish_ns, cdr);
    }

    fn health(&mut self, now_ns: i64, health: &Health) {
        let mut cdr = std::mem::take(&mut self.cdr);
        diagnostics_message(now_ns, health).encode(&mut cdr);
        self.write(Topic::Diagnostics, now_ns, now_ns, &cdr);
        self.cdr = cdr;
        let waiting = [health.matcher.waiting, health.matcher.waiting_vertical];
        self.max_waiting = std::array::from_fn(|queue| self.max_waiting[queue].max(waiting[queue]));
        (self.dropped, self.unreported) = (health.dropped, health.unreported);
    }

    fn dropped(&self) -> u64 {
        0
    }
}

type Rig = SimRig<SlowDisk<Recording>>;

/// All that the soak counts.
#[derive(Default)]
struct Tally {
    faults: BTreeMap<String, u64>,
    reported: BTreeMap<String, u64>,
    lasers: Account,
    base: Account,
    inertial: Account,
    read_back: BTreeMap<String, u64>,
    parts: u64,
    memory_bytes: Vec<i64>,
    open_files: Vec<usize>,
    wrong: Vec<String>,
}

fn length_s() -> i64 {
    own_process::length_s("BIPLANE_FAULT_SOAK_S", 240)
}

/// A fault of a line.
fn line_fault(port: Port, rng: &mut Rng) -> Fault {
    let mut any = |count: usize| (rng.unit() * count as f64) as usize;
    let harms = [Harm::Drop, Harm::Flip, Harm::Duplicate, Harm::Reorder, Harm::Stall, Harm::Burst];
    let foreign_devices = match port {
        Port::Base => {
            [ForeignDevice::Laser(9600), ForeignDevice::Receiver, ForeignDevice::Modem, ForeignDevice::Echo]
        }
        Port::Imu => [
            ForeignDevice::Laser(38_400),
            ForeignDevice::Rflex(38_400),
            ForeignDevice::Modem,
            ForeignDevice::Echo,
        ],
        _ => [
            ForeignDevice::Pioneer,
            ForeignDevice::Receiver,
            ForeignDevice::RoboClaw(38_400),
            ForeignDevice::Echo,
        ],
    };
    match any(16) {
        0 => Fault::Unplug,
        1 => Fault::Cable,
        2 => Fault::Jerk,
        3 => Fault::PowerCycle,
        4 => Fault::Silence,
        5 => Fault::Garbage,
        6 => Fault::Noise(&[Preset::BitNoise]),
        7 => Fault::Noise(&[Preset::LooseConnector]),
        8 => Fault::Noise(&[Preset::UsbStall]),
        9 | 10 => Fault::ForeignDevice(foreign_devices[any(4)]),
        11 if matches!(port, Port::Horizontal | Port::Vertical) => {
            Fault::OtherRate([19_200, 38_400, 500_000][any(3)])
        }
        _ => Fault::Harm(harms[any(6)], [10_000, 1000, 200][any(3)]),
    }
}

/// Faults on the lines from a quiet moment to the next: one every 15 s or so, each on a line that has come
/// back from the one before.
fn line_faults(from_ns: i64, rng: &mut Rng, tally: &mut Tally) -> Plan {
    let mut happenings = Vec::new();
    let mut free_ns = [from_ns + S; PORTS.len()];
    let mut at_ns = from_ns;
    loop {
        at_ns += (rng.between(2.0, 20.0) * 1e9) as i64;
        let port = PORTS[(rng.unit() * PORTS.len() as f64) as usize];
        let start_ns = at_ns.max(free_ns[place(port)]);
        if start_ns > from_ns + EPOCH_NS - QUIET_NS - 25 * S {
            return Plan::new(happenings);
        }
        let fault = line_fault(port, rng);
        let boot_ns = match port {
            Port::Base => BaseParams::default().boot_ns,
            Port::Imu => XsensParams::default().boot_ns,
            Port::Horizontal | Port::Vertical => LmsParams::default().boot_ns,
        };
        let outage = fault.outage(port, boot_ns, rng);
        let later_ns = start_ns - outage.begin_ns;
        happenings
            .extend(outage.happenings.iter().map(|(at_ns, what)| (at_ns + later_ns, port, what.clone())));
        free_ns[place(port)] = outage.answering_ns + later_ns + 10 * S;
        *tally.faults.entry(fault.name()).or_default() += 1;
    }
}

/// A fault of the host, now and then.
fn host_fault(sim: &mut Rig, from_ns: i64, rng: &mut Rng, tally: &mut Tally) {
    let at_ns = from_ns + (rng.between(5.0, 60.0) * 1e9) as i64;
    let mut length_ns = |from_s: f64, to_s: f64| (rng.between(from_s, to_s) * 1e9) as i64;
    let name = match length_ns(0.0, 4.0) / S {
        0 => {
            let to_ns = at_ns + length_ns(0.1, 20.0);
            let stalls = std::array::from_fn(|_| Stalls::one(at_ns, to_ns + length_ns(0.0, 0.005)));
            sim.host.as_mut().unwrap().stall(stalls);
            "process suspended, 0.1 to 20 s"
        }
        1 | 2 => {
            let (longest_ms, name) = match length_ns(0.0, 2.0) / S {
                0 => (200.0, "a core stolen for 8 s"),
                _ => (30.0, "memory pressure for 8 s"),
            };
            let spell = (at_ns, at_ns + 8 * S);
            let stalls: [Stalls; THREADS] = std::array::from_fn(|_| {
                Stalls::by_chance(spell, [longest_ms / 20.0, longest_ms, longest_ms / 2.0], rng)
            });
            sim.host.as_mut().unwrap().stall(stalls);
            name
        }
        _ => {
            sim.engine.sink().stall(Stalls::one(at_ns, at_ns + length_ns(0.1, 30.0)));
            "slow disk, 0.1 to 30 s"
        }
    };
    *tally.faults.entry(name.to_owned()).or_default() += 1;
}

/// Runs on, while the disk writes in its own time.
fn run_until(sim: &mut Rig, end_ns: i64) {
    while sim.now_ns() < end_ns {
        sim.run((sim.now_ns() + LOOK_NS).min(end_ns), |_| false);
        let now_ns = sim.now_ns();
        sim.engine.sink().write(now_ns);
    }
}

/// Holds what has arrived since `from_ns` against what was recorded, and forgets it.
fn settle(sim: &mut Rig, from_ns: i64, tally: &mut Tally) {
    let now_ns = sim.now_ns();
    sim.engine.sink().flush();
    let witness = std::mem::take(&mut sim.engine.sink().written.witness);
    let transcript = sim.transcript();
    let Some(host) = &mut sim.host else { return };
    for port in PORTS {
        let Some(line) = &sim.lines[place(port)] else { continue };
        let delivered = host.delivered(place(port));
        let since = |mut telegrams: Vec<Telegram>| {
            telegrams.retain(|telegram| telegram.arrived_ns.is_none_or(|at_ns| at_ns >= from_ns));
            telegrams
        };
        let (account, total) = match port {
            Port::Base => {
                let recorded_ns = &witness.odometry_ns;
                let reported = &sim.reported;
                let wait_ns = LONGEST_PROMISE_NS;
                let account = pioneer_account(&line.sent, delivered, from_ns, recorded_ns, reported, wait_ns);
                (account, &mut tally.base)
            }
            Port::Imu => {
                let messages = since(sent_samples(&line.sent, delivered));
                (inertial_account(&messages, delivered, &witness.samples), &mut tally.inertial)
            }
            Port::Horizontal | Port::Vertical => {
                let telegrams = since(sent_scans(&line.sent, delivered));
                let scans = &witness.scans[place(port)];
                (laser_account(port, &telegrams, delivered, scans, &sim.reported), &mut tally.lasers)
            }
        };
        if account.lost() > 0 || account.wrongly_kept > 0 {
            tally.wrong.push(format!("{} s, {port:?}: {account:?}\n{}", now_ns / S, transcript));
        }
        total.add(&account);
    }
    for reported in sim.reported.iter().filter(|reported| reported.at_ns > from_ns) {
        let words = reported.event.fault().map_or_else(|| format!("{:?}", reported.event), ToOwned::to_owned);
        let kind: String = words.chars().take_while(|letter| !"{(".contains(*letter)).collect();
        *tally.reported.entry(kind.trim().to_owned()).or_default() += 1;
    }
    // Everything streams in a quiet moment.
    let streams = |port| ReportedEvent { at_ns: now_ns, port, event: Event::Streaming };
    sim.reported = PORTS.map(streams).to_vec();
    host.forget_before(now_ns - UNDER_WAY_NS);
    for line in sim.lines.iter_mut().flatten() {
        line.sent.forget_before(now_ns - UNDER_WAY_NS);
        (line.asked, line.delivered) = Default::default();
    }
    tally.memory_bytes.push(memory_bytes());
    tally.open_files.push(std::fs::read_dir("/proc/self/fd").unwrap().count());
}

/// Reads the finished parts back, and deletes them.
fn read_back(folder: &Path, tally: &mut Tally) {
    let mut parts: Vec<PathBuf> =
        std::fs::read_dir(folder).unwrap().map(|entry| entry.unwrap().path()).collect();
    parts.retain(|path| path.extension().is_some_and(|extension| extension == "mcap"));
    for part in parts {
        for entry in Reader::open(&part).unwrap().messages() {
            let topic = entry.unwrap().topic.map_or("?", Topic::name);
            *tally.read_back.entry(topic.to_owned()).or_default() += 1;
        }
        tally.parts += 1;
        std::fs::remove_file(part).unwrap();
    }
}

#[test]
fn faults_of_all_kinds_for_hours_leave_memory_queues_and_files_flat_and_lose_nothing_intact() {
    own_process::run("soak::fault_soak::alone");
}

fn soak(folder: &Path, tally: &mut Tally) -> Rig {
    let rig = with_inertial_unit(rig_at(BAUD), UNIT.0, UNIT.1);
    let rotation = Rotation { span_ns: Some(PART_NS), ..Rotation::default() };
    let writer = PartsWriter::create(&folder.join("run.mcap"), &WriterOptions::default(), rotation).unwrap();
    let recording = Recording {
        writer: Some(writer),
        witness: Witness::default(),
        written: BTreeMap::new(),
        max_waiting: [0; 2],
        dropped: 0,
        unreported: 0,
        cdr: Vec::new(),
    };
    let mut disk = SlowDisk::new(recording, QUEUE_BYTES, Stalls::default());
    disk.writes_at_once = false;
    disk.touch(QUEUE_BYTES);
    let lines = idle_lines(&rig, 1, &Faults::default(), &[]);
    let mut sim = SimRig::new(&rig, lines, Plan::default(), disk);
    sim.host = Some(Host::new(Default::default()));
    run_until(&mut sim, 5 * S);
    settle(&mut sim, 0, tally);
    let mut rng = Rng::new(1, 0x50AC, 0);
    let mut warm_allocations = 0;
    for epoch in 0..(length_s() * S / EPOCH_NS) as usize {
        let from_ns = sim.now_ns();
        sim.plan = line_faults(from_ns, &mut rng, tally);
        host_fault(&mut sim, from_ns, &mut rng, tally);
        run_until(&mut sim, from_ns + EPOCH_NS);
        settle(&mut sim, from_ns, tally);
        read_back(folder, tally);
        if epoch + 1 == WARM_EPOCHS {
            warm_allocations = sim.engine_allocations;
        }
    }
    sim.engine_allocations -= warm_allocations;
    sim
}

#[test]
#[ignore = "run by the test above in a process of its own"]
fn alone() {
    let folder = folder("fault_soak");
    let mut tally = Tally::default();
    let mut sim = soak(&folder, &mut tally);
    let queues = sim.host.as_ref().unwrap().longest_queues();
    let (allocations, waiting_bytes) = (sim.engine_allocations, sim.engine.sink().max_waiting_bytes());
    let recording = &mut sim.engine.sink().written;
    recording.writer.take().unwrap().finish().unwrap();
    read_back(&folder, &mut tally);
    let [first_bytes, last_bytes] = quarters(&tally.memory_bytes);
    println!("faults: {} in {} s: {:#?}", tally.faults.values().sum::<u64>(), length_s(), tally.faults);
    println!("said: {:#?}", tally.reported);
    println!("lasers {:?}\nbase {:?}\ninertial {:?}", tally.lasers, tally.base, tally.inertial);
    println!("written {:?}, read back from {} parts {:?}", recording.written, tally.parts, tally.read_back);
    println!("memory: second quarter {} kB, last {} kB", first_bytes >> 10, last_bytes >> 10);
    println!(
        "open files: {:?} at first, {:?} at last, {:?} at most",
        tally.open_files.first(),
        tally.open_files.last(),
        tally.open_files.iter().max()
    );
    println!(
        "most waiting: kernel {} bytes, {} reads, disk {waiting_bytes} bytes, scans {:?}; dropped {}, untold {}; allocations {allocations}",
        queues[0], queues[1], recording.max_waiting, recording.dropped, recording.unreported
    );
    assert!(
        tally.wrong.is_empty(),
        "{} quiet moments are wrong, the first: {}",
        tally.wrong.len(),
        tally.wrong[0]
    );
    // Each part has the static frames.
    let is_whole = |(topic, count): (&&str, &u64)| {
        *topic == Topic::TfStatic.name() || tally.read_back.get(*topic) == Some(count)
    };
    assert!(recording.written.iter().all(is_whole), "what was written is not what is read");
    assert_eq!((recording.dropped, recording.unreported, allocations), (0, 0, 0));
    assert!(last_bytes - first_bytes < FLAT_BYTES, "memory grew");
    assert_eq!(tally.open_files.get(1), tally.open_files.last(), "files stay open");
    std::fs::remove_dir_all(folder).unwrap();
}
