//! Commands that read recordings and write recordings, poses or maps.

pub(crate) mod calibrate;
mod health;
pub(crate) mod import;
pub(crate) mod info;
pub(crate) mod map;
pub(crate) mod model_info;
pub(crate) mod optimize;
pub(crate) mod poses;
pub(crate) mod recover;
mod rig_text;
pub(crate) mod traj;
