//! Units without a number: `mm/s`, `N s m^-3/2`, `kg/m³`.

use super::{Dimension, QuantityError, quantity::WHOLE};

/// The exponent 1, and one power of ten.
const QUARTERS: i32 = WHOLE as i32;

/// A unit: its factor to SI and its dimension.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Unit {
    /// Value in SI = number × `factor`.
    pub factor: f64,
    pub dimension: Dimension,
}

impl Unit {
    /// Read a unit.
    ///
    /// - symbols m, g, s, V, N, Pa, Hz, J, W with SI prefixes (µ, μ and u are micro); also bar, min, h, `%`, Np, dB (of an amplitude, ln 10/20 Np) and 1;
    /// - products by `·`, `*`, `×` or a space, quotients by `/` or `per`, both from left to right, with parentheses;
    /// - exponents by `^`, `**`, superscripts or nothing: `m^-3/2`, `m**(-3/2)`, `m^1.5`, `m³`, `s-1`; multiples of 1/4.
    ///
    /// ```
    /// use granchain_signal::{Dimension, Unit};
    /// let unit = Unit::parse("mm/s")?;
    /// assert_eq!((unit.factor, unit.dimension), (1e-3, Dimension::VELOCITY));
    /// assert_eq!(Unit::parse("N·s·m^(-3/2)")?, Unit::parse("N s/m^1.5")?);
    /// # Ok::<(), granchain_signal::QuantityError>(())
    /// ```
    pub fn parse(text: &str) -> Result<Self, QuantityError> {
        let trimmed = text.trim();
        let scale = Scale::parse(trimmed, trimmed)?;
        Ok(Self { factor: scale.apply("1"), dimension: scale.dimension })
    }
}

/// A unit with its power of ten stored separately, so that prefixes cause no rounding.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Scale {
    /// Four times the power of ten.
    decades: i32,
    /// Factor besides the power of ten: 60 for a minute.
    factor: f64,
    pub(super) dimension: Dimension,
}

/// Symbol, power of ten, other factor, dimension, whether it takes prefixes.
const SYMBOLS: [(&str, i32, f64, Dimension, bool); 19] = [
    ("m", 0, 1.0, Dimension::LENGTH, true),
    ("g", -3, 1.0, Dimension::MASS, true),
    ("s", 0, 1.0, Dimension::TIME, true),
    ("V", 0, 1.0, Dimension::VOLTAGE, true),
    ("N", 0, 1.0, Dimension::FORCE, true),
    ("Pa", 0, 1.0, Dimension::PRESSURE, true),
    ("Hz", 0, 1.0, Dimension::FREQUENCY, true),
    ("J", 0, 1.0, Dimension::ENERGY, true),
    ("W", 0, 1.0, Dimension::of(8, 4, -12), true),
    ("bar", 5, 1.0, Dimension::PRESSURE, true),
    ("psi", 0, 6_894.757_293_168_361, Dimension::PRESSURE, false),
    ("in", 0, 0.0254, Dimension::LENGTH, false),
    ("ft", 0, 0.3048, Dimension::LENGTH, false),
    ("min", 0, 60.0, Dimension::TIME, false),
    ("h", 0, 3600.0, Dimension::TIME, false),
    ("Np", 0, 1.0, Dimension::NONE, false),
    ("dB", 0, std::f64::consts::LN_10 / 20.0, Dimension::NONE, false),
    ("%", -2, 1.0, Dimension::NONE, false),
    ("1", 0, 1.0, Dimension::NONE, false),
];

const PREFIXES: [(&str, i32); 20] = [
    ("da", 1),
    ("Q", 30),
    ("Y", 24),
    ("P", 15),
    ("T", 12),
    ("G", 9),
    ("M", 6),
    ("k", 3),
    ("h", 2),
    ("d", -1),
    ("c", -2),
    ("m", -3),
    ("\u{b5}", -6),
    ("\u{3bc}", -6),
    ("u", -6),
    ("n", -9),
    ("p", -12),
    ("f", -15),
    ("a", -18),
    ("y", -24),
];

/// Candidates for a misspelt unit.
const COMMON: [&str; 36] = [
    "m", "mm", "um", "nm", "cm", "km", "s", "ms", "us", "ns", "Hz", "kHz", "MHz", "GHz", "Pa", "kPa", "MPa", "GPa",
    "N", "mN", "uN", "kN", "kg", "g", "mg", "V", "mV", "kV", "J", "mJ", "uJ", "nJ", "W", "mW", "min", "%",
];

impl Scale {
    pub(super) const ONE: Self = Self { decades: 0, factor: 1.0, dimension: Dimension::NONE };

    /// Read a whole unit; `found` is the text it stands in, for messages.
    pub(super) fn parse(text: &str, found: &str) -> Result<Self, QuantityError> {
        let mut reader = Reader { rest: text, found, open: 0 };
        let scale = reader.product()?;
        if reader.rest.is_empty() { Ok(scale) } else { Err(reader.malformed()) }
    }

    /// `number` (decimal text) in SI, rounded once.
    pub(super) fn apply(self, number: &str) -> f64 {
        let (mantissa, exponent) = number.split_once('e').unwrap_or((number, "0"));
        let exponent = exponent.parse::<i32>().unwrap_or(if exponent.starts_with('-') { -9999 } else { 9999 });
        let exponent = exponent.saturating_add(self.decades.div_euclid(QUARTERS));
        let rest = match self.decades.rem_euclid(QUARTERS) {
            0 => 1.0,
            2 => 10f64.sqrt(),
            quarters => 10f64.powf(f64::from(quarters) / f64::from(QUARTERS)),
        };
        format!("{mantissa}e{exponent}").parse::<f64>().unwrap_or(f64::NAN) * rest * self.factor
    }

    /// self × other^(`quarters`/4); `None` if an exponent becomes too large.
    fn times(self, other: Self, quarters: i32) -> Option<Self> {
        let sum = |a: i8, b: i8| {
            let product = i32::from(b) * quarters;
            (product % QUARTERS == 0).then(|| i8::try_from(i32::from(a) + product / QUARTERS).ok()).flatten()
        };
        (other.decades * quarters % QUARTERS == 0).then_some(())?;
        Some(Self {
            decades: self.decades + other.decades * quarters / QUARTERS,
            factor: self.factor * other.factor.powf(f64::from(quarters) / f64::from(QUARTERS)),
            dimension: Dimension {
                metre: sum(self.dimension.metre, other.dimension.metre)?,
                kilogram: sum(self.dimension.kilogram, other.dimension.kilogram)?,
                second: sum(self.dimension.second, other.dimension.second)?,
                volt: sum(self.dimension.volt, other.dimension.volt)?,
            },
        })
    }
}

struct Reader<'a> {
    rest: &'a str,
    found: &'a str,
    open: usize,
}

/// Largest nesting depth of parentheses.
pub(super) const MOST_OPEN: usize = 32;

impl<'a> Reader<'a> {
    fn malformed(&self) -> QuantityError {
        QuantityError::Malformed { rest: self.rest.to_owned(), found: self.found.to_owned() }
    }

    fn eat(&mut self, tokens: &[&str]) -> bool {
        let Some(rest) = tokens.iter().find_map(|token| self.rest.strip_prefix(token)) else { return false };
        self.rest = rest;
        true
    }

    fn skip_spaces(&mut self) {
        self.rest = self.rest.trim_start_matches(|letter: char| letter.is_whitespace() || letter == '_');
    }

    /// factor ((· | / | nothing) factor)*
    fn product(&mut self) -> Result<Scale, QuantityError> {
        self.skip_spaces();
        let mut scale = Scale::ONE;
        let mut sign = 1;
        loop {
            let before = self.rest;
            let (factor, quarters) = self.factor()?;
            scale = scale.times(factor, sign * quarters).ok_or_else(|| QuantityError::Exponent {
                exponent: before[..before.len() - self.rest.len()].to_owned(),
                found: self.found.to_owned(),
            })?;
            self.skip_spaces();
            if self.rest.is_empty() || self.rest.starts_with(')') {
                return Ok(scale);
            }
            sign = if self.eat(&["/"]) || self.eat_per() { -1 } else { 1 };
            if sign == 1 {
                let _ = self.eat(&["·", "⋅", "∙", "*", "×"]);
            }
            self.skip_spaces();
        }
    }

    fn eat_per(&mut self) -> bool {
        let Some(rest) = self.rest.strip_prefix("per") else { return false };
        if rest.starts_with(|letter: char| letter.is_whitespace() || letter == '_') {
            self.rest = rest;
            return true;
        }
        false
    }

    /// A symbol or a product in parentheses, and four times its exponent.
    fn factor(&mut self) -> Result<(Scale, i32), QuantityError> {
        let scale = if self.eat(&["("]) {
            if self.open == MOST_OPEN {
                return Err(QuantityError::Nested { found: self.found.chars().take(40).collect() });
            }
            self.open += 1;
            let scale = self.product()?;
            self.open -= 1;
            if !self.eat(&[")"]) {
                return Err(self.malformed());
            }
            scale
        } else {
            self.symbol()?
        };
        Ok((scale, self.exponent()?))
    }

    fn symbol(&mut self) -> Result<Scale, QuantityError> {
        let length = match self.rest.chars().next() {
            Some('%' | '1') => 1,
            _ => self.rest.find(|letter: char| !is_letter(letter)).unwrap_or(self.rest.len()),
        };
        if length == 0 {
            return Err(self.malformed());
        }
        let (symbol, rest) = self.rest.split_at(length);
        self.rest = rest;
        lookup(symbol).ok_or_else(|| QuantityError::UnknownUnit {
            unit: symbol.to_owned(),
            found: self.found.to_owned(),
            nearest: nearest(symbol).map(str::to_owned),
        })
    }

    /// Four times the exponent; 4 where none is written.
    fn exponent(&mut self) -> Result<i32, QuantityError> {
        let before: &'a str = self.rest;
        let marked = self.eat(&["^", "**"]);
        let parenthesised = marked && self.eat(&["("]);
        let plain: String = self.rest.chars().map(plain_digit).take_while(|letter| *letter != '\0').collect();
        let Some((quarters, characters)) = quarters(&plain) else {
            let signed =
                plain.starts_with(['-', '+', '.']) || plain.starts_with(|letter: char| letter.is_ascii_digit());
            if !marked && !signed {
                self.rest = before;
                return Ok(QUARTERS);
            }
            return Err(self.bad_exponent(before));
        };
        let bytes: usize = self.rest.chars().take(characters).map(char::len_utf8).sum();
        self.rest = &self.rest[bytes..];
        if parenthesised && !self.eat(&[")"]) {
            return Err(self.bad_exponent(before));
        }
        Ok(quarters)
    }

    fn bad_exponent(&self, before: &str) -> QuantityError {
        let end = before.find(char::is_whitespace).unwrap_or(before.len());
        QuantityError::Exponent { exponent: before[..end].to_owned(), found: self.found.to_owned() }
    }
}

fn is_letter(letter: char) -> bool {
    letter.is_alphabetic() && plain_digit(letter) == '\0'
}

/// Digits, signs and slashes of an exponent, superscripts made plain; NUL for anything else.
fn plain_digit(letter: char) -> char {
    match letter {
        '⁰' => '0',
        '¹' => '1',
        '²' => '2',
        '³' => '3',
        '⁴' => '4',
        '⁵' => '5',
        '⁶' => '6',
        '⁷' => '7',
        '⁸' => '8',
        '⁹' => '9',
        '⁻' | '\u{2212}' => '-',
        '⁺' => '+',
        'ᐟ' | '⁄' => '/',
        '0'..='9' | '-' | '+' | '/' | '.' => letter,
        _ => '\0',
    }
}

/// Four times the leading number `[±]n`, `[±]n/4`, `[±]n.25` of `text`, and how many characters it takes.
fn quarters(text: &str) -> Option<(i32, usize)> {
    let sign = usize::from(text.starts_with(['-', '+']));
    let digits = |from: usize| text[from..].bytes().take_while(u8::is_ascii_digit).count();
    let whole = digits(sign);
    let mut end = sign + whole;
    let value = text[sign..end].parse::<i32>().ok().filter(|value| *value < 64)?;
    let negative = if text.starts_with('-') { -1 } else { 1 };
    let mut quarters = QUARTERS * value;
    if text[end..].starts_with('/') && digits(end + 1) > 0 {
        let length = digits(end + 1);
        let divisor = text[end + 1..end + 1 + length].parse::<i32>().ok().filter(|divisor| *divisor > 0)?;
        if quarters % divisor != 0 {
            return None;
        }
        quarters /= divisor;
        end += 1 + length;
    } else if text[end..].starts_with('.') {
        let length = digits(end + 1);
        match text[end + 1..end + 1 + length].trim_end_matches('0') {
            "" => {}
            "25" => quarters += 1,
            "5" => quarters += 2,
            "75" => quarters += 3,
            _ => return None,
        }
        end += 1 + length;
    }
    Some((negative * quarters, end))
}

fn lookup(symbol: &str) -> Option<Scale> {
    let scale = |power: i32, (_, own, factor, dimension, _): (&str, i32, f64, Dimension, bool)| Scale {
        decades: QUARTERS * (power + own),
        factor,
        dimension,
    };
    if let Some(known) = SYMBOLS.iter().find(|known| known.0 == symbol) {
        return Some(scale(0, *known));
    }
    PREFIXES.iter().find_map(|(prefix, power)| {
        let base = symbol.strip_prefix(prefix)?;
        SYMBOLS.iter().find(|known| known.4 && known.0 == base).map(|known| scale(*power, *known))
    })
}

fn nearest(symbol: &str) -> Option<&'static str> {
    let lower = symbol.to_lowercase();
    COMMON
        .iter()
        .map(|known| {
            let same_but_case = known.to_lowercase() == lower;
            let distance = if same_but_case { 0 } else { strsim::damerau_levenshtein(&known.to_lowercase(), &lower) };
            (distance, *known)
        })
        .filter(|(distance, known)| *distance <= (known.len().max(symbol.chars().count()) / 2).min(2))
        .min_by_key(|(distance, _)| *distance)
        .map(|(_, known)| known)
}
