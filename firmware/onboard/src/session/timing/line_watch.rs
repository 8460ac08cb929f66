//! What a serial line has brought last: a byte, and the end of a reply of lines. Times are nanoseconds.

/// When bytes and replies came.
#[derive(Copy, Clone, Debug, Default)]
pub(crate) struct LineWatch {
    last_byte_ns: i64,
    reply_since_ns: i64,
    /// The last byte ended a line.
    ended_line: bool,
}

impl LineWatch {
    /// Nothing that came before counts.
    pub(crate) fn begin(&mut self, now_ns: i64) {
        *self = Self { last_byte_ns: now_ns, reply_since_ns: now_ns, ended_line: false };
    }

    /// Bytes have come; an empty line ends a reply.
    pub(crate) fn take(&mut self, now_ns: i64, bytes: &[u8]) {
        for byte in bytes {
            let ends_line = *byte == b'\n';
            if ends_line && self.ended_line {
                self.reply_since_ns = now_ns;
            }
            self.ended_line = ends_line;
            self.last_byte_ns = now_ns;
        }
    }

    /// When the last byte came.
    #[must_use]
    pub(crate) fn last_byte_ns(&self) -> i64 {
        self.last_byte_ns
    }

    /// When the last reply ended, so that the next one may have begun.
    #[must_use]
    pub(crate) fn reply_since_ns(&self) -> i64 {
        self.reply_since_ns
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn an_empty_line_ends_a_reply_wherever_reads_are_cut() {
        let mut watch = LineWatch::default();
        watch.begin(5);
        let times = |watch: &LineWatch| (watch.last_byte_ns(), watch.reply_since_ns());
        watch.take(10, b"99b\n");
        assert_eq!(times(&watch), (10, 5));
        watch.take(20, b"");
        assert_eq!(times(&watch), (10, 5));
        watch.take(30, b"\nMD");
        assert_eq!(times(&watch), (30, 30));
        watch.take(40, b"00\n0");
        assert_eq!(times(&watch), (40, 30));
    }
}
