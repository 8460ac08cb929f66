//! What is watched on the lines beside their sessions: faults, other devices, damage, and how far each was
//! listened to.

pub(crate) mod active_faults;
pub(crate) mod damage;
pub(crate) mod foreign_device;
pub(crate) mod read_watermark;

use biplane_recording::{Port, Rig};

use crate::engine::line::watch::active_faults::Faults;
use crate::engine::line::watch::damage::Damage;
use crate::engine::line::watch::foreign_device::ForeignDevice;
use crate::engine::line::watch::read_watermark::ReadWatermark;

/// Watches the lines.
#[derive(Debug)]
pub(crate) struct LineWatch {
    pub(crate) faults: Faults,
    pub(crate) read_watermark: ReadWatermark,
    foreign_devices: Box<[ForeignDevice; Port::ALL.len()]>,
    damage: [Damage; Port::ALL.len()],
}

impl LineWatch {
    /// The lines of this rig.
    pub(crate) fn new(rig: &Rig) -> Self {
        Self {
            faults: Faults::default(),
            read_watermark: ReadWatermark::default(),
            foreign_devices: Box::new(Port::ALL.map(|port| ForeignDevice::on(port, &rig.base.protocol))),
            damage: Default::default(),
        }
    }

    /// The ear of a port.
    pub(crate) fn foreign_device(&mut self, port: Port) -> &mut ForeignDevice {
        of_port(port, self.foreign_devices.each_mut())
    }

    /// The damage of a line.
    pub(crate) fn damage(&mut self, port: Port) -> &mut Damage {
        of_port(port, self.damage.each_mut())
    }
}

fn of_port<T>(port: Port, [horizontal, vertical, base, imu]: [T; Port::ALL.len()]) -> T {
    match port {
        Port::Horizontal => horizontal,
        Port::Vertical => vertical,
        Port::Base => base,
        Port::Imu => imu,
    }
}
