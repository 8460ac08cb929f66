//! A line from time to time while something long goes on and nobody looks at a terminal: in a log one sees
//! that it lives, and how far it is.

use std::sync::mpsc::{RecvTimeoutError, Sender, channel};
use std::sync::{Arc, Mutex, PoisonError};
use std::thread::JoinHandle;
use std::time::Duration;

use biplane_cli::thread;

/// Time between two lines.
pub(crate) const HEARTBEAT: Duration = Duration::from_secs(30);
/// The stack of its thread, bytes: it writes a line.
const STACK_BYTES: usize = 256 << 10;

/// Says its text once in every period until it is dropped.
#[derive(Debug)]
pub(crate) struct Heartbeat {
    text: Arc<Mutex<String>>,
    /// Dropped to end the thread.
    end: Option<Sender<()>>,
    thread: Option<JoinHandle<()>>,
}

impl Heartbeat {
    /// The first line comes after one period. Where the system has no thread or no memory to spare nothing is
    /// said.
    pub(crate) fn new(period: Duration, text: &str, say: impl Fn(&str) + Send + 'static) -> Self {
        let text = Arc::new(Mutex::new(text.to_owned()));
        let (end, ended) = channel::<()>();
        let shown = Arc::clone(&text);
        let beat = move || {
            let mut periods = 0;
            while ended.recv_timeout(period) == Err(RecvTimeoutError::Timeout) {
                periods += 1;
                let text = shown.lock().unwrap_or_else(PoisonError::into_inner).clone();
                say(&format!("{text} ({} s)", (period * periods).as_secs()));
            }
        };
        let thread = thread::start("heartbeat", STACK_BYTES, beat).ok();
        Self { text, end: Some(end), thread }
    }

    /// Another text, from the next line on.
    pub(crate) fn set(&self, text: &str) {
        text.clone_into(&mut self.text.lock().unwrap_or_else(PoisonError::into_inner));
    }
}

impl Drop for Heartbeat {
    fn drop(&mut self) {
        drop(self.end.take());
        if let Some(thread) = self.thread.take() {
            let _ = thread.join();
        }
    }
}

#[cfg(test)]
mod tests {
    use super::Heartbeat;
    use std::sync::mpsc::channel;
    use std::time::Duration;

    #[test]
    fn the_last_text_comes_again_and_again_until_it_ends_and_never_of_what_is_short() {
        let (sender, lines) = channel();
        let say = move |line: &str| sender.send(line.to_owned()).unwrap();
        let heartbeat = Heartbeat::new(Duration::from_millis(1), "first", say);
        heartbeat.set("256 pairs searched");
        while !lines.recv().unwrap().starts_with("256 pairs searched (") {}
        assert_eq!(lines.recv().unwrap(), "256 pairs searched (0 s)");
        drop(heartbeat);
        assert!(lines.into_iter().all(|line| line.starts_with("256 pairs")), "and then no more");

        let (sender, lines) = channel();
        drop(Heartbeat::new(Duration::from_secs(3600), "short", move |line| {
            sender.send(line.to_owned()).unwrap();
        }));
        assert_eq!(lines.into_iter().count(), 0);
    }
}
