//! What every mock device on a line can do, without any input or output: bytes in, bytes out, each at its
//! time.
//!
//! Times are nanoseconds on one clock that the caller chooses and that never steps back.

/// What a device has done, for the summary and for tests.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct DeviceCounts {
    /// Requests with a good checksum, for this device.
    pub requests: u64,
    /// Requests answered with "refused".
    pub refused: u64,
    /// Requests with a wrong checksum.
    pub bad_checksums: u64,
    /// Scans or odometry packets sent whole.
    pub telegrams: u64,
    /// Scans or packets cut off by a request.
    pub cut: u64,
    /// Scans of the source passed over because the line was busy.
    pub skipped: u64,
    /// Bytes put on the line.
    pub bytes_sent: u64,
    /// Bytes received.
    pub bytes_received: u64,
    /// Received bytes that came at another rate than the device's, or belonged to no request.
    pub noise_bytes: u64,
    /// Times that the host kept silent for longer than the watchdog allows.
    pub watchdog: u64,
    /// Times that the power went.
    pub power_cycles: u64,
}

impl DeviceCounts {
    /// Bytes have come that the device cannot read.
    pub(crate) fn receive_noise(&mut self, count: usize) {
        self.bytes_received += count as u64;
        self.noise_bytes += count as u64;
    }
}

/// A device at the far end of a serial line.
pub trait Device: Send {
    /// Bytes arrive at `now_ns`, sent at the device's rate.
    fn handle(&mut self, now_ns: i64, bytes: &[u8]);

    /// Bytes arrive at `now_ns` that were sent at another rate: the device cannot read them.
    fn handle_noise(&mut self, now_ns: i64, count: usize);

    /// Appends the bytes that have left by `now_ns` to `out`, all at the rate [`Device::baud`] gives before
    /// the call. Returns when to call again, if nothing arrives before.
    fn poll(&mut self, now_ns: i64, out: &mut Vec<u8>) -> i64;

    /// The power comes back at `now_ns` after it was gone: everything that is not kept without power is as in
    /// a device just switched on, what waited to be sent is gone, and whatever the device says or does on its
    /// own begins after its own boot time.
    fn power_on(&mut self, now_ns: i64);

    /// Whether a device on a network takes a connection at this time.
    fn takes_connection(&mut self, _now_ns: i64) -> bool {
        true
    }

    /// A client has connected to a device on a network.
    fn connected(&mut self, _now_ns: i64) {}

    /// The connection is gone.
    fn disconnected(&mut self, _now_ns: i64) {}

    /// Rate of the line in Bd; 0 where any will do (network, USB).
    fn baud(&self) -> u32;

    /// Whether the device sends its measurements unasked.
    fn is_streaming(&self) -> bool;

    /// What has happened so far.
    fn counts(&self) -> DeviceCounts;
}
