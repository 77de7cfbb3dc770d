//! Decimal numbers written with a point or with a comma.

use super::choice::choice;

choice! {
    /// Decimal sign of a number.
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
    pub(crate) fn name(self) -> &'static str {
        match self {
            Self::Point => "decimal points",
            Self::Comma => "decimal commas",
        }
    }

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

/// The number in `cell` (without surrounding spaces); `None` if it is not a number in this notation.
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

/// An exact decimal number `digits` · 10^`exponent`, without the rounding of a double.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) struct Exact {
    digits: i128,
    exponent: i32,
}

impl Exact {
    pub(super) fn new(digits: i128, exponent: i32) -> Self {
        Self { digits, exponent }
    }

    /// Parses `cell`; `None` if it is not a number or has too many digits.
    pub(super) fn of(cell: &str, decimal: DecimalSign) -> Option<Self> {
        number(cell, decimal)?;
        let (mantissa, exponent) = cell.split_once(['e', 'E']).unwrap_or((cell, "0"));
        let (whole, fraction) = mantissa.split_once(decimal.character()).unwrap_or((mantissa, ""));
        let digits = format!("{whole}{fraction}").parse().ok()?;
        let places = i32::try_from(fraction.len()).ok()?;
        Some(Self { digits, exponent: exponent.parse::<i32>().ok()?.checked_sub(places)? })
    }

    /// The difference to `other`, rounded once.
    pub(super) fn minus(self, other: Self) -> Option<f64> {
        let exponent = self.exponent.min(other.exponent);
        let scaled = |it: Self| {
            let more = u32::try_from(it.exponent.checked_sub(exponent)?).ok()?;
            it.digits.checked_mul(10i128.checked_pow(more)?)
        };
        format!("{}e{exponent}", scaled(self)?.checked_sub(scaled(other)?)?).parse().ok()
    }
}

/// Unit of a number's last digit: 1e-6 for `-9.9998e-02`, 1 for `12`; `None` if it is not a number.
pub(super) fn last_digit(cell: &str, decimal: DecimalSign) -> Option<f64> {
    number(cell, decimal).filter(|value| value.is_finite())?;
    let (mantissa, exponent) = cell.split_once(['e', 'E']).unwrap_or((cell, "0"));
    let places = mantissa.split_once(decimal.character()).map_or(0, |(_, digits)| digits.len() as i32);
    Some(10f64.powi(exponent.parse::<i32>().ok()?.checked_sub(places)?))
}

/// Units of the last digits of a column's numbers, where trailing zeros may be missing: `0.01` for `0.0100000`.
#[derive(Debug, Default)]
pub(super) struct LastDigits {
    /// Value and unit of its last written digit.
    written: Vec<(f64, f64)>,
}

impl LastDigits {
    pub(super) fn add(&mut self, cell: &str, decimal: DecimalSign) {
        self.written.extend(number(cell, decimal).zip(last_digit(cell, decimal)));
    }

    /// The units if zeros at the end are missing, and as written. In the first case a column has as many decimals as its finest number, or as
    /// many digits as its longest, whichever is coarser, and a zero (`0.00E+00`) is as fine as the finest.
    pub(super) fn units(self) -> [Vec<f64>; 2] {
        // The logarithm of a power of ten may fall short of it.
        let decade = |value: f64| (value.abs().log10() + 1e-12).floor();
        let others = || self.written.iter().filter(|(value, _)| *value != 0.0);
        let finest = others().map(|(_, unit)| *unit).fold(f64::INFINITY, f64::min);
        let longest = others().map(|(value, unit)| decade(*value) - unit.log10().round()).fold(0.0, f64::max);
        let unit = |&(value, written): &(f64, f64)| {
            let by_length = if value == 0.0 { 0.0 } else { 10f64.powi((decade(value) - longest) as i32) };
            written.min(finest.max(by_length))
        };
        [self.written.iter().map(unit).collect(), self.written.iter().map(|(_, written)| *written).collect()]
    }
}

/// Whether `cell` may be a whole number with `sign` as thousands separator: `1,234`, `12.000`, but not `0.123`.
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
