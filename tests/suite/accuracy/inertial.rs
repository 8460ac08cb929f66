//! The same drive with an inertial unit whose samples come with the capture, and with one on a serial line:
//! the recordings hold the same samples.

use std::path::Path;
use std::sync::atomic::AtomicBool;

use biplane_mock::simulate::{self, SimulateOptions};
use biplane_onboard::{ReplayOptions, RunReport, replay};
use biplane_recording::messages::{Imu, Message};
use biplane_recording::{Reader, Topic};

use crate::accuracy::recorded::folder;

/// A unit on a line states when it has averaged, sends 1.5 ms later, and is reckoned with 1 ms.
const LATENCY_ERROR_NS: i64 = 500_000;
/// From then on the clock of the unit is known.
const SETTLED: usize = 100;

fn replayed(work: &Path, name: &str) -> (RunReport, Vec<Imu>) {
    let rig = Path::new(env!("CARGO_MANIFEST_DIR")).join("../hil-fixtures/rigs").join(format!("{name}.toml"));
    let capture = work.join(format!("{name}.mcap"));
    let options = SimulateOptions {
        world: "ramp-up".to_owned(),
        rig: Some(rig),
        output: capture.clone(),
        start_up: name == "xsens",
        ..SimulateOptions::default()
    };
    let simulated = simulate::run(&options).unwrap();
    let output = work.join(format!("{name}.run.mcap"));
    let report = replay(&ReplayOptions::new(&capture, &output), &AtomicBool::new(false)).unwrap();
    assert_eq!(report.recorded.inertial, simulated.inertial as u64, "{name}");
    let reader = Reader::open(&output).unwrap();
    let entries = reader.messages().map(Result::unwrap).filter(|entry| entry.topic == Some(Topic::Imu));
    (report, entries.map(|entry| Imu::decode(&entry.bytes).unwrap()).collect())
}

#[test]
fn a_unit_on_a_line_says_what_one_without_says() {
    let work = folder("inertial");
    let (with_recording, samples) = replayed(&work, "inertial");
    let (on_a_line, line) = replayed(&work, "xsens");
    std::fs::remove_dir_all(&work).unwrap();
    assert_eq!((on_a_line.losses.lost, on_a_line.arrival.damaged, on_a_line.exit_code()), (0, 0, 0));
    assert!(with_recording.recorded.inertial.abs_diff(on_a_line.recorded.inertial) <= 10);
    // The one with a start-up begins 0.6 s later.
    let begin_ns = |samples: &[Imu]| samples[0].stamp_ns - samples[0].stamp_ns % 1_000_000;
    let later_ns = begin_ns(&line) - begin_ns(&samples);
    assert!((599_000_000..602_000_000).contains(&later_ns), "{later_ns} ns");
    let mut worst_ns = 0;
    for (index, (a, b)) in samples.iter().zip(&line).enumerate() {
        assert_eq!(b.frame_id, a.frame_id);
        let numbers = |sample: &Imu| [sample.angular_rad_s, sample.acceleration_m_s2].concat();
        for (x, y) in numbers(a).into_iter().zip(numbers(b)) {
            assert!((x - y).abs() <= 1e-6 * x.abs().max(0.1), "sample {index}: {x} {y}");
        }
        let error_ns = b.stamp_ns - a.stamp_ns - 600_000_000 - LATENCY_ERROR_NS;
        if index >= SETTLED {
            worst_ns = worst_ns.max(error_ns.abs());
        }
    }
    println!("stamps off by {:.3} ms at most", worst_ns as f64 * 1e-6);
    assert!(worst_ns < 300_000, "{worst_ns} ns");
}
