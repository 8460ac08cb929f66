//! What happens to the lines of a rig, and when.

use biplane_mock::faults::Preset;
use biplane_recording::Port;

use crate::rig::devices::foreign::ForeignDevice;
use crate::rig::line::byte_faults::Harm;

/// Something that happens to one line.
#[derive(Clone, Debug, PartialEq)]
pub(crate) enum Happening {
    /// The adapter is pulled out of the computer, which notices: what is under way is lost, writes go
    /// nowhere.
    Unplug,
    /// Its port has been opened again, at the rate that was set last.
    Plug,
    /// The cable behind the adapter is pulled: nothing passes either way, and nobody says so.
    Part,
    /// It is put back.
    Join,
    /// The device loses its power.
    PowerOff,
    /// It has its power again: it starts, and is then as any device just switched on.
    PowerOn,
    /// Nothing comes from the device any more, though it hears and works.
    Mute,
    /// It is heard again.
    Unmute,
    /// Random bytes come instead of the device's.
    Babble,
    /// The device's own bytes come again.
    Clear,
    /// The line has these presets from now on, in both directions; none ends them.
    Faults(Vec<Preset>),
    /// This harm comes to bytes, once in so many on average: to those for the host and to those for the
    /// device. None ends it.
    Harm([Option<(Harm, u32)>; 2]),
    /// Another device is on the line; its own goes on elsewhere, unheard.
    ForeignDevice(ForeignDevice),
    /// Its own device is there again.
    Own,
    /// The laser runs at another rate from now on, and streams as before.
    OtherRate(u32),
}

/// Happenings in the order of their times.
#[derive(Clone, Debug, Default)]
pub(crate) struct Plan {
    happenings: Vec<(i64, Port, Happening)>,
    next: usize,
}

impl Plan {
    /// A plan; the list may be in any order.
    #[must_use]
    pub(crate) fn new(mut happenings: Vec<(i64, Port, Happening)>) -> Self {
        happenings.sort_by_key(|(at_ns, ..)| *at_ns);
        Self { happenings, next: 0 }
    }

    /// When the next one is due.
    #[must_use]
    pub(crate) fn next_ns(&self) -> i64 {
        self.happenings.get(self.next).map_or(i64::MAX, |(at_ns, ..)| *at_ns)
    }

    /// The next one that is due by `now_ns`.
    pub(crate) fn take(&mut self, now_ns: i64) -> Option<(Port, Happening)> {
        let (at_ns, port, happening) = self.happenings.get(self.next)?;
        (*at_ns <= now_ns).then(|| {
            self.next += 1;
            (*port, happening.clone())
        })
    }
}
