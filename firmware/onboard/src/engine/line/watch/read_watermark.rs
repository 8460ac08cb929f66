//! How far each line has been listened to.
//!
//! A host that stood still for a moment (a process that was stopped, a machine with too much to do) finds
//! bytes in its ports that are older than its clock. Before they are read nobody knows whether a device was
//! silent. So a session's time passes only as far as its line has been read; the engine's own goes on.

use biplane_recording::Port;

use crate::session::device_session::Input;

/// The times of the lines.
#[derive(Copy, Clone, Debug)]
pub(crate) struct ReadWatermark {
    /// What came until then has been given to the session.
    up_to_ns: [i64; Port::ALL.len()],
    /// The session has lived until then.
    lived_ns: [i64; Port::ALL.len()],
}

impl Default for ReadWatermark {
    fn default() -> Self {
        Self { up_to_ns: [i64::MAX; Port::ALL.len()], lived_ns: [i64::MIN; Port::ALL.len()] }
    }
}

impl ReadWatermark {
    /// Everything that came on a line until `up_to_ns` has been given to its session.
    pub(crate) fn listened(&mut self, port: Port, up_to_ns: i64) {
        self.up_to_ns[port.index()] = up_to_ns;
    }

    /// For how long nobody had listened when a read returned, nanoseconds; 0 for a line that is always
    /// listened to.
    pub(crate) fn unheard_ns(&self, port: Port, read_ns: i64) -> i64 {
        read_ns.saturating_sub(self.up_to_ns[port.index()]).max(0)
    }

    /// Whether what is due at this time is due on a line that was listened to until then.
    pub(crate) fn is_due(&self, port: Port, wait_ns: i64) -> bool {
        wait_ns <= self.up_to_ns[port.index()]
    }

    /// The time at which a session gets an input. Bytes are there now; time without bytes has passed only as
    /// far as was listened.
    pub(crate) fn session_ns(&mut self, now_ns: i64, port: Port, input: &Input<'_>) -> i64 {
        let place = port.index();
        let passed_ns = match input {
            Input::Time => now_ns.min(self.up_to_ns[place]),
            _ => now_ns,
        };
        self.lived_ns[place] = self.lived_ns[place].max(passed_ns);
        self.lived_ns[place]
    }
}
