//! Ports that go, come back, or do not have a rate.

use biplane_recording::Port;

use super::Engine;
use crate::session::{Event, Input};
use crate::sink::Sink;

impl<S: Sink> Engine<S> {
    /// The port of a line has gone. Its session stands still until [`Engine::port_back`]: nobody would hear it.
    pub fn port_lost(&mut self, now_ns: i64, port: Port) {
        self.begin(now_ns);
        self.event(port, Event::PortLost);
    }

    /// The port of a line does not run at the rate that a command asked for.
    pub fn rate_refused(&mut self, now_ns: i64, port: Port, baud: u32) {
        let now_ns = self.begin(now_ns);
        self.input(now_ns, port, Input::RateRefused(baud));
    }

    /// The port of a line is there again. Its session sets its rate, and listens first whether the device still streams.
    pub fn port_back(&mut self, now_ns: i64, port: Port) {
        let now_ns = self.begin(now_ns);
        self.event(port, Event::PortBack);
        self.input(now_ns, port, Input::PortBack);
        self.settle(now_ns);
    }
}
