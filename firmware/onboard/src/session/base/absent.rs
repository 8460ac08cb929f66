//! No base: a session on which nothing ever happens.

use biplane_wire::Counts;

use crate::session::base::driver::BaseDriver;
use crate::session::base::reading::BaseInfo;
use crate::session::device_session::{Input, Output, Session};

/// What stands where a rig has no base.
#[derive(Clone, Debug, Default)]
pub struct AbsentBase {
    info: BaseInfo,
}

impl Session for AbsentBase {
    fn handle(&mut self, _: i64, _: Input<'_>) {}

    fn poll(&mut self) -> Output {
        Output::WaitUntil(i64::MAX)
    }

    fn is_done(&self) -> bool {
        true
    }

    fn baud(&self) -> u32 {
        0
    }

    fn counts(&self) -> Counts {
        Counts::default()
    }

    fn overflowed(&self) -> u64 {
        0
    }
}

impl BaseDriver for AbsentBase {
    fn info(&self) -> &BaseInfo {
        &self.info
    }

    fn not_kept(&self) -> u64 {
        0
    }

    fn is_streaming(&self) -> bool {
        false
    }

    fn finish(&mut self) {}
}
