//! Words that come from a client of the live view or from a command line.

use biplane::files::{format_seconds, parse_seconds_ns};
use biplane_matcher::TrackerParams;
use biplane_onboard::LiveAddress;

/// What a viewer asks for is understood or refused.
pub(super) fn live_request(input: &[u8]) {
    let _ = biplane_onboard::test_support::live_request(&String::from_utf8_lossy(input));
}

/// `NAME=VALUE`, an address, a time: a value that is taken is in its range, a time is written as the time
/// that it is.
pub(super) fn command_line(input: &[u8]) {
    let text = String::from_utf8_lossy(input);
    if let Some((name, number)) = text.split_once('=')
        && let Ok(value) = number.trim().parse()
    {
        let mut params = TrackerParams::default();
        if params.set(name, value).is_ok() {
            let kept = params.get(name).expect("it was set");
            assert!(kept.is_finite(), "{name} = {kept}");
        }
    }
    let _ = text.parse::<LiveAddress>();
    if let Some(stamp_ns) = parse_seconds_ns(&text) {
        assert_eq!(parse_seconds_ns(&format_seconds(stamp_ns)), Some(stamp_ns));
    }
}
