//! Which serial adapter has which role on the robot, as udev rules: `/dev/lms-horizontal` shall be the same
//! laser after every boot.
//!
//! An adapter is known by its USB serial number and interface; one without a number (or whose number another
//! one has as well) by the socket that it is plugged into; a port of the board itself by its name. The rules
//! name roles only; what follows from a role stands in the rules that the package installs
//! (`packaging/90-biplane.rules`).

use std::fmt::Write;
use std::fs;
use std::io;
use std::path::{Path, PathBuf};

/// How an adapter is told from others.
#[derive(Clone, PartialEq, Eq, Debug)]
#[non_exhaustive]
pub(crate) enum Identity {
    /// By its own number, and the interface where it has several.
    Number {
        /// The USB serial number.
        serial: String,
        /// The USB interface, two hexadecimal digits.
        interface: String,
    },
    /// By its place: bus, hubs, socket and interface, as the kernel names it (`1-1.2:1.0`).
    Place(String),
    /// A port of the board: the kernel's own name (`ttyS0`).
    Board(String),
}

/// A serial port and what it can be known by.
#[derive(Clone, PartialEq, Eq, Debug)]
pub(crate) struct Adapter {
    /// The role on the robot, the name below `/dev`.
    pub role: &'static str,
    /// The kernel's name now.
    pub kernel: String,
    /// Known by its number, if it has one.
    number: Option<Identity>,
    /// Known by its place.
    place: Identity,
}

/// Looks a port up in `sys` (the folder where sysfs is mounted).
///
/// # Errors
/// When `port` is not there, or `sys` knows no serial device of its name.
pub(crate) fn look_up(sys: &Path, role: &'static str, port: &Path) -> io::Result<Adapter> {
    let device = fs::canonicalize(port)?;
    let kernel = device.file_name().unwrap_or_default().to_string_lossy().into_owned();
    let unknown = |_| io::Error::new(io::ErrorKind::NotFound, "is no serial port that the kernel knows");
    let place = fs::canonicalize(sys.join("class/tty").join(&kernel).join("device")).map_err(unknown)?;
    let Some(interface) = parent_with(&place, "bInterfaceNumber") else {
        let board = Identity::Board(kernel.clone());
        return Ok(Adapter { role, kernel, number: None, place: board });
    };
    let number = parent_with(&interface, "idVendor").and_then(|device| {
        let serial = word(&device.join("serial"))?;
        Some(Identity::Number { serial, interface: word(&interface.join("bInterfaceNumber"))? })
    });
    let place = interface.file_name().unwrap_or_default().to_string_lossy().into_owned();
    Ok(Adapter { role, kernel, number, place: Identity::Place(place) })
}

/// The nearest folder, upwards from `folder`, that holds a file of this name.
fn parent_with(folder: &Path, file: &str) -> Option<PathBuf> {
    folder.ancestors().find(|folder| folder.join(file).is_file()).map(Path::to_owned)
}

/// The text of an attribute; `None` when it is empty, or holds what a rule could not say.
fn word(path: &Path) -> Option<String> {
    let text = fs::read_to_string(path).ok()?.trim().to_owned();
    let sayable =
        |letter: char| letter.is_ascii_graphic() && !matches!(letter, '"' | '\\' | '*' | '?' | '[' | '|');
    (!text.is_empty() && text.chars().all(sayable)).then_some(text)
}

/// The rules for these adapters, a line each, with what they do not see.
#[must_use]
pub(crate) fn rules(adapters: &[Adapter]) -> String {
    let mut text = String::from(
        "# Roles of serial adapters: /etc/udev/rules.d/70-biplane-roles.rules; then\n\
         # udevadm control --reload && udevadm trigger --subsystem-match=tty\n",
    );
    for adapter in adapters {
        let alike = |other: &&Adapter| other.number == adapter.number;
        let shared = adapter.number.is_some() && adapters.iter().filter(alike).count() > 1;
        let identity = adapter.number.as_ref().filter(|_| !shared).unwrap_or(&adapter.place);
        // Writing to a string does not fail.
        let _ = writeln!(text, "{}", rule(adapter, identity, shared));
    }
    text
}

fn rule(adapter: &Adapter, identity: &Identity, shared: bool) -> String {
    let Adapter { role, kernel, number, .. } = adapter;
    let (remark, matches) = match identity {
        Identity::Number { serial, interface } => (
            format!("# {kernel}, by its serial number"),
            format!(r#"ENV{{ID_SERIAL_SHORT}}=="{serial}", ENV{{ID_USB_INTERFACE_NUM}}=="{interface}""#),
        ),
        Identity::Place(place) => {
            let why = match number {
                Some(_) if shared => "its serial number is another one's as well",
                _ => "it has no serial number",
            };
            (
                format!("# {kernel}, by its socket ({why}): it has to stay plugged in there"),
                format!(r#"SUBSYSTEMS=="usb", KERNELS=="{place}""#),
            )
        }
        Identity::Board(name) => (format!("# {name}, a port of the board"), format!(r#"KERNEL=="{name}""#)),
    };
    format!("{remark}\nSUBSYSTEM==\"tty\", {matches}, ENV{{BIPLANE_ROLE}}=\"{role}\"")
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::os::unix::fs::symlink;

    /// A sysfs with USB adapters, laid out as Linux 6.1 does.
    struct Machine(PathBuf);

    impl Machine {
        fn new(name: &str) -> Self {
            let root = std::env::temp_dir().join(format!("biplane-udev-{name}-{}", std::process::id()));
            let _ = fs::remove_dir_all(&root);
            fs::create_dir_all(root.join("sys/class/tty")).unwrap();
            fs::create_dir_all(root.join("dev")).unwrap();
            Self(root)
        }

        fn plug(&self, kernel: &str, socket: &str, interface: &str, serial: Option<&str>) {
            let device = self.0.join("sys/devices/pci0000:00/0000:00:14.0/usb1").join(socket);
            let port = device.join(format!("{socket}:1.{interface}")).join(kernel);
            fs::create_dir_all(&port).unwrap();
            fs::write(device.join("idVendor"), "0403\n").unwrap();
            fs::write(port.parent().unwrap().join("bInterfaceNumber"), format!("0{interface}\n")).unwrap();
            if let Some(serial) = serial {
                fs::write(device.join("serial"), format!("{serial}\n")).unwrap();
            }
            self.name(kernel, &port);
        }

        fn name(&self, kernel: &str, place: &Path) {
            let class = self.0.join("sys/class/tty").join(kernel);
            fs::create_dir_all(&class).unwrap();
            symlink(place, class.join("device")).unwrap();
            fs::write(self.0.join("dev").join(kernel), "").unwrap();
        }

        fn look_up(&self, role: &'static str, kernel: &str) -> Adapter {
            look_up(&self.0.join("sys"), role, &self.0.join("dev").join(kernel)).unwrap()
        }
    }

    impl Drop for Machine {
        fn drop(&mut self) {
            let _ = fs::remove_dir_all(&self.0);
        }
    }

    fn rule_lines(adapters: &[Adapter]) -> Vec<String> {
        rules(adapters).lines().filter(|line| !line.starts_with('#')).map(str::to_owned).collect()
    }

    #[test]
    fn adapters_are_known_by_number_and_interface() {
        let machine = Machine::new("number");
        machine.plug("ttyUSB0", "1-1", "0", Some("A106TPF9"));
        machine.plug("ttyUSB1", "1-2", "0", Some("FT4232"));
        machine.plug("ttyUSB2", "1-2", "1", Some("FT4232"));
        let adapters = [
            machine.look_up("lms-horizontal", "ttyUSB0"),
            machine.look_up("lms-vertical", "ttyUSB1"),
            machine.look_up("base", "ttyUSB2"),
        ];
        assert_eq!(
            rule_lines(&adapters),
            [
                r#"SUBSYSTEM=="tty", ENV{ID_SERIAL_SHORT}=="A106TPF9", ENV{ID_USB_INTERFACE_NUM}=="00", ENV{BIPLANE_ROLE}="lms-horizontal""#,
                r#"SUBSYSTEM=="tty", ENV{ID_SERIAL_SHORT}=="FT4232", ENV{ID_USB_INTERFACE_NUM}=="00", ENV{BIPLANE_ROLE}="lms-vertical""#,
                r#"SUBSYSTEM=="tty", ENV{ID_SERIAL_SHORT}=="FT4232", ENV{ID_USB_INTERFACE_NUM}=="01", ENV{BIPLANE_ROLE}="base""#,
            ]
        );
    }

    #[test]
    fn adapters_without_a_number_of_their_own_are_known_by_their_socket() {
        let machine = Machine::new("place");
        machine.plug("ttyUSB0", "1-1.2", "0", None);
        machine.plug("ttyUSB1", "1-3", "0", Some("0001"));
        machine.plug("ttyUSB2", "1-4", "0", Some("0001"));
        machine.plug("ttyUSB3", "1-5", "0", Some("\"*\""));
        let roles = [
            ("lms-horizontal", "ttyUSB0"),
            ("lms-vertical", "ttyUSB1"),
            ("base", "ttyUSB2"),
            ("x", "ttyUSB3"),
        ];
        let adapters = roles.map(|(role, kernel)| machine.look_up(role, kernel));
        for (line, place) in rule_lines(&adapters).iter().zip(["1-1.2:1.0", "1-3:1.0", "1-4:1.0", "1-5:1.0"])
        {
            assert!(line.contains(&format!(r#"SUBSYSTEMS=="usb", KERNELS=="{place}""#)), "{line}");
        }
    }

    #[test]
    fn ports_of_the_board_have_their_names_and_other_files_are_refused() {
        let machine = Machine::new("board");
        machine.name("ttyS0", &machine.0.join("sys/devices"));
        fs::create_dir_all(machine.0.join("sys/devices")).unwrap();
        let line = rule_lines(&[machine.look_up("base", "ttyS0")]).remove(0);
        assert_eq!(line, r#"SUBSYSTEM=="tty", KERNEL=="ttyS0", ENV{BIPLANE_ROLE}="base""#);
        fs::write(machine.0.join("dev/null"), "").unwrap();
        assert!(look_up(&machine.0.join("sys"), "base", &machine.0.join("dev/null")).is_err());
        assert!(look_up(&machine.0.join("sys"), "base", Path::new("/nowhere")).is_err());
    }
}
