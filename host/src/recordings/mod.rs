//! Recordings as input: what they hold, their poses and scans, and logs of other programs.

pub(crate) mod deskew;
pub(crate) mod import;
pub(crate) mod info;
pub(crate) mod mounts;
pub(crate) mod run;
pub(crate) mod scan_geometry;
pub(crate) mod self_report;
pub(crate) mod stamp_text;
pub(crate) mod step_back;
pub(crate) mod wild_poses;
