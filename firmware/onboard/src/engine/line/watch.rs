//! What is watched on the lines beside their sessions: faults, other devices, damage, and how far each was
//! listened to.

use biplane_recording::Port;
use biplane_recording::rig::BaseProtocol;

use crate::engine::line::active_faults::Faults;
use crate::engine::line::damage::Damage;
use crate::engine::line::foreign_device::ForeignDevice;
use crate::engine::line::read_watermark::ReadWatermark;

/// Watches the lines.
#[derive(Debug)]
pub(crate) struct LineWatch {
    pub(crate) faults: Faults,
    pub(crate) read_watermark: ReadWatermark,
    foreign_devices: Box<[ForeignDevice; 3]>,
    damage: [Damage; 3],
}

impl LineWatch {
    /// The lines of a rig whose base speaks this.
    pub(crate) fn new(protocol: &BaseProtocol) -> Self {
        Self {
            faults: Faults::default(),
            read_watermark: ReadWatermark::default(),
            foreign_devices: Box::new(Port::ALL.map(|port| ForeignDevice::on(port, protocol))),
            damage: Default::default(),
        }
    }

    /// The ear of a port.
    pub(crate) fn foreign_device(&mut self, port: Port) -> &mut ForeignDevice {
        let [horizontal, vertical, base] = &mut *self.foreign_devices;
        of_port(port, [horizontal, vertical, base])
    }

    /// The damage of a line.
    pub(crate) fn damage(&mut self, port: Port) -> &mut Damage {
        of_port(port, self.damage.each_mut())
    }
}

fn of_port<T>(port: Port, [horizontal, vertical, base]: [T; 3]) -> T {
    match port {
        Port::Horizontal => horizontal,
        Port::Vertical => vertical,
        Port::Base => base,
    }
}
