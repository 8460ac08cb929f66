//! Scans measured ahead of time, on a thread of their own: casting the rays of a scan takes milliseconds, in
//! which a port's thread could not send.
//!
//! The next scan is expected as far behind the last as that was behind the one before. A wrong guess costs
//! time, never a wrong scan: a source's scan depends on what is asked alone. Times are nanoseconds on the
//! source's clock.

use crate::rig::source::{ScanSource, ScanWords};
use std::sync::mpsc::{Receiver, Sender, channel};

/// What was asked.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
struct Asked {
    t0_ns: i64,
    what: What,
    mm: bool,
}

#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum What {
    /// A scan: field of view and step.
    Scan(u16, u16),
    /// A turn: its quarter.
    Turn(u8),
}

impl Asked {
    fn of(self, source: &mut impl ScanSource) -> Option<ScanWords> {
        match self.what {
            What::Scan(fov_deg, resolution_cdeg) => {
                source.scan(self.t0_ns, fov_deg, resolution_cdeg, self.mm)
            }
            What::Turn(quarter) => source.turn(self.t0_ns, quarter, self.mm),
        }
    }

    /// The one as far behind this as this is behind the one before.
    fn next_after(self, before: Self) -> Option<Self> {
        let step_ns = Some(self.t0_ns - before.t0_ns).filter(|step_ns| *step_ns > 0)?;
        let what = match (self.what, before.what) {
            (What::Turn(now), What::Turn(before)) => What::Turn((2 * now + 4 - before) % 4),
            (what, _) => what,
        };
        Some(Self { t0_ns: self.t0_ns.saturating_add(step_ns), what, ..self })
    }
}

/// A source behind a thread that measures the scan that will probably be asked for next.
pub(super) struct AheadSource {
    asks: Sender<Asked>,
    scans: Receiver<Option<ScanWords>>,
    /// What the thread works on, or has ready.
    pending: Option<Asked>,
    last: Option<Asked>,
}

impl AheadSource {
    /// Moves the source to a thread, which ends with this value.
    ///
    /// # Errors
    /// When the system gives no thread.
    pub(super) fn new(mut source: impl ScanSource + 'static) -> std::io::Result<Self> {
        let (asks, asked) = channel::<Asked>();
        let (answer, scans) = channel();
        std::thread::Builder::new().spawn(move || {
            for asked in asked {
                if answer.send(asked.of(&mut source)).is_err() {
                    break;
                }
            }
        })?;
        Ok(Self { asks, scans, pending: None, last: None })
    }

    fn ask(&mut self, asked: Asked) {
        self.pending = self.asks.send(asked).is_ok().then_some(asked);
    }
}

impl AheadSource {
    fn get(&mut self, asked: Asked) -> Option<ScanWords> {
        if self.pending.is_some_and(|pending| pending != asked) {
            let _ = self.scans.recv();
            self.pending = None;
        }
        if self.pending.is_none() {
            self.ask(asked);
        }
        let scan = self.scans.recv().ok().flatten();
        self.pending = None;
        if let Some(next) = self.last.and_then(|last| asked.next_after(last)) {
            self.ask(next);
        }
        self.last = Some(asked);
        scan
    }
}

impl ScanSource for AheadSource {
    fn scan(&mut self, t0_ns: i64, fov_deg: u16, resolution_cdeg: u16, mm: bool) -> Option<ScanWords> {
        self.get(Asked { t0_ns, what: What::Scan(fov_deg, resolution_cdeg), mm })
    }

    fn turn(&mut self, t0_ns: i64, quarter: u8, mm: bool) -> Option<ScanWords> {
        self.get(Asked { t0_ns, what: What::Turn(quarter), mm })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Its words tell what was asked.
    struct Echo;

    impl ScanSource for Echo {
        fn scan(&mut self, t0_ns: i64, fov_deg: u16, resolution_cdeg: u16, mm: bool) -> Option<ScanWords> {
            let words = [u16::try_from(t0_ns).ok()?, fov_deg, resolution_cdeg, u16::from(mm)];
            Some(words.into_iter().collect())
        }

        fn turn(&mut self, t0_ns: i64, quarter: u8, _: bool) -> Option<ScanWords> {
            Some([u16::try_from(t0_ns).ok()?, u16::from(quarter)].into_iter().collect())
        }
    }

    #[test]
    fn every_scan_is_the_one_that_was_asked_for_whatever_was_guessed() {
        let mut source = AheadSource::new(Echo).unwrap();
        let asks = [
            (10, 180, 50),
            (20, 180, 50),
            (30, 180, 50),
            (35, 180, 50),
            (40, 100, 25),
            (5, 180, 50),
            (15, 180, 100),
        ];
        for (t0_ns, fov_deg, resolution_cdeg) in asks {
            let expected = Echo.scan(t0_ns, fov_deg, resolution_cdeg, true);
            assert_eq!(source.scan(t0_ns, fov_deg, resolution_cdeg, true), expected);
        }
        for (t0_ns, quarter) in [(20, 0), (30, 2), (40, 0), (50, 2), (60, 0), (61, 1), (62, 2)] {
            assert_eq!(source.turn(t0_ns, quarter, true), Echo.turn(t0_ns, quarter, true));
        }
        assert_eq!(source.scan(-1, 180, 50, true), None);
    }
}
