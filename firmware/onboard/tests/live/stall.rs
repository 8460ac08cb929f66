//! A host that stands still for a second, and a device that does while the run ends.

use std::fs;
use std::path::Path;
use std::process::{Child, Command, Stdio};
use std::sync::atomic::AtomicBool;
use std::thread;
use std::time::Duration;

use biplane_onboard::{ReplayOptions, replay};
use biplane_recording::Topic;
use biplane_recording::messages::{LaserScan, Odometry};
use rustix::process::{Pid, Signal, kill_process};

use crate::in_time::in_time;
use crate::mock::{Mock, all};

fn signal(child: &Child, signal: Signal) {
    kill_process(Pid::from_child(child), signal).unwrap();
}

fn sleep_ms(ms: u64) {
    thread::sleep(Duration::from_millis(ms));
}

#[test]
fn a_run_that_stood_still_for_a_second_calls_nobody_silent_and_keeps_what_came_meanwhile() {
    in_time(|| {
        let mock = Mock::start("stood-still", |_| {});
        let rig_path = mock.folder.join("rig.toml");
        fs::write(&rig_path, mock.rig().to_toml()).unwrap();
        let run = mock.folder.join("run.mcap");
        let child = Command::new(env!("CARGO_BIN_EXE_biplane-onboard"))
            .args(["record", "--raw", "--duration", "9s", "--rig"])
            .arg(&rig_path)
            .arg("-o")
            .arg(&run)
            .stdout(Stdio::null())
            .stderr(Stdio::piped())
            .spawn()
            .unwrap();
        sleep_ms(4000);
        for _ in 0..2 {
            signal(&child, Signal::STOP);
            sleep_ms(1150);
            signal(&child, Signal::CONT);
            sleep_ms(700);
        }
        let output = child.wait_with_output().unwrap();
        let log = String::from_utf8_lossy(&output.stderr);
        assert!(output.status.success() && !log.contains("silent") && !log.contains("no intact"), "{log}");
        let again = mock.folder.join("again.mcap");
        replay(&ReplayOptions::new(&run, &again), &AtomicBool::new(false)).unwrap();
        let counts = |path: &Path| {
            let scans =
                [Topic::ScanHorizontal, Topic::ScanVertical].map(|topic| all::<LaserScan>(path, topic).len());
            (scans, all::<Odometry>(path, Topic::Odom).len())
        };
        assert_eq!(counts(&run), counts(&again));
    });
}

#[test]
fn who_is_silent_when_the_run_ends_is_named() {
    in_time(|| {
        let mut mock = Mock::start("silent-end", |_| {});
        let rig_path = mock.folder.join("rig.toml");
        fs::write(&rig_path, mock.rig().to_toml()).unwrap();
        let child = Command::new(env!("CARGO_BIN_EXE_biplane-onboard"))
            .args(["record", "--rig"])
            .arg(&rig_path)
            .arg("-o")
            .arg(mock.folder.join("run.mcap"))
            .stdout(Stdio::null())
            .stderr(Stdio::piped())
            .spawn()
            .unwrap();
        sleep_ms(4000);
        // Their adapters go, and the devices with them: nobody can be asked to stop.
        mock.end();
        sleep_ms(300);
        signal(&child, Signal::INT);
        let output = child.wait_with_output().unwrap();
        let log = String::from_utf8_lossy(&output.stderr);
        for device in ["horizontal laser", "vertical laser", "base"] {
            assert!(log.contains(&format!("{device}: did not answer when asked to stop")), "{log}");
        }
    });
}
