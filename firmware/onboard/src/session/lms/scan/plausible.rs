//! The second line behind the checksum, which misses some errors of two neighboring bytes.
//!
//! While a device streams as it was asked, the form of its telegrams does not change: kind, address, count
//! word with unit and flags, index bytes, source of the status byte. A telegram of another form than the
//! device's configuration and its scans so far promise is doubted. Should the device send that form after
//! all, its second telegram of the kind is believed, and so are the first and all that follow: the same
//! damage does not come twice. A doubted telegram without a second was damaged, and is left out and counted.
//! Nor is the first one believed of a device that starts to stream again as it is configured as it was, when
//! it has another form than the ones before. Ranges say nothing of their truth: any of them may be.

use biplane_wire::lms::{Config, Severity, Status, Unit};

use crate::session::lms::scan::ranges::Measured;

/// What stays the same from telegram to telegram.
#[derive(Copy, Clone, PartialEq, Eq, Debug)]
pub(crate) struct Form {
    address: u8,
    code: u8,
    /// Number of values, unit and flags; of an interlaced turn without number and offset, which alternate.
    count_word: u16,
    has_index: bool,
    source: u8,
    /// Whether the listing names the status byte's severity.
    is_severity_named: bool,
}

/// Set in the count word of one turn of an interlaced scan.
const PARTIAL: u16 = 0x2000;
/// Unit and partial flag.
const KIND: u16 = 0xE000;

impl Form {
    /// The form of a telegram.
    pub(crate) fn of(address: u8, code: u8, status: Status, measured: &Measured<'_>) -> Self {
        let word = match measured {
            Measured::Scan(scan) => scan.count_word(),
            Measured::Pairs(pairs) => pairs.parts().next().map_or(0, |part| part.count_word()),
            Measured::S14(scan) => scan.count_word(),
        };
        Self {
            address,
            code,
            count_word: if word & PARTIAL == 0 { word } else { word & KIND },
            has_index: measured.index().is_some(),
            source: status.source(),
            is_severity_named: !matches!(status.severity(), Severity::Unknown(_)),
        }
    }

    fn unit(self) -> Option<Unit> {
        Unit::from_byte((self.count_word >> 14) as u8)
    }
}

/// Forms that are kept.
const FORMS: usize = 4;

/// A form that comes again within this time was not damage that came twice, nanoseconds. Larger: damage that
/// passed the checksum twice is counted as a telegram that was lost.
const SOON_NS: i64 = 10_000_000_000;

/// What is to be made of a telegram.
#[derive(Copy, Clone, PartialEq, Eq, Debug)]
pub(crate) enum Verdict {
    /// The device sent it.
    Accepted,
    /// The device sent it, and also the doubted one of its form a moment before.
    Confirmed,
    /// It may be damaged.
    Doubted,
}

/// Judges the forms of telegrams.
#[derive(Clone, PartialEq, Eq, Debug, Default)]
pub(crate) struct Plausibility {
    accepted: heapless::Deque<Form, FORMS>,
    /// Seen once, and when.
    suspects: heapless::Deque<(Form, i64), FORMS>,
    config: Option<Config>,
    /// What came again and again, and of which configuration.
    usual: Option<(Config, Form)>,
}

fn keep<T>(forms: &mut heapless::Deque<T, FORMS>, form: T) {
    if forms.is_full() {
        forms.pop_front();
    }
    let _ = forms.push_back(form);
}

impl Plausibility {
    /// The device may send another form from here on: as its configuration says, where that is known.
    pub(crate) fn restart(&mut self, config: Option<&Config>) {
        *self = Self { config: config.cloned(), usual: self.usual.take(), ..Self::default() };
    }

    /// Whether a telegram of this form can be one that the device sent; `now_ns` is when it came.
    pub(crate) fn judge(&mut self, form: Form, now_ns: i64) -> Verdict {
        if self.accepted.iter().any(|accepted| *accepted == form) {
            self.renew(form);
            self.usual = self.config.clone().map(|config| (config, form));
            return Verdict::Accepted;
        }
        let is_first = self.accepted.is_empty() && self.fits_configuration(form) && self.is_as_usual(form);
        let doubted_ns = self.suspects.iter().find(|(suspect, _)| *suspect == form).map(|(_, ns)| *ns);
        if is_first || doubted_ns.is_some() {
            keep(&mut self.accepted, form);
            let is_soon = doubted_ns.is_some_and(|ns| now_ns.saturating_sub(ns) < SOON_NS);
            return if is_soon { Verdict::Confirmed } else { Verdict::Accepted };
        }
        keep(&mut self.suspects, (form, now_ns));
        Verdict::Doubted
    }

    /// The form seen last goes last: damage that came twice, some hours apart, must not drive out the form
    /// that comes all the time.
    fn renew(&mut self, form: Form) {
        for _ in 0..self.accepted.len() {
            if let Some(other) = self.accepted.pop_front().filter(|other| *other != form) {
                let _ = self.accepted.push_back(other);
            }
        }
        let _ = self.accepted.push_back(form);
    }

    fn fits_configuration(&self, form: Form) -> bool {
        let config = self.config.as_ref();
        let same_unit = config.and_then(Config::unit).is_none_or(|unit| form.unit() == Some(unit));
        let has_index = config.and_then(Config::availability).map(|availability| availability.index_bytes());
        same_unit && has_index.is_none_or(|has_index| form.has_index == has_index) && form.is_severity_named
    }

    /// Whether a device that is configured as it was has sent this form before, if it has sent any.
    fn is_as_usual(&self, form: Form) -> bool {
        let usual = self.usual.as_ref().filter(|(config, _)| Some(config) == self.config.as_ref());
        usual.is_none_or(|(_, usual)| *usual == form)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use biplane_wire::lms::{Reply, Scan, Telegram};

    /// Parses a telegram and judges it; `None` when it is no scan at all.
    fn judged(plausibility: &mut Plausibility, bytes: &[u8]) -> Option<bool> {
        let telegram = Telegram::parse(bytes).ok()?;
        let Reply::Scan(view) = telegram.reply().ok()? else { return None };
        let measured = Measured::Scan(view);
        crate::session::lms::scan::scan_geometry::ScanGeometry::of_count(measured.count(), false)?;
        let form = Form::of(telegram.address(), telegram.code(), telegram.status()?, &measured);
        Some(plausibility.judge(form, 0) != Verdict::Doubted)
    }

    fn telegram(count: u16, unit: Unit, index: Option<(u8, u8)>, status: u8) -> Vec<u8> {
        let values = (0..count).map(|i| 300 + i).collect();
        let scan = Scan { unit, values, index, status: Status(status), ..Scan::default() };
        let mut bytes = vec![0; scan.encoded_len()];
        scan.emit(0x80, &mut bytes).unwrap();
        bytes
    }

    #[test]
    fn another_form_is_left_out_once_and_believed_the_second_time() {
        let mut plausibility = Plausibility::default();
        let usual = telegram(361, Unit::Cm, Some((4, 1)), 0x10);
        for other in [
            telegram(361, Unit::Mm, Some((4, 2)), 0x10),
            telegram(361, Unit::Cm, None, 0x10),
            telegram(361, Unit::Cm, Some((4, 2)), 0x18),
            telegram(361, Unit::Cm, Some((4, 2)), 0x17),
            telegram(181, Unit::Cm, Some((4, 2)), 0x10),
        ] {
            assert_eq!(judged(&mut plausibility, &usual), Some(true));
            assert_eq!(judged(&mut plausibility, &other), Some(false));
            for _ in 0..3 {
                assert_eq!(judged(&mut plausibility, &usual), Some(true), "the usual one is never left out");
                assert_eq!(judged(&mut plausibility, &other), Some(true));
            }
            plausibility.restart(None);
        }
    }

    #[test]
    fn of_a_device_that_streams_again_as_it_did_another_form_is_not_believed_at_first_sight() {
        let mut plausibility = Plausibility::default();
        let config = Config::from_bytes(&[0; 32]).unwrap();
        let (usual, damaged) = (telegram(181, Unit::Cm, None, 0x10), telegram(181, Unit::Cm, None, 0x00));
        for first in [&usual, &damaged] {
            plausibility.restart(Some(&config));
            assert_eq!(judged(&mut plausibility, first), Some(*first == usual));
            assert_eq!(judged(&mut plausibility, &usual), Some(true));
            assert_eq!(judged(&mut plausibility, &usual), Some(true));
        }
        // Configured otherwise it may send what it likes.
        let mut other = [0; 32];
        other[0] = 1;
        plausibility.restart(Some(&Config::from_bytes(&other).unwrap()));
        assert_eq!(judged(&mut plausibility, &damaged), Some(true));
    }

    #[test]
    fn damage_that_comes_twice_again_and_again_does_not_drive_out_the_usual_form() {
        let mut plausibility = Plausibility::default();
        let usual = telegram(361, Unit::Cm, None, 0x10);
        for (count, unit) in
            [(101, Unit::Cm), (181, Unit::Cm), (201, Unit::Cm), (401, Unit::Cm), (361, Unit::Mm)]
        {
            for expected in [false, true] {
                assert_eq!(judged(&mut plausibility, &usual), Some(true), "before {count} {unit:?}");
                assert_eq!(judged(&mut plausibility, &telegram(count, unit, None, 0x10)), Some(expected));
            }
        }
        assert_eq!(judged(&mut plausibility, &usual), Some(true));
    }

    #[test]
    fn what_a_device_says_of_its_state_is_no_other_form() {
        let mut plausibility = Plausibility::default();
        for (index, status) in [(0, 0x10), (17, 0x90), (254, 0x50), (15, 0x33), (30, 0x14)] {
            let telegram = telegram(361, Unit::Cm, Some((index, 3)), status);
            assert_eq!(judged(&mut plausibility, &telegram), Some(true), "{status:02X}");
        }
    }

    #[test]
    fn the_first_telegram_is_held_against_the_configuration() {
        let mut plausibility = Plausibility::default();
        plausibility.restart(Some(&Config::factory()));
        assert_eq!(judged(&mut plausibility, &telegram(361, Unit::Cm, None, 0x10)), Some(false));
        assert_eq!(judged(&mut plausibility, &telegram(361, Unit::Mm, Some((1, 1)), 0x10)), Some(false));
        assert_eq!(judged(&mut plausibility, &telegram(361, Unit::Mm, None, 0x10)), Some(true));
    }

    #[test]
    fn of_the_errors_that_the_checksum_misses_all_outside_the_values_but_state_and_count_are_caught() {
        // Bit j of a byte and bit j + 1 of the next: the checksum never sees it.
        let good = telegram(361, Unit::Cm, Some((4, 1)), 0x10);
        let mut missed_places = Vec::new();
        let mut total = 0;
        for byte in 0..good.len() - 3 {
            for bit in 0..7 {
                let mut bad = good.clone();
                bad[byte] ^= 1 << bit;
                bad[byte + 1] ^= 1 << (bit + 1);
                let mut plausibility = Plausibility::default();
                assert_eq!(judged(&mut plausibility, &good), Some(true));
                let taken = judged(&mut plausibility, &bad) == Some(true);
                total += 1;
                if taken {
                    missed_places.push(byte);
                }
            }
        }
        let values = 7..7 + 2 * 361;
        let outside = missed_places.iter().filter(|&byte| !values.contains(byte)).count();
        // A value's range may be any; so may the telegram index, and of the status byte fault, pollution and
        // restart input.
        assert_eq!((total, missed_places.len()), (5117, 5061), "{outside} outside the values");
    }

    #[test]
    fn so_many_telegrams_that_bit_noise_has_damaged_pass_both_lines() {
        // One bit in ten thousand, as the mock's preset: nearly every second telegram is hit.
        const FLIPS_PER_10_000_BITS: f64 = 1.0;
        const TELEGRAMS: u32 = 100_000;
        let good = telegram(361, Unit::Cm, Some((4, 1)), 0x10);
        let mut rng = biplane_mock::rng::Rng::new(7, 7, 7);
        let (mut damaged, mut past_checksum, mut past_both) = (0, 0, 0);
        for _ in 0..TELEGRAMS {
            let mut bad = good.clone();
            let mut bit = rng.exponential(10_000.0 / FLIPS_PER_10_000_BITS);
            while bit < (good.len() * 8) as f64 {
                bad[bit as usize / 8] ^= 1 << (bit as usize % 8);
                bit += 1.0 + rng.exponential(10_000.0 / FLIPS_PER_10_000_BITS);
            }
            if bad == good {
                continue;
            }
            damaged += 1;
            let mut plausibility = Plausibility::default();
            assert_eq!(judged(&mut plausibility, &good), Some(true));
            past_checksum += u32::from(Telegram::parse(&bad).is_ok());
            past_both += u32::from(judged(&mut plausibility, &bad) == Some(true));
        }
        assert_eq!((damaged, past_checksum, past_both), (44_253, 10, 10));
    }
}
