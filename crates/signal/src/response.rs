//! Frequency response of an instrument: a named filter, or a table as calibration certificates have it.

use std::{fmt, str::FromStr, sync::Arc};

use realfft::{RealFftPlanner, num_complex::Complex};
use thiserror::Error;

use super::{CausalShape, Dimension, Quantity, Series, number::engineering};

/// What an instrument makes of a signal, relative to what it makes of the drive frequency.
#[derive(Debug, Clone, PartialEq)]
pub enum InstrumentResponse {
    /// Causal, −3 dB at the stated bandwidth, its delay at zero frequency removed.
    Filter(CausalShape),
    Table(Arc<ResponseTable>),
}

/// Magnitude, and phase where it was measured, at ascending frequencies.
#[derive(Debug, Clone, PartialEq)]
pub struct ResponseTable {
    frequencies: Vec<f64>,
    /// ln of the magnitude, whose unit does not matter.
    logarithms: Vec<f64>,
    /// Phase, rad; without any it is the least that a causal instrument of that magnitude can have.
    phases: Option<Vec<f64>>,
    text: String,
}

/// Why a response cannot be used.
#[derive(Debug, Clone, PartialEq, Error)]
#[error(
    "expected `butterworth-1` to `butterworth-4`, `bessel`, or rows FREQUENCY:MAGNITUDE or FREQUENCY:MAGNITUDE:PHASE with ascending frequencies, \
     separated by commas or lines, such as `0.1MHz:0dB:0deg, 1MHz:-2.1dB:-12deg` or `1MHz:52mV/MPa`; found `{0}`"
)]
pub struct ResponseError(String);

impl FromStr for InstrumentResponse {
    type Err = ResponseError;

    fn from_str(text: &str) -> Result<Self, ResponseError> {
        let text = text.trim();
        if text == "bessel" {
            return Ok(Self::Filter(CausalShape::Bessel));
        }
        if let Some(order) = text.strip_prefix("butterworth-").and_then(|order| order.parse().ok()) {
            let known = (1..=4).contains(&order).then_some(Self::Filter(CausalShape::Butterworth(order)));
            return known.ok_or_else(|| ResponseError(text.into()));
        }
        ResponseTable::parse(text).map(|table| Self::Table(Arc::new(table)))
    }
}

impl fmt::Display for InstrumentResponse {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Filter(CausalShape::Bessel) => f.write_str("bessel"),
            Self::Filter(CausalShape::Butterworth(order)) => write!(f, "butterworth-{order}"),
            Self::Table(table) => f.write_str(&table.text),
        }
    }
}

/// ln of a magnitude: in dB, of a pure number, or of a sensitivity.
fn logarithm(text: &str) -> Option<f64> {
    if let Some((number, _)) = text.split_once("dB") {
        return number.trim().parse::<f64>().ok().map(|level| level * std::f64::consts::LN_10 / 20.0);
    }
    let value = Quantity::parse(text).ok()?.value;
    (value > 0.0).then(|| libm::log(value))
}

fn phase(text: &str) -> Option<f64> {
    match text.strip_suffix("deg") {
        Some(degrees) => degrees.trim().parse::<f64>().ok().map(f64::to_radians),
        None => text.strip_suffix("rad").unwrap_or(text).trim().parse().ok(),
    }
}

impl ResponseTable {
    fn parse(text: &str) -> Result<Self, ResponseError> {
        let (mut frequencies, mut logarithms, mut phases) = (Vec::new(), Vec::new(), Vec::new());
        let rows: Vec<&str> = text.split([',', '\n']).map(str::trim).filter(|row| !row.is_empty()).collect();
        for row in &rows {
            let cells: Vec<&str> = row.split(':').map(str::trim).collect();
            let wrong = || ResponseError((*row).into());
            let [frequency, magnitude, ..] = cells[..] else { return Err(wrong()) };
            let frequency = Quantity::parse_as(frequency, Dimension::FREQUENCY).map_err(|_| wrong())?;
            if frequencies.last().is_some_and(|last| frequency <= *last) || frequency < 0.0 || cells.len() > 3 {
                return Err(wrong());
            }
            frequencies.push(frequency);
            logarithms.push(logarithm(magnitude).filter(|it| it.is_finite()).ok_or_else(wrong)?);
            if let Some(cell) = cells.get(2) {
                phases.push(phase(cell).filter(|it| it.is_finite()).ok_or_else(wrong)?);
            }
        }
        // Every row has a phase, or none has.
        if rows.len() < 2 || ![0, rows.len()].contains(&phases.len()) {
            return Err(ResponseError(text.into()));
        }
        let phases = (!phases.is_empty()).then_some(phases);
        Ok(Self { frequencies, logarithms, phases, text: rows.join(", ") })
    }

    /// Its range, whether phases were measured, for a message.
    pub fn in_words(&self) -> String {
        let [first, last] = [self.frequencies.first(), self.frequencies.last()]
            .map(|frequency| engineering(frequency.copied().unwrap_or(0.0), "Hz", 4));
        let phase = if self.phases.is_some() { "with phases" } else { "with the least phase" };
        format!("{} rows from {first} to {last}, {phase}", self.frequencies.len())
    }

    /// Between the rows by a straight line over the frequency, beyond the first and the last as there.
    fn at(&self, values: &[f64], frequency: f64) -> f64 {
        let next = self.frequencies.partition_point(|known| *known < frequency);
        let (Some(high), Some(low)) = (self.frequencies.get(next), next.checked_sub(1)) else {
            return if next == 0 { values[0] } else { values[values.len() - 1] };
        };
        let part = (frequency - self.frequencies[low]) / (high - self.frequencies[low]);
        values[low] + part * (values[next] - values[low])
    }

    /// What the instrument shows of a series, with magnitude 1 at `reference` (Hz).
    ///
    /// Without phases the least phase, but for a delay, follows from the magnitude by the cepstrum: of ln|H| all that lies at negative time is turned about.
    pub fn apply(&self, series: &Series, reference: f64) -> Series {
        let len = series.len();
        // At rest before; behind the end a quarter of the length at its last value, then back to the first.
        let padded = (2 * len.max(64)).next_power_of_two();
        let (first, last) =
            (series.values.first().copied().unwrap_or(0.0), series.values.last().copied().unwrap_or(0.0));
        let value = |i: usize| match series.values.get(i) {
            Some(value) => *value - first,
            None => {
                let part = ((i - len) as f64 / (padded - len) as f64 * 2.0 - 0.5).clamp(0.0, 1.0);
                (last - first) * 0.5 * (1.0 + libm::cos(std::f64::consts::PI * part))
            }
        };
        let mut work: Vec<f64> = (0..padded).map(value).collect();
        let mut planner = RealFftPlanner::<f64>::new();
        let (forward, backward) = (planner.plan_fft_forward(padded), planner.plan_fft_inverse(padded));
        let mut spectrum = forward.make_output_vec();
        let step = 1.0 / (padded as f64 * series.step);
        let zero = self.at(&self.logarithms, reference);
        let gains = (0..spectrum.len()).map(|k| self.at(&self.logarithms, k as f64 * step) - zero);
        let mut exponents: Vec<Complex<f64>> = gains.map(|gain| Complex::new(gain, 0.0)).collect();
        let done = match &self.phases {
            Some(phases) => {
                let phased = exponents.iter_mut().enumerate();
                phased.for_each(|(k, exponent)| exponent.im = self.at(phases, k as f64 * step));
                Ok(())
            }
            None => {
                let mut cepstrum = vec![0.0; padded];
                let folded = backward.process(&mut exponents, &mut cepstrum);
                let scale = 1.0 / padded as f64;
                cepstrum[0] *= scale;
                cepstrum[padded / 2] *= scale;
                cepstrum[1..padded / 2].iter_mut().for_each(|value| *value *= 2.0 * scale);
                cepstrum[padded / 2 + 1..].fill(0.0);
                folded.and_then(|()| forward.process(&mut cepstrum, &mut exponents))
            }
        };
        let shown = done.and_then(|()| forward.process(&mut work, &mut spectrum)).and_then(|()| {
            for (bin, exponent) in spectrum.iter_mut().zip(&exponents) {
                *bin *= exponent.exp() / padded as f64;
            }
            let last = spectrum.len() - 1;
            spectrum[0].im = 0.0;
            spectrum[last].im = 0.0;
            backward.process(&mut spectrum, &mut work)
        });
        let offset = first * libm::exp(self.at(&self.logarithms, 0.0) - zero);
        match shown {
            Ok(()) => Series::new(series.start, series.step, work[..len].iter().map(|value| value + offset).collect()),
            Err(_) => series.clone(),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn burst(step: f64, len: usize) -> Series {
        let value = |i: usize| {
            let t = i as f64 * step - 60e-6;
            libm::exp(-(t / 8e-6).powi(2)) * libm::sin(std::f64::consts::TAU * 2e5 * t)
        };
        Series::new(0.0, step, (0..len).map(value).collect())
    }

    #[test]
    fn the_least_phase_of_a_magnitude_is_that_of_the_causal_filter_which_has_it() {
        let (series, corner) = (burst(5e-8, 4000), 4e5);
        // |H| of a second-order Butterworth in steps of 10 kHz; its own delay at zero frequency is √2/ω.
        let row = |k: usize| format!("{}kHz:{}", 10 * k, (1.0 + (1e4 * k as f64 / corner).powi(4)).sqrt().recip());
        let text = (0..1000).map(row).collect::<Vec<_>>().join(",");
        let InstrumentResponse::Table(table) = text.parse().unwrap() else { panic!("a filter") };
        let shown = table.apply(&series, 1.0);
        let filtered = CausalShape::Butterworth(2).apply(&series, corner, 0.5_f64.sqrt());
        let delay = 2.0_f64.sqrt() / (std::f64::consts::TAU * corner);
        assert!((filtered.start + delay).abs() < 1e-12);
        let peak = shown.peak();
        // What the filter takes above half the sample rate is a delay below it, which a record's own shift takes up.
        let slope = |i: usize| 0.5 * (filtered.values[i + 1] - filtered.values[i - 1]);
        let rest = |i: usize| shown.values[i] - filtered.values[i];
        let sum = |of: &dyn Fn(usize) -> f64| (900..1600).map(of).sum::<f64>();
        let late = sum(&|i| slope(i) * rest(i)) / sum(&|i| slope(i) * slope(i));
        let apart = (900..1600).map(|i| (rest(i) - late * slope(i)).abs()).fold(0.0, f64::max);
        // The bilinear transform of the filter bends its frequencies by (π f Δt)²/3 = 0.03 %.
        assert!(late.abs() < 1.0 && apart < 3e-3 * peak, "{late} samples, {apart} of {peak}");
    }

    #[test]
    fn a_measured_phase_is_a_delay_and_the_magnitude_is_one_at_the_drive() {
        let series = burst(5e-8, 4000);
        // 1 µs: −360° at 1 MHz. Half as sensitive as at zero frequency from 150 kHz on.
        let text = "0Hz:2V/Pa:0deg, 150kHz:1V/Pa:-54deg, 10MHz:1V/Pa:-3600deg";
        let InstrumentResponse::Table(table) = text.parse().unwrap() else { panic!("a filter") };
        assert_eq!(
            InstrumentResponse::Table(Arc::clone(&table)).to_string().parse(),
            Ok(InstrumentResponse::Table(Arc::clone(&table)))
        );
        let shown = table.apply(&series, 2e5);
        let late = (900..1600).map(|i| (shown.values[i + 20] - series.values[i]).abs()).fold(0.0, f64::max);
        // Part of the burst lies below 150 kHz.
        assert!(late < 0.1 * series.peak(), "{late}");
        assert!((shown.peak() / series.peak() - 1.0).abs() < 0.05);
    }

    #[test]
    fn what_is_no_response_is_refused_with_its_row() {
        for (text, row) in [
            ("bessel-9", "bessel-9"),
            ("butterworth-7", "butterworth-7"),
            ("1MHz:0dB, 0.5MHz:0dB", "0.5MHz:0dB"),
            ("1MHz:0dB, 2MHz:0dB:3deg", "1MHz:0dB, 2MHz:0dB:3deg"),
            ("1MHz:-3, 2MHz:1", "1MHz:-3"),
            ("1 mm:0dB, 2 mm:0dB", "1 mm:0dB"),
        ] {
            let error = text.parse::<InstrumentResponse>().unwrap_err().to_string();
            assert!(error.ends_with(&format!("found `{row}`")), "{error}");
        }
    }
}
