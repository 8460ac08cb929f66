//! Every error says what was expected, what was found, and at which byte.

mod cases;

use biplane_wire::WireError;
use biplane_wire::lms::{Reply, Request, Status, Telegram, checksum};
use biplane_wire::p2os::{self, Packet};
use cases::bytes;

/// A reply around these bytes (code and data), its checksum good.
fn reply_around(body: &[u8]) -> Vec<u8> {
    let mut bytes = vec![0x02, 0x80];
    bytes.extend((body.len() as u16 + 1).to_le_bytes());
    bytes.extend(body);
    bytes.push(Status::OK.0);
    bytes.extend(checksum(&bytes).to_le_bytes());
    bytes
}

/// A packet around this body, its checksum good.
fn packet_around(body: &[u8]) -> Vec<u8> {
    let mut bytes = vec![0xFA, 0xFB, body.len() as u8 + 2];
    bytes.extend(body);
    bytes.extend(p2os::checksum(body).to_be_bytes());
    bytes
}

fn lms_error(bytes: &[u8]) -> WireError {
    match Telegram::parse(bytes) {
        Err(error) => error,
        Ok(telegram) if telegram.status().is_some() => telegram.reply().unwrap_err(),
        Ok(telegram) => telegram.request().unwrap_err(),
    }
}

fn p2os_error(bytes: &[u8]) -> WireError {
    Packet::parse(bytes).and_then(|packet| packet.report()).unwrap_err()
}

#[test]
fn a_bad_telegram_is_described() {
    let table = [
        ("02 80 03 00 A0", "telegram is cut: 9 bytes needed, 5 found"),
        ("02 80", "telegram is cut: 4 bytes needed, 2 found"),
        ("02 80 03 00 A0 00 10 16 0A 00 00", "11 bytes where the telegram has 9"),
        ("03 80 03 00 A0 00 10 16 0A", "byte 0 is 03h, expected 02h"),
        ("02 80 01 00 A0 00 10 16 0A", "length field at byte 2 is 1, expected at least 2"),
        ("02 00 00 00 A0 00 10 16 0A", "length field at byte 2 is 0, expected at least 1"),
        ("02 80 03 00 A0 01 10 16 0A", "checksum at byte 7 is 0A16h, the bytes give 0B14h"),
    ];
    for (line, expected) in table {
        assert_eq!(lms_error(&bytes(line)).to_string(), expected, "{line}");
    }
}

#[test]
fn a_bad_field_in_a_good_frame_is_described() {
    let table: &[(&[u8], &str)] = &[
        (&[0xA0], "telegram is cut: 6 bytes needed, 5 found"),
        (&[0xA0, 0, 0], "7 bytes where the telegram has 6"),
        (&[0x91, 0], "6 bytes where the telegram has 5"),
        (&[0xBB, 2, 180, 0, 100, 0], "accepted is 2 (byte 5)"),
        (&[0xB0, 0x01, 0xC0, 0, 0], "unit of the count word is 3 (byte 5)"),
        (&[0xB7, 1, 0, 2, 0, 0x92, 0x01], "values of a scan: 402 where at most 401 fit (byte 9)"),
        (&[0xB0, 0x00, 0x02], "values of a scan: 512 where at most 401 fit (byte 5)"),
        (&[0xB0, 0x02, 0x00, 1, 2], "telegram is cut: 11 bytes needed, 9 found"),
        (&[0xB0, 0x01, 0x00, 1, 2, 3], "telegram is cut: 11 bytes needed, 10 found"),
        (&[0xB1, 0x01], "telegram is cut: 157 bytes needed, 6 found"),
        (&[0xB2, 0x01], "telegram is cut: 7 bytes needed, 6 found"),
    ];
    for (body, expected) in table {
        assert_eq!(lms_error(&reply_around(body)).to_string(), *expected, "{body:02X?}");
    }
    let long = [&[0xF4][..], &[0; 65]].concat();
    assert_eq!(
        lms_error(&reply_around(&long)).to_string(),
        "configuration: 65 where at most 64 fit (byte 5)"
    );
}

#[test]
fn a_bad_packet_is_described() {
    let table = [
        ("FA FA 03 00 00 00", "byte 1 is FAh, expected FBh"),
        ("FA FB 02 00 00 00", "length field at byte 2 is 2, expected at least 3"),
        ("FA FB 03 00 00", "telegram is cut: 6 bytes needed, 5 found"),
        ("FA FB 03 01 00 02", "checksum at byte 4 is 0002h, the bytes give 0001h"),
    ];
    for (line, expected) in table {
        assert_eq!(p2os_error(&bytes(line)).to_string(), expected, "{line}");
    }
    assert_eq!(
        p2os_error(&packet_around(&[0x32; 19])).to_string(),
        "telegram is cut: 23 bytes needed, 22 found"
    );
    let mut sip = [0; 25];
    (sip[0], sip[19]) = (0x33, 2);
    assert_eq!(p2os_error(&packet_around(&sip)).to_string(), "telegram is cut: 29 bytes needed, 28 found");
    assert_eq!(
        p2os_error(&packet_around(b"\x02Kurt\0Pioneer")).to_string(),
        "telegram is cut: 17 bytes needed, 16 found"
    );
}

#[test]
fn a_telegram_of_the_other_direction_is_described() {
    let reply = bytes("02 80 02 00 91 10 79 30");
    assert_eq!(
        Telegram::parse(&reply).unwrap().request().unwrap_err().to_string(),
        "address 80h is that of a reply, expected a request"
    );
    let request = bytes("02 00 01 00 10 34 12");
    assert_eq!(
        Telegram::parse(&request).unwrap().reply().unwrap_err().to_string(),
        "address 00h is that of a request, expected a reply"
    );
}

#[test]
fn a_buffer_too_small_is_described() {
    let error = Request::Reset.emit(0, &mut [0; 3]).unwrap_err();
    assert_eq!(error.to_string(), "7 bytes to write, but the buffer has 3");
    let raw = Reply::Raw { code: 0xC0, data: &[0; 70_000] };
    let error = raw.emit(0x80, Status::OK, &mut [0; 80_000]).unwrap_err();
    assert_eq!(error.to_string(), "telegram length: 70002 where at most 65535 fit (byte 2)");
}
