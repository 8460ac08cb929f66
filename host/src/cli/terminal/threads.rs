//! `--threads`, of every command that uses several.

use std::sync::Once;

use anyhow::Context;

static STARTED: Once = Once::new();

/// Stack of a thread.
const STACK_BYTES: usize = 2 << 20;
/// What the system and the standard library put beside it. A thread that finds no room for that panics, which
/// nobody can tell in time.
const BESIDE_BYTES: usize = 512 << 10;

/// Words that commands share.
#[derive(Clone, Debug, Default, clap::Args)]
pub(crate) struct Threads {
    /// Threads to use; the result does not depend on it [default: all processors]
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u16).range(1..))]
    threads: Option<u16>,
}

impl Threads {
    /// Starts as many as were asked for, before anything runs on several: started later, those that the
    /// system refuses would end the program without a word. Only the first call in a process starts any.
    pub(crate) fn take(&self) -> anyhow::Result<()> {
        let mut started = Ok(());
        STARTED.call_once(|| {
            started = start(usize::from(self.threads.unwrap_or(0)));
        });
        started.with_context(|| {
            format!("cannot start threads: {}; --threads 1 needs the least", biplane_cli::memory::advice())
        })
    }
}

/// Starts so many, or with 0 as many as there are processors, where there is room for all.
fn start(threads: usize) -> anyhow::Result<()> {
    let processors = || std::thread::available_parallelism().map_or(1, usize::from);
    let count = if threads > 0 { threads } else { processors() };
    let mut room: Vec<u8> = Vec::new();
    room.try_reserve_exact(count * (STACK_BYTES + BESIDE_BYTES))?;
    // Else the compiler leaves out what nobody uses.
    drop(std::hint::black_box(room));
    rayon::ThreadPoolBuilder::new().num_threads(threads).stack_size(STACK_BYTES).build_global()?;
    Ok(())
}
