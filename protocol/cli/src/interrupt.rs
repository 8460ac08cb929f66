//! Ctrl-C and its relatives: a line says what is kept of the work.

use std::io::{self, IsTerminal};

use signal_hook::consts::{SIGHUP, SIGINT, SIGTERM};
use signal_hook::iterator::Signals;

use crate::ending::{end_now, write_at_once};
use crate::thread;

/// A thread that waits and then removes files.
const STACK_BYTES: usize = 1 << 18;

/// From now on SIGINT, SIGTERM and SIGHUP end the program by [`crate::clean_up_by`]. Those that whoever
/// started the program has switched off (`nohup`, a shell's background jobs) stay off.
///
/// # Errors
/// When the system refuses; signals then end the program in silence.
pub fn end_on_signals() -> io::Result<()> {
    let ignored = ignored_signals();
    let caught = [SIGINT, SIGTERM, SIGHUP].into_iter().filter(|signal| ignored >> (signal - 1) & 1 == 0);
    let mut signals = Signals::new(caught)?;
    let watch = move || {
        if let Some(signal) = signals.forever().next() {
            if io::stderr().is_terminal() {
                // Behind the terminal's ^C and a line of progress.
                write_at_once(b"\n");
            }
            end_now(|| name(signal).to_owned());
        }
    };
    thread::start("signals", STACK_BYTES, watch).map(drop)
}

fn name(signal: i32) -> &'static str {
    match signal {
        SIGINT => "interrupted",
        SIGTERM => "told to end (SIGTERM)",
        _ => "its terminal is gone (SIGHUP)",
    }
}

/// The signals that are ignored, bit n - 1 for signal n.
fn ignored_signals() -> u64 {
    let status = std::fs::read_to_string("/proc/self/status").unwrap_or_default();
    let mask = status.lines().find_map(|line| line.strip_prefix("SigIgn:"));
    mask.and_then(|mask| u64::from_str_radix(mask.trim(), 16).ok()).unwrap_or(0)
}
