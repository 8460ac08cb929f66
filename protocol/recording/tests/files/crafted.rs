//! Files put together byte by byte, each with one thing that no writer of ours would do.

use crate::folder::Folder;
use crate::samples::odometry;
use biplane_recording::mcap::recover::Problem;
use biplane_recording::recover;
use biplane_recording::{Entry, Message, ReadError, Reader, RecoverReport};
use std::io::Read;
use std::path::PathBuf;

const MAGIC: &[u8] = b"\x89MCAP0\r\n";

fn record(opcode: u8, body: &[u8]) -> Vec<u8> {
    [&[opcode][..], &(body.len() as u64).to_le_bytes(), body].concat()
}

fn string(text: &str) -> Vec<u8> {
    [&(text.len() as u32).to_le_bytes()[..], text.as_bytes()].concat()
}

fn schema(id: u16, name: &str) -> Vec<u8> {
    let body = [&id.to_le_bytes()[..], &string(name), &string("ros2msg"), &string("")].concat();
    record(0x03, &body)
}

fn channel(id: u16, schema: u16, topic: &str) -> Vec<u8> {
    let ids = [id.to_le_bytes(), schema.to_le_bytes()].concat();
    record(0x04, &[&ids[..], &string(topic), &string("cdr"), &0u32.to_le_bytes()].concat())
}

fn message(channel: u16, log_time: u64, data: &[u8]) -> Vec<u8> {
    let body = [
        &channel.to_le_bytes()[..],
        &7u32.to_le_bytes(),
        &log_time.to_le_bytes(),
        &log_time.to_le_bytes(),
        data,
    ];
    record(0x05, &body.concat())
}

/// A chunk of times 10 to 20 whose checksum is not given.
fn chunk(compression: &str, unpacked_size: u64, packed: &[u8]) -> Vec<u8> {
    let times = [10u64.to_le_bytes(), 20u64.to_le_bytes(), unpacked_size.to_le_bytes()].concat();
    let size = (packed.len() as u64).to_le_bytes();
    record(0x06, &[&times[..], &0u32.to_le_bytes(), &string(compression), &size, packed].concat())
}

fn plain_chunk(records: &[Vec<u8>]) -> Vec<u8> {
    let bytes = records.concat();
    chunk("", bytes.len() as u64, &bytes)
}

/// Everything around the data: magic, header, end of data without checksum, footer, magic.
fn file(data: &[Vec<u8>]) -> Vec<u8> {
    let header = record(0x01, &[string("ros2"), string("hand")].concat());
    let end = [record(0x0F, &[0; 4]), record(0x02, &[0; 20])].concat();
    [MAGIC, &header, &data.concat(), &end, MAGIC].concat()
}

fn odom() -> Vec<u8> {
    [schema(1, "nav_msgs/msg/Odometry"), channel(1, 1, "/odom")].concat()
}

fn encoded() -> Vec<u8> {
    let mut bytes = Vec::new();
    odometry(1).encode(&mut bytes);
    bytes
}

/// Where a stretch begins in a file.
fn find(bytes: &[u8], part: &[u8]) -> usize {
    bytes.windows(part.len()).position(|window| window == part).unwrap()
}

struct Case {
    folder: Folder,
    path: PathBuf,
}

impl Case {
    fn new(name: &str, bytes: &[u8]) -> Self {
        let folder = Folder::new(name);
        let path = folder.file("crafted.mcap");
        std::fs::write(&path, bytes).unwrap();
        Self { folder, path }
    }

    /// The messages before the error, and the error's words.
    fn read(&self) -> (usize, String) {
        let mut count = 0;
        for entry in Reader::open(&self.path).unwrap().messages() {
            match entry {
                Ok(_) => count += 1,
                Err(error) => return (count, error.to_string()),
            }
        }
        (count, String::new())
    }

    fn recover(&self) -> (RecoverReport, Vec<Entry>) {
        let output = self.folder.file("saved.mcap");
        let report = recover(&self.path, &output).unwrap();
        let entries = Reader::open(&output).unwrap().messages().collect::<Result<_, _>>().unwrap();
        (report, entries)
    }
}

#[test]
fn a_crafted_file_that_is_right_is_read() {
    let case = Case::new("right", &file(&[plain_chunk(&[odom(), message(1, 10, &encoded())])]));
    assert_eq!(case.read(), (1, String::new()));
    let (report, entries) = case.recover();
    assert_eq!((report.exit_code(), entries.len()), (0, 1), "{report}");
}

#[test]
fn what_a_chunk_may_not_hold_is_an_error_at_its_place() {
    let good = message(1, 10, &encoded());
    let cut = good[..good.len() - 3].to_vec();
    let table = [
        ("cut", plain_chunk(&[odom(), good.clone(), cut.clone()]), 1, "its chunk ends inside a record"),
        (
            "channel",
            plain_chunk(&[odom(), good.clone(), message(9, 10, b"")]),
            1,
            "a message of channel 9, which is not defined",
        ),
        (
            "schema",
            plain_chunk(&[channel(2, 5, "/x")]),
            0,
            "channel \"/x\" of schema 5, which is not defined",
        ),
        ("short", plain_chunk(&[odom(), record(0x05, b"short")]), 0, "a message record that cannot be read"),
        ("packing", chunk("rar", 9, b"123456789"), 0, "compression \"rar\" is not known"),
        ("claim", chunk("zstd", u64::MAX, b"123456789"), 0, "chunk of 18446744073709551615 bytes"),
        ("size", chunk("", 5, b"123456789"), 0, "chunk of 6 bytes where 5 were announced"),
        ("broken", chunk("zstd", 50, b"123456789"), 0, "compressed bytes are broken"),
        ("lz4", chunk("lz4", 50, b"123456789"), 0, "compressed bytes are broken"),
    ];
    for (name, chunk, count, words) in table {
        let bytes =
            file(&[record(0x0C, &[string("m"), 0u32.to_le_bytes().to_vec()].concat()), chunk.clone()]);
        let (found, error) = Case::new(name, &bytes).read();
        assert_eq!(found, count, "{name}: {error}");
        let place = format!("is damaged at byte {}: ", find(&bytes, &chunk));
        assert!(error.contains(&place) && error.contains(words), "{name}: {error}\n{place}{words}");
    }
}

#[test]
fn a_chunk_that_unpacks_to_more_than_it_says_is_not_followed() {
    let bomb = zstd::stream::encode_all(std::io::repeat(0).take(50_000_000), 1).unwrap();
    assert!(bomb.len() < 50_000);
    let (count, error) = Case::new("bomb", &file(&[chunk("zstd", 1000, &bomb)])).read();
    assert_eq!(count, 0);
    assert!(error.contains("chunk of 1001 bytes where 1000 were announced"), "{error}");
}

#[test]
fn a_file_without_an_end_of_data_is_an_error() {
    let whole = file(&[plain_chunk(&[odom(), message(1, 10, &encoded())])]);
    let end = find(&whole, &record(0x0F, &[0; 4]));
    let bytes = [&whole[..end], &whole[end + 13..]].concat();
    let case = Case::new("no-end", &bytes);
    let (count, error) = case.read();
    assert!(count == 1 && error.contains("the data does not end before the footer"), "{error}");
    let (report, entries) = case.recover();
    assert_eq!((report.exit_code(), entries.len()), (3, 1), "{report}");
}

#[test]
fn bytes_behind_the_end_are_an_error_with_their_place() {
    let whole = file(&[]);
    let case = Case::new("behind", &[&whole[..], b"more"].concat());
    match Reader::open(&case.path) {
        Err(ReadError::Damaged { offset, .. }) => assert_eq!(offset as usize, whole.len() - MAGIC.len()),
        other => panic!("{other:?}"),
    }
    let (report, _) = case.recover();
    assert_eq!(report.exit_code(), 0, "{report}");
}

#[test]
fn a_length_that_swallows_what_follows_is_not_believed() {
    let good = |time| plain_chunk(&[message(1, time, &encoded())]);
    let first = plain_chunk(&[odom(), message(1, 10, &encoded())]);
    let bytes = file(&[first.clone(), good(11), good(12), good(13)]);
    let second = find(&bytes, &good(11));
    for opcode in [0x06, 0x07, 0x0C, 0x09, 0x03, 0x04, 0x05, 0x55] {
        // From the second chunk on, one record that claims to reach into the last.
        let mut damaged = bytes.clone();
        damaged[second] = opcode;
        damaged[second + 1..second + 9].copy_from_slice(&(good(11).len() as u64 * 2 + 20).to_le_bytes());
        let (report, entries) = Case::new("swallow", &damaged).recover();
        assert!(entries.len() >= 3, "{opcode:02x}: {report}");
        assert_eq!(report.exit_code(), 3, "{opcode:02x}: {report}");
    }
}

#[test]
fn the_front_of_a_cut_chunk_is_kept_as_far_as_it_makes_sense() {
    let (good, late) = (message(1, 15, &encoded()), message(1, 21, &encoded()));
    let nonsense = message(1, 15, &[9; 40]);
    for (name, odd) in [("late", late), ("nonsense", nonsense)] {
        let records = [odom(), good.clone(), good.clone(), odd, good.clone(), good.clone()];
        let bytes = file(&[plain_chunk(&records)]);
        let cut = find(&bytes, &record(0x0F, &[0; 4])) - 5;
        let (report, entries) = Case::new(name, &bytes[..cut]).recover();
        assert_eq!(entries.len(), 2, "{name}: {report}");
        assert!(matches!(report.findings[0].problem, Problem::CutChunk), "{report}");
        assert_eq!(report.findings[0].missing_bytes, 5, "{report}");
    }
}

#[test]
fn a_chunk_damaged_in_length_and_content_gives_nothing() {
    let packed = zstd::stream::encode_all(&[odom(), message(1, 10, &encoded())].concat()[..], 1).unwrap();
    let size = [odom(), message(1, 10, &encoded())].concat().len() as u64;
    let mut first = chunk("zstd", size, &packed);
    // The checksum is another, and the length says more than the file has.
    first[9 + 24] = 1;
    let bytes = file(&[first.clone(), plain_chunk(&[odom(), message(1, 11, &encoded())])]);
    let mut damaged = bytes.clone();
    damaged[find(&bytes, &first) + 7] = 0xFF;
    let (report, entries) = Case::new("both", &damaged).recover();
    assert_eq!(entries.len(), 1, "{report}");
    assert_eq!(entries[0].log_time_ns, 11);
    assert!(matches!(report.findings[0].problem, Problem::DamagedChunk { .. }), "{report}");
    // With the right checksum and only the length wrong, all is kept.
    let mut damaged =
        file(&[chunk("zstd", size, &packed), plain_chunk(&[odom(), message(1, 11, &encoded())])]);
    damaged[find(&bytes, &first) + 7] = 0xFF;
    let (report, entries) = Case::new("length", &damaged).recover();
    assert_eq!((entries.len(), report.exit_code()), (2, 3), "{report}");
}

#[test]
fn a_wrong_checksum_over_all_data_alone_costs_nothing_but_is_said() {
    let mut bytes = file(&[plain_chunk(&[odom(), message(1, 10, &encoded())])]);
    let end = find(&bytes, &record(0x0F, &[0; 4]));
    bytes[end + 9] = 1;
    let (report, entries) = Case::new("sum", &bytes).recover();
    assert_eq!((entries.len(), report.exit_code()), (1, 3), "{report}");
    assert_eq!(report.findings[0].problem, Problem::Checksum);
}
