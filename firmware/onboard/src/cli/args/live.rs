//! The words that serve a live view: of `record` and `replay`.

use crate::types::live_address::LiveAddress;
use crate::types::web_origin::WebOrigin;

/// Whether there is a live view, and who may look.
#[derive(Clone, Debug, clap::Args)]
pub(crate) struct LiveArgs {
    /// Serve a live view for Foxglove or Lichtblick: scans, poses, a growing map and points, at ws://ADDR
    /// (127.0.0.1:8765 when left out, which this machine alone can reach). ADDR is an IP address, a port or
    /// both. The run never waits for viewers.
    #[arg(long, value_name = "ADDR", num_args = 0..=1, default_missing_value = "127.0.0.1:8765")]
    pub live: Option<LiveAddress>,
    /// Let web pages from here look at the live view, such as https://viewer.example; may be given more than
    /// once. Desktop programs and pages that the viewer's own machine serves are let in anyway.
    #[arg(long, value_name = "ORIGIN", requires = "live")]
    pub allow_origin: Vec<WebOrigin>,
}
