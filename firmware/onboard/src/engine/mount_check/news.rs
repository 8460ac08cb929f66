//! What has come up of how the lasers sit, or has gone.

use biplane_recording::Port;

use crate::types::mount_fault::MountFault;

/// A suspicion that comes up, or one that has gone.
#[derive(Copy, Clone, PartialEq, Eq, Debug)]
pub(crate) struct News {
    /// The laser.
    pub port: Port,
    /// What is suspected.
    pub mount_fault: MountFault,
    /// Whether it comes up.
    pub begins: bool,
}
