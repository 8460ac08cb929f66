//! Values of flags that several commands take.

/// A length in meters: more than 0, and at most what makes sense for noise and distances of points.
pub(crate) fn length(text: &str) -> Result<f64, String> {
    meters_up_to(10.0, text)
}

/// The longest range of a scanner, meters.
pub(crate) fn range(text: &str) -> Result<f64, String> {
    meters_up_to(100_000.0, text)
}

fn meters_up_to(longest: f64, text: &str) -> Result<f64, String> {
    match text.parse::<f64>() {
        Ok(value) if value > 0.0 && value <= longest => Ok(value),
        _ => Err(format!("expected meters, more than 0 and at most {longest}")),
    }
}

/// The side of a tile, or its margin, meters.
pub(crate) fn tile_size(text: &str) -> Result<f64, String> {
    match text.parse::<f64>() {
        Ok(value) if (0.5..=10_000.0).contains(&value) => Ok(value),
        _ => Err("expected meters between 0.5 and 10000".to_owned()),
    }
}

/// An amount of memory, bytes: a number with K, M, G or T behind it (1000 each, as all messages count), or
/// without.
pub(crate) fn memory(text: &str) -> Result<u64, String> {
    let bare = text.strip_suffix(['B', 'b']).unwrap_or(text);
    let units = [(['K', 'k'], 1e3), (['M', 'm'], 1e6), (['G', 'g'], 1e9), (['T', 't'], 1e12)];
    let unit = units.into_iter().find_map(|(letters, bytes)| Some((bare.strip_suffix(letters)?, bytes)));
    let (number, unit) = unit.unwrap_or((bare, 1.0));
    match number.parse::<f64>().map(|number| number * unit) {
        Ok(bytes) if (1e6..=1e18).contains(&bytes) => Ok(bytes as u64),
        _ => Err("expected an amount of memory of at least 1M, such as 500M or 4G".to_owned()),
    }
}

/// Reads the side of a cell.
pub(crate) fn resolution(text: &str) -> Result<f64, String> {
    match text.parse::<f64>() {
        Ok(value) if (0.001..=10.0).contains(&value) => Ok(value),
        _ => Err("expected meters between 0.001 and 10".to_owned()),
    }
}

/// A number that is not negative.
pub(crate) fn not_negative(text: &str) -> Result<f64, String> {
    match text.parse::<f64>() {
        Ok(value) if value >= 0.0 => Ok(value),
        _ => Err("expected a number that is not negative".to_owned()),
    }
}

#[cfg(test)]
mod tests {
    use super::memory;

    #[test]
    fn memory_is_a_number_with_a_unit_or_without() {
        assert_eq!(memory("4G"), Ok(4_000_000_000));
        // What is asked for is what messages say.
        assert_eq!(memory("10M").map(biplane_cli::memory::megabytes), Ok("10 MB".to_owned()));
        assert_eq!(
            [memory("1.5M"), memory("500mb"), memory("2000000")],
            [Ok(1_500_000), Ok(500_000_000), Ok(2_000_000)]
        );
        for text in ["", "G", "-4G", "4X", "nan", "1e30", "10"] {
            assert!(memory(text).is_err(), "{text}");
        }
    }
}
