//! Ports that go, come back, or do not have a rate; devices that are to be left idle.

use biplane_recording::Port;

use super::Engine;
use crate::session::{Event, Input, Session};
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

    /// Whether all sessions are done that have a port.
    #[must_use]
    pub fn is_stopped(&self) -> bool {
        Port::ALL.into_iter().all(|port| self.faults.is_lost(port) || self.is_done(port))
    }

    /// The devices that were told to stop, or could not be told, and of which nobody knows whether they did.
    pub fn unstopped(&self) -> impl Iterator<Item = Port> {
        Port::ALL.into_iter().filter(|&port| !self.is_done(port))
    }

    fn is_done(&self, port: Port) -> bool {
        match port {
            Port::Horizontal => self.horizontal.line.session.is_done(),
            Port::Vertical => self.vertical.as_ref().is_none_or(|laser| laser.line.session.is_done()),
            Port::Base => self.base.session.is_done(),
        }
    }
}
