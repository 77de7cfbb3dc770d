//! The figures of a run with water: motion of the disc, pressure, its spectrum.

use super::{
    figure::{Axis, Colour, Dash, Figure, Marker, PAGE_WIDTH_MM, Panel, Stroke, trace},
    number::engineering,
};
use granchain_model::response::Response;
use granchain_signal::feature::{FeatureError, PressureFeatures, amplitude_spectrum};

const HIGHEST: f64 = 1.2e6;
/// Lowest level drawn, dB re the fundamental.
const LOWEST_DB: f64 = -60.0;
/// Curves of different field points, first to last; further ones repeat them.
const COLOURS: [Colour; 4] = [Colour::Blue, Colour::Vermillion, Colour::Green, Colour::Purple];

/// File name (without ending) and figure, for each figure of a run with water; `metrics` is what was measured at each field point, in their order.
pub fn figures<'a>(
    response: &Response,
    metrics: impl Iterator<Item = &'a PressureFeatures>,
) -> Result<Vec<(&'static str, Figure)>, FeatureError> {
    let metrics: Vec<&PressureFeatures> = metrics.collect();
    let Some(disc) = response.disc.as_ref().filter(|disc| !disc.pressure.is_empty() && !metrics.is_empty()) else {
        return Ok(Vec::new());
    };
    let velocity = |title: &str, series, colour| {
        Panel::new(Axis::time(), Axis::new("Velocity", "mm/s").times(1e3)).titled(title).height(32.0).line(
            "",
            trace(series),
            Stroke::new(colour).width(0.8),
        )
    };
    let name = |point: usize| if disc.pressure.len() > 1 { format!("point {}", point + 1) } else { String::new() };
    let mut pressure = Panel::new(Axis::time(), Axis::new("Pressure", "kPa").times(1e-3))
        .titled("(c) pressure in the water")
        .height(42.0);
    for (point, series) in disc.pressure.iter().enumerate() {
        pressure = pressure.line(name(point), trace(series), Stroke::new(colour(point)).width(0.8));
    }
    let figure = Figure::new("Velocity of the last bead and of the disc, and pressure in the water")
        .sized(PAGE_WIDTH_MM, 1)
        .panel(velocity("(a) last bead", &response.pole_velocity, Colour::Vermillion))
        .panel(velocity("(b) middle of the disc's back", &disc.velocity, Colour::Black))
        .panel(pressure);
    Ok(vec![("pressure", figure), ("pressure_spectrum", spectrum(response, &metrics)?)])
}

fn colour(point: usize) -> Colour {
    COLOURS[point % COLOURS.len()]
}

/// Levels re the fundamental up to 1.2 MHz, harmonics marked, with the level that the source paper states.
fn spectrum(response: &Response, metrics: &[&PressureFeatures]) -> Result<Figure, FeatureError> {
    let pressures = response.disc.iter().flat_map(|disc| &disc.pressure).filter(|pressure| pressure.peak() > 0.0);
    let x = Axis::frequency(1.02 * HIGHEST);
    let mut panel = Panel::new(x, Axis::new("Level re the fundamental", "dB").range(LOWEST_DB, 12.0)).height(60.0);
    let name = |point: usize, what: &str| {
        if metrics.len() > 1 { format!("point {}, {what}", point + 1) } else { what.to_owned() }
    };
    for (point, (pressure, features)) in pressures.zip(metrics).enumerate() {
        let spectrum = amplitude_spectrum(pressure, features.window)?;
        let fundamental = features.harmonics.first().map_or(0.0, |first| first.amplitude_pa).max(f64::MIN_POSITIVE);
        let level = |amplitude: f64| (20.0 * (amplitude / fundamental).max(1e-20).log10()).max(LOWEST_DB - 20.0);
        let points = (0..spectrum.amplitudes.len())
            .map(|index| (spectrum.frequency(index), level(spectrum.amplitudes[index])))
            .take_while(|(frequency, _)| *frequency <= HIGHEST)
            .collect();
        let harmonics = features.harmonics.iter().map(|harmonic| (harmonic.frequency_hz, harmonic.level_db));
        let harmonics: Vec<_> = harmonics.filter(|(_, level)| *level >= LOWEST_DB).collect();
        panel = panel.line(name(point, "spectrum"), points, Stroke::new(colour(point)).width(0.8));
        if !harmonics.is_empty() {
            panel = panel.points(name(point, "harmonics"), harmonics, colour(point), Marker::Ring);
        }
    }
    let Some(first) = metrics.first() else { return Ok(Figure::new("").panel(panel)) };
    let printed = first.content_level_db;
    panel = panel
        .mark_y(printed, format!("−{} dB", printed.abs()), Stroke::new(Colour::Black).dash(Dash::Dotted))
        .mark_x(first.probe_hz, engineering(first.probe_hz, "Hz", 2));
    let title = "Spectrum of the pressure, Hann window over the drive, levels re the drive's own line";
    Ok(Figure::new(title).sized(PAGE_WIDTH_MM, 1).panel(panel))
}
