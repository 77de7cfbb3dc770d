//! Panels of amplitude spectra, several curves in one, fractions of the drive marked.

use crate::{
    figure::{Axis, Colour, Panel, Stroke},
    sweep::shown_unit,
};
use granchain_signal::feature::{AmplitudeSpectrum, Ratio};

/// The lines named above a spectrum up to four times the drive.
pub(super) const MARKED_LINES: [Ratio; 9] = [
    Ratio::new(1, 3),
    Ratio::new(1, 2),
    Ratio::new(2, 3),
    Ratio::ONE,
    Ratio::new(4, 3),
    Ratio::new(5, 3),
    Ratio::new(2, 1),
    Ratio::new(3, 1),
    Ratio::new(4, 1),
];

/// Decades shown below the largest amplitude.
const DECADES: i32 = 4;

/// A spectrum and how it is drawn.
pub(crate) struct SpectrumCurve<'a> {
    /// Name in the legend; empty keeps it out.
    pub label: String,
    pub spectrum: &'a AmplitudeSpectrum,
    pub stroke: Stroke,
}

/// Strokes for recorded and simulated curves wherever both appear: distinguished by colour, grey value, width and dash.
pub(super) const RECORDED: Stroke = Stroke::new(Colour::Black).width(1.1);
/// See [`RECORDED`].
pub(super) const SIMULATED: Stroke = Stroke::new(Colour::Vermillion).width(0.9);

/// Amplitudes (logarithmic, unit of the series) against frequency up to `highest` Hz, with fractions of the drive marked.
///
/// What lies more than four decades below the largest amplitude is drawn at the lower edge.
pub(crate) fn amplitude_panel(
    curves: &[SpectrumCurve<'_>],
    quantity: &str,
    unit: &str,
    drive: f64,
    highest: f64,
) -> Panel {
    let top = largest(curves, highest);
    let (factor, shown) = if unit == "Pa" { (1e-3, "kPa") } else { shown_unit(unit) };
    let floor = top * 10f64.powi(-DECADES);
    let amplitudes = Axis::new(quantity, shown).times(factor).logarithmic().range(floor, 2.0 * top);
    let mut panel = Panel::new(Axis::frequency(highest), amplitudes);
    for ratio in MARKED_LINES.iter().filter(|ratio| ratio.value() * drive <= highest) {
        panel = panel.mark_x(ratio.value() * drive, ratio.to_string());
    }
    for curve in curves {
        panel = panel.line(curve.label.clone(), points(curve.spectrum, highest, |a| a.max(floor)), curve.stroke);
    }
    panel
}

/// Levels in dB re `reference` (unit of the series) against frequency up to `highest` Hz, whole multiples of the drive marked.
pub(super) fn level_panel(
    curves: &[SpectrumCurve<'_>],
    (reference, name): (f64, &str),
    drive: f64,
    highest: f64,
) -> Panel {
    const RANGE: f64 = 80.0;
    let level = |a: f64| 20.0 * (a / reference).max(1e-12).log10();
    let top = level(largest(curves, highest)).max(0.0);
    let axis = Axis::new(format!("Level re {name}"), "dB").range(top - RANGE, top + 6.0);
    let mut panel = Panel::new(Axis::frequency(highest), axis);
    for multiple in [1_u32, 2, 3, 4, 6, 8, 10, 12, 14, 16] {
        let frequency = f64::from(multiple) * drive;
        if frequency <= highest {
            panel = panel.mark_x(frequency, multiple.to_string());
        }
    }
    for curve in curves {
        let shown = points(curve.spectrum, highest, |a| level(a).max(top - RANGE));
        panel = panel.line(curve.label.clone(), shown, curve.stroke);
    }
    panel
}

fn largest(curves: &[SpectrumCurve<'_>], highest: f64) -> f64 {
    let largest = curves
        .iter()
        .flat_map(|curve| points(curve.spectrum, highest, |a| a))
        .map(|(_, amplitude)| amplitude)
        .fold(0.0, f64::max);
    if largest > 0.0 { largest } else { 1.0 }
}

fn points(spectrum: &AmplitudeSpectrum, highest: f64, shown: impl Fn(f64) -> f64) -> Vec<(f64, f64)> {
    spectrum
        .amplitudes
        .iter()
        .enumerate()
        .skip(1)
        .map(|(index, amplitude)| (spectrum.frequency(index), shown(*amplitude)))
        .take_while(|(frequency, _)| *frequency <= highest)
        .collect()
}
