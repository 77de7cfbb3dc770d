//! Times of day and dates as instants: `10:11:12.000001`, `2019-11-21T10:11:12.1Z`.

use super::decimal::Exact;

/// The unit of a column of them, in notes and reports.
pub(super) const UNIT: &str = "time of day";

/// Seconds since midnight or, behind a date of ISO 8601, since 1970, exactly; of other dates the time of day alone
/// counts, for day and month are written in either order.
pub(super) fn instant(cell: &str) -> Option<Exact> {
    let cell = cell.strip_suffix(['Z', 'z']).unwrap_or(cell);
    let (date, time) = match cell.split_once(['T', ' ']) {
        Some((date, time)) => (Some(date), time.trim()),
        None => (None, cell),
    };
    let days = match date {
        None => 0,
        Some(date) => match days(date) {
            Some(days) => days,
            None if is_date(date) => 0,
            None => return None,
        },
    };
    // An offset from UTC is the same in every row.
    let (time, _) = time.split_once('+').unwrap_or((time, ""));
    let mut parts = time.splitn(3, ':');
    let [hours, minutes] = [parts.next()?, parts.next()?].map(|part| digits(part, 2));
    let (seconds, fraction) =
        parts.next()?.split_once(['.', ',', ':']).map_or_else(|| (time.rsplit(':').next(), ""), |(s, f)| (Some(s), f));
    let whole = ((24 * days + hours?) * 60 + minutes?) * 60 + digits(seconds?, 2)?;
    let places = i32::try_from(fraction.len()).ok().filter(|places| *places <= 15)?;
    let fraction = if fraction.is_empty() { 0 } else { digits(fraction, 15)? };
    Some(Exact::new(i128::from(whole) * 10i128.pow(places.unsigned_abs()) + i128::from(fraction), -places))
}

/// Seconds of the minute with their fraction, as written.
pub(super) fn seconds(cell: &str) -> &str {
    cell.trim_end_matches(['Z', 'z']).rsplit(':').next().unwrap_or_default()
}

fn digits(text: &str, most: usize) -> Option<i64> {
    let plain = (1..=most).contains(&text.len()) && text.bytes().all(|byte| byte.is_ascii_digit());
    plain.then(|| text.parse().ok()).flatten()
}

fn is_date(text: &str) -> bool {
    let parts: Vec<&str> = text.split(['/', '.', '-']).collect();
    parts.len() == 3 && parts.iter().all(|part| digits(part, 4).is_some())
}

/// Days since 1970 of `2019-11-21`.
fn days(text: &str) -> Option<i64> {
    let mut parts = text.split('-');
    let [year, month, day] = [parts.next()?, parts.next()?, parts.next()?].map(|part| digits(part, 4));
    let (year, month, day) = (year?, month?, day?);
    if parts.next().is_some() || text.find('-') != Some(4) || !(1..=12).contains(&month) || !(1..=31).contains(&day) {
        return None;
    }
    // Counted from 1 March, so that a leap day ends its year.
    let years = if month > 2 { year } else { year - 1 };
    let day_of_year = (153 * ((month + 9) % 12) + 2) / 5 + day - 1;
    Some(365 * years + years / 4 - years / 100 + years / 400 + day_of_year - 719_468)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn times_and_dates_are_counted_in_seconds() {
        let since = |a: &str, b: &str| instant(a).unwrap().minus(instant(b).unwrap()).unwrap();
        assert_eq!(since("10:11:12.000001", "10:11:12.000000"), 1e-6);
        assert_eq!(since("1:00:00", "00:59:59.5"), 0.5);
        assert_eq!(since("1970-01-02 00:00:00", "00:00:00"), 86_400.0);
        assert_eq!(since("2019-11-21T10:11:12.1Z", "1970-01-01 00:00:00"), 1_574_331_072.1);
        assert_eq!(since("2024-03-01T00:00:00+01:00", "2024-02-28T00:00:00+01:00"), 2.0 * 86_400.0);
        assert_eq!(since("11/21/2019 10:11:12:001", "11/21/2019 10:11:12:000"), 1e-3);
        for text in ["", "12", "1.5", "10:11", "a:b:c", "2019-11-21", "10:11:12.x", "ok 10:11:12", "-1:00:00"] {
            assert_eq!(instant(text), None, "{text}");
        }
    }
}
