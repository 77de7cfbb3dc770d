//! The figures of what was heard in the water: motion of the disc, pressure, its spectrum.

use super::{
    figure::{Axis, Colour, Dash, Figure, Marker, PAGE_WIDTH_MM, Panel, Stroke, trace},
    number::engineering,
};
use granchain_model::response::Response;
use granchain_signal::feature::{FeatureError, PressureFeatures, amplitude_spectrum};

/// Highest frequency drawn, Hz.
const HIGHEST: f64 = 1.2e6;
/// Lowest level drawn, dB re the fundamental.
const LOWEST_DB: f64 = -60.0;
/// Curves of different field points, first to last; further ones repeat them.
const COLOURS: [Colour; 4] = [Colour::Blue, Colour::Vermillion, Colour::Green, Colour::Purple];

/// File name (without ending) and figure, for each figure of a run with water; `heard` is what was measured at each field point, in their order.
///
/// # Errors
/// When the spectrum of a pressure cannot be taken.
pub fn figures<'a>(
    response: &Response,
    heard: impl Iterator<Item = &'a PressureFeatures>,
) -> Result<Vec<(&'static str, Figure)>, FeatureError> {
    let heard: Vec<&PressureFeatures> = heard.collect();
    let Some(disc) = response.disc.as_ref().filter(|disc| !disc.pressure.is_empty() && !heard.is_empty()) else {
        return Ok(Vec::new());
    };
    let time = || Axis::new("Time", "µs").times(1e6);
    let velocity = |title: &str, series, colour| {
        Panel::new(time(), Axis::new("Velocity", "mm/s").times(1e3)).titled(title).height(32.0).line(
            "",
            trace(series),
            Stroke::new(colour).width(0.8),
        )
    };
    let name = |point: usize| if disc.pressure.len() > 1 { format!("point {}", point + 1) } else { String::new() };
    let mut pressure =
        Panel::new(time(), Axis::new("Pressure", "kPa").times(1e-3)).titled("(c) pressure in the water").height(42.0);
    for (point, series) in disc.pressure.iter().enumerate() {
        pressure = pressure.line(name(point), trace(series), Stroke::new(colour(point)).width(0.8));
    }
    let figure = Figure::new("Velocity of the last bead and of the disc, and pressure in the water")
        .sized(PAGE_WIDTH_MM, 1)
        .panel(velocity("(a) last bead", &response.pole_velocity, Colour::Vermillion))
        .panel(velocity("(b) middle of the disc's back", &disc.velocity, Colour::Black))
        .panel(pressure);
    Ok(vec![("pressure", figure), ("pressure_spectrum", spectrum(response, &heard)?)])
}

fn colour(point: usize) -> Colour {
    COLOURS[point % COLOURS.len()]
}

/// Levels re the fundamental up to 1.2 MHz, harmonics marked, with the level that the source paper states.
fn spectrum(response: &Response, heard: &[&PressureFeatures]) -> Result<Figure, FeatureError> {
    let pressures = response.disc.iter().flat_map(|disc| &disc.pressure).filter(|pressure| pressure.peak() > 0.0);
    let x = Axis::new("Frequency", "kHz").times(1e-3).range(0.0, 1.02 * HIGHEST);
    let mut panel = Panel::new(x, Axis::new("Level re the fundamental", "dB").range(LOWEST_DB, 12.0)).height(60.0);
    let name = |point: usize, what: &str| {
        if heard.len() > 1 { format!("point {}, {what}", point + 1) } else { what.to_owned() }
    };
    for (point, (pressure, features)) in pressures.zip(heard).enumerate() {
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
    let Some(first) = heard.first() else { return Ok(Figure::new("").panel(panel)) };
    let printed = first.content_level_db;
    panel = panel
        .mark_y(printed, format!("−{} dB", printed.abs()), Stroke::new(Colour::Black).dash(Dash::Dotted))
        .mark_x(first.probe_hz, engineering(first.probe_hz, "Hz", 2));
    let title = "Spectrum of the pressure, Hann window over the drive, levels re the drive's own line";
    Ok(Figure::new(title).sized(PAGE_WIDTH_MM, 1).panel(panel))
}
