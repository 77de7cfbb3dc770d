//! Pictures of one motion: all beads over time, its lines over time, its path in the phase plane.

use super::{
    figure::{Axis, Colour, Dash, Figure, Layer, Map, Marker, PAGE_WIDTH_MM, Panel, Stroke, trace},
    number::engineering,
};
use granchain_calibration::predict::steady::stroboscope;
use granchain_model::response::Response;
use granchain_signal::{
    Series,
    feature::{Window, line_amplitude},
};

/// Drive periods of a waterfall.
const PERIODS_SHOWN: f64 = 24.0;
/// Most beads drawn one above the other; of longer chains every second, third … is drawn.
pub(crate) const ROWS: usize = 24;

/// The velocities of the beads one above the other from `start` to `end` (s), and the velocity (m/s) of one row; none where nothing moves.
pub(crate) fn rows(response: &Response, (start, end): (f64, f64)) -> Option<(Panel, f64)> {
    let every = response.bead_velocity.len().div_ceil(ROWS).max(1);
    let all = response.bead_velocity.iter().enumerate().step_by(every);
    let beads: Vec<(usize, Series)> = all.map(|(bead, velocity)| (bead, velocity.window(start, end))).collect();
    let largest = beads.iter().map(|(_, velocity)| velocity.peak()).fold(0.0, f64::max);
    if largest <= 0.0 || !(end > start) {
        return None;
    }
    // Half of the largest velocity is one row.
    let row = 0.5 * largest;
    let names = (0..beads.len()).map(|index| (index as f64, (beads[index].0 + 1).to_string())).collect();
    let axis = Axis::new("Bead, counted from the piston", "1").named_ticks(names);
    let panel = Panel::new(Axis::time().range(start, end), axis).height(22.0 + 7.0 * beads.len() as f64);
    let panel = beads.iter().enumerate().fold(panel, |panel, (index, (_, velocity))| {
        let shifted = velocity.map(|value| value / row + index as f64);
        let colour = if index % 2 == 0 { Colour::Blue } else { Colour::Vermillion };
        panel.line("", trace(&shifted), Stroke::new(colour).width(0.8))
    });
    Some((panel, row))
}

/// Velocity of every bead over the last periods of `window`, in which the drive is on; none where nothing moves.
#[must_use]
pub fn waterfall(response: &Response, window: Window, drive_frequency: f64) -> Option<Figure> {
    let period = 1.0 / drive_frequency;
    let start = window.from.max(window.to - PERIODS_SHOWN * period);
    let (mut panel, row) = rows(response, (start, window.to))?;
    let first = (start / period).ceil() as u32;
    for mark in (first..).map(|number| f64::from(number) * period).take_while(|at| *at <= window.to) {
        panel = panel.mark_x(mark, "");
    }
    // The bar stands behind the last sample.
    let (place, room) = (window.to + 0.3 * period, window.to + 3.0 * period);
    // The largest of 1, 2 and 5 times a power of ten within a row.
    let decade = 10f64.powf(row.log10().floor());
    let speed = [5.0, 2.0].map(|digit| digit * decade).into_iter().find(|round| *round <= row).unwrap_or(decade);
    let stroke = Stroke::new(Colour::Black).width(1.2);
    panel.x = panel.x.range(start, room);
    let name = Layer::Names(vec![(room, 0.0, engineering(speed, "m/s", 2))]);
    let panel = panel.line("", vec![(place, 0.0), (place, speed / row)], stroke).layer(name);
    let title = format!(
        "Velocity of every bead, one row each, over the last {:.0} periods of the drive; dashed lines are one drive period ({}) apart",
        (window.to - start) / period,
        engineering(period, "s", 3)
    );
    Some(Figure::new(title).sized(PAGE_WIDTH_MM, 1).panel(panel))
}

/// Periods of the drive in the window of a short-time spectrum, and by how many it moves on.
const SHORT: f64 = 8.0;
const HOP: f64 = 0.25 * SHORT;
/// Highest frequency of a spectrogram over the drive's, and rows a drive frequency: a third of it lies on a row.
const HIGHEST: usize = 3;
const ROWS_A_DRIVE: usize = 24;
/// Most columns: of more, each moves on by more.
const COLUMNS: f64 = 90.0;
/// Levels drawn below the largest, dB.
const LEVELS: f64 = 60.0;
/// Lines named on the axis, over the drive frequency.
const NAMED: [(f64, &str); 7] = [
    (1.0 / 3.0, "1/3"),
    (2.0 / 3.0, "2/3"),
    (1.0, "1"),
    (4.0 / 3.0, "4/3"),
    (5.0 / 3.0, "5/3"),
    (2.0, "2"),
    (3.0, "3"),
];

/// Short-time amplitude spectra of a trace (Hann window of eight drive periods), dB below the largest of all; none where it is too short or nothing moves.
#[must_use]
pub fn spectrogram(series: &Series, drive_frequency: f64) -> Option<Figure> {
    let period = 1.0 / drive_frequency;
    let span = series.end() - series.start - SHORT * period;
    let hop = (HOP * period).max(span / COLUMNS);
    let columns = (span / hop).floor();
    if !(columns >= 1.0) || !(2.0 * HIGHEST as f64 * drive_frequency < series.sample_rate()) {
        return None;
    }
    let starts: Vec<f64> = (0..=columns as usize).map(|column| series.start + column as f64 * hop).collect();
    let y: Vec<f64> = (1..=HIGHEST * ROWS_A_DRIVE).map(|row| row as f64 / ROWS_A_DRIVE as f64).collect();
    let amplitudes: Vec<f64> = y
        .iter()
        .flat_map(|ratio| starts.iter().map(move |from| (ratio, from)))
        .map(|(ratio, from)| line_amplitude(series, Window::new(*from, from + SHORT * period), ratio * drive_frequency))
        .collect();
    let largest = amplitudes.iter().copied().fold(0.0, f64::max);
    if largest <= 0.0 {
        return None;
    }
    let values = amplitudes.iter().map(|a| (20.0 * (a / largest).log10()).max(-LEVELS)).collect();
    let x = starts.iter().map(|from| from + 0.5 * SHORT * period).collect();
    let names = NAMED.map(|(ratio, name)| (ratio, name.to_owned())).to_vec();
    let axis = Axis::new("Frequency over that of the drive", "1").range(0.0, HIGHEST as f64).named_ticks(names);
    let map = Map { x, y, values };
    let map = Layer::HeatMap { label: "Level re largest (dB)".into(), map, range: Some((-LEVELS, 0.0)) };
    let stroke = Stroke::new(Colour::White).dash(Dash::Dotted).width(0.7);
    let panel = Panel::new(Axis::time(), axis).height(50.0).layer(map);
    let panel = NAMED[..3].iter().fold(panel, |panel, (ratio, _)| panel.mark_y(*ratio, "", stroke));
    let title = "Amplitude spectrum of the velocity of the last bead over time; dotted: 1/3, 2/3 and 1 of the drive";
    Some(Figure::new(title).sized(PAGE_WIDTH_MM, 1).panel(panel))
}

/// Drive periods of a path in the phase plane.
const PATH: f64 = 60.0;

/// Velocity of the last bead against its displacement over the last half of `window`, and once a drive period as a point; none where nothing moves.
#[must_use]
pub fn phase(response: &Response, window: Window, drive_frequency: f64) -> Option<Figure> {
    let period = 1.0 / drive_frequency;
    let late = Window::new((0.5 * (window.from + window.to)).max(window.to - PATH * period), window.to);
    let (u, v) = (response.bead_displacement.last()?, response.bead_velocity.last()?);
    if v.peak() <= 0.0 || v.len() < 4 {
        return None;
    }
    let path = late.indices(v).map(|index| (u.values[index], v.values[index])).collect();
    // Whole periods of the drive.
    let whole = Window::new((late.from / period).ceil() * period, late.to);
    let section = stroboscope(u, whole, period).into_iter().zip(stroboscope(v, whole, period)).collect();
    let panel = Panel::new(Axis::new("Displacement", "µm").times(1e6), Axis::new("Velocity", "mm/s").times(1e3))
        .height(65.0)
        .layer(Layer::Strokes {
            label: "path".into(),
            strokes: vec![path],
            stroke: Stroke::new(Colour::Blue).width(0.35),
        })
        .points("once a drive period", section, Colour::Vermillion, Marker::Dot);
    let title = format!(
        "Phase plane of the last bead over {:.0} drive periods, after the transient",
        (late.to - late.from) / period
    );
    Some(Figure::new(title).panel(panel))
}
