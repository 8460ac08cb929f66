//! Files that broke in every way that we could think of, at every byte or at seeded places: nothing panics,
//! nothing damaged is taken for good, nothing that is whole is lost, and what is lost is said.
//!
//! What is whole is told by the index of the `mcap` crate: the chunks that the damage did not touch.

use std::collections::BTreeSet;
use std::io::Cursor;
use std::path::Path;

use crate::damage::{Damage, Dice, KINDS, seeds};
use crate::folder::Folder;
use crate::samples::{odometry, scan, write_run};
use biplane_recording::recover;
use biplane_recording::{
    AnyMessage, Entry, Message, ReadError, Reader, RecoverError, RecoverReport, WriterOptions,
};

/// A message as it stands in a file.
type Key = (String, i64, i64, u32, Vec<u8>);

fn key(entry: Entry) -> Key {
    (entry.topic_name, entry.log_time_ns, entry.publish_time_ns, entry.sequence, entry.bytes)
}

/// A whole file, and where what stands in it.
struct Whole {
    name: &'static str,
    bytes: Vec<u8>,
    all: BTreeSet<Key>,
    /// Where each chunk begins and ends, and what is in it.
    chunks: Vec<(usize, usize, Vec<Key>)>,
}

impl Whole {
    fn new(name: &'static str, bytes: Vec<u8>) -> Self {
        let summary = mcap::Summary::read(&bytes).unwrap().unwrap();
        let mut chunks = Vec::new();
        for index in &summary.chunk_indexes {
            let messages = summary.stream_chunk(&bytes, index).unwrap().map(|message| {
                let message = message.unwrap();
                let times = (message.log_time as i64, message.publish_time as i64);
                (message.channel.topic.clone(), times.0, times.1, message.sequence, message.data.into_owned())
            });
            let start = index.chunk_start_offset as usize;
            chunks.push((start, start + index.chunk_length as usize, messages.collect::<Vec<_>>()));
        }
        assert!(chunks.len() > 2, "{name}");
        let all = chunks.iter().flat_map(|(_, _, keys)| keys.iter().cloned()).collect();
        Self { name, bytes, all, chunks }
    }

    /// Messages in chunks that the damage has not touched, as far as what they are can be known: their
    /// definitions stand in the first chunk, and in the index.
    fn untouched(&self, damage: &Damage) -> impl Iterator<Item = &Key> {
        let is_whole =
            |start: usize, end: usize| damage.touched.iter().all(|hit| hit.end <= start || end <= hit.start);
        let (first, last) = (&self.chunks[0], &self.chunks[self.chunks.len() - 1]);
        let is_known = is_whole(first.0, first.1) || is_whole(last.1, self.bytes.len());
        let whole = self.chunks.iter().filter(move |(start, end, _)| is_known && is_whole(*start, *end));
        whole.flat_map(|(_, _, keys)| keys)
    }
}

/// Our own, small and larger; and as other writers pack: not at all, and by lz4.
fn wholes(folder: &Folder) -> Vec<Whole> {
    let path = folder.file("whole.mcap");
    let ours = |steps, chunk_span_ns| {
        let options = WriterOptions { overwrite: true, chunk_span_ns, ..WriterOptions::default() };
        write_run(&path, steps, &options).unwrap().finish().unwrap();
        std::fs::read(&path).unwrap()
    };
    vec![
        Whole::new("small", ours(4, 40_000_000)),
        Whole::new("large", ours(70, 300_000_000)),
        Whole::new("plain", foreign(None)),
        Whole::new("lz4", foreign(Some(mcap::Compression::Lz4))),
    ]
}

fn foreign(compression: Option<mcap::Compression>) -> Vec<u8> {
    let mut bytes = Cursor::new(Vec::new());
    let options = mcap::WriteOptions::new().compression(compression).chunk_size(Some(4000)).profile("ros2");
    let mut writer = options.create(&mut bytes).unwrap();
    let mut channel = |name: &str, topic: &str| {
        let schema = writer.add_schema(name, "ros2msg", b"# text").unwrap();
        writer.add_channel(schema, topic, "cdr", &Default::default()).unwrap()
    };
    let odom = channel("nav_msgs/msg/Odometry", "/odom");
    let laser = channel("sensor_msgs/msg/LaserScan", "/scan/horizontal");
    let mut cdr = Vec::new();
    for number in 0..20 {
        for channel_id in [odom, laser] {
            if channel_id == odom {
                odometry(number).encode(&mut cdr);
            } else {
                scan(number, "laser").encode(&mut cdr);
            }
            let time = u64::from(number) * 1000;
            let header = mcap::records::MessageHeader {
                channel_id,
                sequence: number,
                log_time: time,
                publish_time: time,
            };
            writer.write_to_known_channel(&header, &cdr).unwrap();
        }
    }
    writer.finish().unwrap();
    drop(writer);
    bytes.into_inner()
}

/// Reads it all; what comes before an error is as it was written, and without an error nothing is missing.
fn judge_reader(whole: &Whole, damage: &Damage, path: &Path) {
    let Ok(reader) = Reader::open(path) else { return };
    let _ = (reader.rig(), reader.metadata(), reader.attachment_names());
    let mut count = 0;
    for entry in reader.messages() {
        let Ok(entry) = entry else { return };
        let _ = entry.decode();
        assert!(
            whole.all.contains(&key(entry)),
            "{}: {}: the reader takes what was never written",
            whole.name,
            damage.what
        );
        count += 1;
    }
    let same = count >= whole.all.len() || damage.moved;
    assert!(same, "{}: {}: {count} of {} messages and no error", whole.name, damage.what, whole.all.len());
}

/// Gives how many messages are lost of those in chunks that are not whole any more, and whether a damaged one
/// was kept.
fn judge_recovery(whole: &Whole, damage: &Damage, folder: &Folder) -> (usize, bool) {
    let (input, output) = (folder.file("broken.mcap"), folder.file("saved.mcap"));
    let _ = std::fs::remove_file(&output);
    let recovered = recover(&input, &output);
    assert!(std::fs::read(&input).unwrap() == damage.bytes, "{}: {}: touched", whole.name, damage.what);
    let context = format!("{}: {}", whole.name, damage.what);
    let report = match recovered {
        Ok(report) => report,
        Err(RecoverError::Read(ReadError::NotMcap { .. })) => RecoverReport::default(),
        Err(error) => panic!("{context}: {error}"),
    };
    let entries = match output.exists() {
        true => Reader::open(&output).unwrap().messages().collect::<Result<Vec<_>, _>>().unwrap(),
        false => Vec::new(),
    };
    let kept: BTreeSet<Key> = entries.into_iter().map(key).collect();
    for message in whole.untouched(damage) {
        assert!(kept.contains(message), "{context}: a whole message at {} ns is lost: {report}", message.1);
    }
    let missing = whole.all.difference(&kept).count();
    assert!(missing == 0 || report.lost() || !output.exists(), "{context}: {missing} missing: {report}");
    let damaged = kept.difference(&whole.all).next();
    if let Some(damaged) = damaged {
        println!("{context}: kept though damaged: {} at {} ns; {report}", damaged.0, damaged.1);
    }
    (missing, damaged.is_some())
}

fn judge(whole: &Whole, damage: &Damage, folder: &Folder) -> (usize, bool) {
    let path = folder.file("broken.mcap");
    std::fs::write(&path, &damage.bytes).unwrap();
    judge_reader(whole, damage, &path);
    judge_recovery(whole, damage, folder)
}

#[test]
fn a_small_file_cut_at_every_byte_gives_every_chunk_before_the_cut() {
    let folder = Folder::new("every-byte");
    let whole = wholes(&folder).swap_remove(0);
    // Every byte in the long run; here those near the ends of chunks, and a spread.
    let border = |place: &usize| {
        whole.chunks.iter().any(|chunk| chunk.0.abs_diff(*place) < 20 || chunk.1.abs_diff(*place) < 20)
    };
    let all = std::env::var_os("BIPLANE_SEEDS").is_some();
    let places: Vec<_> =
        (0..whole.bytes.len()).filter(|place| all || place % 331 == 0 || border(place)).collect();
    for &length in &places {
        let (_, damaged) = judge(&whole, &Damage::cut(&whole.bytes, length), &folder);
        assert!(!damaged, "cut at {length}");
    }
    println!("| cut at every byte | {} |", places.len());
}

#[test]
fn files_damaged_at_seeded_places_lose_only_what_was_hit_and_say_so() {
    let folder = Folder::new("seeded-damage");
    let wholes = wholes(&folder);
    for (name, damage) in KINDS {
        let (mut trials, mut lost, mut damaged) = (0, 0, 0);
        for seed in seeds(5) {
            for (number, whole) in wholes.iter().enumerate() {
                let dice = &mut Dice::new(seed * 8 + number as u64);
                let damage = damage(&whole.bytes, dice);
                let (missing, is_damaged) = judge(whole, &damage, &folder);
                // Other bytes at the end of a chunk that is not packed (or has no sums within) and was cut:
                // nothing tells them from data.
                let is_ambiguous = damage.invented_end && matches!(whole.name, "plain" | "lz4");
                assert!(!is_damaged || is_ambiguous, "seed {seed}: {}: {}", whole.name, damage.what);
                trials += 1;
                lost += missing;
                damaged += usize::from(is_damaged);
            }
        }
        println!("| {name} | {trials} | {lost} messages in what was hit | {damaged} |");
    }
}

#[test]
fn what_is_no_recording_is_told_in_one_line() {
    let folder = Folder::new("not-ours");
    let zip = [b"PK\x03\x04".as_slice(), &[20; 3000]].concat();
    let png = [b"\x89PNG\r\n\x1a\n\0\0\0\rIHDR".as_slice(), &[7; 3000]].concat();
    let table: [(&str, &[u8]); 6] = [
        ("empty", b""),
        ("text", b"PARAM robot 1\nFLASER 180 1 2 3\n"),
        ("zip", &zip),
        ("png", &png),
        ("zeros", &[0; 100_000]),
        ("half a mark", b"\x89MCAP"),
    ];
    for (name, bytes) in table {
        let path = folder.file(name);
        std::fs::write(&path, bytes).unwrap();
        for error in [
            Reader::open(&path).unwrap_err().to_string(),
            recover(&path, &folder.file("saved.mcap")).unwrap_err().to_string(),
        ] {
            assert!(
                error.contains(name) && error.contains("is not an MCAP file") && error.lines().count() == 1,
                "{error}"
            );
        }
        assert!(!folder.file("saved.mcap").exists());
    }
}

#[test]
fn numbers_that_promise_too_much_are_not_believed() {
    let folder = Folder::new("promises");
    let whole = wholes(&folder).swap_remove(1);
    let mut cdr = Vec::new();
    scan(1, "laser").encode(&mut cdr);
    // Every count in a message.
    for place in 0..cdr.len() - 4 {
        for claim in [u32::MAX, 1 << 31, 1 << 20, 0] {
            let mut bytes = cdr.clone();
            bytes[place..place + 4].copy_from_slice(&claim.to_le_bytes());
            if let Ok(AnyMessage::Scan(scan)) = AnyMessage::decode("sensor_msgs/msg/LaserScan", &bytes) {
                assert!(
                    scan.ranges_m.len() * 4 + scan.intensities.len() * 4 + scan.frame_id.len() <= bytes.len()
                );
            }
        }
    }
    // A sparse file whose records claim all of it.
    let path = folder.file("broken.mcap");
    for opcode in [0x01, 0x05, 0x06, 0x09, 0x0C, 0x66] {
        let mut bytes = whole.bytes[..whole.chunks[1].1].to_vec();
        let claim: u64 = 300 << 20;
        bytes.push(opcode);
        bytes.extend((claim - 9).to_le_bytes());
        std::fs::write(&path, &bytes).unwrap();
        let file = std::fs::File::options().write(true).open(&path).unwrap();
        file.set_len(bytes.len() as u64 + claim).unwrap();
        let _ = std::fs::remove_file(folder.file("saved.mcap"));
        let report = recover(&path, &folder.file("saved.mcap")).unwrap();
        let promised = whole.chunks[0].2.len() + whole.chunks[1].2.len();
        assert!(report.lost() && report.messages as usize >= promised, "{opcode:02x}: {report}");
        assert!(peak_kb() < 200_000, "{opcode:02x}: {} kB of memory", peak_kb());
        assert!(Reader::open(&path).is_err(), "{opcode:02x}");
    }
}

/// The most memory that this process has had, kB.
fn peak_kb() -> u64 {
    let status = std::fs::read_to_string("/proc/self/status").unwrap();
    let line = status.lines().find(|line| line.starts_with("VmHWM:")).unwrap();
    line.split_whitespace().nth(1).unwrap().parse().unwrap()
}
