//! Files compared number by number.

use serde::Serialize;
use serde_json::Value;

/// Relative difference allowed where the same type of processor made both numbers: no sum changes its order.
const SAME_PROCESSOR: f64 = 1e-9;

/// The same of another processor, whose vector unit rounds otherwise.
const OTHER_PROCESSOR: f64 = 1e-6;

/// Absolute difference allowed, in units of the number, as a share of the relative one: what is left of equal sums has no relative accuracy.
const REMAINDER: f64 = 1e-6;

/// One number, or word, that is not what it should be.
#[derive(Debug, Clone, PartialEq, Eq, Serialize)]
pub struct Difference {
    /// The file and the place in it: `calibration.json: features.line_1.simulated`.
    pub place: String,
    /// What the calibration made again says.
    pub expected: String,
    pub found: String,
}

/// Files compared, and what differs.
pub struct Comparison {
    /// Relative difference allowed.
    pub tolerance: f64,
    pub numbers: usize,
    pub differences: Vec<Difference>,
}

impl Comparison {
    /// Of numbers that the same type of processor made, or another.
    pub fn new(same_processor: bool) -> Self {
        let tolerance = if same_processor { SAME_PROCESSOR } else { OTHER_PROCESSOR };
        Self { tolerance, numbers: 0, differences: Vec::new() }
    }

    pub fn differ(&mut self, place: String, expected: impl ToString, found: impl ToString) {
        self.differences.push(Difference { place, expected: expected.to_string(), found: found.to_string() });
    }

    /// Whether two numbers are the same within the tolerance; counted.
    fn same(&mut self, expected: f64, found: f64) -> bool {
        self.numbers += 1;
        (expected - found).abs() <= self.tolerance * (expected.abs().max(found.abs()) + REMAINDER)
    }

    pub fn documents(&mut self, name: &str, expected: &[u8], found: &[u8]) {
        let parsed = [expected, found].map(serde_json::from_slice::<Value>);
        match parsed {
            [Ok(expected), Ok(found)] => self.values(&format!("{name}: "), &expected, &found),
            _ => self.differ(name.into(), "JSON", "a file that is none"),
        }
    }

    fn values(&mut self, place: &str, expected: &Value, found: &Value) {
        let below = |key: &str| if place.ends_with(": ") { format!("{place}{key}") } else { format!("{place}.{key}") };
        match (expected, found) {
            (Value::Object(expected), Value::Object(found)) => {
                for key in expected.keys().chain(found.keys().filter(|key| !expected.contains_key(*key))) {
                    let of = |object: &serde_json::Map<String, Value>| object.get(key).cloned().unwrap_or_default();
                    self.values(&below(key), &of(expected), &of(found));
                }
            }
            (Value::Array(expected), Value::Array(found)) if expected.len() == found.len() => {
                for (index, (expected, found)) in expected.iter().zip(found).enumerate() {
                    self.values(&below(&index.to_string()), expected, found);
                }
            }
            (Value::Number(a), Value::Number(b)) => {
                if !self.same(a.as_f64().unwrap_or(f64::NAN), b.as_f64().unwrap_or(f64::NAN)) {
                    self.differ(place.into(), a, b);
                }
            }
            _ if expected == found => {}
            _ => self.differ(place.into(), expected, found),
        }
    }

    pub fn tables(&mut self, name: &str, expected: &[u8], found: &[u8]) {
        let [expected, found] = [expected, found].map(String::from_utf8_lossy);
        let (rows, others): (Vec<&str>, Vec<&str>) = (expected.lines().collect(), found.lines().collect());
        if rows.len() != others.len() {
            return self.differ(name.into(), format!("{} lines", rows.len()), format!("{} lines", others.len()));
        }
        let columns: Vec<&str> = rows.first().map(|head| head.split(',').collect()).unwrap_or_default();
        for (line, (row, other)) in rows.iter().zip(&others).enumerate() {
            let (cells, stored): (Vec<&str>, Vec<&str>) = (row.split(',').collect(), other.split(',').collect());
            if cells.len() != stored.len() {
                self.differ(format!("{name}:{}", line + 1), *row, *other);
                continue;
            }
            for (index, (cell, other)) in cells.into_iter().zip(stored).enumerate() {
                let same = match (cell.parse(), other.parse()) {
                    (Ok(a), Ok(b)) => self.same(a, b),
                    _ => cell == other,
                };
                if !same {
                    let column = columns.get(index).copied().unwrap_or_default();
                    self.differ(format!("{name}:{}: column `{column}`", line + 1), cell, other);
                }
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn numbers_are_compared_within_the_tolerance_and_named_by_their_place() {
        let mut found = Comparison::new(true);
        found.documents("a.json", br#"{"a": {"b": [1.0, "x"]}}"#, br#"{"a": {"b": [1.0000000001, "x"]}}"#);
        assert_eq!((found.numbers, found.differences.len()), (1, 0));
        found.documents("a.json", br#"{"a": {"b": [1.0, "x"]}}"#, br#"{"a": {"b": [1.001, "x"]}, "c": 1}"#);
        let places: Vec<&str> = found.differences.iter().map(|it| it.place.as_str()).collect();
        assert_eq!(places, ["a.json: a.b.0", "a.json: c"]);
        let mut found = Comparison::new(true);
        found.tables("a.csv", b"t,v\n1,2\n3,4\n", b"t,v\n1,2\n3,5\n");
        assert_eq!(found.differences[0].place, "a.csv:3: column `v`");
        found.tables("a.csv", b"t,v\n1,2\n", b"t,v\n");
        assert_eq!(found.differences[1].expected, "2 lines");
    }
}
