//! The telegram of a scan.

use biplane_wire::cola::{
    Channel, Clock, Dialect, Head, Kind, MAX_TELEGRAM_BYTES, Scan, Telegram, Values, Width,
};

/// What a scan's telegram holds behind its head.
#[derive(Clone, Copy, Debug)]
pub struct Measured<'a> {
    /// Direction of the first beam, 1/10000 degree; 90 degrees is straight ahead.
    pub start_e4deg: i32,
    /// From beam to beam, 1/10000 degree.
    pub step_e4deg: u16,
    /// A range is a value times this, in mm.
    pub scale: f32,
    /// Raw values of the ranges.
    pub words: &'a [u16],
    /// Remissions, one a beam, and their bits.
    pub remissions: Option<(Width, &'a [u16])>,
    /// Whether the device's date and time are sent.
    pub has_clock: bool,
}

/// The telegram of a scan, as an event or an answer.
#[must_use]
pub fn of_scan(head: Head, measured: &Measured<'_>, form: (Kind, Dialect)) -> Vec<u8> {
    let channel = |name: &[u8; 5], scale, width, numbers| Channel {
        name: *name,
        scale,
        offset: 0.0,
        start_e4deg: measured.start_e4deg,
        step_e4deg: measured.step_e4deg,
        width,
        values: Values::Numbers(numbers),
    };
    let mut channels = heapless::Vec::new();
    // There is room for ten.
    let _ = channels.push(channel(b"DIST1", measured.scale, Width::Word, measured.words));
    if let Some((width, remissions)) = measured.remissions {
        let _ = channels.push(channel(b"RSSI1", 1.0, width, remissions));
    }
    let scan = Scan {
        head,
        encoders: heapless::Vec::new(),
        channels,
        position: None,
        name: None,
        comment: None,
        clock: measured.has_clock.then(Clock::default),
        event: Some(None),
    };
    framed(&scan, form)
}

/// A scan in a telegram of this kind and dialect.
#[must_use]
pub fn framed(scan: &Scan<'_>, (kind, dialect): (Kind, Dialect)) -> Vec<u8> {
    let mut data = vec![0; MAX_TELEGRAM_BYTES];
    let length = scan.emit_data(dialect, &mut data).unwrap_or_default();
    let data = data.get(..length);
    let telegram = Telegram { dialect, kind, name: Scan::NAME, data };
    let mut bytes = vec![0; telegram.encoded_len()];
    // The buffer is as long as the telegram says.
    let _ = telegram.emit(&mut bytes);
    bytes
}
