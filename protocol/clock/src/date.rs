//! Dates of the calendar.

const NS_PER_S: i64 = 1_000_000_000;
const S_PER_DAY: i64 = 86_400;

/// A time as `2001-09-09T01:46:40.000000000Z` (proleptic Gregorian calendar, UTC).
#[must_use]
pub fn iso_8601(time_ns: i64) -> String {
    let seconds = time_ns.div_euclid(NS_PER_S);
    let (day, second) = (seconds.div_euclid(S_PER_DAY), seconds.rem_euclid(S_PER_DAY));
    // Years that begin in March put the leap day at their end; an era is 400 years, 146,097 days.
    let from_march = day + 719_468;
    let (era, day_of_era) = (from_march.div_euclid(146_097), from_march.rem_euclid(146_097));
    let year_of_era = (day_of_era - day_of_era / 1460 + day_of_era / 36_524 - day_of_era / 146_096) / 365;
    let day_of_year = day_of_era - (365 * year_of_era + year_of_era / 4 - year_of_era / 100);
    let month_from_march = (5 * day_of_year + 2) / 153;
    let day_of_month = day_of_year - (153 * month_from_march + 2) / 5 + 1;
    let month = (month_from_march + 2) % 12 + 1;
    let year = era * 400 + year_of_era + i64::from(month <= 2);
    let (hour, minute) = (second / 3600, second / 60 % 60);
    let nanosecond = time_ns.rem_euclid(NS_PER_S);
    format!(
        "{year:04}-{month:02}-{day_of_month:02}T{hour:02}:{minute:02}:{:02}.{nanosecond:09}Z",
        second % 60
    )
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn times_are_written_as_the_calendar_has_them() {
        let table = [
            (0, "1970-01-01T00:00:00.000000000Z"),
            (1_000_000_000 * NS_PER_S + 5, "2001-09-09T01:46:40.000000005Z"),
            (951_782_400 * NS_PER_S, "2000-02-29T00:00:00.000000000Z"),
            (1_735_689_599 * NS_PER_S, "2024-12-31T23:59:59.000000000Z"),
            (-NS_PER_S, "1969-12-31T23:59:59.000000000Z"),
        ];
        for (time_ns, text) in table {
            assert_eq!(iso_8601(time_ns), text);
        }
    }
}
