//! `ports`: the serial ports that this machine has.

use std::fmt::Write;

use serialport::{SerialPortInfo, SerialPortType};

use crate::types::error::OnboardError;

/// Lists the serial ports of this machine, USB adapters with maker, product and serial number.
///
/// Which adapter is which: list, unplug one, list again. Then `udev-rule` gives them their roles.
#[derive(Debug, clap::Args)]
#[command(after_help = "Example:\n  biplane-onboard ports")]
pub(crate) struct Args {
    /// Print JSON instead of a table.
    #[arg(long)]
    json: bool,
}

pub(crate) fn run(args: &Args) -> Result<u8, OnboardError> {
    let ports = serialport::available_ports()
        .map_err(|error| OnboardError::System { what: "list the serial ports", source: error.into() })?;
    crate::cli::print_result(&if args.json { json(&ports) } else { table(&ports) });
    Ok(0)
}

fn table(ports: &[SerialPortInfo]) -> String {
    let mut text = String::new();
    for port in ports {
        let _ = match &port.port_type {
            SerialPortType::UsbPort(usb) => writeln!(
                text,
                "{:<16} USB {:04x}:{:04x} {} {} {}",
                port.port_name,
                usb.vid,
                usb.pid,
                usb.manufacturer.as_deref().unwrap_or("-"),
                usb.product.as_deref().unwrap_or("-"),
                usb.serial_number.as_deref().unwrap_or("(no serial number)")
            ),
            SerialPortType::BluetoothPort => writeln!(text, "{:<16} Bluetooth", port.port_name),
            _ => writeln!(text, "{:<16} of the board", port.port_name),
        };
    }
    if text.is_empty() { "no serial port\n".to_owned() } else { text }
}

fn json(ports: &[SerialPortInfo]) -> String {
    let list: Vec<_> = ports
        .iter()
        .map(|port| {
            let mut entry = serde_json::json!({ "port": port.port_name });
            if let SerialPortType::UsbPort(usb) = &port.port_type {
                entry["usb"] = serde_json::json!({
                    "vendor_id": usb.vid, "product_id": usb.pid, "manufacturer": usb.manufacturer,
                    "product": usb.product, "serial_number": usb.serial_number,
                });
            }
            entry
        })
        .collect();
    format!("{}\n", serde_json::Value::from(list))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn an_adapter_stands_with_its_numbers_and_a_machine_without_ports_says_so() {
        let usb = serialport::UsbPortInfo {
            vid: 0x0403,
            pid: 0x6001,
            serial_number: Some("A9XYZ".to_owned()),
            manufacturer: Some("FTDI".to_owned()),
            product: None,
        };
        let port =
            SerialPortInfo { port_name: "/dev/ttyUSB0".to_owned(), port_type: SerialPortType::UsbPort(usb) };
        assert_eq!(table(std::slice::from_ref(&port)), "/dev/ttyUSB0     USB 0403:6001 FTDI - A9XYZ\n");
        assert_eq!(table(&[]), "no serial port\n");
        let list: serde_json::Value = serde_json::from_str(&json(&[port])).unwrap();
        assert_eq!(
            (list[0]["usb"]["vendor_id"].as_u64(), list[0]["port"].as_str()),
            (Some(1027), Some("/dev/ttyUSB0"))
        );
    }
}
