//! Time responses as universal files.

use std::fmt::Write as _;

use super::super::RecordedQuantity;
use granchain_signal::Series;

/// Which byte of a number comes first.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum ByteOrder {
    Little,
    Big,
}

#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Precision {
    /// Four; six digits as text.
    Single,
    /// Eight; thirteen digits as text.
    Double,
}

/// How a time response is written.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct UniversalForm {
    pub precision: Precision,
    /// Bytes (58b) in this order, or text (58).
    pub binary: Option<ByteOrder>,
}

#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Samples<'a> {
    Even(&'a Series),
    /// Each at its own instant.
    Uneven {
        /// Instants, s, rising.
        times: &'a [f64],
        /// Values, SI; as many.
        values: &'a [f64],
    },
}

/// A time response (data set 58).
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct TimeResponse<'a> {
    /// First line of identification; up to 80 characters are written.
    pub title: &'a str,
    /// Displacement (m) or velocity (m/s).
    pub quantity: RecordedQuantity,
    pub samples: Samples<'a>,
}

impl TimeResponse<'_> {
    /// The bytes of a universal file with this one function, behind a data set 164 that states SI.
    ///
    /// As bytes in double precision the values come back exactly. As text they have six digits in single and thirteen in
    /// double precision; instants of uneven samples have six digits as text, always. First instant and step of even samples
    /// stand in the header and have up to eight digits.
    #[must_use]
    pub fn to_bytes(&self, form: UniversalForm) -> Vec<u8> {
        let (count, even, start, step) = match self.samples {
            Samples::Even(series) => (series.len(), true, series.start, series.step),
            Samples::Uneven { values, .. } => (values.len(), false, 0.0, 0.0),
        };
        let width = match form.precision {
            Precision::Single => 4,
            Precision::Double => 8,
        };
        let mut text = String::new();
        let mut line = |part: &str| {
            text.push_str(part);
            text.push('\n');
        };
        line("    -1\n   164");
        line(&format!("{:>10}{:<20}{:>10}", 1, "SI: Meter (newton)", 2));
        let factor = fortran(1.0, 25, 17).replace('E', "D");
        line(&format!("{factor}{factor}{factor}\n{}\n    -1\n    -1", fortran(273.15, 25, 17).replace('E', "D")));
        match form.binary {
            None => line("    58"),
            Some(order) => {
                let order = if order == ByteOrder::Little { 1 } else { 2 };
                let bytes = count * width * if even { 1 } else { 2 };
                line(&format!("    58b{order:>6}{:>6}{:>12}{bytes:>12}{:>6}{:>6}{:>12}{:>12}", 2, 11, 0, 0, 0, 0));
            }
        }
        let plain: String = self.title.chars().map(|c| if c.is_control() { ' ' } else { c }).take(80).collect();
        line(if plain.trim().is_empty() { "NONE" } else { plain.trim() });
        line("NONE\nNONE\nNONE\nNONE");
        line(&format!(
            "{:>5}{:>10}{:>5}{:>10} {:<10}{:>10}{:>4} {:<10}{:>10}{:>4}",
            1, 0, 0, 0, "NONE", 1, 3, "NONE", 0, 0
        ));
        let data = if form.precision == Precision::Single { 2 } else { 4 };
        let header = [start, step, 0.0].map(in_thirteen).concat();
        line(&format!("{data:>10}{count:>10}{:>10}{header}", i32::from(even)));
        let (kind, name, unit) = match self.quantity {
            RecordedQuantity::Displacement => (8, "Displacement", "m"),
            RecordedQuantity::Velocity => (11, "Velocity", "m/s"),
            RecordedQuantity::Pressure => (15, "Pressure", "Pa"),
        };
        for (kind, name, unit) in [(17, "Time", "s"), (kind, name, unit), (0, "NONE", "NONE"), (0, "NONE", "NONE")] {
            line(&format!("{kind:>10}{:>5}{:>5}{:>5} {name:<20} {unit:<20}", 0, 0, 0));
        }
        let mut bytes = text.into_bytes();
        match form.binary {
            Some(order) => self.binary(form.precision, order, &mut bytes),
            None => bytes.extend_from_slice(self.text(form.precision).as_bytes()),
        }
        bytes.extend_from_slice(b"    -1\n");
        bytes
    }

    fn numbers(&self) -> Box<dyn Iterator<Item = f64> + '_> {
        match self.samples {
            Samples::Even(series) => Box::new(series.values.iter().copied()),
            Samples::Uneven { times, values } => Box::new(times.iter().zip(values).flat_map(|(t, v)| [*t, *v])),
        }
    }

    fn binary(&self, precision: Precision, order: ByteOrder, bytes: &mut Vec<u8>) {
        for number in self.numbers() {
            match (precision, order) {
                (Precision::Single, ByteOrder::Little) => bytes.extend((number as f32).to_le_bytes()),
                (Precision::Single, ByteOrder::Big) => bytes.extend((number as f32).to_be_bytes()),
                (Precision::Double, ByteOrder::Little) => bytes.extend(number.to_le_bytes()),
                (Precision::Double, ByteOrder::Big) => bytes.extend(number.to_be_bytes()),
            }
        }
    }

    /// 6E13.5, 4E20.12 or 2(E13.5,E20.12).
    fn text(&self, precision: Precision) -> String {
        let even = matches!(self.samples, Samples::Even(_));
        let (a_line, wide) = if precision == Precision::Single { (6, false) } else { (4, true) };
        let mut text = String::new();
        let mut written = 0;
        for (i, number) in self.numbers().enumerate() {
            let instant = !even && i % 2 == 0;
            text.push_str(&if wide && !instant { fortran(number, 20, 12) } else { fortran(number, 13, 5) });
            written = i + 1;
            if written % a_line == 0 {
                text.push('\n');
            }
        }
        if written % a_line != 0 {
            text.push('\n');
        }
        text
    }
}

/// `number` in exponential form with `digits` behind the point, right-justified.
fn fortran(number: f64, width: usize, digits: usize) -> String {
    let plain = format!("{number:.digits$e}");
    let (mantissa, exponent) = plain.split_once('e').unwrap_or((&plain, "0"));
    let exponent: i32 = exponent.parse().unwrap_or(0);
    let mut text = String::with_capacity(width);
    // Writing to a String cannot fail.
    let _ = write!(text, "{mantissa}E{exponent:+03}");
    format!("{text:>width$}")
}

/// `number` in a field of thirteen, a blank first, with as many digits as it needs or as there is room for.
fn in_thirteen(number: f64) -> String {
    (5..=7)
        .rev()
        .map(|digits| fortran(number, 13, digits))
        .filter(|text| text.len() == 13 && text.starts_with(' '))
        .find(|text| text.trim().parse().is_ok_and(|it: f64| it == number) || text.trim().len() <= 12)
        .unwrap_or_else(|| fortran(number, 13, 5))
}
