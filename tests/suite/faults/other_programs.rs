//! Other programs with our mock laser, whatever its phase: CARMEN and AriaCoda get their scans.
//!
//! Drawn for each seed: the mirror's phase, when the program begins, how late the adapter is, how long the
//! device takes to write its configuration.

use biplane_mock::devices::lms::LmsParams;
use biplane_mock::devices::lms::request::Latency;
use biplane_mock::faults::Faults;
use biplane_mock::rng::Rng;

use crate::rig::devices::earlier_client::{
    ARIA_WRITES, CARMEN_WRITES, CONFIG, INSTALL, NARROW_QUARTER, PARTIAL, STOP, STREAM, TO_38400, WIDE_1,
};
use crate::rig::devices::laser;
use crate::rig::laser_client::{LaserClient, SCAN};
use crate::rig::line::SimLine;
use crate::rig::{MS, S, seeds};

/// CARMEN waits so long for an answer, and says the same again.
const CARMEN_WAITS_NS: i64 = 250 * MS;
/// So many times.
const CARMEN_TRIES: u32 = 8;
/// AriaCoda changes the rate of its port so long behind its request.
const ARIA_CHANGES_NS: i64 = 20 * MS;
/// And waits so long for an answer.
const ARIA_WAITS_NS: i64 = 10 * S;
/// It says stop at a scan in place of an answer, and asks again; so many times.
const ARIA_TRIES: u32 = 30;
/// Answers to AriaCoda take no longer than this, all together.
const ARIA_CONNECTS_NS: i64 = 5 * S;
/// Scans that must come, one within this time of the other.
const SCANS: usize = 5;
const SCAN_WITHIN_NS: i64 = 2 * S;

/// A line to this laser with a program that opened it at 9600 Bd some time ago.
fn client(params: LmsParams, seed: u64, rng: &mut Rng) -> LaserClient {
    let device = laser(params, &Faults::default(), seed, 0);
    let mut client = LaserClient::new(SimLine::new(device, seed, 0), 9600);
    client.pass((rng.between(0.5, 2.0) * S as f64) as i64);
    client
}

/// Whether so many scans come.
fn streams(client: &mut LaserClient) -> bool {
    (0..SCANS).all(|_| client.wait(SCAN_WITHIN_NS).is_some_and(|telegram| telegram[4] == SCAN))
}

/// CARMEN says this until it is answered with the code; whether it is.
fn carmen_asks(client: &mut LaserClient, request: &[u8], code: u8) -> bool {
    (0..CARMEN_TRIES).any(|_| {
        client.say(request);
        let until_ns = client.now_ns() + CARMEN_WAITS_NS;
        while let Some(telegram) = client.wait(until_ns - client.now_ns()) {
            if telegram[4] == code {
                return true;
            }
        }
        false
    })
}

/// CARMEN's start-up; what went wrong.
fn carmen(client: &mut LaserClient) -> Result<(), String> {
    let found = [9600, 19_200, 38_400, 500_000].into_iter().any(|baud| {
        client.set_baud(baud);
        carmen_asks(client, STOP, 0xA0)
    });
    if !found {
        return Err("not found".to_owned());
    }
    let order = [
        (10, STOP, 0xA0),
        (0, CONFIG, 0xF4),
        (1001, INSTALL, 0xA0),
        (1000, CARMEN_WRITES, 0xF7),
        (1001, NARROW_QUARTER, 0xBB),
        (1000, STOP, 0xA0),
        (1000, PARTIAL, 0xA0),
    ];
    for (pause_ms, request, code) in order {
        client.pass(pause_ms * MS);
        if !carmen_asks(client, request, code) {
            return Err(format!("{:02X} is not answered", request[4]));
        }
    }
    if streams(client) { Ok(()) } else { Err("no scans".to_owned()) }
}

/// AriaCoda says this after a pause until it is answered with the code; how long that took.
fn aria_asks(client: &mut LaserClient, pause_ms: i64, request: &[u8], code: u8) -> Result<i64, String> {
    let begun_ns = client.now_ns();
    for _ in 0..ARIA_TRIES {
        client.pass(pause_ms * MS);
        client.say(request);
        loop {
            let telegram = client.wait(ARIA_WAITS_NS).ok_or(format!("no {code:02X} within 10 s"))?;
            match telegram[4] {
                found if found == code => return Ok(client.now_ns() - begun_ns),
                SCAN => break client.say(STOP),
                _ => {}
            }
        }
    }
    Err(format!("scans for ever, no {code:02X}"))
}

/// AriaCoda's start-up; how long the answers took.
fn aria(client: &mut LaserClient) -> Result<i64, String> {
    client.say(TO_38400);
    client.pass(ARIA_CHANGES_NS);
    client.set_baud(38_400);
    let order = [(300, WIDE_1, 0xBB), (200, INSTALL, 0xA0), (200, ARIA_WRITES, 0xF7), (200, STREAM, 0xA0)];
    let mut taken_ns = 0;
    for (pause_ms, request, code) in order {
        taken_ns += aria_asks(client, pause_ms, request, code)?;
    }
    match streams(client) {
        true if taken_ns > ARIA_CONNECTS_NS => Err(format!("takes {} ms", taken_ns / MS)),
        true => Ok(taken_ns),
        false => Err("no scans".to_owned()),
    }
}

#[test]
fn carmen_streams_from_the_mock_in_whatever_phase_though_it_repeats_its_write() {
    let (mut runs, mut worst_ns, mut wrong) = (0, 0, Vec::new());
    for baud in [9600, 38_400, 500_000] {
        for left_streaming in [false, true] {
            for seed in seeds(3, 1) {
                let mut rng = Rng::new(seed, 0xCA, i64::from(baud));
                let config_write_ns = (rng.between(50.0, 1500.0) * MS as f64) as i64;
                let latency = Latency { config_write_ns, ..Latency::default() };
                let params = LmsParams { baud, left_streaming, latency, ..LmsParams::default() };
                let mut client = client(params, seed, &mut rng);
                let begun_ns = client.now_ns();
                let result = carmen(&mut client);
                let counts = client.device_counts();
                (runs, worst_ns) = (runs + 1, worst_ns.max(client.now_ns() - begun_ns));
                if result.is_err() || counts.refused + counts.bad_checksums > 0 {
                    let write_ms = config_write_ns / MS;
                    wrong.push(format!(
                        "{baud} Bd, streaming {left_streaming}, seed {seed}, writes in {write_ms} ms: \
                         {result:?}, {counts:?}"
                    ));
                }
            }
        }
    }
    println!("| CARMEN with the mock | {runs} runs | five scans within {} ms |", worst_ns / MS);
    assert!(wrong.is_empty(), "{} runs are wrong, the first:\n{}", wrong.len(), wrong[0]);
}

#[test]
fn ariacoda_connects_to_a_mock_that_was_left_streaming_in_whatever_phase() {
    let (mut runs, mut worst_ns, mut wrong) = (0, 0, Vec::new());
    for baud in [9600, 38_400] {
        for seed in seeds(3, 1) {
            let mut rng = Rng::new(seed, 0xA1, i64::from(baud));
            let params = LmsParams { baud, left_streaming: true, ..LmsParams::default() };
            runs += 1;
            match aria(&mut client(params, seed, &mut rng)) {
                Ok(taken_ns) => worst_ns = worst_ns.max(taken_ns),
                Err(what) => wrong.push(format!("{baud} Bd, seed {seed}: {what}")),
            }
        }
    }
    println!("| AriaCoda with the mock | {runs} runs | answers within {} ms |", worst_ns / MS);
    assert!(wrong.is_empty(), "{} runs are wrong, the first:\n{}", wrong.len(), wrong[0]);
}
