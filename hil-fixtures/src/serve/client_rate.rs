//! At which line speed a client wrote bytes, although the mock reads them later.
//!
//! A pseudo-terminal tells the speed that its client has set by now, and not when that was set. A client may
//! write a request and set another speed 20 ms later (AriaCoda does). A mock that looks often enough sees the
//! bytes before that. One that the scheduler held up finds bytes and a speed that has changed since it looked
//! last; then the speed of that look counts. Times are nanoseconds on the wall.

/// A client that changes its speed behind a request waits longer than this.
const PROMPT_NS: i64 = 15_000_000;

/// The speed of a client, as it was looked at again and again.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct ClientRate {
    /// When it was looked at last, and the speed in Bd.
    last: Option<(i64, u32)>,
}

impl ClientRate {
    /// Looks at the speed `baud` that the client has now; the one at which bytes read now were written.
    pub(super) fn at_writing(&mut self, now_ns: i64, baud: u32) -> u32 {
        match self.last.replace((now_ns, baud)) {
            Some((last_ns, before)) if now_ns - last_ns > PROMPT_NS => before,
            _ => baud,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const MS: i64 = 1_000_000;

    #[test]
    fn behind_a_pause_the_speed_before_it_counts_and_else_the_present_one() {
        let mut rate = ClientRate::default();
        assert_eq!(rate.at_writing(0, 9600), 9600);
        assert_eq!(rate.at_writing(5 * MS, 38_400), 38_400);
        assert_eq!(rate.at_writing(60 * MS, 9600), 38_400);
        assert_eq!(rate.at_writing(65 * MS, 9600), 9600);
    }
}
