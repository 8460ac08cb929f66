//! In a recording: reports of a session that somebody else left open, which the live run did not take either.

use biplane_wire::p2os::Command;

/// Whether what comes belongs to somebody else's session.
#[derive(Copy, Clone, Debug, Default)]
pub(super) struct Foreign {
    /// A report was taken, or the base was opened: whatever comes from now on is taken.
    has_run: bool,
    /// Since our host began to synchronise, and until that is answered: reports since something was sent.
    reports: Option<u32>,
}

impl Foreign {
    /// What a host sent. One that begins to synchronise takes no report before that was answered, unless it had run. A PULSE has the same
    /// bytes, but a report before it is answered by no CLOSE.
    pub(super) fn host_sent(&mut self, bytes: &[u8]) {
        let mut sync = [0; 64];
        let is_sync = Command::Sync(0).emit(&mut sync).is_ok_and(|length| sync[..length] == *bytes);
        self.reports = match self.reports {
            None if is_sync && !self.has_run => Some(0),
            Some(reports) if is_sync && reports > 0 => None,
            reports => reports.map(|_| 0),
        };
    }

    /// A report came; whether it is of somebody else's session.
    pub(super) fn owns_report(&mut self) -> bool {
        self.reports = self.reports.map(|reports| reports.saturating_add(1));
        self.has_run |= self.reports.is_none();
        self.reports.is_some()
    }

    /// The base has said its names: it is opened anew.
    pub(super) fn opened(&mut self) {
        self.has_run = true;
        self.reports = None;
    }
}
