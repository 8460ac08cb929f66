//! What a run tells the service manager that started it (systemd, `Type=notify`); nothing where there is
//! none.

use sd_notify::NotifyState;

/// The line to the service manager.
#[derive(Copy, Clone, Debug)]
pub(crate) struct Service {
    is_there: bool,
    has_watchdog: bool,
}

impl Service {
    /// Looks for a service manager, as the environment tells.
    #[must_use]
    pub(crate) fn find() -> Self {
        Self {
            is_there: std::env::var_os("NOTIFY_SOCKET").is_some(),
            has_watchdog: sd_notify::watchdog_enabled().is_some(),
        }
    }

    /// The service is up: it records, or waits for devices that will be plugged in.
    pub(crate) fn ready(self) {
        self.notify(&[NotifyState::Ready]);
    }

    /// What the service does, in a sentence.
    pub(crate) fn status(self, text: &str) {
        self.notify(&[NotifyState::Status(text)]);
    }

    /// The loop is alive.
    pub(crate) fn alive(self) {
        if self.has_watchdog {
            self.notify(&[NotifyState::Watchdog]);
        }
    }

    /// The service ends by itself.
    pub(crate) fn stopping(self) {
        self.notify(&[NotifyState::Stopping]);
    }

    fn notify(self, states: &[NotifyState<'_>]) {
        if self.is_there {
            // A manager that does not listen changes nothing for us.
            let _ = sd_notify::notify(states);
        }
    }
}
