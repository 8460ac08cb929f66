//! How long things take.

/// The clocks at some moment, nanoseconds.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Stopwatch {
    wall_ns: i64,
    cpu_ns: i64,
}

impl Stopwatch {
    /// The clocks now.
    pub(crate) fn now() -> Self {
        Self { wall_ns: biplane_clock::monotonic_ns(), cpu_ns: biplane_clock::process_cpu_ns() }
    }

    /// Seconds on the clock and of processor time since then.
    pub(crate) fn elapsed_s(&self) -> (f64, f64) {
        let now = Self::now();
        ((now.wall_ns - self.wall_ns) as f64 / 1e9, (now.cpu_ns - self.cpu_ns) as f64 / 1e9)
    }
}
