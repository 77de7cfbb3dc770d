//! Grid of a sweep: scene keys, their values, and all combinations.

use std::fmt;

use serde::{Deserialize, Serialize};
use thiserror::Error;

use granchain_signal::{Dimension, Quantity, QuantityError, number::to_12_digits};

/// Most points a grid may have.
pub(crate) const MOST_POINTS: usize = 1_000_000;

/// One value of a scene key.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(untagged)]
pub enum Value {
    Number(f64),
    /// A keyword, such as a damping law.
    Word(String),
}

impl fmt::Display for Value {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Number(number) => f.write_str(ryu::Buffer::new().format(*number).trim_end_matches(".0")),
            Self::Word(word) => f.write_str(word),
        }
    }
}

/// One scene key and the values it takes, in order.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Axis {
    /// The key, as in `--set`.
    pub key: String,
    /// SI unit of the numbers as written on the command line; empty for pure numbers, plain SI numbers and words.
    pub unit: String,
    pub values: Vec<Value>,
}

/// Why a text is not an axis.
#[derive(Debug, Clone, PartialEq, Error)]
#[non_exhaustive]
pub enum GridError {
    #[error(
        "expected KEY=START:STOP:STEP or KEY=A,B,C, such as `alpha=0.3:1.5:0.05` or `drive.amplitude=0.2um,0.5um`, \
         found `{found}`"
    )]
    NoAxis { found: String },
    #[error("`{found}`: {source}")]
    Quantity { found: String, source: QuantityError },
    #[error("`{found}`: expected values of one dimension, found {first} and {second}; write the unit on each")]
    MixedDimensions { found: String, first: String, second: String },
    #[error(
        "`{key}={start}:{stop}:{step}`: with a step of {step} the values never reach {stop} from {start}; write {key}={stop}:{start}:{step}, or a \
         step of the other sign"
    )]
    WrongStep { key: String, start: String, stop: String, step: String },
    #[error("`{found}`: expected START:STOP:STEP with a step other than 0")]
    NoStep { found: String },
    #[error("the grid has {points:.0} points, at most {MOST_POINTS} are possible; use a coarser step")]
    TooLarge { points: f64 },
    #[error("`{key}` is varied twice; put its values into one --vary")]
    Twice { key: String },
}

impl Axis {
    /// Read `KEY=START:STOP:STEP` (ends included) or `KEY=A,B,C`; numbers with or without units, words in lists.
    ///
    /// ```
    /// # use granchain_calibration::predict::grid::{Axis, Value};
    /// let axis = Axis::parse("drive.amplitude=0.1um:0.3um:0.1um")?;
    /// assert_eq!(axis.values, [1e-7, 2e-7, 3e-7].map(Value::Number));
    /// assert_eq!(axis.unit, "m");
    /// # Ok::<(), granchain_calibration::predict::grid::GridError>(())
    /// ```
    pub fn parse(text: &str) -> Result<Self, GridError> {
        let no_axis = || GridError::NoAxis { found: text.into() };
        let (key, values) = text.split_once('=').ok_or_else(no_axis)?;
        let (key, values) = (key.trim(), values.trim());
        if key.is_empty() || values.is_empty() {
            return Err(no_axis());
        }
        let parts: Vec<&str> = values.split([':', ',']).map(str::trim).collect();
        if parts.iter().any(|part| part.is_empty()) {
            return Err(no_axis());
        }
        let is_range = values.contains(':');
        if is_range && (parts.len() != 3 || values.contains(',')) {
            return Err(no_axis());
        }
        let starts_a_number = |part: &str| part.starts_with(|c: char| c.is_ascii_digit() || "+-.".contains(c));
        if !is_range && !parts.iter().any(|part| starts_a_number(part)) {
            let values = parts.into_iter().map(|word| Value::Word(word.into())).collect();
            return Ok(Self { key: key.into(), unit: String::new(), values });
        }
        let quantities: Vec<Quantity> = parts
            .iter()
            .map(|part| Quantity::parse(part))
            .collect::<Result<_, _>>()
            .map_err(|source| GridError::Quantity { found: text.into(), source })?;
        let dimension = quantities[0].dimension;
        if let Some(other) = quantities.iter().find(|quantity| quantity.dimension != dimension) {
            return Err(GridError::MixedDimensions {
                found: text.into(),
                first: dimension.describe(),
                second: other.dimension.describe(),
            });
        }
        let numbers: Vec<f64> = quantities.iter().map(|quantity| quantity.value).collect();
        let numbers = if is_range { range(numbers[0], numbers[1], numbers[2], text)? } else { numbers };
        let unit = if dimension == Dimension::NONE { String::new() } else { dimension.si_unit() };
        Ok(Self { key: key.into(), unit, values: numbers.into_iter().map(Value::Number).collect() })
    }
}

/// start, start + step, … up to stop, which counts as reached within 1e-9 of a step.
fn range(start: f64, stop: f64, step: f64, text: &str) -> Result<Vec<f64>, GridError> {
    let steps = (stop - start) / step;
    if step == 0.0 || !steps.is_finite() {
        return Err(GridError::NoStep { found: text.into() });
    }
    if steps < 0.0 {
        let mut parts = text.split(['=', ':']).map(|part| part.trim().to_owned());
        let [key, start, stop, step] = std::array::from_fn(|_| parts.next().unwrap_or_default());
        return Err(GridError::WrongStep { key, start, stop, step });
    }
    let last = (steps + 1e-9).floor();
    if last >= MOST_POINTS as f64 {
        return Err(GridError::TooLarge { points: last + 1.0 });
    }
    Ok((0..=last as usize).map(|index| to_12_digits(start + index as f64 * step)).collect())
}

/// Every combination of the axes' values, the last axis fastest.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Grid {
    pub axes: Vec<Axis>,
}

impl Grid {
    /// The full grid of some axes.
    pub fn new(axes: Vec<Axis>) -> Result<Self, GridError> {
        for (index, axis) in axes.iter().enumerate() {
            if axes[..index].iter().any(|earlier| earlier.key == axis.key) {
                return Err(GridError::Twice { key: axis.key.clone() });
            }
        }
        let points: f64 = axes.iter().map(|axis| axis.values.len() as f64).product();
        if points > MOST_POINTS as f64 {
            return Err(GridError::TooLarge { points });
        }
        Ok(Self { axes })
    }

    pub fn len(&self) -> usize {
        self.axes.iter().map(|axis| axis.values.len()).product()
    }

    /// Whether the grid has no points.
    pub fn is_empty(&self) -> bool {
        self.len() == 0
    }

    /// Values of point `index`, one per axis.
    pub fn values(&self, index: usize) -> Vec<&Value> {
        let mut rest = index;
        let mut values: Vec<&Value> = self
            .axes
            .iter()
            .rev()
            .map(|axis| {
                let value = &axis.values[rest % axis.values.len()];
                rest /= axis.values.len();
                value
            })
            .collect();
        values.reverse();
        values
    }

    /// About `most` points at most, evenly spread and not aligned with any axis; all if there are no more.
    pub fn spread(&self, most: usize) -> impl ExactSizeIterator<Item = usize> + use<> {
        let in_step = |stride: usize| self.axes.iter().any(|axis| axis.values.len() % stride == 0);
        let least = self.len().div_ceil(most);
        let stride = if least < 2 { 1 } else { (least..).find(|stride| !in_step(*stride)).unwrap_or(least) };
        (0..self.len()).step_by(stride)
    }

    /// Place of point `index` along an axis, from 0.
    pub fn place(&self, index: usize, axis: usize) -> usize {
        let behind: usize = self.axes[axis + 1..].iter().map(|axis| axis.values.len()).product();
        index / behind % self.axes[axis].values.len()
    }

    /// The first value of each axis with the unit it was written with, for a scene to check.
    pub fn with_units(&self) -> impl Iterator<Item = String> {
        let written = self.axes.iter().filter(|axis| !axis.unit.is_empty());
        written.filter_map(|axis| Some(format!("{}={} {}", axis.key, axis.values.first()?, axis.unit)))
    }

    /// The overrides of point `index`, as for `--set`: `KEY=VALUE` in SI.
    pub fn overrides(&self, index: usize) -> Vec<String> {
        self.axes.iter().zip(self.values(index)).map(|(axis, value)| format!("{}={value}", axis.key)).collect()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn few_of_many_points_take_every_value_of_every_axis() {
        let grid = Grid::new(
            ["alpha=1:30:1", "chain.beads=2:11:1", "drive.cycles=1:40:1"].map(|text| Axis::parse(text).unwrap()).into(),
        )
        .unwrap();
        assert_eq!(grid.spread(12_000).collect::<Vec<_>>(), (0..12_000).collect::<Vec<_>>());
        let some: Vec<usize> = grid.spread(2000).collect();
        assert!(some.len() <= 2000 && some.len() > 1000, "{}", some.len());
        for (axis, length) in [30, 10, 40].into_iter().enumerate() {
            let mut met: Vec<usize> = some.iter().map(|index| grid.place(*index, axis)).collect();
            met.sort_unstable();
            met.dedup();
            assert_eq!(met.len(), length);
        }
        let values = |index: usize| grid.values(index).into_iter().cloned().collect::<Vec<_>>();
        let placed = |index: usize| {
            (0..3).map(|axis| grid.axes[axis].values[grid.place(index, axis)].clone()).collect::<Vec<_>>()
        };
        assert!((0..12_000).step_by(7).all(|index| values(index) == placed(index)));
    }

    fn numbers(text: &str) -> Vec<f64> {
        let number = |value: &Value| match value {
            Value::Number(number) => *number,
            Value::Word(word) => panic!("{word}"),
        };
        Axis::parse(text).unwrap().values.iter().map(number).collect()
    }

    #[test]
    fn the_papers_alpha_sweep_has_25_clean_values() {
        let values = numbers("alpha=0.3:1.5:0.05");
        assert_eq!(values.len(), 25);
        assert_eq!(values[5].to_string(), "0.55");
        assert_eq!(values[24].to_string(), "1.5");
    }

    #[test]
    fn a_range_may_fall_and_need_not_meet_its_stop() {
        assert_eq!(numbers("alpha=1:0:-0.5"), [1.0, 0.5, 0.0]);
        assert_eq!(numbers("alpha=0:1:0.4"), [0.0, 0.4, 0.8]);
    }

    #[test]
    fn units_are_si_in_the_grid_and_must_agree() {
        let axis = Axis::parse("drive.amplitude=100nm,0.5um").unwrap();
        assert_eq!(axis.unit, "m");
        assert_eq!(axis.values, [Value::Number(1e-7), Value::Number(5e-7)]);
        assert!(matches!(Axis::parse("drive.amplitude=0.1:1um:0.1um"), Err(GridError::MixedDimensions { .. })));
    }

    #[test]
    fn words_are_kept() {
        let axis = Axis::parse("damping.kind=linear,kuwabara-kono").unwrap();
        assert_eq!(axis.values, [Value::Word("linear".into()), Value::Word("kuwabara-kono".into())]);
    }

    #[test]
    fn what_is_no_axis_is_refused() {
        for text in ["alpha", "=1", "alpha=", "alpha=1,,2", "alpha=1:2", "alpha=1:2:3:4", "alpha=1:2,3:4"] {
            assert!(matches!(Axis::parse(text), Err(GridError::NoAxis { .. })), "{text}");
        }
        assert!(matches!(Axis::parse("alpha=1:2:0"), Err(GridError::NoStep { .. })));
        assert!(matches!(Axis::parse("alpha=1:2:-1"), Err(GridError::WrongStep { .. })));
        assert!(matches!(Axis::parse("alpha=0:1:1e-9"), Err(GridError::TooLarge { .. })));
        assert!(matches!(Axis::parse("alpha=1furlong,2"), Err(GridError::Quantity { .. })));
    }

    #[test]
    fn the_grid_runs_through_every_combination_with_the_last_axis_fastest() {
        let grid =
            Grid::new(vec![Axis::parse("alpha=1,2").unwrap(), Axis::parse("damping.kind=a,b,c").unwrap()]).unwrap();
        assert_eq!(grid.len(), 6);
        assert_eq!(grid.overrides(0), ["alpha=1", "damping.kind=a"]);
        assert_eq!(grid.overrides(4), ["alpha=2", "damping.kind=b"]);
        let twice = vec![Axis::parse("alpha=1").unwrap(), Axis::parse("alpha=2").unwrap()];
        assert!(matches!(Grid::new(twice), Err(GridError::Twice { .. })));
    }
}
