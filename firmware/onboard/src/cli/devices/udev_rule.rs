//! `udev-rule`: serial adapters by their role.

use std::path::{Path, PathBuf};

use crate::io::udev_rule::{look_up, rules};
use crate::types::error::OnboardError;

/// Prints the udev rules that give serial adapters their role's name (/dev/lms-horizontal, /dev/lms-vertical,
/// /dev/base, /dev/imu).
///
/// Each adapter is recognized by its serial number; one without, by the socket it is plugged into. With the
/// adapters plugged in, as root: `biplane-onboard udev-rule --horizontal /dev/ttyUSB0 --vertical /dev/ttyUSB1
/// --base /dev/ttyUSB2 > /etc/udev/rules.d/70-biplane-roles.rules`, then `udevadm control --reload && udevadm
/// trigger --subsystem-match=tty`.
#[derive(Debug, clap::Args)]
#[group(required = true, multiple = true)]
pub(crate) struct Args {
    /// The port of the laser that localizes.
    #[arg(long, value_name = "PORT")]
    horizontal: Option<PathBuf>,
    /// The port of the laser that sees the building.
    #[arg(long, value_name = "PORT")]
    vertical: Option<PathBuf>,
    /// The port of the base.
    #[arg(long, value_name = "PORT")]
    base: Option<PathBuf>,
    /// The port of the inertial unit.
    #[arg(long, value_name = "PORT")]
    imu: Option<PathBuf>,
}

pub(crate) fn run(args: &Args) -> Result<u8, OnboardError> {
    let roles = [
        ("lms-horizontal", &args.horizontal),
        ("lms-vertical", &args.vertical),
        ("base", &args.base),
        ("imu", &args.imu),
    ];
    let mut adapters = Vec::new();
    for (role, port) in roles {
        let Some(port) = port else { continue };
        let adapter = look_up(Path::new("/sys"), role, port);
        adapters.push(adapter.map_err(|source| OnboardError::Place { path: port.clone(), source })?);
    }
    crate::cli::print_result(&rules(&adapters));
    Ok(0)
}
