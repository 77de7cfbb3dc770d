use granchain_signal::{Dimension, Quantity};

use super::{Line, Preamble, count};

/// `#Digilent WaveForms Oscilloscope Acquisition`, further `#` lines, `Time (s),Channel 1 (V)`.
pub(super) fn digilent(lines: &[Line<'_>]) -> Preamble {
    let keys = || lines.iter().take_while(|line| line.text.starts_with('#')).filter_map(Line::keyed);
    let rate = keys().find(|(key, _)| *key == "Sample rate").map(|(_, value)| value);
    let rate = rate.and_then(|value| Quantity::parse_as(value, Dimension::FREQUENCY).ok()).filter(|rate| *rate > 0.0);
    Preamble {
        instrument: "Digilent WaveForms",
        body_line: 1,
        interval: rate.map(|rate| 1.0 / rate),
        points: keys().find(|(key, _)| *key == "Samples").and_then(|(_, value)| count(value)),
        ..Preamble::default()
    }
}
