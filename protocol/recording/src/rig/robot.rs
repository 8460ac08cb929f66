//! The rig as a whole: read from a text, and written as one.

use super::parse::{self, Devices, Ports};
use super::print::print;
use super::{Base, InertialUnit, Laser, RigError};
use crate::file_kind::{KIND_BYTES, describe};
use std::path::Path;

/// A robot: two lasers, a base, and perhaps an inertial unit.
#[derive(Clone, PartialEq, Debug)]
pub struct Rig {
    /// The laser that localizes.
    pub horizontal: Laser,
    /// The laser that sees the building; a robot without one only maps in 2D.
    pub vertical: Option<Laser>,
    /// The mobile base.
    pub base: Base,
    /// The inertial unit, if there is one.
    pub imu: Option<InertialUnit>,
}

impl Rig {
    /// Reads the text of a `rig.toml`.
    ///
    /// A key that is not given takes the value of the template ([`Rig::default`]), also inside `mount`; ports
    /// must be given.
    ///
    /// # Errors
    /// All that is wrong, each with line, key, what was found and what is allowed.
    pub fn parse(text: &str) -> Result<Self, RigError> {
        Self::parse_with(text, Ports::Any)
    }

    fn parse_with(text: &str, ports: Ports) -> Result<Self, RigError> {
        let Devices { horizontal, vertical, base, imu } = parse::parse(text, ports)?;
        Ok(Self { horizontal, vertical, base, imu })
    }

    /// Reads a `rig.toml`.
    ///
    /// # Errors
    /// That the file cannot be read, or what [`Rig::parse`] says of it, with the file's name.
    pub fn load(path: &Path) -> Result<Self, RigError> {
        Self::load_with(path, Ports::Any)
    }

    /// The same of a rig whose devices are to be opened: each needs a port or an address of its own.
    ///
    /// # Errors
    /// As [`Rig::load`]; devices that share a port are named together with all else that is wrong.
    pub fn load_to_open(path: &Path) -> Result<Self, RigError> {
        Self::load_with(path, Ports::Apart)
    }

    fn load_with(path: &Path, ports: Ports) -> Result<Self, RigError> {
        let bytes = std::fs::read(path).map_err(|source| RigError::File { path: path.to_owned(), source })?;
        let Ok(text) = std::str::from_utf8(&bytes) else {
            let start = &bytes[..bytes.len().min(KIND_BYTES as usize)];
            return Err(RigError::NoText { path: path.to_owned(), what: describe(start) });
        };
        Self::parse_with(text, ports)
            .map_err(|source| RigError::In { path: path.to_owned(), source: Box::new(source) })
    }

    /// The resolved `rig.toml`: every key with its value, but for settings that are left to the device.
    /// [`Rig::parse`] makes the same rig of it.
    #[must_use]
    pub fn to_toml(&self) -> String {
        print(&self.horizontal, self.vertical.as_ref(), &self.base, self.imu.as_ref())
    }
}

impl Default for Rig {
    /// The template rig: both lasers on a Pioneer.
    fn default() -> Self {
        Self {
            horizontal: Laser::horizontal(),
            vertical: Some(Laser::vertical()),
            base: Base::default(),
            imu: None,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::Rig;

    #[test]
    fn a_file_that_is_no_text_is_named_for_what_it_is() {
        let path = std::env::temp_dir().join(format!("biplane-rig-{}.mcap", std::process::id()));
        std::fs::write(&path, b"\x89MCAP0\r\n\x01\xff\xfe").unwrap();
        let error = Rig::load(&path).unwrap_err().to_string();
        std::fs::remove_file(&path).unwrap();
        assert!(error.ends_with(".mcap is an MCAP file, and no rig.toml"), "{error}");
    }
}
