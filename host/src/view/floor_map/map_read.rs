//! The floor map of a build's folder, read back: the pair that `map_files` has written.

use std::fs;
use std::io;
use std::path::Path;

use biplane_recording::messages::shown::FloorMap;

/// Values of `/map`.
const OCCUPIED: i8 = 100;
const FREE: i8 = 0;
const UNKNOWN: i8 = -1;

/// Reads `map.pgm` and `map.yaml` of a folder; `None` where there are none.
///
/// # Errors
/// When they cannot be read, or are not as this program writes them.
pub(crate) fn read_map(folder: &Path) -> io::Result<Option<FloorMap>> {
    let (image, text) = (folder.join("map.pgm"), folder.join("map.yaml"));
    if !image.exists() || !text.exists() {
        return Ok(None);
    }
    let odd = |path: &Path| {
        let what = format!("{} is not as `biplane build` writes it", path.display());
        io::Error::new(io::ErrorKind::InvalidData, what)
    };
    let (size, cells) = cells_of(&fs::read(&image)?).ok_or_else(|| odd(&image))?;
    let (cell_m, origin_m) = place_of(&fs::read_to_string(&text)?).ok_or_else(|| odd(&text))?;
    Ok(Some(FloorMap { cell_m, size, origin_m, cells }))
}

/// Size and cells, from the lower left.
fn cells_of(bytes: &[u8]) -> Option<([u32; 2], Vec<i8>)> {
    let mut parts = bytes.splitn(4, |&byte| byte == b'\n');
    let (magic, size, white) = (parts.next()?, parts.next()?, parts.next()?);
    let pixels = parts.next()?;
    let (columns, rows) = std::str::from_utf8(size).ok()?.split_once(' ')?;
    let (columns, rows): (u32, u32) = (columns.parse().ok()?, rows.parse().ok()?);
    let is_whole = pixels.len() as u64 == u64::from(columns) * u64::from(rows) && columns > 0;
    if magic != b"P5" || white != b"255" || !is_whole {
        return None;
    }
    let cell = |pixel: &u8| match pixel {
        0 => OCCUPIED,
        254 => FREE,
        _ => UNKNOWN,
    };
    let rows = pixels.chunks(columns as usize).rev();
    Some(([columns, pixels.len() as u32 / columns], rows.flatten().map(cell).collect()))
}

/// Side of a cell and lower left corner, meters.
fn place_of(text: &str) -> Option<(f32, [f64; 2])> {
    let value = |key: &str| text.lines().find_map(|line| line.strip_prefix(key)).map(str::trim);
    let cell_m = value("resolution:")?.parse().ok()?;
    let origin = value("origin:")?.strip_prefix('[')?.strip_suffix(']')?;
    let mut numbers = origin.split(',').map(|number| number.trim().parse::<f64>().ok());
    Some((cell_m, [numbers.next()??, numbers.next()??]))
}

#[cfg(test)]
mod tests {
    use super::{cells_of, place_of};

    #[test]
    fn rows_are_counted_from_below() {
        let bytes = b"P5\n2 2\n255\n\x00\xfe\xcd\x00";
        assert_eq!(cells_of(bytes), Some(([2, 2], vec![-1, 100, 100, 0])));
        assert_eq!(cells_of(&bytes[..13]), None);
        assert_eq!(cells_of(b"P5\n0 0\n255\n"), None);
    }

    #[test]
    fn the_place_is_that_of_the_description() {
        let text = "image: map.pgm\nmode: trinary\nresolution: 0.05\norigin: [-1.500000, 2.000000, 0.0]\n";
        assert_eq!(place_of(text), Some((0.05, [-1.5, 2.0])));
        assert_eq!(place_of("resolution: 0.05\norigin: [1.0]\n"), None);
    }
}
