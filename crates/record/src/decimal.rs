//! Decimal numbers written with a point or with a comma.

use super::choice::choice;

choice! {
    /// What stands between the whole part of a number and its fraction.
    pub enum DecimalSign {
        /// 0.5
        #[default]
        Point = "point",
        /// 0,5
        Comma = "comma",
    }
}

impl DecimalSign {
    /// Its name in messages, in the plural.
    #[must_use]
    pub fn name(self) -> &'static str {
        match self {
            Self::Point => "decimal points",
            Self::Comma => "decimal commas",
        }
    }

    /// The character.
    #[must_use]
    pub(crate) fn character(self) -> char {
        match self {
            Self::Point => '.',
            Self::Comma => ',',
        }
    }

    pub(super) fn other(self) -> Self {
        match self {
            Self::Point => Self::Comma,
            Self::Comma => Self::Point,
        }
    }
}

/// Longest number that is rewritten without an allocation.
const SHORT: usize = 48;

/// The number in `cell`, which has no space around it; `None` if it is none in this writing.
pub(super) fn number(cell: &str, decimal: DecimalSign) -> Option<f64> {
    if decimal == DecimalSign::Point {
        return cell.parse().ok();
    }
    let Some(at) = cell.bytes().position(|byte| matches!(byte, b',' | b'.')) else { return cell.parse().ok() };
    if cell.as_bytes()[at] == b'.' {
        return None;
    }
    // A second comma is no number to `parse` either.
    if cell.len() > SHORT {
        return cell.replacen(',', ".", 1).parse().ok();
    }
    let mut point = [0; SHORT];
    let point = &mut point[..cell.len()];
    point.copy_from_slice(cell.as_bytes());
    point[at] = b'.';
    std::str::from_utf8(point).ok()?.parse().ok()
}

/// The unit of a number's last digit: 1e-6 of `-9.9998e-02`, 1 of `12`; `None` where it is no number.
pub(super) fn last_digit(cell: &str, decimal: DecimalSign) -> Option<f64> {
    number(cell, decimal).filter(|value| value.is_finite())?;
    let (mantissa, exponent) = cell.split_once(['e', 'E']).unwrap_or((cell, "0"));
    let places = mantissa.split_once(decimal.character()).map_or(0, |(_, digits)| digits.len() as i32);
    Some(10f64.powi(exponent.parse::<i32>().ok()?.checked_sub(places)?))
}

/// Whether `cell` may as well be a whole number with its thousands set off by `sign`: `1,234`, `12.000`, but not `0.123`.
pub(super) fn may_be_grouped(cell: &str, sign: DecimalSign) -> bool {
    let mut parts = cell.trim_start_matches(['-', '+']).split(sign.character());
    let first = parts.next().unwrap_or_default();
    let digits = |part: &str| !part.is_empty() && part.bytes().all(|byte| byte.is_ascii_digit());
    let mut groups = 0;
    let even = parts.all(|part| {
        groups += 1;
        part.len() == 3 && digits(part)
    });
    even && groups > 0 && digits(first) && first.len() <= 3 && !first.starts_with('0')
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_comma_gives_the_very_number_that_a_point_gives() {
        for text in ["0.1", "-12.345678901234567", "1.5e-9", "+3", "-.25", "7.", "1e5"] {
            let plain = number(text, DecimalSign::Point);
            assert!(plain.is_some(), "{text}");
            assert_eq!(number(&text.replace('.', ","), DecimalSign::Comma), plain, "{text}");
        }
        let long = format!("0,{}1", "0".repeat(60));
        assert_eq!(number(&long, DecimalSign::Comma), Some(1e-61));
        for text in ["1.5", "1,2,3", "1.234,5", "1,234.5", ",", "", "a"] {
            assert_eq!(number(text, DecimalSign::Comma), None, "{text}");
        }
        assert_eq!(number("1,5", DecimalSign::Point), None);
    }

    #[test]
    fn thousands_are_suspected_only_where_they_can_be() {
        for text in ["1,234", "-12,000", "1,234,567"] {
            assert!(may_be_grouped(text, DecimalSign::Comma), "{text}");
        }
        for text in ["0,123", "1,23", "1234,567", "1,2345", "1,234e3", "1234", "", "12"] {
            assert!(!may_be_grouped(text, DecimalSign::Comma), "{text}");
        }
    }
}
