//! A line from time to time that says which stage runs and how far it is, for logs: whoever reads one knows
//! that the program lives.

use std::sync::Arc;
use std::sync::atomic::{AtomicU32, Ordering};
use std::sync::mpsc::{RecvTimeoutError, Sender, channel};
use std::thread::JoinHandle;
use std::time::Duration;

/// Between two lines of one stage.
pub(super) const INTERVAL: Duration = Duration::from_secs(30);
/// Shares of a stage's work are kept in steps of a thousandth; this stands for none told.
const UNKNOWN: u32 = u32::MAX;

/// See the module's text.
pub(super) struct Heartbeat {
    stages: Option<Sender<&'static str>>,
    share: Arc<AtomicU32>,
    thread: Option<JoinHandle<()>>,
}

impl Heartbeat {
    /// Says lines by `notify` while a stage runs. Where no thread can be had, none are said.
    pub(super) fn new(interval: Duration, notify: impl Fn(&str) + Send + 'static) -> Self {
        let (stages, begun) = channel();
        let share = Arc::new(AtomicU32::new(UNKNOWN));
        let of_thread = Arc::clone(&share);
        let work = move || {
            let mut running = None;
            let mut beats = 0;
            loop {
                match begun.recv_timeout(interval) {
                    Ok(name) => (running, beats) = (Some(name), 0),
                    Err(RecvTimeoutError::Disconnected) => return,
                    Err(RecvTimeoutError::Timeout) => {
                        beats += 1;
                        let Some(name) = running else { continue };
                        notify(&line(name, interval * beats, of_thread.load(Ordering::Relaxed)));
                    }
                }
            }
        };
        let thread = std::thread::Builder::new().name("heartbeat".to_owned()).spawn(work).ok();
        Self { stages: Some(stages), share, thread }
    }

    /// A stage begins.
    pub(super) fn begin(&self, name: &'static str) {
        self.share.store(UNKNOWN, Ordering::Relaxed);
        // A thread that could not be had hears nothing.
        let _ = self.stages.as_ref().map(|stages| stages.send(name));
    }

    /// This share of its work is done, 0 to 1.
    pub(super) fn at(&self, share: f64) {
        self.share.store((share.clamp(0.0, 1.0) * 1000.0) as u32, Ordering::Relaxed);
    }
}

impl Drop for Heartbeat {
    fn drop(&mut self) {
        self.stages = None;
        let _ = self.thread.take().map(JoinHandle::join);
    }
}

fn line(name: &str, running: Duration, share: u32) -> String {
    let done = if share == UNKNOWN { String::new() } else { format!(", {} % done", share / 10) };
    format!("  {name:<10} runs for {} s{done}", running.as_secs())
}

#[cfg(test)]
mod tests {
    use super::{Heartbeat, UNKNOWN, line};
    use std::sync::mpsc::channel;
    use std::time::Duration;

    #[test]
    fn a_stage_that_runs_is_named_again_and_again_and_one_that_is_over_is_not() {
        let (sender, lines) = channel();
        let heartbeat = Heartbeat::new(Duration::from_millis(5), move |text: &str| {
            let _ = sender.send(text.to_owned());
        });
        heartbeat.begin("planes");
        heartbeat.at(0.5);
        for _ in 0..2 {
            let half_done = lines.iter().find(|line| line.contains("50 % done")).unwrap();
            assert!(half_done.contains("planes"), "{half_done}");
        }
        heartbeat.begin("polygons");
        assert!(lines.iter().find(|line| !line.contains("planes")).unwrap().contains("polygons"));
        drop(heartbeat);
        while lines.try_recv().is_ok() {}
        assert!(lines.recv().is_err(), "the thread is gone");
    }

    #[test]
    fn what_is_not_known_is_not_said() {
        assert_eq!(line("write", Duration::from_secs(60), UNKNOWN), "  write      runs for 60 s");
        assert_eq!(line("map", Duration::from_secs(30), 999), "  map        runs for 30 s, 99 % done");
    }
}
