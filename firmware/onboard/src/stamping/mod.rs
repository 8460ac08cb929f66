//! From read times to the time at which a telegram's first byte left its device.
//!
//! A read returns some time after its last byte was on the line: late by what the adapter adds (about 0.3 ms,
//! now and then 8 ms, with a latency timer 16 ms, in a stall 300 ms), never early. Three things remove most
//! of that. [`Arrivals`] takes, over all reads that a telegram came in, the earliest departure that fits the
//! line's rate, and tells what it is worth. [`Envelope`] is the line that no departure lies below, with the
//! device's own rate. [`CycleClock`] counts the device's cycles between departures, and stamps each with its
//! cycle on that line; a device that states its own time has a [`DeviceClock`](device_clock::DeviceClock)
//! instead. All is causal: a stamp uses what has arrived, nothing later. Units: nanoseconds of the
//! host's time; byte offsets since the port was opened. Model and figures: `docs/time.md`.

pub(crate) mod arrivals;
pub(crate) mod cycle_clock;
pub(crate) mod cycle_params;
pub(crate) mod departure;
pub(crate) mod device_clock;
pub(crate) mod envelope;
pub(crate) mod mean_interval;
pub(crate) mod regularity;
#[cfg(test)]
mod tests;
