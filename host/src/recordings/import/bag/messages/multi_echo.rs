//! `sensor_msgs/MultiEchoLaserScan`: a list of echoes a beam, of which one is taken.

use biplane_recording::messages::LaserScan;
use biplane_recording::messages::cdr::{CdrError, Decoder};

use crate::recordings::import::bag::options::Echo;

/// A scan of one echo a beam, and how many beams had several.
pub(crate) fn read(decoder: &mut Decoder<'_>, echo: Echo) -> Result<(LaserScan, usize), CdrError> {
    let mut scan = LaserScan::read_without_beams(decoder)?;
    let (ranges, intensities) = (echoes(decoder)?, echoes(decoder)?);
    let has_intensities = intensities.len() == ranges.len();
    let mut several = 0;
    for (beam, echoes) in ranges.iter().enumerate() {
        several += usize::from(echoes.len() > 1);
        let bright: &[f32] = if has_intensities { &intensities[beam] } else { &[] };
        let place = match echo {
            Echo::First => 0,
            Echo::Last => echoes.len().saturating_sub(1),
            Echo::Strongest if bright.len() == echoes.len() => brightest(bright),
            Echo::Strongest => 0,
        };
        // A beam without an echo came back from nowhere.
        scan.ranges_m.push(echoes.get(place).copied().unwrap_or(f32::INFINITY));
        if has_intensities {
            scan.intensities.push(bright.get(place).copied().unwrap_or(0.0));
        }
    }
    Ok((scan, several))
}

fn echoes(decoder: &mut Decoder<'_>) -> Result<Vec<Vec<f32>>, CdrError> {
    let count = decoder.count(4)?;
    (0..count).map(|_| decoder.f32_sequence()).collect()
}

fn brightest(intensities: &[f32]) -> usize {
    let places = intensities.iter().enumerate();
    places.fold((0, f32::MIN), |best, (place, &value)| if value > best.1 { (place, value) } else { best }).0
}
