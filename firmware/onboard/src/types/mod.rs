//! What all stages of a run share: errors, the report at its end, and small values that several stages name.

pub(crate) mod byte_time;
pub(crate) mod device_name;
pub(crate) mod error;
pub(crate) mod foreign_protocol;
pub(crate) mod live_address;
pub(crate) mod live_report;
pub(crate) mod mount_fault;
pub(crate) mod pose_delays;
pub(crate) mod run_report;
pub(crate) mod uncovered;
pub(crate) mod web_origin;
