//! Stamps as the time that LAS files have: seconds of GPS less 1e9.
//!
//! GPS counts every second, UTC (and with it Unix time) has left some out. Source: IERS Bulletin C,
//! announcements of leap seconds.

/// 1980-01-06 00:00:00 UTC, where GPS begins, in Unix time, seconds.
const GPS_ZERO_S: i64 = 315_964_800;
/// What LAS takes off so that numbers stay small, seconds.
const ADJUSTMENT_S: i64 = 1_000_000_000;
/// Unix time after each leap second since 1980; there was none from 2017 to 2026.
const LEAPS_S: [i64; 18] = [
    362_793_600,   // 1981-07-01
    394_329_600,   // 1982-07-01
    425_865_600,   // 1983-07-01
    489_024_000,   // 1985-07-01
    567_993_600,   // 1988-01-01
    631_152_000,   // 1990-01-01
    662_688_000,   // 1991-01-01
    709_948_800,   // 1992-07-01
    741_484_800,   // 1993-07-01
    773_020_800,   // 1994-07-01
    820_454_400,   // 1996-01-01
    867_715_200,   // 1997-07-01
    915_148_800,   // 1999-01-01
    1_136_073_600, // 2006-01-01
    1_230_768_000, // 2009-01-01
    1_341_100_800, // 2012-07-01
    1_435_708_800, // 2015-07-01
    1_483_228_800, // 2017-01-01
];
const NS_PER_S: i64 = 1_000_000_000;

/// Adjusted standard GPS time of a stamp in Unix nanoseconds, seconds.
pub(crate) fn adjusted_s(stamp_ns: i64) -> f64 {
    let (whole_s, rest_ns) = (stamp_ns.div_euclid(NS_PER_S), stamp_ns.rem_euclid(NS_PER_S));
    let leaps = LEAPS_S.iter().filter(|at| whole_s >= **at).count() as i64;
    (whole_s - GPS_ZERO_S + leaps - ADJUSTMENT_S) as f64 + rest_ns as f64 / NS_PER_S as f64
}

#[cfg(test)]
mod tests {
    use super::{LEAPS_S, adjusted_s};

    #[test]
    fn known_instants_have_their_gps_time() {
        // GPS week 1024 (the first roll-over) began 1999-08-22 00:00:00 GPS, which is 1999-08-21 23:59:47
        // UTC.
        assert!((adjusted_s(935_279_987_000_000_000) + 1e9 - 1024.0 * 604_800.0).abs() < 1e-6);
        // Week 2048 began 2019-04-07 00:00:00 GPS, 2019-04-06 23:59:42 UTC.
        assert!((adjusted_s(1_554_595_182_500_000_000) + 1e9 - 2048.0 * 604_800.0 - 0.5).abs() < 1e-6);
        assert!(LEAPS_S.is_sorted() && LEAPS_S.iter().all(|at| at % 86_400 == 0));
    }
}
