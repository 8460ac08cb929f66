//! The program as a service runs it: told to wait, watched, told to go on with the next part, told to stop.

use std::fs;
use std::io::{BufRead, BufReader};
use std::os::unix::net::UnixDatagram;
use std::process::{Child, Command, Stdio};
use std::time::Duration;

use biplane_recording::{Reader, Rig};
use rustix::process::{Pid, Signal, kill_process};

use crate::in_time::in_time;
use crate::mock::Mock;

/// What the service manager hears until a message begins so; all of it.
fn hear_until(socket: &UnixDatagram, wanted: &str) -> Vec<String> {
    let mut received = Vec::new();
    let mut bytes = [0; 4096];
    while !received.iter().any(|message: &String| message.starts_with(wanted)) {
        let count =
            socket.recv(&mut bytes).unwrap_or_else(|error| panic!("no {wanted}: {error}, {received:?}"));
        let text = String::from_utf8_lossy(&bytes[..count]).into_owned();
        received.extend(text.lines().map(str::to_owned));
    }
    received
}

fn signal(child: &Child, signal: Signal) {
    kill_process(Pid::from_child(child), signal).unwrap();
}

#[test]
fn a_service_waits_for_its_devices_tells_that_it_lives_and_ends_with_whole_parts() {
    in_time(|| {
        let mut mock = Mock::start("service", |_| {});
        let rig: Rig = mock.rig();
        let rig_path = mock.folder.join("rig.toml");
        fs::write(&rig_path, rig.to_toml()).unwrap();
        mock.end();
        let socket = UnixDatagram::bind(mock.folder.join("notify")).unwrap();
        socket.set_read_timeout(Some(Duration::from_secs(8))).unwrap();
        let mut child = Command::new(env!("CARGO_BIN_EXE_biplane-onboard"))
            .args(["record", "--wait", "--json-status", "--rotate-minutes", "60", "--rig"])
            .arg(&rig_path)
            .arg("-o")
            .arg(mock.folder.join("run.mcap"))
            .env("NOTIFY_SOCKET", mock.folder.join("notify"))
            .env("WATCHDOG_USEC", "5000000")
            .stdout(Stdio::piped())
            .stderr(Stdio::null())
            .spawn()
            .unwrap();
        // Up, though no device is there.
        let received = hear_until(&socket, "READY=1");
        assert!(received.iter().any(|message| message.starts_with("STATUS=waiting for")), "{received:?}");
        mock.serve(|_| {});
        hear_until(&socket, "STATUS=0:00:02");
        hear_until(&socket, "WATCHDOG=1");
        signal(&child, Signal::HUP);
        signal(&child, Signal::USR1);
        hear_until(&socket, "STATUS=0:00:04");
        signal(&child, Signal::TERM);
        hear_until(&socket, "STOPPING=1");
        assert_eq!(child.wait().unwrap().code(), Some(0));
        let lines = BufReader::new(child.stdout.take().unwrap()).lines();
        let objects: Vec<serde_json::Value> =
            lines.map(|line| serde_json::from_str(&line.unwrap()).unwrap()).collect();
        let (report, states) = objects.split_last().unwrap();
        let waited = states.iter().take_while(|state| state["kind"] == "waiting").count();
        let (waiting, states) = states.split_at(waited);
        assert_eq!(waiting[0]["missing"].as_array().unwrap().len(), 3, "{waiting:?}");
        assert!(states.len() >= 4 && states.iter().all(|state| state["kind"] == "status"), "{states:?}");
        assert!(states[3]["horizontal"]["rate_hz"].as_f64().unwrap() > 5.0 && states[3]["pose"].is_object());
        assert_eq!((&report["kind"], &report["end"]), (&"report".into(), &"stopped".into()));
        for part in ["run_0.mcap", "run_1.mcap"] {
            assert!(Reader::open(&mock.folder.join(part)).unwrap().messages().count() > 20, "{part}");
        }
    });
}
