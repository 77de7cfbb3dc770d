//! The figures of one run: what the piston did, what the pole did, and its spectrum.

use super::figure::{Axis, Colour, Figure, PAGE_WIDTH_MM, Panel, Stroke, trace};
use crate::{
    feature::{FeatureError, Features, Ratio, amplitude_spectrum},
    response::Response,
};

/// Highest frequency drawn, in drive frequencies.
const HIGHEST_RATIO: f64 = 8.0;
/// Lowest level drawn, re the drive line: −80 dB.
const LOWEST_LEVEL: f64 = 1e-4;

/// File name (without ending) and figure, for each figure of a run.
///
/// # Errors
/// When the spectrum of the pole's velocity cannot be taken.
pub fn figures(response: &Response, features: &Features) -> Result<Vec<(&'static str, Figure)>, FeatureError> {
    Ok(vec![("response", response_figure(response)), ("spectrum", spectrum_figure(response, features)?)])
}

fn response_figure(response: &Response) -> Figure {
    let time = || Axis::new("Time", "µs").times(1e6);
    let piston = Panel::new(time(), Axis::new("Displacement", "µm").times(1e6)).titled("(a) piston").height(30.0).line(
        "",
        trace(&response.piston_displacement),
        Stroke::new(Colour::Blue),
    );
    let pole = Panel::new(time(), Axis::new("Velocity", "mm/s").times(1e3))
        .titled("(b) pole of the last bead")
        .height(45.0)
        .line("", trace(&response.pole_velocity), Stroke::new(Colour::Vermillion));
    Figure::new("Displacement of the piston and velocity of the last bead's pole")
        .sized(PAGE_WIDTH_MM, 1)
        .panel(piston)
        .panel(pole)
}

fn spectrum_figure(response: &Response, features: &Features) -> Result<Figure, FeatureError> {
    let spectrum = amplitude_spectrum(&response.pole_velocity, features.window)?;
    let drive = features.line(Ratio::ONE).map_or(0.0, |line| line.amplitude);
    let largest = spectrum.amplitudes.iter().copied().fold(drive, f64::max);
    let highest = HIGHEST_RATIO * features.drive_frequency_hz;
    let points = spectrum
        .amplitudes
        .iter()
        .enumerate()
        .map(|(index, amplitude)| (spectrum.frequency(index), amplitude.max(0.1 * LOWEST_LEVEL * largest)))
        .filter(|(frequency, _)| *frequency <= highest)
        .collect();
    let x = Axis::new("Frequency", "kHz").times(1e-3).range(0.0, highest);
    let y =
        Axis::new("Velocity amplitude", "mm/s").times(1e3).logarithmic().range(LOWEST_LEVEL * largest, 2.0 * largest);
    let panel = [Ratio::new(1, 3), Ratio::new(1, 2), Ratio::new(2, 3), Ratio::ONE, Ratio::new(2, 1), Ratio::new(3, 1)]
        .into_iter()
        .fold(Panel::new(x, y).height(55.0), |panel, ratio| {
            panel.mark_x(ratio.value() * features.drive_frequency_hz, ratio.to_string())
        })
        .line("", points, Stroke::new(Colour::Vermillion));
    Ok(Figure::new("Spectrum of the velocity of the last bead's pole, Hann window over the drive; fractions of the drive frequency marked")
        .sized(PAGE_WIDTH_MM, 1)
        .panel(panel))
}
