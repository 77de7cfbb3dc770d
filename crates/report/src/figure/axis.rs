//! Axes: label and unit, range, ticks with few digits.

use crate::number;

/// How positions grow along an axis.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Scale {
    Linear,
    /// Evenly in the logarithm; values must be positive.
    Logarithmic,
}

/// One axis: what it carries, in which unit, and from where to where.
#[derive(Debug, Clone, PartialEq)]
pub struct Axis {
    /// What it carries, such as `Velocity`.
    pub label: String,
    /// Unit after `factor`, such as `mm/s`; `1` for a pure number, empty where the ticks are names.
    pub unit: String,
    /// Displayed value over given value: data stay in SI, 1e3 shows m/s as mm/s.
    pub factor: f64,
    pub scale: Scale,
    /// Fixed ends, in given (not displayed) values; `None` follows the data.
    pub range: Option<(f64, f64)>,
    /// Ticks at fixed given values with their names; `None` chooses them.
    pub named_ticks: Option<Vec<(f64, String)>>,
}

impl Axis {
    /// A linear axis whose data are already in `unit` (`1` for a pure number).
    #[must_use]
    pub fn new(label: impl Into<String>, unit: impl Into<String>) -> Self {
        Self {
            label: label.into(),
            unit: unit.into(),
            factor: 1.0,
            scale: Scale::Linear,
            range: None,
            named_ticks: None,
        }
    }

    /// Time in s, shown in µs.
    #[must_use]
    pub(crate) fn time() -> Self {
        Self::new("Time", "µs").times(1e6)
    }

    /// Frequency from 0 to `highest` in Hz, shown in kHz or MHz.
    #[must_use]
    pub(crate) fn frequency(highest: f64) -> Self {
        let (factor, unit) = if highest >= 3e6 { (1e-6, "MHz") } else { (1e-3, "kHz") };
        Self::new("Frequency", unit).times(factor).range(0.0, highest)
    }

    /// The same axis for data of which one, times `factor`, is one of the axis's unit.
    #[must_use]
    pub fn times(self, factor: f64) -> Self {
        Self { factor, ..self }
    }

    #[must_use]
    pub fn logarithmic(self) -> Self {
        Self { scale: Scale::Logarithmic, ..self }
    }

    /// The same axis with fixed ends, in given values.
    #[must_use]
    pub fn range(self, low: f64, high: f64) -> Self {
        Self { range: Some((low, high)), ..self }
    }

    /// The same axis with ticks at these given values.
    #[must_use]
    pub fn named_ticks(self, ticks: Vec<(f64, String)>) -> Self {
        Self { named_ticks: Some(ticks), ..self }
    }

    pub(crate) fn title(&self) -> String {
        title(&self.label, &self.unit, 0)
    }

    /// Whether a value can be placed on this axis.
    pub(super) fn carries(&self, value: f64) -> bool {
        let shown = value * self.factor;
        shown.is_finite() && (self.scale == Scale::Linear || shown > 0.0)
    }
}

/// A tick: where (0…1 along the axis) and its name; a tick without name is a minor one.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct Tick {
    pub place: f64,
    pub name: Option<String>,
}

/// An axis whose ends are known.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct Resolved {
    factor: f64,
    scale: Scale,
    low: f64,
    high: f64,
    pub ticks: Vec<Tick>,
    /// Label and unit, with a power of ten pulled out of the ticks where they would need many digits.
    pub title: String,
}

impl Resolved {
    /// Fix the ends of `axis` (given values, low < high) for a frame of `length` pt with about one tick each `spacing` pt.
    pub(crate) fn new(axis: &Axis, (low, high): (f64, f64), length: f64, spacing: f64) -> Self {
        let scaled = |value: f64| match axis.scale {
            Scale::Linear => value * axis.factor,
            Scale::Logarithmic => (value * axis.factor).log10(),
        };
        let (low, high) = (scaled(low), scaled(high));
        let wanted = (length / spacing).max(2.0);
        let mut resolved = Self {
            factor: axis.factor,
            scale: axis.scale,
            low,
            high,
            ticks: Vec::new(),
            title: title(&axis.label, &axis.unit, 0),
        };
        if let Some(named) = &axis.named_ticks {
            let inside = |value: f64| (-1e-9..=1.0 + 1e-9).contains(&resolved.place(value));
            resolved.ticks = named
                .iter()
                .filter(|(value, _)| axis.carries(*value) && inside(*value))
                .map(|(value, name)| Tick { place: resolved.place(*value), name: Some(name.clone()) })
                .collect();
        } else if axis.scale == Scale::Linear {
            let exponent = pulled_out_exponent(low.abs().max(high.abs()));
            resolved.title = title(&axis.label, &axis.unit, exponent);
            resolved.ticks = linear_ticks(low, high, wanted, exponent);
        } else {
            resolved.ticks = logarithmic_ticks(low, high, wanted);
        }
        resolved
    }

    /// Where a given value lies: 0 at the low end, 1 at the high end, beyond them outside.
    pub(crate) fn place(&self, value: f64) -> f64 {
        let shown = value * self.factor;
        let scaled = if self.scale == Scale::Logarithmic { shown.log10() } else { shown };
        (scaled - self.low) / (self.high - self.low)
    }
}

fn title(label: &str, unit: &str, exponent: i32) -> String {
    let power = number::power_of_ten(exponent);
    match (unit, exponent) {
        ("", _) => label.to_owned(),
        ("1", 0) => format!("{label} (–)"),
        ("1", _) => format!("{label} ({power})"),
        (_, 0) => format!("{label} ({unit})"),
        (_, _) => format!("{label} ({power} {unit})"),
    }
}

/// The power of ten, a multiple of three, to pull out of ticks whose largest magnitude is `largest`; 0 where none is needed.
fn pulled_out_exponent(largest: f64) -> i32 {
    if largest == 0.0 || (9.9e-3..1e4).contains(&largest) {
        return 0;
    }
    (largest.log10() / 3.0).floor() as i32 * 3
}

/// Smallest of 1, 2, 5 × 10ⁿ that is at least `raw`.
fn round_step(raw: f64) -> f64 {
    let power = 10f64.powf(raw.log10().floor());
    let lead = [1.0, 2.0, 5.0, 10.0].into_iter().find(|lead| lead * power >= raw * (1.0 - 1e-9)).unwrap_or(10.0);
    lead * power
}

fn linear_ticks(low: f64, high: f64, wanted: f64, exponent: i32) -> Vec<Tick> {
    let step = round_step((high - low) / wanted);
    let unit = 10f64.powi(exponent);
    let digits = (-(step / unit).log10().floor()).max(0.0) as usize;
    let first = (low / step - 1e-6).ceil() as i64;
    let last = (high / step + 1e-6).floor() as i64;
    (first..=last)
        .map(|index| {
            let value = index as f64 * step;
            Tick { place: (value - low) / (high - low), name: Some(number::fixed(value / unit, digits)) }
        })
        .collect()
}

/// Ticks for a logarithmic axis from 10^low to 10^high.
fn logarithmic_ticks(low: f64, high: f64, wanted: f64) -> Vec<Tick> {
    let place = |value: f64| (value.log10() - low) / (high - low);
    let inside = |place: &f64| (-1e-6..=1.0 + 1e-6).contains(place);
    let span = high - low;
    if span < 0.7 {
        let (from, to) = (10f64.powf(low), 10f64.powf(high));
        return linear_ticks(from, to, wanted.min(5.0), 0)
            .into_iter()
            .map(|tick| Tick { place: place(from + tick.place * (to - from)), name: tick.name })
            .filter(|tick| inside(&tick.place))
            .collect();
    }
    let stride = (span / wanted).ceil().max(1.0) as i32;
    let named_leads: &[f64] = if span < 1.7 { &[1.0, 2.0, 5.0] } else { &[1.0] };
    let mut ticks = Vec::new();
    for decade in low.floor() as i32..=high.ceil() as i32 {
        for lead in 1..=9 {
            let lead = f64::from(lead);
            let value = lead * 10f64.powi(decade);
            let named = named_leads.contains(&lead) && decade.rem_euclid(stride) == 0;
            let name = named.then(|| decade_name(lead, decade));
            let place = place(value);
            if inside(&place) && (named || stride == 1) {
                ticks.push(Tick { place, name });
            }
        }
    }
    ticks
}

fn decade_name(lead: f64, decade: i32) -> String {
    if (-3..=3).contains(&decade) {
        number::fixed(lead * 10f64.powi(decade), usize::try_from(-decade).unwrap_or(0))
    } else if lead == 1.0 {
        number::power_of_ten(decade)
    } else {
        format!("{lead:.0}×{}", number::power_of_ten(decade))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn names(axis: &Axis, ends: (f64, f64)) -> Vec<String> {
        Resolved::new(axis, ends, 160.0, 35.0).ticks.into_iter().filter_map(|tick| tick.name).collect()
    }

    #[test]
    fn ticks_stand_at_round_values_with_no_more_digits_than_their_step() {
        assert_eq!(names(&Axis::new("Velocity", "mm/s").times(1e3), (-0.247, 0.289)), ["−200", "0", "200"]);
        assert_eq!(names(&Axis::new("α", "1"), (0.48, 0.545)), ["0.48", "0.50", "0.52", "0.54"]);
    }

    #[test]
    fn large_and_small_values_hand_their_power_of_ten_to_the_title() {
        let axis = Axis::new("γ", "N·s·m⁻³ᐟ²");
        let resolved = Resolved::new(&axis, (0.0, 12_000.0), 160.0, 35.0);
        assert_eq!(resolved.title, "γ (10³ N·s·m⁻³ᐟ²)");
        assert_eq!(names(&axis, (0.0, 12_000.0)), ["0", "5", "10"]);
    }

    #[test]
    fn logarithmic_ticks_name_decades_and_place_them_evenly() {
        let axis = Axis::new("Amplitude", "1").logarithmic();
        let resolved = Resolved::new(&axis, (1e-5, 1e3), 160.0, 20.0);
        assert_eq!(names(&axis, (1e-4, 1e4)).first().map(String::as_str), Some("10⁻⁴"));
        assert!((resolved.place(1e-1) - 0.5).abs() < 1e-12);
    }
}
