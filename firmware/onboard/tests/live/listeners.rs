//! What the process opens towards a network: nothing unless asked, and then one door that this machine alone
//! can reach.

use std::fs;
use std::net::{IpAddr, Ipv4Addr};
use std::process::{Child, Command, Stdio};
use std::thread::sleep;
use std::time::Duration;

use crate::in_time::in_time;
use crate::mock::Mock;

/// Stops the process when a test ends, however it ends.
struct Running(Child);

impl Drop for Running {
    fn drop(&mut self) {
        let _ = self.0.kill();
        let _ = self.0.wait();
    }
}

/// Numbers of the sockets that a process holds but for pairs of its own: local ones without a name, through
/// which its signals come.
fn sockets(pid: u32) -> Vec<String> {
    let local = fs::read_to_string(format!("/proc/{pid}/net/unix")).unwrap();
    let rows = local.lines().map(|line| line.split_whitespace().collect::<Vec<_>>());
    // Columns of `unix` in proc_pid_net(5): the seventh is the number, an eighth is there where it has a
    // name.
    let own: Vec<&str> = rows.filter(|row| row.len() == 7).map(|row| row[6]).collect();
    let descriptors = fs::read_dir(format!("/proc/{pid}/fd")).unwrap();
    let links = descriptors.filter_map(|entry| fs::read_link(entry.unwrap().path()).ok());
    links
        .filter_map(|link| Some(link.to_str()?.strip_prefix("socket:[")?.strip_suffix(']')?.to_owned()))
        .filter(|socket| !own.contains(&socket.as_str()))
        .collect()
}

/// Local address and port of a TCP socket that listens, by its number (Linux: proc_pid_net(5), columns of
/// `tcp`).
fn listening(pid: u32, socket: &str) -> Option<(IpAddr, u16)> {
    let table = fs::read_to_string(format!("/proc/{pid}/net/tcp")).unwrap();
    let row = table
        .lines()
        .map(|line| line.split_whitespace().collect::<Vec<_>>())
        .find(|row| row.get(9) == Some(&socket) && row.get(3) == Some(&"0A"))?;
    let (address, port) = row[1].split_once(':')?;
    let address = u32::from_str_radix(address, 16).ok()?;
    Some((Ipv4Addr::from(u32::from_be(address)).into(), u16::from_str_radix(port, 16).ok()?))
}

/// Records the mock until its recording grows.
fn record(mock: &Mock, name: &str, words: &[&str]) -> Running {
    let rig_path = mock.folder.join("rig.toml");
    fs::write(&rig_path, mock.rig().to_toml()).unwrap();
    let output = mock.folder.join(name);
    let child = Command::new(env!("CARGO_BIN_EXE_biplane-onboard"))
        .args(["record", "--rig"])
        .arg(&rig_path)
        .arg("-o")
        .arg(&output)
        .args(words)
        .stdout(Stdio::null())
        .stderr(Stdio::null())
        .spawn()
        .unwrap();
    let running = Running(child);
    let active = output.with_extension("mcap.active");
    for _ in 0..100 {
        if fs::metadata(&active).is_ok_and(|file| file.len() > 10_000) {
            return running;
        }
        sleep(Duration::from_millis(100));
    }
    panic!("nothing is recorded in ten seconds");
}

#[test]
fn a_recording_opens_no_socket_unless_asked_and_then_one_on_this_machine_alone() {
    in_time(|| {
        let mock = Mock::start("listeners", |_| {});
        let plain = record(&mock, "plain.mcap", &[]);
        assert_eq!(sockets(plain.0.id()), [""; 0], "sockets without --live");
        drop(plain);
        // A port alone, as `--live` with nothing more: the address is the one by default.
        let live = record(&mock, "live.mcap", &["--live", ":0"]);
        let held = sockets(live.0.id());
        let doors: Vec<_> = held.iter().map(|socket| listening(live.0.id(), socket)).collect();
        assert!(
            matches!(doors[..], [Some((IpAddr::V4(Ipv4Addr::LOCALHOST), 1..))]),
            "with --live there are {held:?}, listening at {doors:?}"
        );
    });
}
