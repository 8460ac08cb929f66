//! What each parser of outside bytes promises for any bytes whatever: a function that panics where a promise
//! is broken.
//!
//! Besides "no panic": what parses is written back as the same bytes or reads back as the same value, every
//! byte of a stream is accounted for, memory grows with the input and with no number in it, and the time is
//! bounded. The same functions are run
//! - on stable Rust over a corpus and seeded mutations of it (`tests/inputs`),
//! - by a coverage-guided fuzzer (`tests/fuzz`).

mod geometry;
mod logs;
pub mod making;
mod messages;
mod recordings;
mod rigs;
mod sessions;
mod wire;
mod words;

use biplane_clock::thread_cpu_ns;

/// Memory that a parser may take for itself, bytes: chunks of a megabyte as they are written.
const OWN_BYTES: usize = 4 << 20;
/// Processor time that an input may take, nanoseconds: a hundred times what the slowest takes in a debug
/// build.
const TIME_NS: i64 = 10_000_000_000;

/// How an input is written, which says how it is best damaged.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Form {
    /// Numbers in their own bytes.
    Binary,
    /// Words and numbers as people read them.
    Text,
}

/// A parser of outside bytes and what it promises.
#[derive(Clone, Copy, Debug)]
pub struct Target {
    /// Its name: of the corpus' folder, and for the command line.
    pub name: &'static str,
    /// How its inputs are written.
    pub form: Form,
    /// Panics when a promise is broken.
    pub check: fn(&[u8]),
    /// Bytes of memory that it may take whatever the input.
    pub own_bytes: usize,
    /// Bytes of memory that each byte of the input may cost.
    pub memory_factor: usize,
    /// Bytes that the input really unpacks to, each of which may cost `memory_factor` bytes as well; 0 where
    /// nothing is packed.
    pub unpacked: fn(&[u8]) -> usize,
}

const fn target(name: &'static str, form: Form, memory_factor: usize, check: fn(&[u8])) -> Target {
    Target { name, form, check, own_bytes: OWN_BYTES, memory_factor, unpacked: |_| 0 }
}

/// All of them.
pub const TARGETS: &[Target] = &[
    target("lms", Form::Binary, 64, wire::lms),
    // The buffers of two deframers, 64 KiB each.
    target("cola", Form::Binary, 256, wire::cola),
    target("scip", Form::Binary, 256, wire::scip),
    target("p2os", Form::Binary, 64, wire::p2os),
    target("rflex", Form::Binary, 64, wire::rflex),
    target("roboclaw", Form::Binary, 64, wire::roboclaw),
    target("xsens", Form::Binary, 64, wire::xsens),
    target("laser_session", Form::Binary, 1024, sessions::laser),
    target("base_session", Form::Binary, 1024, sessions::base),
    target("message", Form::Binary, 16, messages::any),
    Target { unpacked: recordings::unpacked, ..target("mcap", Form::Binary, 16, recordings::file) },
    target("rig", Form::Text, 400, rigs::rig),
    target("carmen", Form::Text, 64, logs::carmen),
    // Tables of three decompressors.
    Target { own_bytes: 16 << 20, ..target("bag", Form::Binary, 64, logs::bag) },
    target("poses", Form::Text, 64, logs::poses),
    target("relations", Form::Text, 64, logs::relations),
    target("obj", Form::Text, 64, geometry::obj),
    // Triangles of 72 bytes, of which a circle of one line makes many, and trees of planes.
    target("ifc", Form::Text, 4096, geometry::ifc),
    target("ply", Form::Binary, 64, geometry::ply),
    // Six other formats are made of it.
    Target { own_bytes: 16 << 20, ..target("model_json", Form::Text, 1024, geometry::model_json) },
    // The tables of a LAZ decompressor, and points that pack well.
    Target { own_bytes: 16 << 20, ..target("las", Form::Binary, 4096, geometry::cloud) },
    // Points that take a bit each.
    Target { own_bytes: 16 << 20, ..target("e57", Form::Binary, 4096, geometry::cloud) },
    // A byte of LZF is up to 88 of points.
    target("pcd", Form::Binary, 1024, geometry::cloud),
    target("ptx", Form::Text, 64, geometry::cloud),
    target("xyz", Form::Text, 64, geometry::cloud),
    target("world_path", Form::Text, 400, rigs::world_path),
    target("live_request", Form::Text, 64, words::live_request),
    target("words", Form::Text, 64, words::command_line),
];

/// The target of that name.
#[must_use]
pub fn named(name: &str) -> Option<&'static Target> {
    TARGETS.iter().find(|target| target.name == name)
}

/// Runs one input: panics where the parser breaks a promise of its own, takes more memory than the input is
/// worth, or does not come back. Memory is measured where [`crate::inputs::making::peak::PeakAllocator`] is
/// installed.
///
/// # Panics
/// With what is wrong.
pub fn judge(target: &Target, input: &[u8]) {
    let before_ns = thread_cpu_ns();
    let ((), taken) = making::peak::during(|| (target.check)(input));
    let spent_ns = thread_cpu_ns() - before_ns;
    assert!(spent_ns < TIME_NS, "{}: {} bytes took {spent_ns} ns", target.name, input.len());
    if taken > target.own_bytes {
        let allowed = target.own_bytes + target.memory_factor * (input.len() + (target.unpacked)(input));
        assert!(
            taken <= allowed,
            "{}: {} bytes took {taken} bytes of memory, {allowed} are allowed",
            target.name,
            input.len()
        );
    }
}
