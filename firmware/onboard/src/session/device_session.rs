//! What every device session is: inputs with their time in, outputs to be polled.

use crate::session::base::reading::OdometryReading;
use crate::session::event::Event;
use crate::session::inertial::reading::InertialReading;
use crate::session::lms::scan::ranges::ScanReading;

/// The longest request is the LMS configuration (41 bytes).
pub(crate) const REQUEST_CAPACITY: usize = 64;

/// Bytes of one request to a device.
pub(crate) type RequestBytes = heapless::Vec<u8, REQUEST_CAPACITY>;

/// What happens to a session.
#[derive(Copy, Clone, Debug)]
pub enum Input<'a> {
    /// A read returned these bytes; at most [`MAX_INPUT_BYTES`] at once.
    Bytes(&'a [u8]),
    /// Nothing came; time has passed.
    Time,
    /// The port does not run at this rate, bits per second, which was asked for with [`Output::SetBaud`].
    RateRefused(u32),
    /// The port was gone and is there again; nothing was heard meanwhile.
    PortBack,
    /// The device shall be left idle; [`Session::is_done`] tells when it is.
    Stop,
}

/// Longest run of bytes that a session takes in one input.
pub const MAX_INPUT_BYTES: usize = 256;

/// What a session wants done.
#[derive(Clone, PartialEq, Debug)]
#[allow(clippy::large_enum_variant)] // No heap in the acquisition path: a scan is handed on by value.
pub enum Output {
    /// Send these bytes to the device.
    Write(RequestBytes),
    /// Change the port's rate, bits per second. What the port has received by then still comes.
    SetBaud(u32),
    /// A scan has arrived.
    Scan(ScanReading),
    /// A scan of a laser that states its own time has arrived: it lies in the session until the next poll.
    TimedScan,
    /// Make the connection anew.
    Reconnect,
    /// An odometry report has arrived.
    Odometry(OdometryReading),
    /// A sample of an inertial unit has arrived.
    Inertial(InertialReading),
    /// Something worth saying happened.
    Event(Event),
    /// Nothing more until this time (nanoseconds; `i64::MAX` = until bytes come).
    WaitUntil(i64),
}

/// A device session.
pub trait Session {
    /// Takes one input at its time. Drain [`Session::poll`] afterwards.
    fn handle(&mut self, now_ns: i64, input: Input<'_>);

    /// The next thing to do.
    fn poll(&mut self) -> Output;

    /// Whether the session has nothing left to say: stopped, or its one task is done.
    fn is_done(&self) -> bool;

    /// The rate of the line now, bits per second.
    fn baud(&self) -> u32;

    /// The account of all bytes that came.
    fn counts(&self) -> biplane_wire::Counts;

    /// Outputs that were lost because nobody polled in time; 0 when every input is followed by
    /// [`Session::poll`] as it should.
    fn overflowed(&self) -> u64;
}
