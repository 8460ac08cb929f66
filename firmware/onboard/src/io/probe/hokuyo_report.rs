//! What a Hokuyo laser told a probe, in words.

use biplane_wire::scip::Delivery;

use crate::io::probe::device_report::DeviceReport;
use crate::session::scip::info::ScipInfo;
use crate::session::scip::settings::{ScipOffer, ScipSettings};

/// The report of a laser that answered.
pub(crate) fn report(info: &ScipInfo, settings: &ScipSettings, nothing: &DeviceReport) -> DeviceReport {
    let parameters = info.parameters.as_ref();
    let fov_deg = parameters
        .map(|parameters| f64::from(parameters.last_step - parameters.first_step) * parameters.step_deg());
    DeviceReport {
        answered: true,
        baud_found: info.found_baud,
        kind: Some(info.model.to_string()),
        firmware: Some(info.firmware.to_string()).filter(|text| !text.is_empty()),
        fov_deg: fov_deg.map(|fov_deg| fov_deg.round() as u16),
        resolution_deg: parameters.map(|parameters| parameters.step_deg()),
        units: Some("mm"),
        remarks: remarks(info, settings),
        ..nothing.clone()
    }
}

fn remarks(info: &ScipInfo, settings: &ScipSettings) -> Vec<String> {
    let mut remarks = Vec::new();
    if !info.serial.is_empty() {
        remarks.push(format!("serial number {}", info.serial));
    }
    if !info.state.is_empty() {
        remarks.push(format!("state: {}, laser {}", info.state, info.laser));
    }
    let Some(parameters) = &info.parameters else { return remarks };
    let [min_m, max_m] = [parameters.min_mm, parameters.max_mm].map(|mm| f64::from(mm) * 1e-3);
    let offer = ScipOffer::of(parameters);
    remarks.push(format!("ranges from {min_m} to {max_m} m; offers {offer}"));
    if let (Some(found), Some(wanted)) = (info.found_baud, settings.baud)
        && found != wanted
    {
        remarks.push(format!("record would change the rate: {wanted} Bd instead of {found}"));
    }
    match settings.request(parameters) {
        Err(_) => remarks.push("the rig asks for what it does not offer".to_owned()),
        Ok(request) => {
            let skip = match request.delivery {
                Delivery::Once => 0,
                Delivery::Stream { skip, .. } => skip,
            };
            remarks.push(format!(
                "record would ask for steps {} to {}, {} joined to one, one of {} turns",
                request.first_step,
                request.last_step,
                request.steps_per_value(),
                skip + 1
            ));
        }
    }
    remarks
}
