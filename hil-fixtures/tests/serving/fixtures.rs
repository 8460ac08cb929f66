//! The captures of `hil-fixtures/captures`: small, described, undamaged, and of use.

use biplane_mock::capture::source::Capture;
use std::path::{Path, PathBuf};

fn captures() -> Vec<PathBuf> {
    let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("captures");
    let files =
        std::fs::read_dir(folder).expect("the folder").filter_map(|entry| entry.ok().map(|e| e.path()));
    files.filter(|path| path.extension().is_some_and(|extension| extension == "mcap")).collect()
}

#[test]
fn every_capture_is_small_and_has_a_sidecar_that_tells_its_origin_and_checksum() {
    let crc32 = crc::Crc::<u32>::new(&crc::CRC_32_ISO_HDLC);
    let captures = captures();
    assert!(captures.len() >= 3);
    for path in captures {
        let bytes = std::fs::read(&path).expect("a file");
        assert!(bytes.len() < 300_000, "{}: {} bytes", path.display(), bytes.len());
        let text = std::fs::read_to_string(path.with_extension("toml")).expect("a sidecar");
        let sidecar: toml::Table = text.parse().expect("TOML");
        for key in ["device", "settings", "origin", "date", "obtained", "crc32"] {
            let value = sidecar.get(key).and_then(toml::Value::as_str).unwrap_or_default();
            assert!(!value.trim().is_empty(), "{}: {key}", path.display());
        }
        let found = format!("{:08x}", crc32.checksum(&bytes));
        assert_eq!(sidecar["crc32"].as_str(), Some(found.as_str()), "{}", path.display());
    }
}

#[test]
fn every_capture_holds_scans_of_both_lasers_and_odometry() {
    for path in captures() {
        let capture = Capture::read(&path).expect("a capture");
        for track in [&capture.horizontal, &capture.vertical] {
            let scans = track.as_ref().map_or(0, |track| track.times_ns().len());
            assert!(scans >= 20, "{}: {scans} scans", path.display());
        }
        assert!(capture.base.is_some_and(|track| track.packets.len() >= 20), "{}", path.display());
        assert!(capture.rig.is_some(), "{}", path.display());
    }
}
