//! ROS 1 bags (format V2.0), front to back: neither the index nor the chunk information at the end is needed,
//! so that a bag whose recorder was killed reads as far as it goes.

use std::collections::BTreeMap;
use std::fs::File;
use std::io::{self, BufReader, Read};
use std::path::Path;

use super::channel::{Channel, Kind, LONGEST_MESSAGE, RawMessage, Visit};
use super::losses::Losses;
use super::ros1_records::{Broken, Record, Records, field};
use crate::recordings::import::bag::error::BagError;

/// How a bag begins.
pub(crate) const MAGIC: &[u8] = b"#ROSBAG V2.0\n";

const MESSAGE: u8 = 2;
const BAG_HEADER: u8 = 3;
const CHUNK: u8 = 5;
const CONNECTION: u8 = 7;

/// Visits the messages of a bag.
pub(crate) fn read(
    file: File,
    path: &Path,
    losses: &mut Losses,
    visit: &mut Visit<'_>,
) -> Result<(), BagError> {
    let failed = |source| BagError::Read { path: path.to_owned(), source };
    let size = file.metadata().map_err(failed)?.len();
    let mut input = BufReader::with_capacity(1 << 18, file);
    input.read_exact(&mut [0; MAGIC.len()]).map_err(failed)?;
    let mut walk = Walk { path, losses, visit, channels: BTreeMap::new(), nobodys: 0, first_nobody: 0 };
    let ended = walk.file(Records::new(input, MAGIC.len() as u64), size);
    let (nobodys, first) = (walk.nobodys, walk.first_nobody);
    if nobodys > 0 {
        losses.add(path, &format!("{nobodys} messages of connection {first} or others that are not defined"));
    }
    match ended {
        Ok(()) | Err(Broken::Stopped) => Ok(()),
        Err(Broken::Io(source)) => Err(failed(source)),
        Err(broken) => {
            losses.add(path, &words(&broken));
            Ok(())
        }
    }
}

fn words(broken: &Broken) -> String {
    match broken {
        Broken::CutOff(offset) => format!("cut off in the record at byte {offset}"),
        Broken::Damaged(offset, what) => format!("{what} at byte {offset}; what follows is lost"),
        Broken::Io(error) => error.to_string(),
        Broken::Stopped => "stopped".to_owned(),
    }
}

struct Walk<'a, 'b> {
    path: &'a Path,
    losses: &'a mut Losses,
    visit: &'a mut Visit<'b>,
    channels: BTreeMap<u32, Channel>,
    /// Messages whose connection is not defined, and the first such connection.
    nobodys: u64,
    first_nobody: u32,
}

impl Walk<'_, '_> {
    fn file(&mut self, mut records: Records<BufReader<File>>, size: u64) -> Result<(), Broken> {
        while let Some(record) = records.next()? {
            match record.op() {
                Some(CHUNK) => {
                    let inside = records.within(&record, size, |data| self.chunk(&record, data))?;
                    match inside {
                        Ok(()) => {}
                        Err(Broken::Stopped) => return Err(Broken::Stopped),
                        Err(broken) => self.lose_in_chunk(&record, &broken),
                    }
                }
                Some(BAG_HEADER) if record.field("encryptor").is_some_and(|name| !name.is_empty()) => {
                    return Err(Broken::Damaged(record.offset, "an encrypted bag, which is not read"));
                }
                Some(CONNECTION | MESSAGE) => self.record(&mut records, &record)?,
                _ => records.within(&record, size, |_| ())?,
            }
        }
        Ok(())
    }

    fn lose_in_chunk(&mut self, chunk: &Record, broken: &Broken) {
        let what = match broken {
            Broken::CutOff(offset) => format!("its data ends in the record at its byte {offset}"),
            Broken::Damaged(offset, what) => format!("{what} at its byte {offset}"),
            Broken::Io(error) => error.to_string(),
            Broken::Stopped => return,
        };
        let text = format!("chunk at byte {}: {what}; the rest of it is lost", chunk.offset);
        self.losses.add(self.path, &text);
    }

    /// The records of a chunk, unpacked as they are read.
    fn chunk(&mut self, chunk: &Record, data: &mut impl Read) -> Result<(), Broken> {
        let compression = chunk.field("compression").unwrap_or(b"none");
        match compression {
            b"none" => self.inside(chunk, data),
            b"bz2" => self.inside(chunk, bzip2::read::BzDecoder::new(data)),
            b"lz4" => self.inside(chunk, lz4::Decoder::new(data).map_err(Broken::Io)?),
            other => {
                let text = format!("compression {:?} is not known", String::from_utf8_lossy(other));
                Err(Broken::Io(io::Error::other(text)))
            }
        }
    }

    fn inside(&mut self, chunk: &Record, data: impl Read) -> Result<(), Broken> {
        // Unpackers are asked for many bytes at a time.
        let mut records = Records::new(BufReader::with_capacity(1 << 16, data), 0);
        while let Some(record) = records.next()? {
            self.record(&mut records, &record)?;
        }
        let (found, announced) = (records.passed(), chunk.u32("size").map_or(0, u64::from));
        if found == announced {
            return Ok(());
        }
        let text = format!("{found} bytes in it, {announced} announced");
        Err(Broken::Io(io::Error::other(text)))
    }

    /// A record that is no chunk.
    fn record<R: Read>(&mut self, records: &mut Records<R>, record: &Record) -> Result<(), Broken> {
        match record.op() {
            Some(CONNECTION) => {
                let data = records.take(record.length, record.offset)?;
                self.connection(record, &data);
                Ok(())
            }
            Some(MESSAGE) => self.message(records, record),
            _ => records.skip(record),
        }
    }

    fn connection(&mut self, record: &Record, data: &[u8]) {
        let text = |bytes: Option<&[u8]>| String::from_utf8_lossy(bytes.unwrap_or_default()).into_owned();
        let Some(id) = record.u32("conn") else { return };
        let topic = record.field("topic").filter(|name| !name.is_empty()).or(field(data, "topic"));
        let (type_name, md5sum) = (text(field(data, "type")), text(field(data, "md5sum")));
        self.channels.entry(id).or_insert_with(|| Channel::ros1(&text(topic), &type_name, &md5sum));
    }

    fn message<R: Read>(&mut self, records: &mut Records<R>, record: &Record) -> Result<(), Broken> {
        let id = record.u32("conn").unwrap_or(u32::MAX);
        let Some(channel) = self.channels.get(&id) else {
            self.first_nobody = if self.nobodys == 0 { id } else { self.first_nobody };
            self.nobodys += 1;
            return records.skip(record);
        };
        // Seconds in the low half, nanoseconds in the high one.
        let time = record.u64("time").unwrap_or_default();
        let received_ns = (time & 0xFFFF_FFFF) as i64 * 1_000_000_000 + (time >> 32) as i64;
        let is_taken = channel.kind != Kind::Other;
        let is_long = u64::from(record.length) > LONGEST_MESSAGE;
        let bytes = if is_taken && !is_long {
            records.take(record.length, record.offset)?
        } else {
            records.skip(record)?;
            Vec::new()
        };
        if is_taken && is_long {
            let what = format!("a message of {} bytes on {}", record.length, channel.topic);
            self.losses.add(self.path, &what);
            return Ok(());
        }
        let message = RawMessage { channel, received_ns, bytes: &bytes };
        if (self.visit)(&message).is_break() { Err(Broken::Stopped) } else { Ok(()) }
    }
}
