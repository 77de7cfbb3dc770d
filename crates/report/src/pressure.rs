//! The figures of a pressure field: maps at instants, maps at frequencies, beam patterns.

use super::{
    figure::{Axis, Colour, Dash, Figure, Layer, Map, PAGE_WIDTH_MM, Panel, Stroke},
    number::engineering,
    sweep::letter,
};
use granchain_model::water::field::FieldGrid;

/// Lowest level shown of an amplitude, dB re the largest.
const LOWEST_DB: f64 = -40.0;

/// The disc in front of the field, and where the field is known.
#[derive(Debug, Clone, PartialEq)]
pub struct Scenery {
    /// Radius of the disc, m.
    pub radius: f64,
    pub thickness: f64,
    /// Points of the maps, from the axis out and from the disc's back on.
    pub grid: FieldGrid,
    /// What the field was computed by, such as `Rayleigh integral`.
    pub method: &'static str,
}

/// A beam pattern at one frequency.
#[derive(Debug, Clone, PartialEq)]
pub struct Beam {
    pub frequency: f64,
    /// |P| at each angle, of any unit, ≥ 0.
    pub amplitudes: Vec<f64>,
}

impl Scenery {
    /// A panel with the disc and a map, mirrored about the axis.
    fn panel(&self, title: String, label: &str, values: &[f64], range: (f64, f64)) -> Panel {
        let FieldGrid { radius, distance } = &self.grid;
        let columns = radius.len();
        let skip = usize::from(radius.first() == Some(&0.0));
        let x: Vec<f64> = radius.iter().skip(skip).rev().map(|r| -r).chain(radius.iter().copied()).collect();
        let mirrored = |row: &[f64]| -> Vec<f64> { row.iter().skip(skip).rev().chain(row.iter()).copied().collect() };
        let map = Map { x, y: distance.clone(), values: values.chunks_exact(columns).flat_map(mirrored).collect() };
        let reach = radius.last().copied().unwrap_or(0.0);
        let depth = distance.last().copied().unwrap_or(0.0);
        let disc = vec![
            (-self.radius, -self.thickness),
            (self.radius, -self.thickness),
            (self.radius, 0.0),
            (-self.radius, 0.0),
        ];

        let axis = |label: &str, from: f64, to: f64| Axis::new(label, "mm").times(1e3).range(from, to);
        Panel::new(axis("r", -reach, reach), axis("z into the water", -1.4 * self.thickness, depth))
            .titled(title)
            .equal_scales()
            .layer(Layer::HeatMap { label: label.into(), map, range: Some(range) })
            .shapes("", [disc], (Colour::Grey, 0.6))
            .line("", vec![(-reach, 0.0), (reach, 0.0)], Stroke::new(Colour::Black).width(0.5))
    }

    /// Pressure (Pa) at instants (s) over the grid, one map each, all on one signed scale that ends at the largest size.
    #[must_use]
    pub fn instants(&self, maps: &[(f64, Vec<f64>)]) -> Figure {
        let sizes = maps.iter().flat_map(|(_, values)| values).map(|value| value.abs());
        let largest = sizes.fold(0.0, f64::max).max(f64::MIN_POSITIVE);
        let (factor, unit) = scaled(largest);
        let title = format!(
            "Pressure in the water at {}, by {}; grey: the disc; one scale for all maps, white at zero",
            list(maps.iter().map(|(time, _)| engineering(*time, "s", 4))),
            self.method
        );
        let figure = Figure::new(title).sized(PAGE_WIDTH_MM, 2.min(maps.len().max(1)));
        maps.iter().enumerate().fold(figure, |figure, (index, (time, values))| {
            let shown: Vec<f64> = values.iter().map(|value| factor * value).collect();
            let range = (-factor * largest, factor * largest);
            let title = format!("({}) {}", letter(index), engineering(*time, "s", 4));
            figure.panel(self.panel(title, &format!("Pressure ({unit})"), &shown, range))
        })
    }

    /// Amplitude (Pa) at frequencies (Hz) over the grid, one map each, in dB re the largest of its own map.
    #[must_use]
    pub fn frequencies(&self, maps: &[(f64, Vec<f64>)]) -> Figure {
        let title = format!(
            "Amplitude of the pressure at {}, dB re the largest of each map, by {}; grey: the disc",
            list(maps.iter().map(|(frequency, _)| engineering(*frequency, "Hz", 3))),
            self.method
        );
        let figure = Figure::new(title).sized(PAGE_WIDTH_MM, 2.min(maps.len().max(1)));
        maps.iter().enumerate().fold(figure, |figure, (index, (frequency, values))| {
            let largest = values.iter().copied().fold(f64::MIN_POSITIVE, f64::max);
            let title = format!(
                "({}) {}, largest {}",
                letter(index),
                engineering(*frequency, "Hz", 3),
                engineering(largest, "Pa", 3)
            );
            figure.panel(self.panel(title, "Amplitude (dB)", &levels(values, largest), (LOWEST_DB, 0.0)))
        })
    }
}

/// Levels over the angle (rad, ascending from 0), mirrored, dB re the axis.
#[must_use]
pub fn beams(angles: &[f64], beams: &[Beam], distance: Option<f64>) -> Figure {
    const STROKES: [Stroke; 4] = [
        Stroke::new(Colour::Black),
        Stroke::new(Colour::Vermillion).dash(Dash::Dashed),
        Stroke::new(Colour::Blue).dash(Dash::DashDotted),
        Stroke::new(Colour::Green).dash(Dash::Dotted),
    ];
    let place = distance.map_or("far away".into(), |distance| format!("at {}", engineering(distance, "m", 3)));
    let ticks = (-3..=3).map(|third| (f64::from(30 * third).to_radians(), (30 * third).to_string().replace('-', "−")));
    let x = Axis::new("Angle from the axis", "°").named_ticks(ticks.collect());
    let end = angles.last().copied().unwrap_or(0.0);
    let levels = || {
        let own = beams.iter().flat_map(|beam| {
            let axis = beam.amplitudes.first().copied().unwrap_or(0.0);
            beam.amplitudes.iter().map(move |amplitude| 20.0 * (amplitude / axis).log10())
        });
        own.filter(|level| level.is_finite())
    };
    let lowest = levels().fold(-10.0, f64::min).max(LOWEST_DB);
    let y = Axis::new("Pressure amplitude re the axis", "dB").range(lowest - 2.0, 2.0 + levels().fold(0.0, f64::max));
    let panel = beams.iter().zip(STROKES.into_iter().cycle()).fold(
        Panel::new(x.range(-end, end), y).height(55.0).mark_y(-6.0, "", Stroke::new(Colour::Grey).dash(Dash::Dotted)),
        |panel, (beam, stroke)| {
            let axis = beam.amplitudes.first().copied().unwrap_or(0.0).max(f64::MIN_POSITIVE);
            // Nothing below the frame needs a place.
            let level = |amplitude: f64| (20.0 * (amplitude / axis).max(1e-9).log10()).max(2.0 * LOWEST_DB);
            let half: Vec<(f64, f64)> = angles.iter().copied().zip(beam.amplitudes.iter().map(|&a| level(a))).collect();
            let mirrored = half.iter().skip(1).rev().map(|&(angle, level)| (-angle, level));
            panel.line(engineering(beam.frequency, "Hz", 3), mirrored.chain(half.iter().copied()).collect(), stroke)
        },
    );
    Figure::new(format!("Beam pattern {place}, dB re the axis; dotted: −6 dB")).panel(panel)
}

/// Factor and unit in which a largest pressure reads well.
fn scaled(largest: f64) -> (f64, &'static str) {
    if largest >= 1e6 {
        (1e-6, "MPa")
    } else if largest >= 1e3 {
        (1e-3, "kPa")
    } else {
        (1.0, "Pa")
    }
}

fn levels(values: &[f64], largest: f64) -> Vec<f64> {
    values.iter().map(|value| (20.0 * (value / largest).max(1e-9).log10()).max(LOWEST_DB)).collect()
}

fn list(names: impl Iterator<Item = String>) -> String {
    names.collect::<Vec<_>>().join(", ")
}
