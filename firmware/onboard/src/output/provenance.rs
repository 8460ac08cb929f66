//! What a recording tells of its own making: rig, resolved parameters, versions, start time.

use std::collections::BTreeMap;

use biplane_clock::iso_8601;
use biplane_matcher::TrackerParams;
use biplane_recording::mcap::read::{RIG_ASSUMED, RIG_ATTACHMENT};
use biplane_recording::{PartsWriter, Rig, WriteError};

use crate::stamping::cycle_params::CycleClockParams;

/// Writes attachments and metadata at the start of a recording. `start_ns` is UTC, nanoseconds; `assumed`
/// says what of the rig is, where nobody wrote one down.
///
/// # Errors
/// As [`PartsWriter::attach`].
pub(crate) fn write(
    writer: &mut PartsWriter,
    rig: &Rig,
    assumed: Option<String>,
    matcher: &TrackerParams,
    program: &str,
    start_ns: i64,
) -> Result<(), WriteError> {
    writer.attach(RIG_ATTACHMENT, "application/toml", rig.to_toml().as_bytes())?;
    writer.attach("parameters.json", "application/json", parameters(matcher).as_bytes())?;
    let words = [
        ("program", program.to_owned()),
        ("version", env!("CARGO_PKG_VERSION").to_owned()),
        ("matcher", matcher.method.name().to_owned()),
        ("start_time", iso_8601(start_ns)),
        ("start_time_ns", start_ns.to_string()),
    ];
    let words = words.into_iter().chain(assumed.map(|assumed| (RIG_ASSUMED, assumed)));
    let words: BTreeMap<_, _> = words.map(|(key, value)| (key.to_owned(), value)).collect();
    writer.metadata("biplane", &words)
}

/// All parameters in force, as JSON.
fn parameters(matcher: &TrackerParams) -> String {
    let clock = CycleClockParams::default();
    let values = TrackerParams::parameters().map(|parameter| parameter.name);
    let values: BTreeMap<_, _> = values.map(|name| (name, matcher.get(name).ok())).collect();
    let value = serde_json::json!({
        "matcher": matcher.method.name(),
        "tracker": values,
        "stamping": format!("{clock:?}"),
    });
    format!("{value:#}\n")
}
