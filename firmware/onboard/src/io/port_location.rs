//! Where a port is, also after it moved.
//!
//! The kernel numbers adapters as they come: one that was pulled and put back may have been `/dev/ttyUSB0`
//! and be `/dev/ttyUSB2`. udev keeps links that follow the device, by what the adapter is (`by-id`) and by
//! the socket it sits in (`by-path`). A rig that names such a link, or one of its own rules', needs nothing
//! more. For a rig that names the device itself, the link that points to it is remembered while it is there:
//! the adapter's own, and the socket's only for an adapter without one. An adapter that is known is waited
//! for: in its socket may be another one by then, and two lasers would have changed places.

use std::path::{Path, PathBuf};

/// Where udev keeps its links.
pub(crate) const SERIAL_LINKS: &str = "/dev/serial";

/// The name under which a port is found.
#[derive(Clone, PartialEq, Eq, Debug)]
pub(crate) struct Place {
    configured: PathBuf,
    link: Option<PathBuf>,
}

impl Place {
    /// A port that is called so in the rig; what else it is called is not known yet.
    #[must_use]
    pub(crate) fn new(configured: impl Into<PathBuf>) -> Self {
        Self { configured: configured.into(), link: None }
    }

    /// Looks which link in `root` (usually [`SERIAL_LINKS`]) leads to the port, which is there now. A name
    /// that is a link itself is its owner's word: nothing else is taken for it.
    pub(crate) fn remember(&mut self, root: &Path) {
        self.link = None;
        let is_link = self.configured.symlink_metadata().is_ok_and(|found| found.is_symlink());
        let (false, Ok(device)) = (is_link, self.configured.canonicalize()) else { return };
        let leads_here = |link: &PathBuf| link.canonicalize().is_ok_and(|target| target == device);
        let first = |kind| {
            let entries = std::fs::read_dir(root.join(kind)).into_iter().flatten().flatten();
            entries.map(|entry| entry.path()).filter(leads_here).min()
        };
        self.link = first("by-id").or_else(|| first("by-path"));
    }

    /// The name in the rig.
    #[must_use]
    pub(crate) fn configured(&self) -> &Path {
        &self.configured
    }

    /// Where to look. The bare name only where no link is known: another adapter may have it now.
    #[must_use]
    pub(crate) fn now(&self) -> &Path {
        self.link.as_deref().unwrap_or(&self.configured)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::fs;
    use std::os::unix::fs::symlink;

    #[test]
    fn a_bare_name_is_followed_by_its_adapter_or_else_its_socket_and_a_link_is_taken_at_its_word() {
        let root = std::env::temp_dir().join(format!("biplane-place-{}", std::process::id()));
        let _ = fs::remove_dir_all(&root);
        for kind in ["by-id", "by-path"] {
            fs::create_dir_all(root.join(kind)).unwrap();
        }
        for number in 0..3 {
            fs::write(root.join(format!("ttyUSB{number}")), "").unwrap();
        }
        symlink("../ttyUSB0", root.join("by-id/usb-FTDI_A")).unwrap();
        symlink("../ttyUSB1", root.join("by-id/usb-FTDI_B")).unwrap();
        symlink("../ttyUSB1", root.join("by-path/pci-2")).unwrap();
        symlink("../ttyUSB2", root.join("by-path/pci-3")).unwrap();
        let place = |name: &str| {
            let mut place = Place::new(root.join(name));
            place.remember(&root);
            place
        };
        let found = |place: &Place| place.now().strip_prefix(&root).unwrap().to_owned();
        assert_eq!(found(&place("ttyUSB0")), Path::new("by-id/usb-FTDI_A"));
        let known = place("ttyUSB1");
        assert_eq!(found(&place("ttyUSB2")), Path::new("by-path/pci-3"), "it has no name of its own");
        assert_eq!(found(&place("by-path/pci-2")), Path::new("by-path/pci-2"));
        assert_eq!(found(&place("ttyS9")), Path::new("ttyS9"), "nothing is known of it");
        // The adapter is pulled, and another one is put in its socket: it is not taken for it.
        fs::remove_file(root.join("by-id/usb-FTDI_B")).unwrap();
        assert_eq!(found(&known), Path::new("by-id/usb-FTDI_B"));
        assert!(!known.now().exists());
        fs::remove_dir_all(root).unwrap();
    }
}
