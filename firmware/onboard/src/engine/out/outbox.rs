//! What the driver of an engine is to fetch: commands for the serial lines, and what sessions have said.

use biplane_recording::Port;

use crate::engine::options::Command;
use crate::session::event::Event;

/// Commands and events that may wait for the driver; more than one input leads to.
pub(crate) const QUEUE_CAPACITY: usize = 128;

/// Commands and events that wait for the driver.
#[derive(Debug, Default)]
pub(crate) struct Outbox {
    commands: heapless::Deque<(Port, Command), QUEUE_CAPACITY>,
    events: heapless::Deque<(Port, Event), QUEUE_CAPACITY>,
    /// Commands that nobody fetched in time.
    pub(crate) commands_dropped: u64,
    /// The same of events.
    pub(crate) unreported: u64,
}

impl Outbox {
    pub(crate) fn command(&mut self, port: Port, command: Command) {
        self.commands_dropped += u64::from(self.commands.push_back((port, command)).is_err());
    }

    pub(crate) fn event(&mut self, port: Port, event: Event) {
        self.unreported += u64::from(self.events.push_back((port, event)).is_err());
    }

    pub(crate) fn next_command(&mut self) -> Option<(Port, Command)> {
        self.commands.pop_front()
    }

    pub(crate) fn next_event(&mut self) -> Option<(Port, Event)> {
        self.events.pop_front()
    }
}
