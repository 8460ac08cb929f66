//! How far each line has been listened to.
//!
//! A host that stood still for a moment (a process that was stopped, a machine with too much to do) finds bytes in its ports that are older
//! than its clock. Before they are read nobody knows whether a device was silent. So a session's time passes only as far as its line has been
//! read; the engine's own goes on.

use biplane_recording::Port;

use super::Engine;
use crate::session::{Input, Session};
use crate::sink::Sink;

/// The times of the lines.
#[derive(Copy, Clone, Debug)]
pub struct Heard {
    /// What came until then has been given to the session.
    up_to_ns: [i64; Port::ALL.len()],
    /// The session has lived until then.
    lived_ns: [i64; Port::ALL.len()],
}

impl Default for Heard {
    fn default() -> Self {
        Self { up_to_ns: [i64::MAX; Port::ALL.len()], lived_ns: [i64::MIN; Port::ALL.len()] }
    }
}

fn index(port: Port) -> usize {
    Port::ALL.iter().position(|&other| other == port).unwrap_or_default()
}

impl Heard {
    /// For how long nobody had listened when a read returned, nanoseconds; 0 for a line that is always listened to.
    pub(super) fn unheard_ns(&self, port: Port, read_ns: i64) -> i64 {
        read_ns.saturating_sub(self.up_to_ns[index(port)]).max(0)
    }

    fn is_due(&self, port: Port, wait_ns: i64) -> bool {
        wait_ns <= self.up_to_ns[index(port)]
    }

    /// The time at which a session gets an input. Bytes are there now; time without bytes has passed only as far as was listened.
    fn session_ns(&mut self, now_ns: i64, port: Port, input: &Input<'_>) -> i64 {
        let place = index(port);
        let passed_ns = match input {
            Input::Time => now_ns.min(self.up_to_ns[place]),
            _ => now_ns,
        };
        self.lived_ns[place] = self.lived_ns[place].max(passed_ns);
        self.lived_ns[place]
    }
}

impl<S: Sink> Engine<S> {
    /// Everything that came on a line until `up_to_ns` has been given to [`Engine::bytes`]: said before a read, how old its bytes may be. What is due later on this line waits for the next
    /// such word. A line of which this is never said is always listened to.
    pub fn heard(&mut self, port: Port, up_to_ns: i64) {
        self.heard.up_to_ns[index(port)] = up_to_ns;
    }

    /// When a session wants to be asked again; one without a port does not, and not before it is known what came until then.
    pub(super) fn line_wait_ns(&self, port: Port) -> i64 {
        let wait_ns = match port {
            _ if self.faults.is_lost(port) => i64::MAX,
            Port::Horizontal => self.horizontal.line.wait_ns(),
            Port::Vertical => self.vertical.as_ref().map_or(i64::MAX, |vertical| vertical.line.wait_ns()),
            Port::Base => self.base.wait_ns(),
        };
        if self.heard.is_due(port, wait_ns) { wait_ns } else { i64::MAX }
    }

    pub(super) fn input(&mut self, now_ns: i64, port: Port, input: Input<'_>) {
        let session_ns = self.heard.session_ns(now_ns, port, &input);
        match port {
            Port::Horizontal => self.horizontal.line.session.handle(session_ns, input),
            Port::Vertical => match &mut self.vertical {
                Some(vertical) => vertical.line.session.handle(session_ns, input),
                None => return,
            },
            Port::Base => self.base.session.handle(session_ns, input),
        }
        self.drain(now_ns, port);
    }
}
