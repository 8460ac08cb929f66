//! What is wrong with each line, kept until diagnostics have told it: a fault shorter than their interval is
//! told as well, and its end too.

use biplane_recording::Port;

use crate::engine::out::health::LineFault;
use crate::engine::out::health::LineHealth;
use crate::session::event::Event;

/// The faults of the lines.
#[derive(Copy, Clone, Debug, Default)]
pub(crate) struct Faults {
    lines: [Fault; Port::ALL.len()],
}

#[derive(Copy, Clone, Debug, Default)]
struct Fault {
    port_lost: bool,
    lasting: Option<&'static str>,
    /// Not told yet.
    fresh: Option<&'static str>,
}

impl Faults {
    /// Something was said of a line. False when it only follows from what was said before, so that nobody
    /// need be told.
    pub(crate) fn note(&mut self, port: Port, event: &Event) -> bool {
        let fault = &mut self.lines[port.index()];
        match event {
            Event::PortLost => fault.port_lost = true,
            Event::PortBack => fault.port_lost = false,
            _ => {}
        }
        // A device behind a port that was gone is silent, or its telegram is cut, for that reason.
        let follows = matches!(event, Event::Silent { .. } | Event::Garbled { .. })
            && fault.lasting == Event::PortLost.fault();
        // One that fell silent does not answer either: that was said, with the news that it is asked on.
        let is_known = matches!(event, Event::NotFound { .. }) && fault.lasting.is_some();
        if let Some(words) = event.fault().filter(|_| !follows) {
            fault.lasting = Some(words);
            fault.fresh = Some(words);
        }
        !follows && !is_known
    }

    /// Whether the line's port is gone.
    #[must_use]
    pub(crate) fn is_lost(&self, port: Port) -> bool {
        self.lines[port.index()].port_lost
    }

    /// The state of a line with its fault; what is over is told once.
    pub(crate) fn reported(&mut self, port: Port, line: LineHealth) -> LineHealth {
        let Fault { port_lost, lasting, fresh } = &mut self.lines[port.index()];
        let streaming = line.streaming && !*port_lost;
        if streaming && line.rate_hz > 0.0 {
            *lasting = None;
        }
        let fault = match (*lasting, fresh.take()) {
            (Some(words), _) => LineFault::Lasts(words),
            (None, Some(words)) => LineFault::Over(words),
            (None, None) => LineFault::None,
        };
        // Its end is told too, once.
        *fresh = *lasting;
        LineHealth { streaming, fault, ..line }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_fault_is_told_while_it_lasts_and_once_when_it_is_over() {
        let mut faults = Faults::default();
        let flows = LineHealth { streaming: true, rate_hz: 9.0, ..LineHealth::default() };
        let still = LineHealth { streaming: true, rate_hz: 0.0, ..flows };
        let fault = |faults: &mut Faults, line| faults.reported(Port::Base, line).fault;
        assert_eq!(fault(&mut faults, flows), LineFault::None);
        faults.note(Port::Base, &Event::PortLost);
        let words = Event::PortLost.fault().unwrap();
        assert!(faults.is_lost(Port::Base) && !faults.is_lost(Port::Horizontal));
        assert_eq!(fault(&mut faults, still), LineFault::Lasts(words));
        assert!(!faults.reported(Port::Base, still).streaming);
        faults.note(Port::Base, &Event::PortBack);
        assert!(!faults.note(Port::Base, &Event::Silent { for_ms: 3000 }), "it follows");
        assert_eq!(fault(&mut faults, still), LineFault::Lasts(words));
        assert_eq!(fault(&mut faults, flows), LineFault::Over(words));
        assert_eq!(fault(&mut faults, flows), LineFault::None);
        // What it leads to is told, and not said once more.
        let not_found = Event::NotFound { rounds: 1 };
        assert!(faults.note(Port::Vertical, &not_found), "at the start");
        assert!(faults.note(Port::Horizontal, &Event::Silent { for_ms: 1000 }));
        assert!(!faults.note(Port::Horizontal, &not_found));
        assert_eq!(
            faults.reported(Port::Horizontal, still).fault,
            LineFault::Lasts(not_found.fault().unwrap())
        );
        // Over before it could be told.
        assert!(faults.note(Port::Base, &Event::Silent { for_ms: 1000 }));
        assert_eq!(fault(&mut faults, flows), LineFault::Over("silent"));
        assert_eq!(fault(&mut faults, flows), LineFault::None);
    }
}
