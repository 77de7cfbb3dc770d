//! The figures of a calibration.

use super::{
    CalibrationReport, DensityMap, PairMap, RecordReport, RunPoint,
    shown::{Estimate, Law},
    spectrum::{RECORDED, SIMULATED, SpectrumCurve, amplitude_panel, level_panel},
};
use crate::{
    figure::{Axis, Colour, Dash, ErrorPoint, Figure, Layer, Map, Marker, PAGE_WIDTH_MM, Panel, Stroke, trace},
    number,
    page::Plate,
    sweep::capitalised,
};
use granchain_signal::{
    Series,
    feature::{AmplitudeSpectrum, Measurand, Window, amplitude_spectrum},
};

fn quantity(measurand: Measurand) -> Axis {
    match measurand {
        Measurand::Velocity => Axis::new("Velocity", "mm/s").times(1e3),
        Measurand::Pressure => Axis::new("Pressure", "kPa").times(1e-3),
    }
}

/// Drive and its spectrum, side by side.
pub(super) fn drive(report: &CalibrationReport, record: &RecordReport) -> Vec<Plate> {
    let stroke = RECORDED.width(0.7);
    let displacement = Panel::new(Axis::time(), Axis::new("Piston displacement", "µm").times(1e6)).line(
        "",
        trace(&record.drive),
        stroke,
    );
    let mut plates = vec![Plate::new("drive", Figure::new("Displacement of the piston at α = 1.").panel(displacement))];
    if let Ok(spectrum) = amplitude_spectrum(&record.drive, Window::whole(&record.drive)) {
        let highest = (4.3 * report.drive_frequency).min(0.5 * record.drive.sample_rate());
        let reference = spectrum.amplitudes.iter().copied().fold(0.0, f64::max);
        let curves = [SpectrumCurve { label: String::new(), spectrum: &spectrum, stroke }];
        let panel = level_panel(&curves, (reference, "largest"), report.drive_frequency, highest);
        let title = "Amplitude spectrum of the piston displacement, normalised to its largest line. The numbers at the top are multiples of the drive frequency.";
        plates.push(Plate::new("drive-spectrum", Figure::new(title).panel(panel)));
    }
    plates
}

/// What is left of every fitted feature at the answer, in scatters: what decided.
pub(super) fn pulls(law: &Law<'_>, records: &[RecordReport]) -> Vec<Plate> {
    let pulls: Vec<(String, f64, bool)> = law
        .compared(records)
        .into_iter()
        .filter_map(|(name, feature)| Some((name, feature.deviation?, feature.widened.is_some())))
        .collect();
    if pulls.is_empty() {
        return Vec::new();
    }
    let count = pulls.len();
    let row = |index: usize| (count - index) as f64;
    let names = pulls.iter().enumerate().map(|(index, (name, ..))| (row(index), name.clone())).collect();
    let farthest = pulls.iter().map(|(_, pull, _)| pull.abs()).fold(3.0, f64::max);
    let shown = farthest.min(FARTHEST_PULL);
    let ends = 1.08 * shown;
    let y = Axis::new("Fitted feature", "").range(0.0, count as f64 + 1.0).named_ticks(names);
    let mut panel = Panel::new(Axis::new("ln(model/record) in SD with model error", "1").range(-ends, ends), y);
    let height = count as f64 + 1.0;
    for (half, label, tint) in [(2.0, "±2", 0.14), (1.0, "±1", 0.3)] {
        let corners = vec![(-half, 0.0), (half, 0.0), (half, height), (-half, height)];
        panel = panel.shapes(label, [corners], (Colour::Grey, tint));
    }
    let of = |widened: bool| {
        let points = pulls.iter().enumerate().filter(move |(_, (.., down))| *down == widened);
        points.map(|(index, (_, pull, _))| ErrorPoint::exact(pull.clamp(-shown, shown), row(index))).collect::<Vec<_>>()
    };
    for (points, label, colour, marker) in [
        (of(false), "fitted", Colour::Blue, Marker::Disc),
        (of(true), "variance enlarged: no run reproduces it", Colour::Vermillion, Marker::Diamond),
    ] {
        if !points.is_empty() {
            panel.layers.push(Layer::Points { label: label.into(), points, colour, marker });
        }
    }
    let beyond = if farthest > shown { format!(" Beyond ±{shown} points stand at the edge.") } else { String::new() };
    let figure = Figure::new(format!("Every fitted feature at the fitted values.{beyond}"))
        .sized(PAGE_WIDTH_MM, 1)
        .panel(panel.height(3.4 * count as f64 + 6.0));
    vec![Plate::new(format!("pulls-{}", law.key()), figure)]
}

/// Pulls beyond this many scatters are drawn at the edge.
const FARTHEST_PULL: f64 = 12.0;

/// Recorded and simulated velocity or pressure: whole, ring-up, a few periods of the plateau.
pub(super) fn traces(report: &CalibrationReport, record: &RecordReport) -> Vec<Plate> {
    let measurand = report.outcome.quantity;
    let main = &record.recorded;
    let period = 1.0 / report.drive_frequency;
    let overlay = |x: Axis, recorded: Stroke, simulated: Stroke| {
        let mut panel = Panel::new(x, quantity(measurand));
        if !record.masked.is_empty() {
            panel = masked(record, panel);
        }
        panel = panel.line(record.record_label.clone(), trace(main), recorded);
        if let Some(series) = &record.simulated {
            panel = panel.line("simulated", trace(series), simulated);
        }
        panel
    };
    let what = match measurand {
        Measurand::Velocity => format!("velocity of the last bead’s {}", record.observed.name()),
        Measurand::Pressure => "pressure at the hydrophone".to_owned(),
    };
    let and = if record.simulated.is_some() { " and simulated" } else { "" };
    let both = format!("{}, {}{and}", capitalised(&what), record.record_label);
    let start = main.start;
    let end = record.simulated.as_ref().map_or(main.end(), |series| series.end().min(main.end())).max(start + period);
    let whole = overlay(Axis::time().range(start, end), RECORDED.width(0.8), SIMULATED.width(0.5)).height(48.0);
    let near = Spectra::of(record).near(report);
    let columns = 1 + usize::from(near.is_some());
    let mut caption = format!("{both}: the whole record.");
    if near.is_some() {
        caption.push_str(
            " Right: amplitude spectra over the analysis window; names above the frame are fractions and multiples of the drive frequency.",
        );
    }
    if !record.masked.is_empty() {
        caption.push_str(" Shaded: masked samples, bridged in both.");
    }
    for found in &record.instrument {
        caption.push(' ');
        caption.push_str(found);
    }
    let mut panels = vec![whole];
    panels.extend(near);
    if !record.residual.is_empty() {
        caption.push_str(
            " Below: the difference record − simulation in the compared part. If the model is right, 90 % of it lies in the band, which includes noise \
             and run-to-run variation.",
        );
        panels.push(residual(record, Axis::time().range(start, end), quantity(measurand)));
    }
    let whole = Figure { panels, ..Figure::new(caption).sized(PAGE_WIDTH_MM, columns) };

    let onset = onset(main);
    let ring_up = (onset - period).max(start);
    let plateau = record.window.unwrap_or(Window::whole(main));
    let middle = 0.5 * (plateau.from + plateau.to);
    let zoom = |from: f64, periods: f64| {
        overlay(Axis::time().range(from, from + periods * period), RECORDED, SIMULATED.dash(Dash::Dashed)).height(44.0)
    };
    let name = measurand.name();
    vec![
        Plate::new(name, whole),
        Plate::new(
            format!("{name}-onset"),
            Figure::new("The first twelve drive periods after the onset.").panel(zoom(ring_up, 13.0)),
        ),
        Plate::new(
            format!("{name}-zoom"),
            Figure::new("Six drive periods in the middle of the analysis window.")
                .panel(zoom((middle - 3.0 * period).max(start), 6.0)),
        ),
    ]
}

/// What is left of the record at the answer, between the edges of its 90 % band.
fn residual(record: &RecordReport, x: Axis, y: Axis) -> Panel {
    let edge = |factor: f64| record.residual.iter().map(|(t, _, deviation)| (*t, factor * deviation)).collect();
    let left = record.residual.iter().map(|(t, left, _)| (*t, *left)).collect();
    let y = Axis { label: "Residual".into(), ..y };
    let band = Stroke::new(Colour::Vermillion).width(0.6);
    Panel::new(x, y)
        .line("record − simulated", left, RECORDED.width(0.5))
        .line("90 % band", edge(QUANTILE), band)
        .line("", edge(-QUANTILE), band)
        .height(32.0)
}

/// 95 % quantile of the standard normal distribution.
const QUANTILE: f64 = 1.645;

/// The stretches that were bridged, over the height of all traces.
fn masked(record: &RecordReport, panel: Panel) -> Panel {
    let traces = [&record.recorded].into_iter().chain(&record.simulated);
    let values = traces.flat_map(|series| series.values.iter().copied());
    let (low, high) = values.fold((0.0_f64, 0.0_f64), |(low, high), value| (low.min(value), high.max(value)));
    let shapes = record.masked.iter().map(|(from, to)| vec![(*from, low), (*to, low), (*to, high), (*from, high)]);
    panel.shapes("masked", shapes, (Colour::Grey, 0.45))
}

/// First crossing of a quarter of the peak, s.
fn onset(series: &Series) -> f64 {
    let level = 0.25 * series.peak();
    series.values.iter().position(|value| value.abs() >= level).map_or(series.start, |index| series.time(index))
}

/// Spectra of record and simulation over the analysis window, each with its sample rate, Hz.
struct Spectra<'a> {
    record: &'a RecordReport,
    recorded: Option<(AmplitudeSpectrum, f64)>,
    simulated: Option<(AmplitudeSpectrum, f64)>,
}

impl<'a> Spectra<'a> {
    fn of(record: &'a RecordReport) -> Self {
        let spectrum = |series: &Series| {
            let window = record.window.unwrap_or(Window::whole(series));
            amplitude_spectrum(series, window).ok().map(|spectrum| (spectrum, series.sample_rate()))
        };
        let simulated = record.simulated.as_ref().and_then(spectrum);
        Self { record, recorded: spectrum(&record.recorded), simulated }
    }

    fn curves(&self) -> Vec<SpectrumCurve<'_>> {
        let recorded = self.recorded.iter().map(|(of, _)| (self.record.record_label.clone(), of, RECORDED));
        let simulated = self.simulated.iter().map(|(of, _)| ("simulated".to_owned(), of, SIMULATED));
        let curves = recorded.chain(simulated);
        curves.map(|(label, spectrum, stroke)| SpectrumCurve { label, spectrum, stroke }).collect()
    }

    fn main(&self) -> Option<&(AmplitudeSpectrum, f64)> {
        self.recorded.as_ref().or(self.simulated.as_ref())
    }

    /// Amplitudes up to four times the drive.
    fn near(&self, report: &CalibrationReport) -> Option<Panel> {
        let (_, rate) = self.main()?;
        let (name, unit) = match report.outcome.quantity {
            Measurand::Velocity => ("Velocity amplitude", "m/s"),
            Measurand::Pressure => ("Pressure amplitude", "Pa"),
        };
        let drive = report.drive_frequency;
        Some(amplitude_panel(&self.curves(), name, unit, drive, (4.3 * drive).min(0.5 * rate)).height(48.0))
    }
}

/// Spectra of both traces over the analysis window, in dB up to the usable band.
pub(super) fn spectra(report: &CalibrationReport, record: &RecordReport) -> Vec<Plate> {
    let spectra = Spectra::of(record);
    let Some((main, rate)) = spectra.main() else { return Vec::new() };
    let drive = report.drive_frequency;
    let far = (0.4 * rate).min(1.25e6).max((4.3 * drive).min(0.5 * rate));
    let index = (drive / main.step_hz).round() as usize;
    let reference = main.amplitudes.get(index).copied().filter(|amplitude| *amplitude > 0.0);
    let Some(reference) = reference else { return Vec::new() };
    let of = if spectra.recorded.is_some() { "record's" } else { "simulated" };
    let title = format!(
        "Amplitude spectra over the analysis window up to the bandwidth, in dB relative to the {of} line at the drive frequency."
    );
    let mut curves = spectra.curves();
    for curve in &mut curves {
        curve.stroke = curve.stroke.width(0.6);
    }
    let far = Figure::new(title).panel(level_panel(&curves, (reference, "drive line"), drive, far).height(48.0));
    vec![Plate::new("spectrum", far)]
}

pub(super) fn axis(estimate: &Estimate) -> Axis {
    let name = capitalised(estimate.name);
    let name = if name.ends_with(estimate.symbol) { name } else { format!("{name} {}", estimate.symbol) };
    Axis::new(name, number::unit(&estimate.unit)).logarithmic()
}

/// Where the runs went, and the density with its accepted set.
pub(super) fn objective(law: &Law<'_>) -> Vec<Plate> {
    let [first, second, ..] = law.parameters.as_slice() else { return Vec::new() };
    let key = law.key();
    let map = law.drawn.map.as_ref().map(|map| (map.shown(first, second), map.accepted_level));
    let at = |run: &RunPoint| Some((first.factor * run.parameters.first()?, second.factor * run.parameters.get(1)?));
    let runs = &law.drawn.runs;
    let mut finished: Vec<(f64, (f64, f64))> = runs.iter().filter_map(|run| Some((run.misfit?, at(run)?))).collect();
    finished.sort_by(|a, b| a.0.total_cmp(&b.0));
    let best: Vec<_> = finished.iter().take(10).map(|(_, at)| *at).collect();
    let others: Vec<_> = finished.iter().skip(10).map(|(_, at)| *at).collect();
    let failed: Vec<_> = runs.iter().filter(|run| run.misfit.is_none()).filter_map(at).collect();
    let mut plates = Vec::new();
    if !finished.is_empty() {
        let mut panel = Panel::new(
            axis(first).range(first.bounds.0, first.bounds.1),
            axis(second).range(second.bounds.0, second.bounds.1),
        )
        .height(55.0)
        .points("runs", others, Colour::Grey, Marker::Dot)
        .points("ten best", best.clone(), Colour::Blue, Marker::Diamond);
        if !failed.is_empty() {
            panel = panel.points("failed", failed, Colour::Orange, Marker::Cross);
        }
        if let Some((map, level)) = &map {
            panel = panel.layer(region("90 % region", map.clone(), *level, Colour::Vermillion));
        }
        let title = format!("The whole search range, {}: every run, and the 90 % region.", law.name());
        plates.push(Plate::new(format!("runs-{key}"), Figure::new(title).panel(panel)));
    }
    if let Some((map, level)) = &map {
        let panel = density([first, second], map, *level).height(55.0);
        let title = format!("Posterior density near the fit, {}.", law.name());
        plates.push(Plate::new(format!("density-{key}"), Figure::new(title).panel(panel)));
    }
    plates.extend(pairs(law));
    if let Some(plate) = history(law, &key) {
        plates.push(plate);
    }
    plates
}

/// Where the density is at least `level`.
fn region(label: &str, map: Map, level: f64, colour: Colour) -> Layer {
    Layer::Contour { label: label.into(), map, level, stroke: Stroke::new(colour).width(1.1) }
}

/// The density over two parameters, its 90 % region and the fit.
fn density([first, second]: [&Estimate; 2], map: &Map, level: f64) -> Panel {
    let label = "Density / maximum (–)".into();
    Panel::new(axis(first), axis(second))
        .layer(Layer::HeatMap { label, map: map.clone(), range: Some((0.0, 1.0)) })
        .layer(region("90 % region", map.clone(), level, Colour::Black))
        .points("fit", vec![(first.value, second.value)], Colour::Vermillion, Marker::Ring)
}

/// Density over every pair of more than two parameters.
fn pairs(law: &Law<'_>) -> Option<Plate> {
    if law.drawn.pairs.is_empty() {
        return None;
    }
    let title =
        format!("Posterior density of every pair of parameters near the fit, summed over the others, {}.", law.name());
    let mut figure = Figure::new(title).sized(PAGE_WIDTH_MM, 2);
    for PairMap { first, second, map } in &law.drawn.pairs {
        let [first, second] = [law.parameters.get(*first)?, law.parameters.get(*second)?];
        let panel = density([first, second], &map.shown(first, second), map.accepted_level);
        figure = figure.panel(panel.height(42.0));
    }
    Some(Plate::new(format!("pairs-{}", law.key()), figure))
}

/// The 90 % regions of all fidelity levels on common axes.
pub(super) fn fidelities(law: &Law<'_>) -> Option<Plate> {
    let [first, second, ..] = law.parameters.as_slice() else { return None };
    let (below, above) = (law.below(), law.drawn.map.as_ref()?);
    let region = |panel: Panel, label: &str, map: &DensityMap, stroke: Stroke| {
        panel.layer(Layer::Contour {
            label: format!("90 % region, {label}"),
            map: map.shown(first, second),
            level: map.accepted_level,
            stroke,
        })
    };
    let upper = law.fit.fidelities.get(below.len())?.model.as_str();
    let at = |parameters: &[Estimate]| match parameters {
        [first, second, ..] => vec![(first.value, second.value)],
        _ => Vec::new(),
    };
    let mut panel = Panel::new(axis(first), axis(second)).height(55.0);
    let looks = [(Colour::Blue, Dash::Dashed, Marker::Diamond), (Colour::Green, Dash::Dotted, Marker::Square)];
    for ((lower, drawn, _), (colour, dash, _)) in below.iter().zip(looks) {
        panel = region(panel, lower, drawn.map.as_ref()?, Stroke::new(colour).width(0.9).dash(dash));
    }
    panel = region(panel, upper, above, Stroke::new(Colour::Vermillion).width(1.1));
    for ((lower, _, parameters), (colour, _, marker)) in below.iter().zip(looks) {
        panel = panel.points(format!("fit, {lower}"), at(parameters), colour, marker);
    }
    panel = panel.points(format!("fit, {upper}"), at(&law.parameters), Colour::Vermillion, Marker::Ring);
    let key = law.key();
    let title = format!("90 % regions of the models, {}.", law.name());
    Some(Plate::new(format!("rungs-{key}"), Figure::new(title).panel(panel)))
}

/// Misfit of every run in the order made, and the least so far.
fn history(law: &Law<'_>, key: &str) -> Option<Plate> {
    let runs: Vec<(f64, f64)> = law
        .drawn
        .runs
        .iter()
        .enumerate()
        .filter_map(|(index, run)| Some((index as f64 + 1.0, run.misfit.filter(|misfit| *misfit > 0.0)?)))
        .collect();
    if runs.is_empty() {
        return None;
    }
    let best = least_so_far(&runs);
    let axis = Axis::new("Misfit per feature", "1").logarithmic();
    let panel = Panel::new(Axis::new("Run", "count"), axis)
        .height(36.0)
        .points("run", runs, Colour::Grey, Marker::Dot)
        .line("best so far", best, Stroke::new(Colour::Blue).width(1.2));
    let title = format!("Search history, {}: misfit of each run, and the least so far.", law.name());
    Some(Plate::new(format!("history-{key}"), Figure::new(title).sized(PAGE_WIDTH_MM, 1).panel(panel)))
}

/// The least of a series up to each point, as a staircase.
fn least_so_far(series: &[(f64, f64)]) -> Vec<(f64, f64)> {
    let mut stairs: Vec<(f64, f64)> = Vec::new();
    for &(at, value) in series {
        match stairs.last() {
            Some(&(_, least)) if value < least => stairs.extend([(at, least), (at, value)]),
            Some(_) => {}
            None => stairs.push((at, value)),
        }
    }
    let end = series.last().zip(stairs.last()).map(|((at, _), (_, least))| (*at, *least));
    stairs.extend(end);
    stairs
}

#[cfg(test)]
mod tests {
    use super::least_so_far;

    #[test]
    fn the_least_so_far_never_rises_and_ends_at_the_least_of_all() {
        let series = [(1.0, 0.9), (2.0, 1.7), (3.0, 0.5), (4.0, 7.0)];
        assert_eq!(least_so_far(&series), [(1.0, 0.9), (3.0, 0.9), (3.0, 0.5), (4.0, 0.5)]);
        assert_eq!(least_so_far(&[]), []);
    }
}
