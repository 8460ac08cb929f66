//! Chance for tests of sessions, the same in every run.

use crate::session::device_session::{Input, Output, Session};

/// Numbers of chance.
pub(crate) struct Noise(u64);

impl Noise {
    pub(crate) fn new(seed: u64) -> Self {
        Self(seed)
    }

    pub(crate) fn word(&mut self) -> u32 {
        self.0 = self.0.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
        (self.0 >> 33) as u32
    }

    pub(crate) fn byte(&mut self) -> u8 {
        self.word() as u8
    }

    pub(crate) fn below(&mut self, bound: u32) -> usize {
        (self.word() % bound) as usize
    }
}

/// Lets a session endure so many inputs of these bytes, each up to so long after the one before.
pub(crate) fn endure(
    session: &mut dyn Session,
    noise: &mut Noise,
    inputs: usize,
    longest_pause_ns: u32,
    mut bytes: impl FnMut(&mut Noise) -> Vec<u8>,
) {
    let mut now_ns = 0;
    for _ in 0..inputs {
        now_ns += i64::from(noise.word() % longest_pause_ns);
        session.handle(now_ns, Input::Bytes(&bytes(noise)));
        while !matches!(session.poll(), Output::WaitUntil(_)) {}
    }
}
