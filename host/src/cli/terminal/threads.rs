//! `--threads`, of every command that uses several.

use std::sync::Once;

use anyhow::Context;

static STARTED: Once = Once::new();

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
            let threads = usize::from(self.threads.unwrap_or(0));
            started = rayon::ThreadPoolBuilder::new().num_threads(threads).build_global();
        });
        started.with_context(|| {
            format!("cannot start threads: {}; --threads 1 needs the least", biplane_cli::memory::advice())
        })
    }
}
