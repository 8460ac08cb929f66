//! MCAP files: read, walked for all they hold, and salvaged.

use std::io::{Read, Write};
use std::path::Path;

use biplane_recording::{AnyMessage, ReadError, Reader, capture, recover_over};

use super::messages::writes_back;
use crate::inputs::making::memory_file::{MemoryFile, Scratch};

/// The most that a chunk may unpack to; more is refused before it is unpacked
/// (`protocol/recording/src/mcap/chunk.rs`).
const LARGEST_CHUNK: u64 = 1 << 28;

/// Reading ends with an error or at the end; a file that reads to its end is salvaged without loss, and what
/// is salvaged of any file is a whole file of as many messages as the report says.
pub(super) fn file(input: &[u8]) {
    let file = MemoryFile::of(input);
    let read = read(&file.path());
    if let Ok(reader) = Reader::open_unfinished(&file.path()) {
        let before_the_break = reader.messages().take_while(Result::is_ok).count();
        if let Ok(messages) = &read {
            assert_eq!(*messages, before_the_break);
        }
        let _ = (reader.profile(), reader.library());
    }
    let salvaged = Scratch::new();
    if let Ok(report) = recover_over(&file.path(), &salvaged.0, true) {
        let kept = read_all(&salvaged.0).expect("what was salvaged is whole");
        assert_eq!(kept, report.messages, "messages of the report");
        let _ = report.to_string();
        if let Ok(messages) = read {
            assert!(
                kept >= messages as u64 || report.lost(),
                "{messages} read, {kept} salvaged, and no loss told"
            );
        }
    }
}

/// All that a file holds; how many messages.
fn read(path: &Path) -> Result<usize, ReadError> {
    let reader = Reader::open(path)?;
    let _ = (reader.metadata(), reader.attachment_names(), reader.rig());
    let mut count = 0;
    for entry in reader.messages() {
        let entry = entry?;
        count += 1;
        let _ = capture::serial_bytes(&entry);
        if let Ok(message) = entry.decode()
            && message != AnyMessage::Other
        {
            writes_back(&entry.type_name, &message);
        }
    }
    Ok(count)
}

/// How many messages a file holds.
pub(super) fn read_all(path: &Path) -> Result<u64, ReadError> {
    let reader = Reader::open(path)?;
    let mut count = 0;
    for entry in reader.messages() {
        entry?;
        count += 1;
    }
    Ok(count)
}

/// Bytes that the packed parts of a file really unpack to, wherever they stand in it, up to what a chunk may.
pub(super) fn unpacked(input: &[u8]) -> usize {
    const ZSTD: [u8; 4] = [0x28, 0xB5, 0x2F, 0xFD];
    const LZ4: [u8; 4] = [0x04, 0x22, 0x4D, 0x18];
    let mut bytes = 0;
    for (at, window) in input.windows(4).enumerate() {
        if window == ZSTD {
            bytes += zstd::stream::read::Decoder::with_buffer(&input[at..]).map_or(0, length);
        } else if window == LZ4 {
            bytes += lz4::Decoder::new(&input[at..]).map_or(0, length);
        }
    }
    bytes
}

fn length(packed: impl Read) -> usize {
    /// Counts what is written.
    struct Count(usize);
    impl Write for Count {
        fn write(&mut self, bytes: &[u8]) -> std::io::Result<usize> {
            self.0 += bytes.len();
            Ok(bytes.len())
        }
        fn flush(&mut self) -> std::io::Result<()> {
            Ok(())
        }
    }
    let mut count = Count(0);
    // What came before an error counts too.
    let _ = std::io::copy(&mut packed.take(LARGEST_CHUNK), &mut count);
    count.0
}
