//! A serial line: when its bytes are on it, what may happen to them, and when the computer gets them.

mod channel;
mod latency_timer;
mod reads;
mod timing;

pub use channel::{Arrival, Channel, Fault, garble};
pub(crate) use latency_timer::LatencyTimer;
pub use latency_timer::LatencyTimerParams;
pub use reads::{Adapter, ReadParams, SerialRead};
pub use timing::{laser_byte_ns, scans_per_telegram, transfer_ns};
