//! Pseudo-terminals as serial ports.

use crate::client::Client;
use crate::folder;
use biplane_mock::devices::pty::{Pty, PtyError};

fn settle(pty: &mut Pty) {
    for _ in 0..5 {
        pty.wait(1_000_000);
    }
}

#[test]
fn the_clients_speed_is_seen_and_custom_rates_are_possible() {
    let folder = folder("speed");
    let link = folder.join("laser");
    let mut pty = Pty::open(9600).expect("a terminal");
    pty.publish(&link).expect("a link");
    assert_eq!(pty.client_baud(), Some(9600));
    let client = Client::open(&link, 38_400);
    assert_eq!(pty.client_baud(), Some(38_400));
    client.set_baud(500_000);
    assert_eq!(pty.client_baud(), Some(500_000));
}

#[test]
fn a_client_gets_neither_what_was_sent_before_it_came_nor_what_the_last_one_left() {
    let folder = folder("reopen");
    let link = folder.join("laser");
    let mut pty = Pty::open(9600).expect("a terminal");
    pty.publish(&link).expect("a link");
    settle(&mut pty);
    pty.write(b"nobody");
    assert_eq!(pty.lost_bytes, 6);
    for round in 0..3 {
        let client = Client::open(&link, 9600);
        settle(&mut pty);
        assert!(pty.has_client(), "round {round}");
        pty.write(b"fresh");
        assert_eq!(client.read_until(2000, |received| received.len() >= 5), b"fresh", "round {round}");
        pty.write(b"stale");
        drop(client);
        settle(&mut pty);
        assert!(!pty.has_client(), "round {round}");
    }
}

#[test]
fn a_client_that_does_not_read_does_not_block_the_mock() {
    let folder = folder("deaf");
    let link = folder.join("laser");
    let mut pty = Pty::open(9600).expect("a terminal");
    pty.publish(&link).expect("a link");
    let _client = Client::open(&link, 9600);
    settle(&mut pty);
    for _ in 0..1000 {
        pty.write(&[0x55; 1000]);
    }
    assert!(pty.lost_bytes > 500_000);
}

#[test]
fn a_link_goes_with_its_terminal_and_a_file_in_its_place_is_left_alone() {
    let folder = folder("links");
    let (link, file) = (folder.join("laser"), folder.join("file"));
    std::fs::write(&file, "precious").expect("a file");
    let mut pty = Pty::open(9600).expect("a terminal");
    assert!(matches!(pty.publish(&file), Err(PtyError::InTheWay { .. })));
    assert_eq!(std::fs::read_to_string(&file).ok().as_deref(), Some("precious"));
    pty.publish(&link).expect("a link");
    let mut other = Pty::open(9600).expect("a terminal");
    other.publish(&link).expect("a link that replaces the first");
    drop(pty);
    assert!(link.is_symlink(), "a link that points elsewhere by now is not removed");
    drop(other);
    assert!(!link.is_symlink());
}
