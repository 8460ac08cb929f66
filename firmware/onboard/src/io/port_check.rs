//! The ports and addresses that a rig needs, and what can be said of them before they are opened.

use std::io;
use std::path::Path;

use biplane_recording::rig::Laser;
use biplane_recording::{Port, Rig};

use crate::io::line::OpenLine;
use crate::types::device_name::device_name;
use crate::types::error::{OnboardError, SharedPort};

/// A port or an address that a rig needs.
#[derive(Copy, Clone, PartialEq, Eq, Debug)]
pub(crate) struct NeededPort<'a> {
    /// Which device is on it.
    pub device: Port,
    /// Its path, or its host and port.
    pub path: &'a str,
    /// Its rate, bits per second; `None` of a device on a network.
    pub baud: Option<u32>,
}

/// The ports of a rig in a fixed order.
#[must_use]
pub(crate) fn of_rig(rig: &Rig) -> Vec<NeededPort<'_>> {
    fn laser(device: Port, laser: &Laser) -> NeededPort<'_> {
        match laser.address() {
            Some(path) => NeededPort { device, path, baud: None },
            None => NeededPort { device, path: &laser.port, baud: Some(laser.baud) },
        }
    }
    let mut ports = vec![laser(Port::Horizontal, &rig.horizontal)];
    ports.extend(rig.vertical.as_ref().map(|vertical| laser(Port::Vertical, vertical)));
    let base = NeededPort { device: Port::Base, path: &rig.base.port, baud: Some(rig.base.baud) };
    ports.extend(rig.base.is_present().then_some(base));
    let unit = rig.imu.as_ref().filter(|unit| unit.is_serial());
    ports.extend(unit.map(|unit| NeededPort { device: Port::Imu, path: &unit.port, baud: Some(unit.baud) }));
    ports
}

/// What of a rig is allowed, and most likely not meant; said once a run.
pub(crate) fn warn(rig: &Rig) {
    if let Some(words) = unmeasured_words(&rig.base.protocol.unmeasured()) {
        tracing::warn!("base: {words}");
    }
}

/// What is to be measured, of the keys of a home-made base that have the values of the defaults.
fn unmeasured_words(keys: &[&str]) -> Option<String> {
    let (names, measures) = match keys {
        [] => return None,
        [key] => ((*key).to_owned(), "has its default value, which is not that"),
        [first @ .., last] => {
            (format!("{} and {last}", first.join(", ")), "have their default values, which are not those")
        }
    };
    let count = keys.iter().any(|key| key.starts_with("metres_per_count"));
    let wheels = keys.contains(&"wheel_base_m");
    let count = count.then_some("drive 10 m straight ahead and enter 10 divided by the counts of each wheel");
    let wheels = wheels.then_some("enter the distance between the middles of both wheels' treads");
    let measure: Vec<&str> = count.into_iter().chain(wheels).collect();
    Some(format!(
        "{names} {measures} of your robot, so that odometry will be wrong: {} (docs/bases.md)",
        measure.join("; ")
    ))
}

impl NeededPort<'_> {
    /// Opens the port, or connects to the device.
    ///
    /// # Errors
    /// What the system says.
    pub(crate) fn open(&self) -> io::Result<OpenLine> {
        match self.baud {
            Some(baud) => OpenLine::serial(Path::new(self.path), baud),
            None => OpenLine::network(self.path),
        }
    }
}

/// Checks what the rig's own reader cannot: that no two devices share a port.
///
/// # Errors
/// All devices that share one.
pub(crate) fn check(rig: &Rig) -> Result<(), OnboardError> {
    let ports = of_rig(rig);
    let mut shared = Vec::new();
    for (index, port) in ports.iter().enumerate() {
        if let Some(other) = ports.iter().take(index).find(|other| other.path == port.path) {
            let devices = [device_name(other.device), device_name(port.device)];
            shared.push(SharedPort { port: port.path.to_owned(), devices });
        }
    }
    if shared.is_empty() { Ok(()) } else { Err(OnboardError::SharedPorts { shared }) }
}

#[cfg(test)]
mod tests {
    use super::{check, unmeasured_words};
    use biplane_recording::Rig;

    #[test]
    fn a_base_with_values_of_nobody_is_named_with_what_to_measure() {
        assert_eq!(unmeasured_words(&[]), None);
        let one = unmeasured_words(&["metres_per_count_right"]).unwrap();
        assert!(
            one.starts_with("metres_per_count_right has its default value, which is not that of"),
            "{one}"
        );
        assert!(one.contains("drive 10 m straight ahead") && !one.contains("treads"), "{one}");
        let two = unmeasured_words(&["wheel_base_m", "metres_per_count_left"]).unwrap();
        assert!(two.starts_with("wheel_base_m and metres_per_count_left have their default values"), "{two}");
        assert!(two.contains("treads"), "{two}");
    }

    #[test]
    fn all_devices_that_share_a_port_are_named_at_once() {
        let mut rig = Rig::default();
        assert!(check(&rig).is_ok());
        rig.horizontal.port = rig.base.port.clone();
        rig.vertical.as_mut().unwrap().port = rig.base.port.clone();
        let error = check(&rig).unwrap_err().to_string();
        let expected = "/dev/base is the port of horizontal laser and of vertical laser: each device needs its own; \
            /dev/base is the port of horizontal laser and of base: each device needs its own";
        assert_eq!(error, expected);
    }
}
