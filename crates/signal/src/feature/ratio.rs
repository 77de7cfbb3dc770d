//! Exact fractions of the drive frequency.

use std::{fmt, str::FromStr};

use serde::{Deserialize, Deserializer, Serialize, Serializer, de};

/// A line's frequency over the drive's, as an exact reduced fraction; displays as `1/3` or `2`.
///
/// ```
/// # use granchain_signal::feature::Ratio;
/// assert_eq!(Ratio::new(2, 6).to_string(), "1/3");
/// assert_eq!("4/2".parse(), Ok(Ratio::new(2, 1)));
/// ```
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub struct Ratio {
    num: u32,
    den: u32,
}

impl Ratio {
    /// num/den in lowest terms; a denominator of 0 counts as 1.
    pub const fn new(num: u32, den: u32) -> Self {
        let den = if den == 0 { 1 } else { den };
        let (mut a, mut b) = (num, den);
        while b != 0 {
            (a, b) = (b, a % b);
        }
        Self { num: num / a, den: den / a }
    }

    pub const ONE: Self = Self::new(1, 1);

    /// Denominator in lowest terms, at least 1.
    pub const fn den(self) -> u32 {
        self.den
    }

    pub fn value(self) -> f64 {
        f64::from(self.num) / f64::from(self.den)
    }
}

/// The lines looked for: sub-harmonics of period 2, 3 and 4, their ultra-harmonics up to 3, then harmonics up to 8.
pub const FRACTIONAL_LINES: [Ratio; 20] = [
    Ratio::new(1, 4),
    Ratio::new(1, 3),
    Ratio::new(1, 2),
    Ratio::new(2, 3),
    Ratio::new(3, 4),
    Ratio::new(1, 1),
    Ratio::new(5, 4),
    Ratio::new(4, 3),
    Ratio::new(3, 2),
    Ratio::new(5, 3),
    Ratio::new(2, 1),
    Ratio::new(7, 3),
    Ratio::new(5, 2),
    Ratio::new(8, 3),
    Ratio::new(3, 1),
    Ratio::new(4, 1),
    Ratio::new(5, 1),
    Ratio::new(6, 1),
    Ratio::new(7, 1),
    Ratio::new(8, 1),
];

impl PartialOrd for Ratio {
    fn partial_cmp(&self, other: &Self) -> Option<std::cmp::Ordering> {
        Some(self.cmp(other))
    }
}

impl Ord for Ratio {
    fn cmp(&self, other: &Self) -> std::cmp::Ordering {
        let cross = |a: u32, b: u32| u64::from(a) * u64::from(b);
        cross(self.num, other.den).cmp(&cross(other.num, self.den))
    }
}

impl fmt::Display for Ratio {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        if self.den == 1 { f.pad(&self.num.to_string()) } else { f.pad(&format!("{}/{}", self.num, self.den)) }
    }
}

#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
#[error("expected a fraction such as `1/3` or `2`, found `{found}`")]
pub struct RatioError {
    pub found: String,
}

impl FromStr for Ratio {
    type Err = RatioError;

    fn from_str(text: &str) -> Result<Self, RatioError> {
        let (num, den) = text.split_once('/').unwrap_or((text, "1"));
        match (num.trim().parse(), den.trim().parse()) {
            (Ok(num), Ok(den)) if den != 0 => Ok(Self::new(num, den)),
            _ => Err(RatioError { found: text.to_owned() }),
        }
    }
}

impl Serialize for Ratio {
    fn serialize<S: Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
        serializer.collect_str(self)
    }
}

impl<'de> Deserialize<'de> for Ratio {
    fn deserialize<D: Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        String::deserialize(deserializer)?.parse().map_err(de::Error::custom)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn fractions_are_reduced_ordered_and_survive_a_round_trip_through_text() {
        assert_eq!(Ratio::new(6, 4), Ratio::new(3, 2));
        assert!(Ratio::new(2, 3) < Ratio::new(3, 4));
        assert!(FRACTIONAL_LINES.is_sorted());
        for ratio in FRACTIONAL_LINES {
            let json = serde_json::to_string(&ratio).unwrap();
            assert_eq!(serde_json::from_str::<Ratio>(&json).unwrap(), ratio);
        }
        assert_eq!(serde_json::to_string(&Ratio::new(1, 3)).unwrap(), "\"1/3\"");
        assert!("1/0".parse::<Ratio>().is_err());
        assert!("third".parse::<Ratio>().is_err());
    }
}
