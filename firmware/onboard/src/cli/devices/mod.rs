//! Commands about devices: what is connected, what it answers, how a rig is configured.

pub(crate) mod check_config;
pub(crate) mod ports;
pub(crate) mod probe;
pub(crate) mod udev_rule;
