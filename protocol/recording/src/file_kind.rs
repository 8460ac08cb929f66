//! What a file is that is not what was asked for, and which command takes it.

use std::fmt;

/// Bytes at a file's start that tell what it is.
pub const KIND_BYTES: u64 = 512;
/// Characters of a text that are shown.
const SHOWN_CHARS: usize = 40;
/// Bytes of anything else that are shown.
const SHOWN_BYTES: usize = 8;

/// What a file is, by its first bytes.
#[derive(Copy, Clone, PartialEq, Eq, Debug)]
pub enum FileKind {
    /// A recording or capture.
    Mcap,
    /// A log of CARMEN, or of whoever writes its lines.
    Carmen,
    /// A ROS 1 bag.
    RosBag,
    /// A database of `SQLite`, as ROS 2 bags are.
    Sqlite,
    /// A point cloud or mesh as PLY.
    Ply,
    /// A point cloud as LAS or LAZ.
    Las,
    /// Point clouds as ASTM E57.
    E57,
    /// A point cloud of the Point Cloud Library.
    Pcd,
    /// A mesh or cloud as Wavefront OBJ.
    Obj,
    /// A model as binary glTF.
    Glb,
    /// A building as IFC.
    Ifc,
    /// A picture.
    Picture,
    /// Something packed: gzip, bzip2, xz, zip, zstd.
    Packed,
    /// A `rig.toml`.
    Rig,
}

/// How files begin.
const STARTS: [(&[u8], FileKind); 24] = [
    (b"\x89MCAP", FileKind::Mcap),
    (b"#ROSBAG V", FileKind::RosBag),
    (b"SQLite format 3\0", FileKind::Sqlite),
    (b"ply\n", FileKind::Ply),
    (b"ply\r", FileKind::Ply),
    (b"LASF", FileKind::Las),
    (b"ASTM-E57", FileKind::E57),
    (b"# .PCD", FileKind::Pcd),
    (b"VERSION 0.7\nFIELDS", FileKind::Pcd),
    (b"VERSION .7\nFIELDS", FileKind::Pcd),
    (b"glTF", FileKind::Glb),
    (b"ISO-10303-21", FileKind::Ifc),
    (b"\x89PNG", FileKind::Picture),
    (b"\xff\xd8\xff", FileKind::Picture),
    (b"GIF8", FileKind::Picture),
    (b"P5\n", FileKind::Picture),
    (b"\x1f\x8b", FileKind::Packed),
    (b"BZh", FileKind::Packed),
    (b"\xfd7zXZ", FileKind::Packed),
    (b"PK\x03\x04", FileKind::Packed),
    (b"\x28\xb5\x2f\xfd", FileKind::Packed),
    (b"# CARMEN Logfile", FileKind::Carmen),
    (b"[horizontal]", FileKind::Rig),
    (b"[base]", FileKind::Rig),
];

/// Words that begin a line of a CARMEN log.
const CARMEN_LINES: [&str; 9] = [
    "FLASER ",
    "RLASER ",
    "ROBOTLASER1 ",
    "ROBOTLASER2 ",
    "RAWLASER1 ",
    "RAWLASER2 ",
    "ODOM ",
    "PARAM ",
    "SYNC ",
];

impl FileKind {
    /// The kind of a file that begins so; [`KIND_BYTES`] are enough. `None` for what is none of these.
    #[must_use]
    pub fn of(start: &[u8]) -> Option<Self> {
        if let Some((_, kind)) = STARTS.iter().find(|(bytes, _)| start.starts_with(bytes)) {
            return Some(*kind);
        }
        let text = text_of(start)?;
        let mut lines = text.lines().filter(|line| !line.starts_with('#') && !line.trim().is_empty());
        let line = lines.next()?;
        if CARMEN_LINES.iter().any(|word| line.starts_with(word)) {
            return Some(Self::Carmen);
        }
        ["v ", "vn ", "mtllib ", "o ", "g "].iter().any(|word| line.starts_with(word)).then_some(Self::Obj)
    }
}

impl fmt::Display for FileKind {
    /// What it is, and which command takes it.
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(match self {
            Self::Mcap => "an MCAP file",
            Self::Carmen => "a CARMEN log (`biplane import carmen` reads it)",
            Self::RosBag => "a ROS 1 bag",
            Self::Sqlite => "an SQLite database, as ROS 2 bags are",
            Self::Ply => "a PLY file (`biplane planes` reads clouds, `biplane compact` meshes)",
            Self::Las => "a LAS or LAZ cloud (`biplane planes` reads it)",
            Self::E57 => "an E57 cloud (`biplane planes` reads it)",
            Self::Pcd => "a PCD cloud (`biplane planes` reads it)",
            Self::Obj => "a Wavefront OBJ file (`biplane compact` reads meshes)",
            Self::Glb => "a glTF model",
            Self::Ifc => {
                "an IFC building (`biplane compare --ifc` and `biplane-mock simulate --world` read it)"
            }
            Self::Picture => "a picture",
            Self::Packed => "packed: unpack it first",
            Self::Rig => "a rig.toml (it goes with --rig)",
        })
    }
}

/// What a file is that begins so, in words for an error: "is empty", "is a PLY file", "is a text that begins
/// with", "begins with 68 65 6c".
#[must_use]
pub fn describe(start: &[u8]) -> String {
    if start.is_empty() {
        return "is empty".to_owned();
    }
    if let Some(kind) = FileKind::of(start) {
        return format!("is {kind}");
    }
    if let Some(text) = text_of(start) {
        let line: String = text.lines().next().unwrap_or_default().chars().take(SHOWN_CHARS).collect();
        return format!("is a text that begins with \"{line}\"");
    }
    let shown: Vec<String> = start.iter().take(SHOWN_BYTES).map(|byte| format!("{byte:02x}")).collect();
    format!("begins with {}", shown.join(" "))
}

/// The start as text, if it is one; a character that the end cuts in two is left out.
#[must_use]
pub fn text_of(start: &[u8]) -> Option<&str> {
    let text = match std::str::from_utf8(start) {
        Ok(text) => text,
        Err(error) if error.error_len().is_none() => {
            std::str::from_utf8(&start[..error.valid_up_to()]).ok()?
        }
        Err(_) => return None,
    };
    let is_plain = |c: char| !c.is_control() || "\n\r\t".contains(c);
    (!text.is_empty() && text.chars().all(is_plain)).then_some(text)
}

#[cfg(test)]
mod tests {
    use super::{FileKind, describe};

    #[test]
    fn files_are_known_by_how_they_begin() {
        let table: [(&[u8], FileKind); 12] = [
            (b"\x89MCAP0\r\n\x01", FileKind::Mcap),
            (b"#ROSBAG V2.0\n", FileKind::RosBag),
            (b"SQLite format 3\0\x10", FileKind::Sqlite),
            (b"ply\nformat ascii 1.0\n", FileKind::Ply),
            (b"LASF\0\0", FileKind::Las),
            (b"ASTM-E57\x01\0", FileKind::E57),
            (b"# .PCD v0.7 - Point Cloud Data\n", FileKind::Pcd),
            (b"PARAM robot_front_laser_max 81.9\n", FileKind::Carmen),
            (b"# message_name [message contents]\nFLASER 180 1.2", FileKind::Carmen),
            (b"# a comment\nv 0 0 0\n", FileKind::Obj),
            (b"PK\x03\x04\x14\0", FileKind::Packed),
            (b"ISO-10303-21;\nHEADER;", FileKind::Ifc),
        ];
        for (start, kind) in table {
            assert_eq!(FileKind::of(start), Some(kind), "{}", start.escape_ascii());
        }
        for other in [&b""[..], b"hello", b"\x00\x01\x02", b"velocity 3", b"\xc3"] {
            assert_eq!(FileKind::of(other), None, "{}", other.escape_ascii());
        }
    }

    #[test]
    fn words_tell_what_it_is_and_what_takes_it() {
        assert_eq!(describe(b""), "is empty");
        assert_eq!(describe(b"hello, world\nagain"), "is a text that begins with \"hello, world\"");
        assert_eq!(describe(b"\x00\x01\xffabcdefgh"), "begins with 00 01 ff 61 62 63 64 65");
        assert!(describe(b"FLASER 3 1 2 3").ends_with("(`biplane import carmen` reads it)"));
        // A text whose last character is cut in two is a text.
        assert_eq!(
            describe("gr\u{fc}".as_bytes().split_last().unwrap().1),
            "is a text that begins with \"gr\""
        );
    }
}
