//! The onboard process: device sessions, time stamps, scan matching in real time, recording.
pub mod odometry;
pub mod session;
pub mod stamping;
