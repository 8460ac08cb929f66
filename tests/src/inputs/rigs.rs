//! Files that people write by hand: `rig.toml`, paths of simulated drives.

use biplane_mock::world::path::Path;
use biplane_recording::Rig;

/// A rig that parses is printed, and what is printed is the same rig; all that is derived of it is finite.
pub(super) fn rig(input: &[u8]) {
    let Ok(rig) = Rig::parse(&String::from_utf8_lossy(input)) else { return };
    let printed = rig.to_toml();
    assert_eq!(Rig::parse(&printed).expect("what is printed parses"), rig, "{printed}");
    for laser in [Some(&rig.horizontal), rig.vertical.as_ref()].into_iter().flatten() {
        let point_in_base_m = laser.mount.base_from_laser([1.0, 2.0, 3.0]);
        assert!(point_in_base_m.iter().all(|v| v.is_finite()), "{printed}");
    }
}

/// A path of a simulated drive that parses can be checked.
pub(super) fn world_path(input: &[u8]) {
    let _ = Path::parse(&String::from_utf8_lossy(input));
}
