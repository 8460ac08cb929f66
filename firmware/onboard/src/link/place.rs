//! Where a port is, also after it moved.
//!
//! The kernel numbers adapters as they come: one that was pulled and put back may have been `/dev/ttyUSB0` and be `/dev/ttyUSB2`.
//! udev keeps links that follow the device, by what the adapter is (`by-id`) and by the socket it sits in (`by-path`). A rig that
//! names such a link, or one of its own rules', needs nothing more. For a rig that names the device itself, the links that point to it
//! are remembered while it is there.

use std::path::{Path, PathBuf};

/// Where udev keeps its links.
pub const SERIAL_LINKS: &str = "/dev/serial";

/// The names under which a port may be found.
#[derive(Clone, PartialEq, Eq, Debug)]
pub struct Place {
    configured: PathBuf,
    links: Vec<PathBuf>,
}

impl Place {
    /// A port that is called so in the rig; what else it is called is not known yet.
    #[must_use]
    pub fn new(configured: impl Into<PathBuf>) -> Self {
        Self { configured: configured.into(), links: Vec::new() }
    }

    /// Looks which links in `root` (usually [`SERIAL_LINKS`]) lead to the port, which is there now. A name that is a link itself is
    /// its owner's word: nothing else is taken for it.
    pub fn remember(&mut self, root: &Path) {
        self.links.clear();
        let is_link = self.configured.symlink_metadata().is_ok_and(|found| found.is_symlink());
        let (false, Ok(device)) = (is_link, self.configured.canonicalize()) else { return };
        for kind in ["by-id", "by-path"] {
            let entries = std::fs::read_dir(root.join(kind)).into_iter().flatten().flatten();
            let leads_here = |link: &PathBuf| link.canonicalize().is_ok_and(|target| target == device);
            self.links.extend(entries.map(|entry| entry.path()).filter(leads_here).min());
        }
    }

    /// The name in the rig.
    #[must_use]
    pub fn configured(&self) -> &Path {
        &self.configured
    }

    /// Where to look, in order. The bare name only where no link is known: another adapter may have it now.
    pub fn candidates(&self) -> impl Iterator<Item = &Path> {
        let bare = self.links.is_empty().then_some(self.configured.as_path());
        self.links.iter().map(PathBuf::as_path).chain(bare)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::fs;
    use std::os::unix::fs::symlink;

    #[test]
    fn a_bare_name_is_followed_by_its_links_and_a_link_is_taken_at_its_word() {
        let root = std::env::temp_dir().join(format!("biplane-place-{}", std::process::id()));
        let _ = fs::remove_dir_all(&root);
        for kind in ["by-id", "by-path"] {
            fs::create_dir_all(root.join(kind)).unwrap();
        }
        for number in 0..2 {
            fs::write(root.join(format!("ttyUSB{number}")), "").unwrap();
        }
        symlink("../ttyUSB0", root.join("by-id/usb-FTDI_A")).unwrap();
        symlink("../ttyUSB1", root.join("by-id/usb-FTDI_B")).unwrap();
        symlink("../ttyUSB1", root.join("by-path/pci-2")).unwrap();
        let places = |configured: PathBuf| {
            let mut place = Place::new(configured);
            place.remember(&root);
            place.candidates().map(|path| path.strip_prefix(&root).unwrap().to_owned()).collect::<Vec<_>>()
        };
        assert_eq!(places(root.join("ttyUSB0")), [Path::new("by-id/usb-FTDI_A")]);
        assert_eq!(places(root.join("ttyUSB1")), [Path::new("by-id/usb-FTDI_B"), Path::new("by-path/pci-2")]);
        assert_eq!(places(root.join("by-path/pci-2")), [Path::new("by-path/pci-2")]);
        assert_eq!(places(root.join("ttyS9")), [Path::new("ttyS9")], "nothing is known of it");
        fs::remove_dir_all(root).unwrap();
    }
}
