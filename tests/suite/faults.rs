//! Every fault, at every place, for many seeds: noticed, said once, over by itself, and nothing lost that arrived intact.
//!
//! A run lasts some 20 s of simulated time: three seconds undisturbed, the fault, and ten seconds in which everything must be as before.
//! `BIPLANE_SEEDS=100 cargo test --release -p biplane-tests --test suite faults -- --nocapture` prints the full table.

use biplane_mock::base_device::BaseParams;
use biplane_mock::faults::{Faults, Preset};
use biplane_mock::lms_device::LmsParams;
use biplane_mock::rng::Rng;
use biplane_onboard::session::Event;
use biplane_recording::{Port, Rig};

use crate::rig::devices::idle_lines;
use crate::rig::plan::{Happening, Plan};
use crate::rig::truth::{Account, base_account, laser_account, sent_reports, sent_scans};
use crate::rig::witness::Witness;
use crate::rig::{MS, S, SimRig, place, seeds};

/// Every device is found at the rig's rate, so that its first measurement comes within this time.
const UP_NS: i64 = 3 * S;
/// An outage is noticed within this time.
const NOTICED_NS: i64 = S;
/// Shorter ones need not be.
const SURELY_NOTICED_NS: i64 = 12 * S / 10;
/// Streaming again, after the device answers at the rate that the session last used.
const BACK_KNOWN_NS: i64 = 2 * S;
/// Streaming again, when its rate must be searched.
const BACK_SEARCHED_NS: i64 = 9 * S;
/// How long is looked on after the fault.
const AFTER_NS: i64 = 10 * S;

const LASERS: [Port; 2] = [Port::Horizontal, Port::Vertical];

/// What is done to a line.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Fault {
    /// The adapter is pulled out and put back.
    Unplug,
    /// The same, for less than a driver need notice.
    Jerk,
    /// The device loses its power, gets it back and starts.
    PowerCycle,
    /// Nothing comes from the device.
    Silence,
    /// Random bytes come instead.
    Garbage,
    /// Presets: those of the line for eight seconds, those of the device or its measurements from the start.
    Noise(&'static [Preset]),
}

/// A fault in time.
struct Outage {
    begin_ns: i64,
    /// From then on the device would answer.
    answering_ns: i64,
    happenings: Vec<(i64, Happening)>,
    back_within_ns: i64,
}

impl Fault {
    fn outage(self, port: Port, rng: &mut Rng) -> Outage {
        let begin_ns = 3 * S + (rng.unit() * 1e9) as i64;
        let mut lasts = |from_s: f64, to_s: f64| (rng.between(from_s, to_s) * 1e9) as i64;
        let (length_ns, begins, ends, back_within_ns) = match self {
            Self::Unplug => (lasts(1.3, 9.0), Happening::Unplug, Happening::Plug, BACK_KNOWN_NS),
            Self::Jerk => (lasts(0.05, 0.8), Happening::Unplug, Happening::Plug, BACK_KNOWN_NS),
            Self::PowerCycle => {
                let within_ns = if port == Port::Base { BACK_KNOWN_NS } else { BACK_SEARCHED_NS };
                (lasts(0.3, 10.0), Happening::PowerOff, Happening::PowerOn, within_ns)
            }
            Self::Silence => (lasts(1.3, 9.0), Happening::Mute, Happening::Unmute, BACK_KNOWN_NS),
            Self::Garbage => (lasts(1.3, 9.0), Happening::Babble, Happening::Clear, BACK_KNOWN_NS),
            Self::Noise(presets) => {
                let begins = Happening::Faults(presets.to_vec());
                (8 * S, begins, Happening::Faults(Vec::new()), BACK_KNOWN_NS)
            }
        };
        let ends_ns = begin_ns + length_ns;
        let happenings = vec![(begin_ns, begins), (ends_ns, ends)];
        let boot_ns = match (self, port) {
            (Self::PowerCycle, Port::Base) => BaseParams::default().boot_ns,
            (Self::PowerCycle, _) => LmsParams::default().boot_ns,
            _ => 0,
        };
        let answering_ns = ends_ns + boot_ns;
        Outage { begin_ns, answering_ns, happenings, back_within_ns }
    }

    fn presets(self) -> &'static [Preset] {
        match self {
            Self::Noise(presets) => presets,
            _ => &[],
        }
    }

    fn name(self) -> String {
        match self {
            Self::Unplug => "adapter unplugged, 1.3 to 9 s".to_owned(),
            Self::Jerk => "adapter unplugged, under 0.8 s".to_owned(),
            Self::PowerCycle => "power-cycle".to_owned(),
            Self::Silence => "silence, 1.3 to 9 s".to_owned(),
            Self::Garbage => "garbage, 1.3 to 9 s".to_owned(),
            Self::Noise(presets) => {
                presets.iter().map(|preset| preset.name()).collect::<Vec<_>>().join(" + ")
            }
        }
    }
}

/// What a run, or many, came to.
#[derive(Clone, Debug, Default)]
struct Outcome {
    runs: u64,
    /// Slowest notice.
    noticed_ns: i64,
    /// Most times that the same thing was said of one outage.
    said: u64,
    /// Slowest return.
    back_ns: i64,
    /// Telegrams of the lines with the fault, and of the others.
    hit: Account,
    others: Account,
    /// What was not as it should be.
    wrong: Vec<String>,
}

impl Outcome {
    fn add(&mut self, other: Self) {
        self.runs += other.runs;
        self.noticed_ns = self.noticed_ns.max(other.noticed_ns);
        self.said = self.said.max(other.said);
        self.back_ns = self.back_ns.max(other.back_ns);
        self.hit.add(&other.hit);
        self.others.add(&other.others);
        self.wrong.extend(other.wrong);
    }

    fn row(&self, fault: &str, places: &str, baud: u32) -> String {
        let Self { runs, noticed_ns, said, back_ns, hit, others, .. } = self;
        format!(
            "| {fault} | {places} | {baud} | {runs} | {} | {said} | {} | {} / {} | {} | {} | {} | {} / {} |\n",
            noticed_ns / MS,
            back_ns / MS,
            hit.recorded,
            hit.intact,
            hit.damaged,
            hit.undetected,
            hit.wrongly_kept,
            others.recorded,
            others.intact,
        )
    }
}

const HEAD: &str = "| fault | place | Bd | runs | noticed, worst ms | said | back, worst ms | recorded / intact | damaged | undetected | wrongly kept | other lines |\n|---|---|---|---|---|---|---|---|---|---|---|---|\n";

fn rig_at(baud: u32) -> Rig {
    let mut rig = Rig::default();
    rig.horizontal.baud = baud;
    if let Some(vertical) = &mut rig.vertical {
        vertical.baud = baud;
    }
    rig
}

/// One run with these faults.
fn run(faults: &[(Port, Fault)], baud: u32, seed: u64) -> Outcome {
    let mut rng = Rng::new(seed, 0xFA_0175, faults.len() as i64);
    let outages: Vec<(Port, Fault, Outage)> =
        faults.iter().map(|&(port, fault)| (port, fault, fault.outage(port, &mut rng))).collect();
    let happenings = outages.iter().flat_map(|(port, _, outage)| {
        outage.happenings.iter().map(|(at_ns, happening)| (*at_ns, *port, happening.clone()))
    });
    let plan = Plan::new(happenings.collect());
    let presets: Vec<Preset> = faults.iter().flat_map(|(_, fault)| fault.presets()).copied().collect();
    let places: Vec<u64> = faults.iter().map(|(port, _)| place(*port) as u64).collect();
    let lines = idle_lines(baud, seed, &Faults::new(&presets, seed), &places);
    let mut sim = SimRig::new(&rig_at(baud), lines, plan, Witness::default());
    let last_ns = outages.iter().map(|(_, _, outage)| outage.answering_ns).max().unwrap_or(0);
    sim.run(last_ns + AFTER_NS, |_| false);
    let mut outcome = Outcome { runs: 1, ..Outcome::default() };
    for (port, fault, outage) in &outages {
        judge(&mut sim, *port, *fault, outage, &mut outcome);
    }
    for port in Port::ALL {
        let account = account(&mut sim, port);
        let is_hit = faults.iter().any(|(hit, _)| *hit == port);
        if account.lost() > 0 || account.wrongly_kept > 0 || (!is_hit && account.undetected > 0) {
            outcome.wrong.push(format!("{port:?}: {account:?}"));
        }
        if is_hit { &mut outcome.hit } else { &mut outcome.others }.add(&account);
        let words = sim.said.iter().filter(|said| said.port == port && said.event.is_warning());
        let warned = words.count();
        if !is_hit && warned > 0 {
            outcome.wrong.push(format!("{port:?} was disturbed"));
        }
    }
    if !outcome.wrong.is_empty() {
        let what = outcome.wrong.join("; ");
        let told: String = sim.told();
        let times: Vec<String> = outages
            .iter()
            .map(|(port, fault, o)| {
                format!("{port:?} {fault:?} from {} to {} ms", o.begin_ns / MS, o.answering_ns / MS)
            })
            .collect();
        outcome.wrong = vec![format!("seed {seed}, {baud} Bd, {times:?}: {what}\n{told}")];
    }
    outcome
}

fn account(sim: &mut SimRig<Witness>, port: Port) -> Account {
    let Some(line) = &sim.lines[place(port)] else { return Account::default() };
    let witness = sim.engine.sink();
    if port == Port::Base {
        return base_account(&sent_reports(&line.sent, &line.delivered), &witness.odometry_ns, &sim.said);
    }
    let telegrams = sent_scans(&line.sent, &line.delivered);
    laser_account(port, &telegrams, &line.delivered, &witness.scans[place(port)], &sim.said)
}

/// When measurements of a line were recorded.
fn recorded_ns(sim: &mut SimRig<Witness>, port: Port) -> Vec<i64> {
    let witness = sim.engine.sink();
    match port {
        Port::Base => witness.odometry_ns.clone(),
        laser => witness.scans[place(laser)].iter().map(|scan| scan.log_ns).collect(),
    }
}

fn judge(sim: &mut SimRig<Witness>, port: Port, fault: Fault, outage: &Outage, outcome: &mut Outcome) {
    let is_loss =
        |event: &Event| matches!(event, Event::Silent { .. } | Event::Garbled { .. } | Event::PoweredOn);
    let losses: Vec<i64> = sim
        .said
        .iter()
        .filter(|said| said.port == port && is_loss(&said.event))
        .map(|said| said.at_ns)
        .collect();
    for kind in [
        |event: &Event| matches!(event, Event::Silent { .. } | Event::Garbled { .. }),
        |event: &Event| matches!(event, Event::PoweredOn),
        |event: &Event| matches!(event, Event::NotFound { .. }),
    ] {
        let said = sim.said.iter().filter(|said| said.port == port && kind(&said.event)).count() as u64;
        outcome.said = outcome.said.max(said);
    }
    let is_outage = !matches!(fault, Fault::Noise(_));
    let length_ns = outage.answering_ns - outage.begin_ns;
    match losses.first() {
        Some(at_ns) => {
            outcome.noticed_ns = at_ns - outage.begin_ns;
            if is_outage && outcome.noticed_ns > NOTICED_NS {
                outcome.wrong.push(format!("noticed after {} ms", outcome.noticed_ns / MS));
            }
        }
        None if is_outage && length_ns >= SURELY_NOTICED_NS => outcome.wrong.push("not noticed".to_owned()),
        None => {}
    }
    if is_outage && outcome.said > 1 {
        outcome.wrong.push(format!("said {} times", outcome.said));
    }
    let recorded_ns = recorded_ns(sim, port);
    match recorded_ns.iter().find(|at_ns| **at_ns > outage.answering_ns) {
        Some(at_ns) => {
            let back_ns = at_ns - outage.answering_ns;
            outcome.back_ns = outcome.back_ns.max(back_ns);
            if back_ns > outage.back_within_ns {
                outcome.wrong.push(format!("{port:?} back after {} ms", back_ns / MS));
            }
        }
        None => outcome.wrong.push(format!("{port:?} not back")),
    }
    if recorded_ns.first().is_none_or(|first_ns| *first_ns > UP_NS) {
        outcome.wrong.push(format!("{port:?} did not come up in time"));
    }
    let end_ns = sim.now_ns();
    if recorded_ns.last().is_none_or(|last_ns| end_ns - last_ns > S) {
        outcome.wrong.push(format!("{port:?} silent at the end"));
    }
}

#[track_caller]
fn check_at(fault: Fault, ports: &[Port], bauds: &[(u32, u64)]) {
    let (mut table, mut wrong) = (HEAD.to_owned(), Vec::new());
    for &(baud, seeds) in bauds {
        for &port in ports {
            let mut all = Outcome::default();
            for seed in 1..=seeds {
                all.add(run(&[(port, fault)], baud, seed));
            }
            table += &all.row(&fault.name(), &format!("{port:?}"), baud);
            wrong.extend(all.wrong);
        }
    }
    println!("{table}");
    assert!(wrong.is_empty(), "{} runs are wrong, the first:\n{}", wrong.len(), wrong[0]);
}

/// At 38400 Bd and, for fewer seeds, at 500000.
#[track_caller]
fn check(fault: Fault) {
    check_at(fault, &Port::ALL, &[(38_400, seeds(2)), (500_000, seeds(2).div_ceil(5))]);
}

#[test]
fn an_unplugged_adapter() {
    check(Fault::Unplug);
}

#[test]
fn an_adapter_unplugged_for_a_moment() {
    check(Fault::Jerk);
}

#[test]
fn a_power_cycle() {
    check(Fault::PowerCycle);
}

#[test]
fn silence() {
    check(Fault::Silence);
}

#[test]
fn garbage() {
    check(Fault::Garbage);
}

#[test]
fn bit_noise() {
    check(Fault::Noise(&[Preset::BitNoise]));
}

#[test]
fn a_loose_connector() {
    check(Fault::Noise(&[Preset::LooseConnector]));
}

#[test]
fn a_usb_stall() {
    check(Fault::Noise(&[Preset::UsbStall]));
}

#[test]
fn a_dazzled_laser() {
    check_at(
        Fault::Noise(&[Preset::Dazzle]),
        &LASERS,
        &[(38_400, seeds(2)), (500_000, seeds(2).div_ceil(5))],
    );
}

#[test]
fn a_dirty_window() {
    check_at(
        Fault::Noise(&[Preset::WindowDirty]),
        &LASERS,
        &[(38_400, seeds(2)), (500_000, seeds(2).div_ceil(5))],
    );
}

#[test]
fn devices_left_streaming() {
    check_at(
        Fault::Noise(&[Preset::LeftStreaming]),
        &Port::ALL,
        &[(38_400, seeds(2)), (500_000, seeds(2).div_ceil(5))],
    );
}

#[test]
fn bit_noise_behind_a_stalling_adapter_with_a_loose_connector() {
    check(Fault::Noise(&[Preset::LooseConnector, Preset::BitNoise, Preset::UsbStall]));
}

#[test]
fn two_faults_at_once() {
    let pairs: [&[(Port, Fault)]; 4] = [
        &[(Port::Horizontal, Fault::Unplug), (Port::Vertical, Fault::PowerCycle)],
        &[(Port::Horizontal, Fault::Garbage), (Port::Vertical, Fault::Noise(&[Preset::LooseConnector]))],
        &[(Port::Vertical, Fault::Silence), (Port::Base, Fault::Noise(&[Preset::BitNoise]))],
        &[
            (Port::Horizontal, Fault::PowerCycle),
            (Port::Vertical, Fault::PowerCycle),
            (Port::Base, Fault::Unplug),
        ],
    ];
    let (mut table, mut wrong) = (HEAD.to_owned(), Vec::new());
    for pair in pairs {
        let mut all = Outcome::default();
        for seed in 1..=seeds(2) {
            all.add(run(pair, 38_400, seed));
        }
        let names: Vec<String> =
            pair.iter().map(|(port, fault)| format!("{port:?}: {}", fault.name())).collect();
        table += &all.row(&names.join("; "), "together", 38_400);
        wrong.extend(all.wrong);
    }
    println!("{table}");
    assert!(wrong.is_empty(), "{} runs are wrong, the first:\n{}", wrong.len(), wrong[0]);
}
