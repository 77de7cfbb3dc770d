//! The page, the figures and the table of one trace's spectrum.

use std::fmt::Write as _;

use super::{
    figure::{Axis, Colour, Dash, Figure, Marker, PAGE_WIDTH_MM, Panel, Stroke, trace},
    number::{fixed, significant},
    page::{Block, Column, Files, Page, Plate, ReportError, Table},
};
use granchain_signal::{
    Series,
    feature::{AmplitudeSpectrum, Features, Line, Ratio, USABLE_NYQUIST_FRACTION},
};

/// Highest frequency of the panel of fractional lines, in drive frequencies.
const FRACTIONAL_SPAN: f64 = 4.25;
/// Highest frequency of the panel of absolute amplitudes, in drive frequencies: 1.25 MHz at 73 kHz.
const ABSOLUTE_SPAN: f64 = 17.0;
/// Lowest level drawn, dB re the highest.
const LOWEST_DB: f64 = -80.0;

/// How a unit is shown: what the axis carries, the unit shown, shown number over SI number.
fn shown(unit: &str) -> (&'static str, &'static str, f64) {
    match unit {
        "m/s" => ("Velocity amplitude", "mm/s", 1e3),
        "m" => ("Displacement amplitude", "µm", 1e6),
        "Pa" => ("Pressure amplitude", "kPa", 1e-3),
        _ => ("Amplitude", "SI", 1.0),
    }
}

/// The spectrum twice: dB re the drive line with the fractional lines marked, and absolute amplitudes over the whole band.
///
/// `features` must have been measured on the same trace and window as `spectrum`.
#[must_use]
pub fn figure(spectrum: &AmplitudeSpectrum, features: &Features) -> Figure {
    let frequency = features.drive_frequency_hz;
    let largest = spectrum.amplitudes.iter().copied().fold(f64::MIN_POSITIVE, f64::max);
    let lowest = largest * 10.0_f64.powf(0.05 * LOWEST_DB);
    let drive = features.line(Ratio::ONE).map_or(largest, |line| line.amplitude).max(lowest);
    let nyquist = 0.5 * features.sample_rate_hz;
    let points = |highest: f64, level: &dyn Fn(f64) -> f64| -> Vec<(f64, f64)> {
        let all = spectrum.amplitudes.iter().enumerate().map(|(index, &a)| (spectrum.frequency(index), a));
        all.take_while(|(f, _)| *f <= highest).map(|(f, a)| (f, level(a.max(0.1 * lowest)))).collect()
    };
    let db = |amplitude: f64| 20.0 * (amplitude / drive).log10();

    let highest = (FRACTIONAL_SPAN * frequency).min(nyquist);
    let marked: Vec<&Line> = features.lines.iter().filter(|line| line.frequency_hz <= highest).collect();
    let at = |below: bool| {
        let chosen = marked.iter().filter(|line| line.below_noise_floor == below);
        chosen.map(|line| (line.frequency_hz, db(line.amplitude.max(lowest)))).collect::<Vec<_>>()
    };
    let mut relative = Panel::new(
        Axis::frequency(highest),
        Axis::new("Level re the drive line", "dB").range(db(lowest), db(largest) + 8.0),
    )
    .titled("(a) fractions of the drive frequency")
    .height(50.0);
    for line in &marked {
        // Quarters stand within a label's width of their neighbours: a point, no name.
        if line.ratio.den() < 4 {
            relative = relative.mark_x(line.frequency_hz, line.ratio.to_string());
        }
    }
    relative = relative.line("", points(highest, &db), Stroke::new(Colour::Blue));
    let floor: Vec<(f64, f64)> = (1..=8 * (highest / frequency).ceil() as usize)
        .map(|eighth| 0.125 * eighth as f64 * frequency)
        .take_while(|place| *place <= highest)
        .filter_map(|place| Some((place, spectrum.local_floor(place, frequency)?)))
        .map(|(place, floor)| (place, db(floor.max(lowest))))
        .collect();
    if floor.len() > 1 {
        relative = relative.line("noise floor", floor, Stroke::new(Colour::Black).dash(Dash::Dotted));
    }
    for (below, name, marker) in [(false, "line", Marker::Disc), (true, "below three times the floor", Marker::Ring)] {
        let points = at(below);
        if !points.is_empty() {
            relative = relative.points(name, points, Colour::Vermillion, marker);
        }
    }

    let highest = (ABSOLUTE_SPAN * frequency).min(USABLE_NYQUIST_FRACTION * nyquist);
    let (label, unit, factor) = shown(&features.unit);
    let mut absolute = Panel::new(
        Axis::frequency(highest),
        Axis::new(label, unit).times(factor).logarithmic().range(lowest, 2.5 * largest),
    )
    .titled("(b) absolute")
    .height(50.0);
    for (name, edge) in [("−6 dB", features.bandwidth_hz), ("−20 dB", features.bandwidth_20db_hz)] {
        if let Some(edge) = edge.filter(|edge| *edge <= highest) {
            absolute = absolute.mark_x(edge, name);
        }
    }
    absolute = absolute.line("", points(highest, &|amplitude| amplitude), Stroke::new(Colour::Blue));
    let title = format!(
        "Amplitude spectrum, Hann window over {:.1} drive periods; lines evaluated at their own frequencies",
        features.window.duration() * frequency
    );
    Figure::new(title).sized(PAGE_WIDTH_MM, 1).panel(relative).panel(absolute)
}

/// One trace and its spectrum as a page shows them.
#[derive(Debug)]
pub struct SpectrumPage<'a> {
    pub file: &'a str,
    /// What it holds, such as `velocity`.
    pub quantity: &'a str,
    /// What was measured, for people: names and values.
    pub facts: Vec<(String, String)>,
    pub series: &'a Series,
    pub spectrum: &'a AmplitudeSpectrum,
    /// What was measured of it.
    pub features: &'a Features,
    /// What was assumed on reading.
    pub assumptions: Vec<String>,
}

impl SpectrumPage<'_> {
    /// `report.html`, and every figure as SVG and PNG beside it.
    pub fn files(self) -> Result<Files, ReportError> {
        let Self { file, quantity, series, spectrum, features, .. } = self;
        let (_, unit, factor) = shown(&features.unit);
        let plates = vec![
            Plate::new("trace", trace_figure(series, features, quantity)),
            Plate::new("spectrum", figure(spectrum, features)),
        ];
        let mut blocks =
            vec![Block::Facts(self.facts), Block::Plates(plates), Block::Table(lines_table(features, (factor, unit)))];
        blocks.extend(Block::listed("Assumed on reading", self.assumptions));
        let subtitle = "Lines, peaks and bandwidth of one trace".to_owned();
        Page { title: format!("Spectrum of the {quantity} in {file}"), subtitle, blocks }.files_beside()
    }
}

/// The trace with its analysis window marked.
fn trace_figure(series: &Series, features: &Features, quantity: &str) -> Figure {
    let (label, unit, factor) = shown(&features.unit);
    let axis = Axis::new(label.trim_end_matches(" amplitude"), unit).times(factor);
    let panel = Panel::new(Axis::time(), axis)
        .height(44.0)
        .mark_x(features.window.from, "window")
        .mark_x(features.window.to, "end")
        .line("", trace(series), Stroke::new(Colour::Blue).width(0.7));
    Figure::new(format!("The {quantity} of the whole file; the marks bound the analysis window."))
        .sized(PAGE_WIDTH_MM, 1)
        .panel(panel)
}

/// Whether a line may be a side lobe of the drive's: the window is short of four periods of their difference, and the line not above twice
/// Hann's envelope there, 1/(πx(x² − 1)) for x periods.
fn is_leakage(line: &Line, features: &Features) -> bool {
    let periods = (line.frequency_hz - features.drive_frequency_hz).abs() * features.window.duration();
    let envelope = if periods < 1.5 { 1.0 } else { 1.0 / (std::f64::consts::PI * periods * (periods * periods - 1.0)) };
    periods < 4.0 && line.relative < 2.0 * envelope
}

/// The lines at fractions and multiples of the drive frequency, amplitudes in `unit`, which is `factor` times the SI's number.
#[must_use]
pub fn lines_table(features: &Features, (factor, unit): (f64, &str)) -> Table {
    let found = features.lines.iter().map(|line| {
        let remark = match line.ratio {
            _ if line.below_noise_floor => "not above the floor",
            Ratio::ONE => "drive",
            _ if is_leakage(line, features) => "leakage of the drive line",
            _ => "",
        };
        let sizes = [significant(factor * line.amplitude, 4), significant(line.relative, 3), fixed(line.db, 1)];
        (line.ratio, line.frequency_hz, sizes, remark.to_owned())
    });
    let absent = features
        .absent
        .iter()
        .map(|line| (line.ratio, line.frequency_hz, ["–"; 3].map(str::to_owned), format!("absent: {}", line.reason)));
    let mut rows: Vec<_> = found.chain(absent).collect();
    rows.sort_by_key(|(ratio, ..)| *ratio);
    let row = |(ratio, frequency, sizes, remark): (Ratio, f64, [String; 3], String)| {
        [ratio.to_string(), fixed(1e-3 * frequency, 3)].into_iter().chain(sizes).chain([remark]).collect()
    };
    Table {
        caption: "Lines at fractions and multiples of the drive frequency; relative, dB: to the drive's".into(),
        columns: vec![
            Column::words("Line"),
            Column::numbers("Frequency").unit("kHz"),
            Column::numbers("Amplitude").unit(unit),
            Column::numbers("Relative"),
            Column::numbers("dB"),
            Column::words("Remark"),
        ],
        rows: rows.into_iter().map(row).collect(),
    }
}

/// `spectrum.csv`: frequency, amplitude in SI and level re the drive line, up to the Nyquist frequency.
#[must_use]
pub fn csv(spectrum: &AmplitudeSpectrum, features: &Features) -> String {
    let unit = features.unit.replace('/', "_per_").replace("Pa", "pa");
    let drive = features.line(Ratio::ONE).map_or(0.0, |line| line.amplitude);
    let mut text = format!("frequency_hz,amplitude_{unit},level_db_re_drive_line\n");
    for (index, amplitude) in spectrum.amplitudes.iter().enumerate() {
        let level = 20.0 * (amplitude / drive).max(1e-20).log10();
        // Writing to a string cannot fail.
        let _ = writeln!(text, "{:.3},{amplitude:e},{level:.3}", spectrum.frequency(index));
    }
    text
}

#[cfg(test)]
mod tests {
    use granchain_signal::feature::{FeatureSettings, Window, measure};

    use super::*;

    /// Lines of a tone of that many cycles, with a second line at 2/3 of its frequency.
    fn remarks(cycles: f64, second: f64) -> Vec<(Ratio, bool)> {
        let value = |i: usize| {
            let phase = std::f64::consts::TAU * 73e3 * 2e-7 * i as f64;
            phase.sin() + second * (2.0 / 3.0 * phase).sin()
        };
        let series = Series::new(0.0, 2e-7, (0..(cycles / 73e3 / 2e-7) as usize).map(value).collect());
        let settings = FeatureSettings {
            drive_frequency: 73e3,
            window: Some(Window::whole(&series)),
            noise_rms: 0.0,
            noise_bandwidth: None,
            band: None,
            unit: "m/s".into(),
        };
        let features = measure(&series, &settings).unwrap();
        let loud = features.lines.iter().filter(|line| line.relative > 1e-3 && line.ratio != Ratio::ONE);
        loud.map(|line| (line.ratio, is_leakage(line, &features))).collect()
    }

    #[test]
    fn side_lobes_of_a_short_window_are_called_leakage_and_lines_are_not() {
        // Nearer than 4/8.3 of the drive frequency.
        let short = remarks(8.3, 0.0);
        let near = |ratio: &Ratio| (ratio.value() - 1.0).abs() < 0.48;
        assert!(short.len() > 2 && short.iter().all(|(ratio, leakage)| *leakage == near(ratio)), "{short:?}");
        let long = remarks(60.0, 0.0);
        assert!(long.iter().all(|(_, leakage)| !leakage), "{long:?}");
        let is_line = |(ratio, leakage): &(Ratio, bool)| (ratio.to_string() == "2/3").then_some(!leakage);
        assert_eq!(remarks(8.3, 0.5).iter().find_map(is_line), Some(true));
    }
}
