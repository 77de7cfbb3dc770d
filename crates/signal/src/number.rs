//! Numbers for readers: consistent significant digits, a true minus sign, engineering prefixes.

use super::quantity::{Dimension, Quantity};

/// `value` with `digits` decimals and a true minus sign; −0 is 0.
pub fn fixed(value: f64, digits: usize) -> String {
    let text = format!("{value:.digits$}");
    match text.strip_prefix('-') {
        Some(rest) if rest.chars().all(|letter| matches!(letter, '0' | '.')) => rest.to_owned(),
        Some(rest) => format!("−{rest}"),
        None => text,
    }
}

/// `value` to `figures` significant figures, without an exponent between 1e-4 and 1e6.
///
/// ```
/// use granchain_signal::number::significant;
/// assert_eq!(significant(-246.84, 3), "−247");
/// assert_eq!(significant(0.30418, 3), "0.304");
/// assert_eq!(significant(3.2e9, 2), "3.2×10⁹");
/// assert_eq!(significant(f64::NAN, 3), "–");
/// ```
pub fn significant(value: f64, figures: usize) -> String {
    if !value.is_finite() {
        return "–".to_owned();
    }
    if value == 0.0 {
        return "0".to_owned();
    }
    let figures = figures.max(1);
    let exponent = rounded_exponent(value, figures);
    if (-4..6).contains(&exponent) {
        let places = figures as i32 - 1 - exponent;
        let rounded = if places < 0 { (value / 10f64.powi(-places)).round() * 10f64.powi(-places) } else { value };
        return fixed(rounded, places.max(0) as usize);
    }
    let lead = fixed(value / 10f64.powi(exponent), figures - 1);
    format!("{lead}×{}", power_of_ten(exponent))
}

/// `value` to three significant figures at most, without trailing zeros: for bounds and settings.
///
/// ```
/// use granchain_signal::number::short;
/// assert_eq!(short(0.02), "0.02");
/// assert_eq!(short(3660.0), "3660");
/// ```
pub fn short(value: f64) -> String {
    let text = significant(value, 3);
    let (number, power) = text.split_once('×').map_or((text.as_str(), None), |(number, power)| (number, Some(power)));
    let number = if number.contains('.') { number.trim_end_matches('0').trim_end_matches('.') } else { number };
    power.map_or(number.to_owned(), |power| format!("{number}×{power}"))
}

/// `value` rounded to two significant figures of its `uncertainty`.
///
/// ```
/// use granchain_signal::number::to_uncertainty;
/// assert_eq!(to_uncertainty(0.503_21, 0.012_34), "0.503");
/// assert_eq!(to_uncertainty(3659.7, 412.0), "3660");
/// ```
pub fn to_uncertainty(value: f64, uncertainty: f64) -> String {
    if !value.is_finite() || !uncertainty.is_finite() || uncertainty <= 0.0 || value == 0.0 {
        return significant(value, 3);
    }
    let last = rounded_exponent(uncertainty, 2) - 1;
    let figures = rounded_exponent(value, 1) - last + 1;
    significant(value, figures.clamp(2, 8) as usize)
}

/// `value` in SI with an engineering prefix before `unit`, to `figures` significant figures.
///
/// ```
/// use granchain_signal::number::engineering;
/// assert_eq!(engineering(0.2891, "m/s", 3), "289 mm/s");
/// assert_eq!(engineering(73e3, "Hz", 3), "73.0 kHz");
/// ```
pub fn engineering(value: f64, unit: &str, figures: usize) -> String {
    if !value.is_finite() || value == 0.0 {
        return format!("{} {unit}", significant(value, figures));
    }
    let third = rounded_exponent(value, figures).div_euclid(3).clamp(-5, 4);
    let prefix = ["f", "p", "n", "µ", "m", "", "k", "M", "G", "T"][(third + 5) as usize];
    format!("{} {prefix}{unit}", significant(value / 10f64.powi(3 * third), figures))
}

/// 10ⁿ in superscript digits.
pub fn power_of_ten(exponent: i32) -> String {
    let mut text = "10".to_owned();
    text.extend(exponent.to_string().chars().map(|letter| match letter {
        '-' => '⁻',
        '1' => '¹',
        '2' => '²',
        '3' => '³',
        digit => char::from_u32('⁰' as u32 + digit as u32 - '0' as u32).unwrap_or(digit),
    }));
    text
}

/// A unit with raised dots and exponents instead of spaces, stars and carets; `1` stays.
///
/// ```
/// use granchain_signal::number::unit;
/// assert_eq!(unit("N s/m"), "N·s/m");
/// assert_eq!(unit("N*s*m^(-3/2)"), "N·s·m⁻³ᐟ²");
/// ```
pub fn unit(plain: &str) -> String {
    let mut pretty = plain.trim().replace([' ', '*'], "·");
    for (written, meant) in [
        ("^(-3/2)", "⁻³ᐟ²"),
        ("^-3/2", "⁻³ᐟ²"),
        ("^-1.5", "⁻³ᐟ²"),
        ("^-1", "⁻¹"),
        ("^2", "²"),
        ("^3", "³"),
        ("um", "µm"),
    ] {
        pretty = pretty.replace(written, meant);
    }
    if pretty.is_empty() { "1".to_owned() } else { pretty }
}

/// Value and interval with the interval deciding the digits, `0.503 (0.488 to 0.519)`, or the value alone.
pub fn with_interval(value: f64, interval: Option<(f64, f64)>) -> String {
    match interval {
        Some((low, high)) => {
            let half = 0.5 * (high - low);
            let like = |end: f64| to_uncertainty(end, half);
            format!("{} ({} to {})", like(value), like(low), like(high))
        }
        None => significant(value, 3),
    }
}

/// Exponent of the leading digit after rounding to `figures` significant figures.
fn rounded_exponent(value: f64, figures: usize) -> i32 {
    let text = format!("{:.*e}", figures.saturating_sub(1), value.abs());
    text.split_once('e').and_then(|(_, exponent)| exponent.parse().ok()).unwrap_or(0)
}

/// A value rounded to 12 digits: 0.3 + 5·0.05 is 0.55, not 0.5500000000000000444.
pub fn to_12_digits(value: f64) -> f64 {
    format!("{value:.11e}").parse().unwrap_or(value)
}

/// An instant or interval (s) with prefix and unit, to 12 digits: −13.6 µs.
pub fn time(value: f64) -> String {
    Quantity::new(to_12_digits(value), Dimension::TIME).to_string()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn rounding_up_to_the_next_decade_keeps_the_number_of_figures() {
        assert_eq!(significant(9.996, 3), "10.0");
        assert_eq!(engineering(999.6e-3, "m/s", 3), "1.00 m/s");
        assert_eq!(significant(123_456.0, 2), "120000");
    }

    #[test]
    fn a_negative_number_has_a_minus_sign_and_zero_has_none() {
        assert_eq!(fixed(-0.04, 1), "0.0");
        assert_eq!(significant(-70.6, 2), "−71");
        assert_eq!(power_of_ten(-12), "10⁻¹²");
    }
}
