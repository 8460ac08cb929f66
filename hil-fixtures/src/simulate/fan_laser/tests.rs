//! Captures of simulated lasers of today.

use crate::devices::scip::ScipParams;
use crate::faults::{Faults, Preset};
use crate::line::transfer_ns;
use crate::simulate::tests::Scratch;
use crate::simulate::{LaserOptions, SimulateError, SimulateOptions, SimulateReport, run};
use biplane_recording::capture::serial;
use biplane_recording::{Direction, Port, Reader};
use biplane_wire::Item;
use biplane_wire::scip::{Block, Deframer, Scan};

const SICK: &str = "[horizontal]\nprotocol = \"cola\"\naddress = \"192.168.0.1:2112\"\n";
const HOKUYO: &str = "[horizontal]\nprotocol = \"scip\"\naddress = \"192.168.0.10:10940\"\n";
const BAUD: u32 = 115_200;
const URG: &str = "[horizontal]\nprotocol = \"scip\"\nport = \"a\"\nbaud = 115200\n";

/// Two meters of corridor with a laser like this.
fn drive(
    scratch: &Scratch,
    rig: &str,
    change: impl FnOnce(&mut SimulateOptions),
) -> Result<SimulateReport, SimulateError> {
    let path = scratch.file("path.toml", "waypoints_m = [[0, 0], [2, 0]]\nspeed_m_s = 1.0\n");
    let mut options = SimulateOptions {
        path: Some(path.display().to_string()),
        rig: Some(scratch.file("rig.toml", &format!("{rig}[base]\nprotocol = \"none\"\n"))),
        output: scratch.0.join("c.mcap"),
        overwrite: true,
        ..SimulateOptions::default()
    };
    change(&mut options);
    run(&options)
}

#[test]
fn faults_of_the_measurement_are_refused_and_those_of_lines_are_not() {
    for (name, rig) in [("sick-faults", SICK), ("hokuyo-faults", HOKUYO)] {
        let scratch = Scratch::new(name);
        let spoiled = |preset| drive(&scratch, rig, |options| options.faults = Faults::new(&[preset], 1));
        for (preset, word) in [(Preset::Dazzle, "dazzle"), (Preset::WindowDirty, "window-dirty")] {
            let message = spoiled(preset).expect_err(word).to_string();
            assert!(message.contains(word) && message.contains("LMS 2xx"), "{message}");
            assert!(!scratch.0.join("c.mcap").exists());
        }
        assert!(spoiled(Preset::BitNoise).expect("simulates").scans_horizontal > 100);
    }
}

#[test]
fn the_same_seed_gives_the_same_bytes_and_another_seed_others() {
    for (name, rig) in [("sick-seed", SICK), ("hokuyo-seed", HOKUYO), ("urg-seed", URG)] {
        let scratch = Scratch::new(name);
        let bytes = |seed| {
            drive(&scratch, rig, |options| options.seed = seed).expect("simulates");
            std::fs::read(scratch.0.join("c.mcap")).expect("a file")
        };
        let first = bytes(4);
        assert!(first == bytes(4), "{name}");
        assert!(first != bytes(5), "{name}");
    }
}

#[test]
fn a_hokuyo_laser_on_a_slow_line_leaves_out_turns_and_its_bytes_take_their_time() {
    let scratch = Scratch::new("urg");
    let lasers = LaserOptions {
        hokuyo: ScipParams::of_name("URG-04LX").expect("a known laser"),
        ..LaserOptions::default()
    };
    let report = drive(&scratch, URG, |options| options.lasers = lasers).expect("simulates");
    let reader = Reader::open(&scratch.0.join("c.mcap")).expect("a capture");
    let (mut deframer, mut scans, mut bytes) = (Deframer::new(), Vec::new(), 0);
    for read in serial(&reader).map(|read| read.expect("serial bytes")) {
        if (read.port, read.direction) != (Port::Horizontal, Direction::Rx) {
            continue;
        }
        bytes += read.bytes.len();
        deframer.feed(&read.bytes, |item| {
            let Item::Frame { bytes, .. } = item else { panic!("only whole replies: {item:?}") };
            let block = Block::parse(bytes).expect("a reply");
            if let Some(scan) = Scan::parse(&block) {
                let scan = scan.expect("a scan");
                assert_eq!((scan.request.first_step, scan.values.iter().count()), (44, 682));
                scans.push((read.time_ns, scan.clock_ms, bytes.len()));
            }
        });
    }
    assert_eq!(scans.len(), report.scans_horizontal);
    // 682 values take 185 ms at this rate, and a turn 100 ms: every second one is left out.
    assert!(scans.len() > 8, "{} scans", scans.len());
    for pair in scans.windows(2) {
        let [(before_ns, before_ms, _), (now_ns, now_ms, length)] = [pair[0], pair[1]];
        assert!((199..=202).contains(&(now_ms - before_ms)), "{} ms", now_ms - before_ms);
        assert!(now_ns - before_ns > transfer_ns(length, BAUD), "{} ns", now_ns - before_ns);
    }
    assert!(transfer_ns(bytes, BAUD) < (report.duration_s * 1e9) as i64, "{bytes} bytes");
}
