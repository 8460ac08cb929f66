//! How the lasers sit, as far as what they see tells: in the state of their lines, and said when it does not fit the rig.

use biplane_recording::Port;

use super::Engine;
use crate::health::LineHealth;
use crate::mounting::News;
use crate::session::Event;
use crate::sink::Sink;

impl<S: Sink> Engine<S> {
    /// Says what has come up since the last state.
    pub(super) fn tell_mounting(&mut self) {
        while let Some(News { port, suspicion, begins }) = self.mounting.news() {
            self.event(port, Event::Mounting { suspicion, begins });
        }
    }

    /// The state of a line with how its laser sits.
    pub(super) fn with_mounting(&self, port: Port, line: LineHealth) -> LineHealth {
        LineHealth { mounting: Some(self.mounting.mounting(port)), ..line }
    }
}
