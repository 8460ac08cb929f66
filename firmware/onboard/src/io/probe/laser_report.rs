//! What a laser told a probe, in words: its state, its faults, its configuration, and what `record` would
//! change of it.

use biplane_wire::lms::Unit;

use crate::io::probe::device_report::DeviceReport;
use crate::session::lms::setup::info::LaserInfo;
use crate::session::lms::setup::settings::LaserSettings;

/// The report of a laser that answered.
pub(crate) fn report(info: &LaserInfo, settings: &LaserSettings, nothing: &DeviceReport) -> DeviceReport {
    let config = info.config.as_ref();
    let of_config = config.and_then(|config| config.unit());
    let unit = of_config.or_else(|| info.report().and_then(|report| report.unit().ok()));
    DeviceReport {
        answered: true,
        baud_found: info.found_baud,
        kind: Some(info.type_text.to_string()),
        firmware: Some(info.firmware.to_string()).filter(|text| !text.is_empty()),
        fov_deg: info.variant.map(|(fov_deg, _)| fov_deg),
        resolution_deg: info.variant.map(|(_, resolution_cdeg)| f64::from(resolution_cdeg) / 100.0),
        units: unit.map(|unit| match unit {
            Unit::Cm => "cm",
            Unit::Mm => "mm",
            Unit::TenCm => "10 cm",
        }),
        measuring_mode: info.measuring_mode().map(|mode| mode.byte()),
        fault: info.has_fault.map(|has_fault| has_fault || has_current_faults(info)),
        remarks: remarks(info, settings),
        ..nothing.clone()
    }
}

fn has_current_faults(info: &LaserInfo) -> bool {
    info.faults.is_some_and(|faults| faults.first.iter().flatten().any(|fault| fault.is_current))
}

fn remarks(info: &LaserInfo, settings: &LaserSettings) -> Vec<String> {
    let mut remarks = Vec::new();
    match info.report() {
        Some(report) => remarks.push(format!("status: {report}")),
        None => remarks.push("status: not told".to_owned()),
    }
    if let Some(status) = info.status {
        remarks.push(format!("status byte {:02X}h: {status}", status.0));
    }
    match info.faults {
        Some(faults) => remarks.push(format!("faults: {faults}")),
        None => remarks.push("faults: not told".to_owned()),
    }
    match &info.config {
        Some(config) => remarks.push(format!("configuration: {config}")),
        None => remarks.push("configuration: not told".to_owned()),
    }
    remarks.extend(would_change(info, settings));
    remarks
}

/// What `record` would change.
fn would_change(info: &LaserInfo, settings: &LaserSettings) -> Vec<String> {
    let mut changes = Vec::new();
    if let Some(found) = info.found_baud.filter(|&found| found != settings.baud) {
        changes.push(format!("record would change the rate: {} Bd instead of {found}", settings.baud));
    }
    if let Some(change) = info.differs(settings).filter(|change| !change.is_empty()) {
        changes.push(format!("record would write the configuration: {change}"));
    }
    let wanted = (settings.fov_deg, settings.resolution_cdeg);
    if let Some((fov_deg, step)) = info.variant.filter(|&variant| variant != wanted) {
        let is = format!("{fov_deg} degrees in steps of {}.{:02}", step / 100, step % 100);
        let asked = format!("{} degrees in steps of {}.{:02}", wanted.0, wanted.1 / 100, wanted.1 % 100);
        let is_fixed = info.is_s14(settings) || settings.fov_deg == 90;
        changes.push(if is_fixed {
            format!("the rig asks for {asked}, which this device does not have: it keeps {is}")
        } else {
            format!("record would set the field of view: {asked} instead of {is}")
        });
    }
    changes
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::types::device_name::ShortText;
    use biplane_wire::lms::{Config, Status};

    const SETTINGS: LaserSettings = LaserSettings {
        baud: 38400,
        fov_deg: 180,
        resolution_cdeg: 100,
        unit: Unit::Cm,
        range_max_m: None,
        index_bytes: Some(true),
        remission: false,
        dazzle_tolerant: None,
    };

    fn info(type_text: &str) -> LaserInfo {
        LaserInfo {
            found_baud: Some(9600),
            type_text: ShortText::try_from(type_text).expect("it fits"),
            status: Some(Status(0x92)),
            variant: Some((180, 50)),
            config: Some(Config::factory()),
            faults: Some(crate::session::lms::health::FaultList::default()),
            has_fault: Some(false),
            ..LaserInfo::default()
        }
    }

    #[test]
    fn what_differs_from_the_rig_is_said_in_words() {
        let report = report(&info("LMS200;30106;V02.10"), &SETTINGS, &DeviceReport::default());
        assert_eq!(report.remarks[0], "status: not told");
        assert_eq!(report.remarks[1], "status byte 92h: warning, front window polluted");
        assert_eq!(report.remarks[2], "faults: no faults");
        assert!(report.remarks[3].starts_with("configuration: 34 bytes, mm, measuring mode 00h"));
        assert_eq!(
            report.remarks[4..],
            [
                "record would change the rate: 38400 Bd instead of 9600",
                "record would write the configuration: units cm instead of mm, availability 02h instead of 00h",
                "record would set the field of view: 180 degrees in steps of 1.00 instead of 180 degrees in steps of 0.50",
            ]
        );
        assert_eq!((report.units, report.measuring_mode, report.fault), (Some("mm"), Some(0), Some(false)));
    }

    #[test]
    fn an_s14_has_one_field_of_view() {
        let s14 = LaserInfo { variant: Some((90, 50)), ..info("LMS291;S14;X01.27") };
        let report = report(&s14, &SETTINGS, &DeviceReport::default());
        let last = report.remarks.last().expect("some");
        assert_eq!(
            last,
            "the rig asks for 180 degrees in steps of 1.00, which this device does not have: it keeps 90 degrees in steps of 0.50"
        );
    }
}
