//! Assumptions and warnings of reading, as text.

use std::path::Path;

use granchain_signal::{Dimension, Quantity, Series, wander};

use super::{
    MaskReason, Masked, MeasurementError, NoiseSource, ReadOptions, RecordKind, RecordedQuantity,
    dialect::Dialect,
    encoding::Encoding,
    mask,
    sampling::Sampled,
    table::{Form, Table, TextForm},
};

pub(super) fn hertz(frequency: f64) -> String {
    Quantity::new(frequency, Dimension::FREQUENCY).to_string()
}

/// A quantity to three figures.
pub(super) fn to_three_figures(value: f64, dimension: Dimension) -> Quantity {
    Quantity::new(format!("{value:.2e}").parse().unwrap_or(value), dimension)
}

/// Peak from which overload is suspected, as a fraction of full scale.
const NEAR_FULL_SCALE: f64 = 0.98;
/// Peak below which poor resolution is suspected, as a fraction of full scale.
const NEAR_NOTHING: f64 = 0.02;

/// Lowest and highest frequency of a strongest line, Hz: horns begin at some kHz, a steel bead of 1 mm rings at 3 MHz, strong ultrasound ends at
/// 20 MHz. A horn of 20 to 100 kHz leaves both with a unit of time that is wrong by 1000.
const LINES_OF_MOTION: (f64, f64) = (1e2, 1e7);
const LINES_OF_PRESSURE: (f64, f64) = (1e2, 3e7);

/// Noise of a horn tip that affects the chain's response, as a fraction of its peak: 1 nm of 1 µm changes peaks by
/// some per cent.
const LOUD_NOISE: f64 = 0.003;
/// Largest noise of a record, over its peak, for which intervals were tested.
const TESTED_NOISE: f64 = 0.05;
/// Range of a vibration's running mean, as a fraction of its peak, that rounding a period to whole samples cannot
/// explain.
const LARGE_DRIFT: f64 = 0.1;
/// Distance by which a bead may move within a few periods as it is pushed into its support, m.
const MOVES_ON: f64 = 2.5e-7;

/// File format on one line.
pub(super) fn written(table: &Table) -> String {
    match &table.form {
        Form::Text(form) => {
            let Dialect { delimiter, decimal } = form.dialect;
            let preamble =
                form.preamble.as_ref().map(|it| format!(", written by {}", it.instrument)).unwrap_or_default();
            format!("{}, {}, {}{preamble}", delimiter.name(), decimal.name(), form.encoding.name())
        }
        Form::Universal(form) => form.written.clone(),
    }
}

/// What was assumed and what looks wrong.
#[derive(Debug, Default)]
pub(super) struct Notes {
    pub assumptions: Vec<String>,
    pub warnings: Vec<String>,
}

impl Notes {
    pub(super) fn assume(&mut self, text: String) {
        self.assumptions.push(text);
    }

    pub(super) fn warn(&mut self, text: String) {
        self.warnings.push(text);
    }

    /// Records a time and its source, and returns the time.
    pub(super) fn take(&mut self, what: &str, time: f64, from: &str) -> f64 {
        self.assume(format!("{what} {:.6} µs ({from})", time * 1e6));
        time
    }

    /// Values that are implausible on such a bench.
    pub(super) fn about_plausibility(&mut self, dimension: Dimension, peak: f64) {
        let (least, most, usual) = match dimension {
            Dimension::LENGTH => (1e-9, 2e-4, "a horn's tip moves by micrometres"),
            Dimension::VELOCITY => (1e-3, 20.0, "beads and tips move at millimetres to metres a second"),
            Dimension::PRESSURE => (0.0, 1e8, "shock waves of lithotripters have less"),
            _ => return,
        };
        let (beyond, limit) = if peak > most { ("above", most) } else { ("below", least) };
        if peak > most || peak < least && peak > 0.0 {
            self.warn(format!(
                "the peak is {}, {beyond} {}: {usual}; check the unit (--unit) or the sensitivity (--scale)",
                to_three_figures(peak, dimension),
                to_three_figures(limit, dimension)
            ));
        }
    }

    /// A unit of time that is wrong by a power of ten: of the drive's `stated` frequency (Hz) less than a period in a record of `duration` (s), or a
    /// strongest `line` that no bead can have.
    pub(super) fn about_time(&mut self, stated: Option<f64>, line: Option<f64>, duration: f64, kind: RecordKind) {
        let (lowest, highest) = if kind == RecordKind::Hydrophone { LINES_OF_PRESSURE } else { LINES_OF_MOTION };
        let found = match (stated, line) {
            (Some(stated), _) if stated * duration < 1.0 => {
                format!("the record lasts {:.2e} periods of the drive's {}", stated * duration, hertz(stated))
            }
            (None, Some(line)) if !(lowest..=highest).contains(&line) => {
                let [line, lowest, highest] =
                    [line, lowest, highest].map(|it| to_three_figures(it, Dimension::FREQUENCY));
                format!(
                    "the strongest line lies at {line}, not between {lowest} and {highest}, where such a record has it"
                )
            }
            _ => return,
        };
        self.warn(format!("{found}: check the unit of time (--read time_unit=s, or another) or the sample rate"));
    }

    pub(super) fn about_table(&mut self, table: &Table, options: &ReadOptions) {
        match &table.form {
            Form::Text(form) => self.about_text(form, table, options),
            Form::Universal(form) => {
                self.assumptions.extend(form.assumptions.iter().cloned());
                self.warnings.extend(form.warnings.iter().cloned());
            }
        }
        if let (Some(time), true, None) = (table.chosen.time, table.chosen.several, &options.time_column) {
            let [time, value] = [time, table.chosen.value].map(|at| &table.columns[at].header);
            self.assume(format!(
                "of several columns of time `{time}` is taken, the one beside `{value}` (--read time_column)"
            ));
        }
        if let Some(time) = table.chosen.time.filter(|time| table.columns[*time].is_clock()) {
            self.assume(format!("`{}` is a time of day: the first instant is taken as 0", table.columns[time].header));
        }
        if let Some((volts, scale)) = table.chosen.volts {
            let name = &table.columns[table.chosen.value].header;
            let from = if options.scale.is_some() { "--scale" } else { "the header" };
            self.assume(match scale.is_of_full_scale() {
                true => format!("`{name}` in parts of full scale × {scale} ({from})"),
                false => format!("`{name}` in volts × {scale} ({from}); volts of the file × {}", volts.factor),
            });
            if options.range.is_none() && scale.dimension() != Dimension::PRESSURE {
                self.assume(
                    "the instrument's full-scale value is not stated (range): overload shows as flat peaks only".into(),
                );
            }
        }
        self.assumptions.extend(table.assumptions.iter().cloned());
        self.warnings.extend(table.warnings.iter().cloned());
        if table.blank_ends > 0 {
            self.assume(format!("{} rows without a value at the ends are left out", table.blank_ends));
        }
        if table.bridged > 0 {
            self.assume(format!("{} missing cells bridged by straight lines (missing=interpolate)", table.bridged));
        }
        if table.open_end {
            self.warn(
                "the last line has no line end: its last number may be cut short; compare it with the original, or delete \
                 the line"
                    .into(),
            );
        }
    }

    fn about_text(&mut self, form: &TextForm, table: &Table, options: &ReadOptions) {
        match (form.encoding, form.foreign) {
            (Encoding::Utf8 | Encoding::Utf8Marked, _) => {}
            (encoding, Some((line, byte))) => {
                self.assume(format!("encoding: {}, for byte 0x{byte:02x} in line {line} is no UTF-8", encoding.name()))
            }
            (encoding, None) => self.assume(format!("encoding: {}", encoding.name())),
        }
        let Dialect { delimiter, decimal } = form.dialect;
        if form.dialect != Dialect::default() {
            let given = match (options.delimiter, options.decimal) {
                (None, None) => "taken from the first rows",
                (Some(_), None) => "delimiter, and the first rows",
                (None, Some(_)) => "the first rows, and decimal",
                (Some(_), Some(_)) => "delimiter, decimal",
            };
            let separated = if form.blanks { "blanks" } else { delimiter.name() };
            self.assume(format!("cells separated by {separated}, {} ({given})", decimal.name()));
        }
        if form.trailing {
            self.assume("the delimiter at the end of every row separates nothing".into());
        }
        if let Some(preamble) = &form.preamble {
            if preamble.body_line > 1 {
                let last = preamble.body_line - 1;
                self.assume(format!("lines 1 to {last} are the preamble of an instrument ({})", preamble.instrument));
            } else {
                self.assume(format!("written by {}", preamble.instrument));
            }
            self.assumptions.extend(preamble.assumptions.iter().cloned());
        }
        if let Some((segment, of)) = form.segment {
            self.assume(format!("segment {segment} of {of} (dataset)"));
        }
        if form.header_line.is_none() && form.preamble.as_ref().is_none_or(|preamble| preamble.header.is_none()) {
            self.assume("no header: columns known by number, units by flags".into());
        }
        if let Some(line) = form.units_line {
            self.assume(format!("line {line} is a row of units"));
        }
        if table.chosen.time.is_none() && form.preamble.as_ref().is_none_or(|preamble| preamble.grid.is_none()) {
            self.assume("no column of time: the first sample is at 0, the others by --sample-rate".into());
        }
    }

    /// Interpolation onto an even grid.
    pub(super) fn about_sampling(&mut self, sampled: &Sampled) {
        let step = sampled.series.step;
        if let Some((shortest, longest)) = sampled.resampled {
            self.assume(format!(
                "uneven samples, {shortest:.4e} s to {longest:.4e} s apart, interpolated by a cubic spline onto one every \
                 {step:.4e} s (resample)"
            ));
        }
    }

    /// Samples that reach the vibrometer's full-scale value.
    pub(super) fn about_range(
        &mut self,
        path: &Path,
        raw: &Series,
        table: &Table,
        options: &ReadOptions,
    ) -> Result<(), MeasurementError> {
        let Some(range) = options.range else { return Ok(()) };
        let motion = table.chosen.value_unit.dimension;
        let full = match table.chosen.volts {
            Some((_, scale)) if range.dimension == Dimension::VOLTAGE => range.value * scale.per_volt(),
            _ if range.dimension == motion => range.value,
            _ => return Err(MeasurementError::WrongRange { path: path.into(), found: range.to_string() }),
        };
        let share = raw.peak() / full;
        let shown = Quantity::new(full, motion);
        let text = format!("the record's peak is {:.0} % of the instrument's range ({shown})", 100.0 * share);
        if share >= NEAR_FULL_SCALE {
            self.warn(format!(
                "{text}: it was overloaded or nearly so, and peaks may be too small; record with a larger range"
            ));
        } else if share < NEAR_NOTHING {
            self.warn(format!("{text}: the resolution of the instrument may show; record with a smaller range"));
        } else {
            self.assume(format!("{text} (range)"));
        }
        Ok(())
    }

    /// Signs that the instrument wrote fewer samples than it took.
    ///
    /// - The preamble states a shorter interval (or a longer one, which contradicts the rows), or another number of
    ///   samples.
    /// - Nearly every sample is an extreme: the largest and the smallest value of each stretch were kept. Noise turns
    ///   at two samples out of three, a tone with four or more samples a cycle at every second.
    /// - The vibrometer's bandwidth exceeds half the sample rate.
    pub(super) fn about_decimation(&mut self, raw: &Series, table: &Table, bandwidth: Option<f64>) {
        let resolve =
            "what lies above half the sample rate is folded down and short peaks are lost; export all samples";
        let preamble = table.form.preamble();
        match preamble.and_then(|preamble| preamble.interval).or(table.stated_step) {
            Some(interval) if raw.step > 1.5 * interval => self.warn(format!(
                "the preamble states a sample every {interval:.4e} s, the rows hold one every {:.4e} s: the instrument \
                 thinned the record out, so {resolve}",
                raw.step
            )),
            Some(interval) if 1.5 * raw.step < interval => self.warn(format!(
                "the preamble states a sample every {interval:.4e} s, the instants one every {:.4e} s, which is taken; check which is \
                 right",
                raw.step
            )),
            _ => {}
        }
        let segment = table.form.text().is_some_and(|form| form.segment.is_some());
        if let Some(points) = preamble.and_then(|preamble| preamble.points).filter(|it| *it != raw.len() && !segment) {
            self.warn(format!(
                "the preamble announces {points} samples, the file holds {}: it was cut or thinned out; export all samples",
                raw.len()
            ));
        }
        let turns = raw.values.windows(3).filter(|w| (w[1] - w[0]) * (w[2] - w[1]) < 0.0).count();
        if raw.len() >= 64 && turns as f64 > 0.95 * (raw.len() - 2) as f64 {
            self.warn(format!(
                "{:.0} % of the samples are a largest or smallest value between their neighbours: the instrument probably kept \
                 the extremes of each stretch (peak detection, envelope), so spectra mean nothing; export all samples",
                100.0 * turns as f64 / (raw.len() - 2) as f64
            ));
        }
        if let Some(bandwidth) = bandwidth.filter(|bandwidth| *bandwidth > 0.5 * raw.sample_rate()) {
            self.warn(format!(
                "the instrument's bandwidth is {}, more than half the sample rate of {}: sampled too slowly or thinned out by the \
                 instrument, so {resolve}",
                hertz(bandwidth),
                hertz(raw.sample_rate())
            ));
        }
    }

    /// Noise of the recorded quantity and its source.
    pub(super) fn about_noise_source(
        &mut self,
        recorded: RecordedQuantity,
        rms: f64,
        source: NoiseSource,
        step: Option<f64>,
    ) {
        let (.., dimension) = recorded.described();
        let shown = |value| to_three_figures(value, dimension);
        match source {
            NoiseSource::Unknown => self.assume("noise: unknown, taken as none".into()),
            NoiseSource::Quantisation => {}
            source => self.assume(format!("noise: {} rms ({})", shown(rms), source.describe())),
        }
        if let Some(step) = step {
            let counts = if source == NoiseSource::Quantisation { ": noise of step/√12" } else { "" };
            self.assume(format!("quantised in steps of {}{counts}", shown(step)));
        }
    }

    /// Sensor noise of a horn tip, which drives the model like a motion.
    pub(super) fn about_noise(&mut self, displacement: &Series, noise_rms: f64) {
        let peak = displacement.peak();
        if noise_rms > LOUD_NOISE * peak {
            self.warn(format!(
                "noise of {} rms before the trigger, {:.2} % of the peak: the piston shakes the chain with it, and peaks and fits scatter \
                 accordingly; average several records, or reduce the instrument's bandwidth",
                Quantity::new(format!("{noise_rms:.2e}").parse().unwrap_or(noise_rms), Dimension::LENGTH),
                100.0 * noise_rms / peak
            ));
        }
    }

    /// Drift of a vibration: its running mean over a drive period (f0, Hz) for a horn, over twelve for a bead or a
    /// pressure, which may have lines at f0/2, f0/3, f0/4 and f0/6.
    pub(super) fn about_drift(&mut self, displacement: &Series, drive_frequency: f64, kind: RecordKind) {
        // A burst that begins or ends moves the mean of five periods by 0.06 of its peak at most.
        let periods = if kind == RecordKind::HornTip { 5.0 } else { 12.0 };
        let period = (periods * displacement.sample_rate() / drive_frequency).round() as usize;
        if period < 4 || displacement.len() < 3 * period {
            return;
        }
        let moved = wander(&displacement.values, period);
        let peak = displacement.peak();
        // A bead that moves on by this much in twelve periods has no drift.
        let own = if kind == RecordKind::Vibrometer { MOVES_ON * drive_frequency / periods } else { 0.0 };
        if moved > f64::max(LARGE_DRIFT * peak, own) {
            let (what, remedy) = match kind {
                RecordKind::HornTip => (
                    "a drift or step drives the chain as a motion of the horn would",
                    "AC-couple the instrument, or record the velocity",
                ),
                RecordKind::Vibrometer | RecordKind::Hydrophone => (
                    "hum or a drift adds to its peaks and early features",
                    "AC-couple the instrument, or find the ground loop",
                ),
            };
            self.warn(format!(
                "the baseline moves by {} within the record, {:.0} % of the peak: {what}; {remedy}",
                to_three_figures(moved, kind.dimension()),
                100.0 * moved / peak
            ));
        }
    }

    /// Noise of a bead or a pressure above the level for which intervals were tested.
    pub(super) fn about_loud_noise(&mut self, series: &Series, noise_rms: f64) {
        let share = noise_rms / series.peak();
        if share > TESTED_NOISE {
            self.warn(format!(
                "noise of {:.0} % of the peak: intervals were tested with up to {:.0} %, and the smallest features drown in it; average several \
                 shots, or reduce the instrument's bandwidth",
                100.0 * share,
                100.0 * TESTED_NOISE
            ));
        }
    }

    /// Masked samples, if any; a mask that the user stated is no warning.
    pub(super) fn about_mask(&mut self, masked: &[Masked]) {
        if masked.is_empty() {
            return;
        }
        let text = mask::in_words(masked);
        if masked.iter().all(|masked| masked.reason == MaskReason::Stated) {
            self.assume(format!("masked: {text} (mask)"));
        } else {
            self.warn(format!(
                "masked, as no motion looks like it: {text}; a fit bridges them, in the record and in every simulated run alike; to use these \
                 samples pass --read mask=none, to choose others --read mask=FROM:TO,…"
            ));
        }
    }

    /// Values at which the record is flat. A quantity with a `least` value, as a force between bodies, is flat there by nature.
    pub(super) fn about_clipping(&mut self, raw: &Series, least: Option<f64>) -> [Option<f64>; 2] {
        let mut clipped = [None, None];
        let values = &raw.values;
        let (low, high) =
            values.iter().fold((f64::INFINITY, f64::NEG_INFINITY), |(low, high), &x| (low.min(x), high.max(x)));
        if !(high > low) {
            self.warn(
                "every sample has the same value: the input may be disconnected, or the wrong column was read".into(),
            );
            return clipped;
        }
        let finest = values.windows(2).map(|w| (w[1] - w[0]).abs()).filter(|d| *d > 0.0).fold(f64::INFINITY, f64::min);
        for (end, extreme, which) in [(1, high, "largest"), (0, low, "smallest")] {
            if end == 0 && least == Some(extreme) {
                continue;
            }
            let (mut runs, mut longest, mut i) = (0, 0, 0);
            while i < values.len() {
                if values[i] != extreme {
                    i += 1;
                    continue;
                }
                let past = values[i..].iter().position(|x| *x != extreme).map_or(values.len(), |n| i + n);
                let entry = if i > 0 { (values[i - 1] - extreme).abs() } else { 0.0 };
                if past - i >= 3 && entry > 3.0 * finest {
                    runs += 1;
                    longest = longest.max(past - i);
                }
                i = past;
            }
            if runs >= 2 || longest >= 5 {
                clipped[end] = Some(extreme);
                let natural = if extreme == 0.0 { ", unless the quantity has no values beyond 0" } else { "" };
                self.warn(format!(
                    "the {which} value occurs in {runs} flat run(s) of up to {longest} samples: the input was probably \
                     clipped{natural}, so peaks are too small; record with a larger range"
                ));
            }
        }
        clipped
    }
}
