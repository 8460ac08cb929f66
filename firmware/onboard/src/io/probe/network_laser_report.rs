//! What a laser on a network told a probe: its type, its state, how it is set, and what `record` would change
//! of that.

use biplane_wire::cola::Dialect;

use crate::io::probe::device_report::DeviceReport;
use crate::session::cola::info::ColaInfo;
use crate::session::cola::settings::ColaSettings;

/// The report of a laser that answered.
pub(crate) fn report(info: &ColaInfo, settings: &ColaSettings, nothing: &DeviceReport) -> DeviceReport {
    let range = info.config.range;
    let fov_deg = |start: i32, stop: i32| (f64::from(stop.saturating_sub(start)) / 1e4).round() as u16;
    DeviceReport {
        answered: true,
        kind: Some(info.name.to_string()),
        firmware: Some(info.firmware.to_string()).filter(|text| !text.is_empty()),
        fov_deg: range.map(|range| fov_deg(range.start_e4deg, range.stop_e4deg)),
        resolution_deg: range.map(|range| f64::from(range.step_e4deg) / 1e4),
        units: Some("mm"),
        fault: info.state.map(|state| state == 2),
        remarks: remarks(info, settings),
        ..nothing.clone()
    }
}

fn remarks(info: &ColaInfo, settings: &ColaSettings) -> Vec<String> {
    let mut remarks = Vec::new();
    let dialect = if info.dialect == Some(Dialect::A) { "CoLa A" } else { "CoLa B" };
    match info.serial.as_str() {
        "" => remarks.push(format!("answers in {dialect}")),
        serial => remarks.push(format!("serial number {serial}, answers in {dialect}")),
    }
    match info.family {
        Some(family) => remarks.push(format!("is taken for a {}", family.name())),
        None => remarks.push("is none of LMS1xx, LMS5xx, TiM5xx, TiM7xx by its name".to_owned()),
    }
    if let Some(state) = info.state {
        let words = match state {
            0 => "busy",
            1 => "ready",
            2 => "error",
            _ => "unknown",
        };
        remarks.push(format!("state {state}: {words}"));
    }
    if let Some(scan) = info.config.scan {
        let (rate_hz, step_deg) = (f64::from(scan.rate_chz) / 100.0, f64::from(scan.step_e4deg) / 1e4);
        remarks.push(format!("measures at {rate_hz} Hz in steps of {step_deg} degrees"));
    }
    if let Some(data) = info.config.data {
        let remission = if data.remission { "with" } else { "without" };
        remarks.push(format!("sends one of {} scans, {remission} remission", data.every));
    }
    match settings.change(info.family, &info.config) {
        Err(offered) => remarks.push(format!("the rig asks for what it does not have: {offered}")),
        Ok(change) if change.is_empty() => {}
        Ok(change) if settings.login => remarks.push(format!("record would write: {change}")),
        Ok(change) => remarks.push(format!(
            "differs from the rig, and record leaves it so; with `login = true` in the rig it would write: {change}"
        )),
    }
    remarks
}
