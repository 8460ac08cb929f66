//! Configuration, measuring mode and status report in words, as `probe` prints them. What the listing does
//! not explain is printed as a number.

use core::fmt::{self, Display, Formatter};

use super::{Config, MeasuringMode, StatusReport, Unit};
use crate::lms::settings::mode::mode_name;

impl Display for Unit {
    fn fmt(&self, f: &mut Formatter<'_>) -> fmt::Result {
        f.write_str(match self {
            Unit::Cm => "cm",
            Unit::Mm => "mm",
            Unit::TenCm => "10 cm",
        })
    }
}

impl Display for MeasuringMode {
    fn fmt(&self, f: &mut Formatter<'_>) -> fmt::Result {
        let flags = match self {
            MeasuringMode::FieldsAbDazzle => "fields A and B, dazzle",
            MeasuringMode::Reflector8 => "reflector levels 0 to 7",
            MeasuringMode::FieldsAbc => "fields A, B and C",
            MeasuringMode::Reflector4 => "reflector levels 0 to 3",
            MeasuringMode::FieldsAb => "fields A and B",
            MeasuringMode::Reflector2 => "reflector yes or no",
            MeasuringMode::FieldA => "field A",
            MeasuringMode::NormalizedRemission => "normalized remission",
            MeasuringMode::RawRemission => "raw remission",
            MeasuringMode::Immediate => "no flags",
            MeasuringMode::Energy => "energy instead of range",
            MeasuringMode::Other(_) => "meaning not known",
        };
        write!(f, "measuring mode {:02X}h (", self.byte())?;
        if let Some(bits) = self.range_bits() {
            write!(f, "{bits} bits of range, ")?;
        }
        write!(f, "{flags})")
    }
}

impl Display for Config {
    fn fmt(&self, f: &mut Formatter<'_>) -> fmt::Result {
        write!(f, "{} bytes", self.as_bytes().len())?;
        match (self.unit(), self.as_bytes().get(6)) {
            (Some(unit), _) => write!(f, ", {unit}")?,
            (None, Some(byte)) => write!(f, ", unit {byte}")?,
            (None, None) => {}
        }
        if let Some(mode) = self.measuring_mode() {
            write!(f, ", {mode}")?;
        }
        if let Some(availability) = self.availability() {
            write!(f, ", availability {:02X}h", availability.0)?;
            write!(f, " (index bytes {}", on_off(availability.index_bytes()))?;
            write!(f, ", goes on when dazzled {}", on_off(availability.level_3()))?;
            write!(f, ", outputs ignore dazzle {})", on_off(availability.dazzle_ignored()))?;
        }
        if let (Some(threshold), Some(sensitivity)) = (self.threshold_mv(), self.sensitivity()) {
            write!(f, ", threshold {threshold}, peak threshold or sensitivity {sensitivity}")?;
        }
        if let Some(blanking_cm) = self.blanking_cm() {
            write!(f, ", blanking {blanking_cm} cm")?;
        }
        if let (Some(evaluation), Some(restart)) = (self.multiple_evaluation(), self.restart()) {
            write!(f, ", multiple evaluation {evaluation}, restart {restart}")?;
        }
        Ok(())
    }
}

fn on_off(on: bool) -> &'static str {
    if on { "on" } else { "off" }
}

impl Display for StatusReport<'_> {
    fn fmt(&self, f: &mut Formatter<'_>) -> fmt::Result {
        write!(f, "firmware {}, ", self.version())?;
        match mode_name(self.operating_mode()) {
            Some(name) => f.write_str(name)?,
            None => write!(f, "operating mode {:02X}h", self.operating_mode())?,
        }
        f.write_str(if self.has_fault() { ", fault" } else { ", no fault" })?;
        f.write_str(if self.laser_on() { ", laser on" } else { ", laser off" })?;
        let (degrees, hundredths) = (self.resolution_cdeg() / 100, self.resolution_cdeg() % 100);
        write!(f, ", {} degrees in steps of {degrees}.{hundredths:02}", self.angle_deg())?;
        match self.unit() {
            Ok(unit) => write!(f, ", {unit}")?,
            Err(byte) => write!(f, ", unit {byte}")?,
        }
        write!(f, ", {}", self.measuring_mode())?;
        match self.baud() {
            Ok(baud) => write!(f, ", {} Bd", baud.bits_per_second())?,
            Err(code) => write!(f, ", rate code {code:04X}h")?,
        }
        f.write_str(if self.permanent_baud() { " also after power-on" } else { ", 9600 Bd after power-on" })?;
        f.write_str(", window")?;
        self.pollution().iter().try_for_each(|channel| write!(f, " {channel}"))
    }
}

#[cfg(test)]
mod tests {
    extern crate std;
    use super::super::{Config, MeasuringMode, StatusFields, StatusReport};
    use std::string::ToString;

    #[test]
    fn a_configuration_is_said_in_words_as_far_as_it_goes() {
        assert_eq!(
            Config::factory().to_string(),
            "34 bytes, mm, measuring mode 00h (13 bits of range, fields A and B, dazzle), availability 00h (index bytes off, \
             goes on when dazzled off, outputs ignore dazzle off), threshold 70, peak threshold or sensitivity 0, blanking 0 cm, \
             multiple evaluation 2, restart 2"
        );
        assert_eq!(Config::default().to_string(), "0 bytes");
        let odd = Config::from_bytes(&[0, 0, 0, 0, 2, 0x20, 9]).unwrap().to_string();
        assert!(odd.starts_with(
            "7 bytes, unit 9, measuring mode 20h (meaning not known), availability 02h (index bytes on"
        ));
        assert_eq!(MeasuringMode::Energy.to_string(), "measuring mode 3Fh (energy instead of range)");
    }

    #[test]
    fn a_status_report_is_said_in_words() {
        let mut fields = StatusFields { has_fault: true, operating_mode: 0x99, ..StatusFields::default() };
        let words = |fields: &StatusFields| StatusReport::new(&fields.encode()).unwrap().to_string();
        assert_eq!(
            words(&fields),
            "firmware X01.27, operating mode 99h, fault, laser on, 180 degrees in steps of 0.50, cm, measuring mode 00h (13 bits \
             of range, fields A and B, dazzle), 9600 Bd, 9600 Bd after power-on, window 100 100 100 100 100 100 100 100"
        );
        fields.operating_mode = 0x24;
        assert!(words(&fields).starts_with("firmware X01.27, continuous output, fault"));
    }
}
