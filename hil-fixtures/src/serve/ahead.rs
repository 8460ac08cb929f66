//! Scans measured ahead of time, on a thread of their own: casting the rays of a scan takes milliseconds, in which a port's thread
//! could not send.
//!
//! The next scan is expected as far behind the last as that was behind the one before. A wrong guess costs time, never a wrong scan: a
//! source's scan depends on what is asked alone. Times are nanoseconds on the source's clock.

use crate::source::{ScanSource, ScanWords};
use std::sync::mpsc::{Receiver, Sender, channel};

/// What was asked: t0, field of view, step, millimetres.
type Asked = (i64, u16, u16, bool);

/// A source behind a thread that measures the scan that will probably be asked for next.
pub struct AheadSource {
    asks: Sender<Asked>,
    scans: Receiver<Option<ScanWords>>,
    /// What the thread works on, or has ready.
    pending: Option<Asked>,
    last: Option<Asked>,
}

impl AheadSource {
    /// Moves the source to a thread, which ends with this value.
    #[must_use]
    pub fn new(mut source: impl ScanSource + 'static) -> Self {
        let (asks, asked) = channel::<Asked>();
        let (answer, scans) = channel();
        std::thread::spawn(move || {
            for (t0_ns, fov_deg, resolution_cdeg, mm) in asked {
                if answer.send(source.scan(t0_ns, fov_deg, resolution_cdeg, mm)).is_err() {
                    break;
                }
            }
        });
        Self { asks, scans, pending: None, last: None }
    }

    fn ask(&mut self, asked: Asked) {
        self.pending = self.asks.send(asked).is_ok().then_some(asked);
    }
}

impl ScanSource for AheadSource {
    fn scan(&mut self, t0_ns: i64, fov_deg: u16, resolution_cdeg: u16, mm: bool) -> Option<ScanWords> {
        let asked = (t0_ns, fov_deg, resolution_cdeg, mm);
        if self.pending.is_some_and(|pending| pending != asked) {
            let _ = self.scans.recv();
            self.pending = None;
        }
        if self.pending.is_none() {
            self.ask(asked);
        }
        let scan = self.scans.recv().ok().flatten();
        let step_ns = self.last.map(|(last_ns, ..)| t0_ns - last_ns).filter(|step_ns| *step_ns > 0);
        self.last = Some(asked);
        self.pending = None;
        if let Some(step_ns) = step_ns {
            self.ask((t0_ns.saturating_add(step_ns), fov_deg, resolution_cdeg, mm));
        }
        scan
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
    }

    #[test]
    fn every_scan_is_the_one_that_was_asked_for_whatever_was_guessed() {
        let mut source = AheadSource::new(Echo);
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
        assert_eq!(source.scan(-1, 180, 50, true), None);
    }
}
