//! The ports of a run are opened, or waited for, before anything is read and before a file is begun.

use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};

use serde::Serialize;

use crate::io::line::OpenLine;
use crate::io::port_check;
use crate::io::port_check::NeededPort;
use crate::io::serial::Link;
use crate::record::RecordOptions;
use crate::record::status::notifier::StatusMode;
use crate::record::status::notifier::print_json;
use crate::record::status::service::Service;
use crate::types::device_name::device_name;
use crate::types::error::{OnboardError, PortRefused};

/// Ports that are waited for are looked for so often, nanoseconds.
const LOOK_NS: i64 = 250_000_000;
/// Machines are told so often what is waited for, nanoseconds.
const REPORT_NS: i64 = 1_000_000_000;

/// Opens all ports of a rig. All that are missing are told at once, or waited for.
///
/// # Errors
/// [`OnboardError::Ports`]; [`OnboardError::StoppedWaiting`] when `stop` is set while ports are waited for.
pub(crate) fn open_ports(
    options: &RecordOptions,
    service: Service,
    stop: &AtomicBool,
) -> Result<Vec<(Link, Arc<OpenLine>)>, OnboardError> {
    let mut slots: Vec<Slot<'_>> = port_check::of_rig(&options.rig).into_iter().map(Slot::new).collect();
    let mut reported_ns = i64::MIN;
    loop {
        let refused: Vec<_> = slots.iter_mut().filter_map(|slot| slot.open(options)).collect();
        if refused.is_empty() {
            return Ok(slots.into_iter().filter_map(|slot| slot.opened).collect());
        }
        if !options.wait {
            return Err(OnboardError::Ports { refused });
        }
        let now_ns = biplane_clock::monotonic_ns();
        if now_ns.saturating_sub(reported_ns) >= REPORT_NS {
            notify(options, service, &refused);
            reported_ns = now_ns;
        }
        service.alive();
        if stop.load(Ordering::Relaxed) {
            return Err(OnboardError::StoppedWaiting { missing: refused });
        }
        biplane_clock::sleep_ns(LOOK_NS);
    }
}

/// One port of the rig.
struct Slot<'a> {
    port: NeededPort<'a>,
    opened: Option<(Link, Arc<OpenLine>)>,
    /// It was said that it is waited for.
    reported: bool,
}

impl<'a> Slot<'a> {
    fn new(port: NeededPort<'a>) -> Self {
        Self { port, opened: None, reported: false }
    }

    /// Opens the port if it is not open yet; why not, when it cannot be.
    fn open(&mut self, options: &RecordOptions) -> Option<PortRefused> {
        if self.opened.is_some() {
            return None;
        }
        let NeededPort { device, path, .. } = self.port;
        match Link::open(&self.port, &options.serial_links) {
            Ok(opened) => {
                if self.reported {
                    tracing::info!("{}: {path} is there", device_name(device));
                }
                self.opened = Some(opened);
                None
            }
            Err(refused) => {
                if options.wait && !std::mem::replace(&mut self.reported, true) {
                    tracing::warn!("{refused}; waiting for it");
                }
                Some(refused)
            }
        }
    }
}

/// What a run that waits tells once a second, as one JSON object a line. In `docs/recording.md`.
#[derive(Debug, Serialize)]
struct Waiting<'a> {
    kind: &'static str,
    time_ns: i64,
    output: &'a std::path::Path,
    missing: &'a [PortRefused],
}

fn notify(options: &RecordOptions, service: Service, missing: &[PortRefused]) {
    service.status(&format!("waiting for {}", crate::types::error::names(missing)));
    // Up as far as it can be: the rest is for whoever plugs the devices in.
    service.ready();
    if options.status == StatusMode::Json {
        let time_ns = biplane_clock::utc_ns();
        print_json(&Waiting { kind: "waiting", time_ns, output: &options.output, missing });
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::record::status::service::Service;
    use biplane_recording::Rig;

    #[test]
    fn all_ports_that_are_missing_are_named_at_once() {
        let mut rig = Rig::default();
        rig.horizontal.port = "/nowhere/h".to_owned();
        rig.vertical = Some(rig.horizontal.clone());
        rig.vertical.as_mut().unwrap().port = "/nowhere/v".to_owned();
        rig.base.port = "/nowhere/b".to_owned();
        let mut options = RecordOptions::new(rig, "run.mcap");
        let stop = AtomicBool::new(true);
        for wait in [false, true] {
            options.wait = wait;
            let refused = open_ports(&options, Service::find(), &stop).unwrap_err().to_string();
            for port in ["/nowhere/h (horizontal laser)", "/nowhere/v (vertical laser)", "/nowhere/b (base)"]
            {
                assert!(refused.contains(port), "{refused}");
            }
        }
    }

    #[test]
    fn machines_are_told_what_is_waited_for_under_documented_names() {
        let refused = PortRefused { port: "/p".to_owned(), device: "base", reason: "gone".to_owned() };
        let waiting = Waiting {
            kind: "waiting",
            time_ns: 1,
            output: std::path::Path::new("run.mcap"),
            missing: std::slice::from_ref(&refused),
        };
        let value = serde_json::to_value(&waiting).unwrap();
        assert_eq!(value["missing"][0]["port"], "/p");
        let docs = include_str!("../../../../docs/recording.md");
        for object in [&value, &value["missing"][0]] {
            for name in object.as_object().unwrap().keys() {
                assert!(docs.contains(&format!("`{name}`")), "docs/recording.md does not tell of {name}");
            }
        }
    }
}
