//! Lines to devices: the only place that opens ports and makes connections. Each has a thread that reads and
//! stamps; writes come from the loop.

pub(crate) mod clock;
pub(crate) mod line;
pub(crate) mod port_check;
pub(crate) mod port_location;
pub(crate) mod probe;
pub(crate) mod reader;
pub(crate) mod realtime;
pub(crate) mod serial;
pub(crate) mod udev_rule;
