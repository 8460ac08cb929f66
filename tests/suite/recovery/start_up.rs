//! Every state in which a laser may be found, and how long it takes until the first scan as the rig wants it
//! is recorded.
//!
//! Targets: 3 s at the rig's rate, 9 s when the rate must be searched. States after other programs are made
//! by playing their requests (transcripts of sicktoolbox, MRPT, CARMEN, AriaCoda and Player) to the mock
//! device before the engine starts.

use std::ops::RangeInclusive;

use biplane_mock::devices::device::Device;
use biplane_mock::devices::lms::LmsParams;
use biplane_mock::devices::lms::request::Latency;
use biplane_mock::devices::lms::settings::{ConfigBlock, Variant};
use biplane_mock::faults::Faults;
use biplane_recording::Rig;

use crate::rig::devices::earlier_client::{CLIENTS, Client, after_client};
use crate::rig::devices::{base, idle_laser, laser};
use crate::rig::line::SimLine;
use crate::rig::plan::Plan;
use crate::rig::seeds;
use crate::rig::verdict::witness::{INVALID, NOTHING, RecordedScan, Witness};
use crate::rig::{MS, S, SimRig};

const RATES: [u32; 4] = [9600, 19_200, 38_400, 500_000];
/// At the rig's rate.
const KNOWN_MS: i64 = 3_000;
/// When the rate must be searched.
const SEARCHED_MS: i64 = 9_000;
/// A case that takes longer has failed.
const LONGEST_NS: i64 = 60 * S;

/// A state in which a laser is found.
struct Case {
    /// What it is.
    name: String,
    /// Rate that the rig asks for.
    rig_baud: u32,
    /// The device for a seed.
    make: Box<dyn Fn(u64) -> Box<dyn Device>>,
    /// Requests that the device misses.
    missed_share: f64,
    /// First good scan by then, milliseconds.
    limit_ms: i64,
}

impl Case {
    fn of(name: &str, rig_baud: u32, params: LmsParams) -> Self {
        let limit_ms = if params.baud == rig_baud { KNOWN_MS } else { SEARCHED_MS };
        Self {
            name: name.to_owned(),
            rig_baud,
            make: Box::new(move |seed| laser(params.clone(), &Faults::default(), seed, 0)),
            missed_share: 0.0,
            limit_ms,
        }
    }

    fn after(client: &'static Client, cut_s: Option<f64>, rig_baud: u32, baud_after: u32) -> Self {
        let when = cut_s.map_or("closed".to_owned(), |cut_s| format!("killed {cut_s} s after its start"));
        Self {
            name: format!("after {}, {when}", client.name),
            rig_baud,
            make: Box::new(move |seed| after_client(client, cut_s, seed)),
            missed_share: 0.0,
            limit_ms: if baud_after == rig_baud { KNOWN_MS } else { SEARCHED_MS },
        }
    }

    /// Milliseconds until the first scan as wanted, `i64::MAX` when none came in time; and what was said
    /// until then.
    fn measure(&self, seed: u64) -> (i64, String) {
        let mut rig = Rig { vertical: None, ..Rig::default() };
        rig.horizontal.baud = self.rig_baud;
        let mut line = SimLine::new((self.make)(seed), seed, 0);
        line.missed_share = self.missed_share;
        let base = SimLine::new(base(&rig.base, &Faults::default()), seed, 2);
        let lines = [Some(line), None, Some(base), None];
        let mut sim = SimRig::new(&rig, lines, Plan::default(), Witness::default());
        let beams = rig.horizontal.beam_count();
        let came = sim.run(LONGEST_NS, |sim| {
            let scan = sim.engine.sink().scans[0].last();
            scan.is_some_and(|scan| scan.ranges_mm.len() == beams && is_in_centimeters(scan))
        });
        let time_ms = if came { sim.now_ns() / MS } else { i64::MAX };
        (time_ms, sim.transcript())
    }
}

/// The rig's units. In millimeters a scan reaches no farther than 32.758 m; and of its ranges one in ten is
/// whole centimeters, of all the beams of a scan never all.
fn is_in_centimeters(scan: &RecordedScan) -> bool {
    let is_range = |mm: &&u32| **mm != NOTHING && **mm != INVALID;
    let whole = scan.ranges_mm.iter().filter(is_range).all(|mm| mm % 10 == 0);
    whole && scan.ranges_mm.iter().filter(is_range).count() >= 20 && scan.range_max_mm > 32_758
}

fn left_streaming(baud: u32, variant: Variant) -> LmsParams {
    LmsParams { baud, variant, left_streaming: true, ..LmsParams::default() }
}

fn found_by_rate() -> Vec<Case> {
    let mut cases = Vec::new();
    for rig_baud in [38_400, 500_000, 9600, 19_200] {
        for baud in RATES {
            let name = format!("idle at {baud} Bd");
            cases.push(Case::of(&name, rig_baud, idle_laser(baud)));
        }
        for baud in RATES {
            for variant in Variant::ALL {
                let name = format!("left streaming at {baud} Bd, any variant");
                cases.push(Case::of(&name, rig_baud, left_streaming(baud, variant)));
            }
        }
    }
    cases
}

fn found_in_other_states() -> Vec<Case> {
    let at_rate = || idle_laser(38_400);
    let latency = Latency::default();
    let mut cases = vec![
        Case::of("just switched on", 38_400, LmsParams { baud: 9600, power_on_message: true, ..at_rate() }),
        // Severity 1, "info", with every reply and scan, as the logs of a real LMS 200 have it.
        Case::of("status byte 11h", 38_400, LmsParams { errors: vec![(1, 5)], ..at_rate() }),
        Case::of("other variant", 38_400, LmsParams { variant: Variant::of(100, 25), ..at_rate() }),
        Case::of(
            "millimeters, other measuring mode",
            38_400,
            LmsParams { config: ConfigBlock::default().with_units(true, 6), ..at_rate() },
        ),
        Case::of(
            "acknowledges after 60 ms",
            38_400,
            LmsParams { latency: Latency { acknowledge_ns: 60 * MS, ..latency }, ..at_rate() },
        ),
        Case::of(
            "answers everything 200 ms late",
            38_400,
            LmsParams { latency: late(200 * MS), ..at_rate() },
        ),
    ];
    // The listing allows these times; no driver can be faster than the device.
    let slow = |name: &str, limit_ms, params: LmsParams| Case { limit_ms, ..Case::of(name, 38_400, params) };
    let mode_3_s = Latency { mode_ns: 2_900 * MS, ..latency };
    cases.push(slow(
        "mode changes take 2.9 s",
        2 * 2_900 + 9_000,
        LmsParams { latency: mode_3_s, ..at_rate() },
    ));
    let write_15_s = Latency { config_write_ns: 14_500 * MS, ..latency };
    let config = ConfigBlock::default().with_units(true, 0);
    let params = LmsParams { latency: write_15_s, config, ..at_rate() };
    cases.push(slow("writing the configuration takes 14.5 s", 14_500 + 3_000, params));
    for baud in [38_400, 9600] {
        let idle =
            Case::of(&format!("misses a fifth of the requests, idle at {baud} Bd"), 38_400, idle_laser(baud));
        cases.push(Case { missed_share: 0.2, limit_ms: SEARCHED_MS, ..idle });
    }
    cases
}

fn late(by_ns: i64) -> Latency {
    let Latency {
        acknowledge_ns,
        mode_ns,
        type_ns,
        status_ns,
        config_ns,
        config_write_ns,
        variant_ns,
        reset_ns,
    } = Latency::default();
    Latency {
        acknowledge_ns,
        mode_ns: mode_ns + by_ns,
        type_ns: type_ns + by_ns,
        status_ns: status_ns + by_ns,
        config_ns: config_ns + by_ns,
        config_write_ns: config_write_ns + by_ns,
        variant_ns: variant_ns + by_ns,
        reset_ns,
    }
}

fn found_after_others() -> Vec<Case> {
    let mut cases = Vec::new();
    for client in CLIENTS {
        for rig_baud in [38_400, 500_000] {
            cases.push(Case::after(client, None, rig_baud, client.baud_at_end));
            for &(cut_s, baud) in client.cuts {
                cases.push(Case::after(client, Some(cut_s), rig_baud, baud));
            }
        }
    }
    cases
}

/// Runs the cases; prints a row for all of one name and returns what was missed.
fn table(cases: &[Case], seeds: RangeInclusive<u64>) -> Vec<String> {
    let mut missed = Vec::new();
    let mut rows =
        "| found | rig's rate | runs | mean ms | worst ms | limit ms |\n|---|---|---|---|---|---|\n"
            .to_owned();
    for cases in cases.chunk_by(|a, b| (&a.name, a.rig_baud) == (&b.name, b.rig_baud)) {
        let mut times = Vec::new();
        for (case, seed) in cases.iter().flat_map(|case| seeds.clone().map(move |seed| (case, seed))) {
            let (time_ms, transcript) = case.measure(seed);
            times.push(time_ms);
            if time_ms > case.limit_ms {
                missed.push(format!(
                    "{}, rig {} Bd, seed {seed}: {time_ms} ms\n{transcript}",
                    case.name, case.rig_baud
                ));
            }
        }
        let (worst, runs) = (times.iter().max().copied().unwrap_or(0), times.len() as i64);
        let mean = times.iter().map(|time| time / runs).sum::<i64>();
        let (name, rig_baud, limit_ms) = (&cases[0].name, cases[0].rig_baud, cases[0].limit_ms);
        rows += &format!("| {name} | {rig_baud} | {runs} | {mean} | {worst} | {limit_ms} |\n");
    }
    println!("{rows}");
    missed
}

#[track_caller]
fn check(cases: &[Case], few_seeds: u64) {
    let missed = table(cases, seeds(few_seeds, 1));
    assert!(missed.is_empty(), "{} missed, the first:\n{}", missed.len(), missed[0]);
}

#[test]
fn a_laser_left_at_any_rate_idle_or_streaming_in_any_variant_comes_up_in_time() {
    check(&found_by_rate(), 2);
}

#[test]
fn a_laser_in_another_state_or_slow_or_hard_of_hearing_comes_up_in_time() {
    check(&found_in_other_states(), 4);
}

#[test]
fn a_laser_that_another_program_has_left_comes_up_in_time() {
    check(&found_after_others(), 2);
}
