//! The client of a simulated laser: what it asks and when, and what it hears. Times are nanoseconds.

use crate::devices::device::Device;
use crate::simulate::SimulateError;
use crate::simulate::times::Times;
use biplane_wire::cola::{Dialect, Kind, Scan, Telegram, emit_byte};
use biplane_wire::scip::{Command, Request, ScanRequest};

/// From the capture's start, or the end of the start-up, to the request for scans: the first one was then
/// measured behind it.
const ASK_AFTER_NS: i64 = 100_000_000;
/// Longer than any request.
const MAX_REQUEST_BYTES: usize = 256;
/// Requests of [`scip_requests`], each of which has one reply.
pub(super) const SCIP_REQUESTS: usize = 3;

/// Bytes that had left by a time.
pub(super) type Output = (i64, Vec<u8>);

/// Who it is, then scans.
pub(super) fn cola_requests(
    dialect: Option<Dialect>,
    times: &Times,
) -> Result<Vec<(i64, Vec<u8>)>, SimulateError> {
    let dialect = dialect.unwrap_or(Dialect::B);
    let mut on = [0; 1];
    let length = emit_byte(1, dialect, &mut on)?;
    let ask = |kind, name, data| {
        let telegram = Telegram { dialect, kind, name, data };
        let mut bytes = vec![0; telegram.encoded_len()];
        telegram.emit(&mut bytes).map(|_| bytes)
    };
    Ok(vec![
        (0, ask(Kind::Read, b"DeviceIdent", None)?),
        (times.stream_ns + ASK_AFTER_NS, ask(Kind::Subscribe, Scan::NAME, on.get(..length))?),
    ])
}

/// Who it is, how it measures, then scans.
pub(super) fn scip_requests(scans: ScanRequest, times: &Times) -> Result<Vec<(i64, Vec<u8>)>, SimulateError> {
    let ask = |command| {
        let mut bytes = vec![0; MAX_REQUEST_BYTES];
        let length = Request::from(command).emit(&mut bytes)?;
        bytes.truncate(length);
        Ok::<_, SimulateError>(bytes)
    };
    let at_ns = times.stream_ns + ASK_AFTER_NS;
    let requests: [_; SCIP_REQUESTS] =
        [(0, Command::Version), (0, Command::Parameters), (at_ns, Command::Scans(scans))];
    requests.into_iter().map(|(at_ns, command)| Ok((at_ns, ask(command)?))).collect()
}

/// Runs the device until `end_ns`, asking what is to be asked.
pub(super) fn talk(device: &mut dyn Device, requests: &[(i64, Vec<u8>)], end_ns: i64) -> Vec<Output> {
    let mut requests = requests.iter().peekable();
    let (mut outputs, mut due_ns) = (Vec::new(), 0);
    device.connected(0);
    loop {
        let now_ns = requests.peek().map_or(due_ns, |(at_ns, _)| due_ns.min(*at_ns));
        if now_ns > end_ns {
            return outputs;
        }
        while let Some((_, bytes)) = requests.next_if(|(at_ns, _)| *at_ns <= now_ns) {
            device.handle(now_ns, bytes);
        }
        let mut out = Vec::new();
        due_ns = device.poll(now_ns, &mut out).max(now_ns + 1);
        if !out.is_empty() {
            outputs.push((now_ns, out));
        }
    }
}
