//! A text log line by line, with line numbers; memory stays bounded whatever the file holds.

use std::fs::File;
use std::io::{self, BufRead, BufReader, Read};
use std::path::Path;

/// The longest line that is read, bytes: a hundred times a CARMEN scan of 361 beams.
const LONGEST: usize = 1 << 18;

/// One line of a log.
pub(crate) enum LogLine<'a> {
    /// Its text; bytes that are no UTF-8 are replaced.
    Text(std::borrow::Cow<'a, str>),
    /// The line is longer than any line of a log; it was skipped.
    TooLong,
}

/// Reads lines one by one.
pub(crate) struct LogLines {
    input: BufReader<File>,
    buffer: Vec<u8>,
    number: usize,
}

impl LogLines {
    /// Opens a file.
    pub(crate) fn open(path: &Path) -> io::Result<Self> {
        let input = BufReader::with_capacity(1 << 18, File::open(path)?);
        Ok(Self { input, buffer: Vec::new(), number: 0 })
    }

    /// The next line and its number from 1; `None` at the end.
    pub(crate) fn next(&mut self) -> io::Result<Option<(usize, LogLine<'_>)>> {
        self.buffer.clear();
        let limit = LONGEST as u64 + 1;
        let read = self.input.by_ref().take(limit).read_until(b'\n', &mut self.buffer)?;
        if read == 0 {
            return Ok(None);
        }
        self.number += 1;
        if read > LONGEST && self.buffer.last() != Some(&b'\n') {
            self.skip_rest()?;
            return Ok(Some((self.number, LogLine::TooLong)));
        }
        Ok(Some((self.number, LogLine::Text(String::from_utf8_lossy(&self.buffer)))))
    }

    fn skip_rest(&mut self) -> io::Result<()> {
        loop {
            self.buffer.clear();
            let read = self.input.by_ref().take(LONGEST as u64).read_until(b'\n', &mut self.buffer)?;
            if read == 0 || self.buffer.last() == Some(&b'\n') {
                return Ok(());
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::{LONGEST, LogLine, LogLines};

    #[test]
    fn lines_keep_their_numbers_across_one_that_is_far_too_long() {
        let path = std::env::temp_dir().join(format!("biplane-lines-{}", std::process::id()));
        let mut bytes = b"one\n".to_vec();
        bytes.resize(bytes.len() + 3 * LONGEST, b'7');
        bytes.extend_from_slice(b"\nthr\xFFee\nfour");
        std::fs::write(&path, bytes).unwrap();
        let mut lines = LogLines::open(&path).unwrap();
        let mut seen = Vec::new();
        while let Some((number, line)) = lines.next().unwrap() {
            seen.push((
                number,
                match line {
                    LogLine::Text(text) => text.trim_end().to_owned(),
                    LogLine::TooLong => "too long".to_owned(),
                },
            ));
        }
        let expected = [(1, "one"), (2, "too long"), (3, "thr\u{FFFD}ee"), (4, "four")];
        assert_eq!(seen, expected.map(|(number, text)| (number, text.to_owned())));
        std::fs::remove_file(path).unwrap();
    }
}
