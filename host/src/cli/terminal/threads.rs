//! `--threads`, of every command that uses several.

/// Words that commands share.
#[derive(Clone, Debug, Default, clap::Args)]
pub(crate) struct Threads {
    /// Threads to use; the result does not depend on it [default: all processors]
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u16).range(1..))]
    threads: Option<u16>,
}

impl Threads {
    /// Takes as many as were asked for; before anything runs on several.
    pub(crate) fn take(&self) -> anyhow::Result<()> {
        if let Some(threads) = self.threads {
            rayon::ThreadPoolBuilder::new().num_threads(usize::from(threads)).build_global()?;
        }
        Ok(())
    }
}
