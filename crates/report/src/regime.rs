//! Where a driven chain moves how: a map over two parameters, a bifurcation diagram over one.

use super::{
    figure::{Axis, Colour, Figure, Layer, Map, Marker, PAGE_WIDTH_MM, Panel, Stroke, extent},
    sweep::{capitalised, shown_unit},
};
use granchain_calibration::predict::steady::Regime;
use granchain_signal::median;

/// A varied parameter.
#[derive(Debug, Clone, PartialEq)]
pub struct Varied {
    /// For people, such as `amplitude scale α`.
    pub name: String,
    /// SI unit; `1` for a pure number.
    pub unit: String,
    /// Ascending, SI.
    pub values: Vec<f64>,
}

impl Varied {
    fn axis(&self) -> Axis {
        let (factor, unit) = shown_unit(&self.unit);
        Axis::new(capitalised(&self.name), unit).times(factor)
    }

    /// Edges half-way between the values.
    fn edges(&self) -> Vec<f64> {
        let values = &self.values;
        let [first, last] = [values[1] - values[0], values[values.len() - 1] - values[values.len() - 2]];
        let between = values.windows(2).map(|pair| 0.5 * (pair[0] + pair[1]));
        std::iter::once(values[0] - 0.5 * first).chain(between).chain([values[values.len() - 1] + 0.5 * last]).collect()
    }
}

/// What a calibration found of both parameters of a map.
#[derive(Debug, Clone, PartialEq)]
pub struct Fit {
    pub value: (f64, f64),
    /// Outline of each part of the 90 % region.
    pub regions: Vec<Vec<(f64, f64)>>,
}

/// Names of the regimes that differ in colour, each with its tint.
const CLASSES: [(&str, (Colour, f64)); 6] = [
    ("period 1", (Colour::SkyBlue, 0.3)),
    ("period 2", (Colour::SkyBlue, 1.0)),
    ("period 3", (Colour::Blue, 1.0)),
    ("longer period", (Colour::Green, 0.9)),
    ("quasi-periodic", (Colour::Purple, 0.85)),
    ("chaotic", (Colour::Orange, 0.8)),
];

fn class(regime: Regime) -> usize {
    match regime {
        Regime::Period(periods) => periods.clamp(1, 4) as usize - 1,
        Regime::QuasiPeriodic => 4,
        Regime::Chaotic => 5,
    }
}

/// Amplitude of the line at f0/3 over that of the drive line that a map outlines.
const THIRD: f64 = 0.1;

/// The regime over two parameters, row by row from the lowest y, each with its line at f0/3 over the drive's; white where a run failed.
#[must_use]
pub fn map(x: &Varied, y: &Varied, runs: &[Option<(Regime, Option<f64>)>], fit: Option<&Fit>) -> Figure {
    let (left, below) = (x.edges(), y.edges());
    let columns = x.values.len();
    let mut shapes: [Vec<Vec<(f64, f64)>>; CLASSES.len()] = Default::default();
    for (row, cells) in runs.chunks(columns).enumerate() {
        let mut first = 0;
        for cells in cells.chunk_by(|a, b| a.map(|a| class(a.0)) == b.map(|b| class(b.0))) {
            let (from, to) = (left[first], left[first + cells.len()]);
            let corners = vec![(from, below[row]), (to, below[row]), (to, below[row + 1]), (from, below[row + 1])];
            first += cells.len();
            if let Some(Some((regime, _))) = cells.first() {
                shapes[class(*regime)].push(corners);
            }
        }
    }
    let axes = [(x, &left), (y, &below)].map(|(varied, edges)| varied.axis().range(edges[0], edges[edges.len() - 1]));
    let [across, up] = axes;
    let mut panel = Panel::new(across, up).height(85.0);
    for (shapes, (name, fill)) in shapes.into_iter().zip(CLASSES).filter(|(shapes, _)| !shapes.is_empty()) {
        panel = panel.shapes(name, shapes, fill);
    }
    // The median of a run and those around it: in chaos the line scatters.
    let third = |i: usize, j: usize| {
        let around = (j.max(1) - 1..(j + 2).min(y.values.len()))
            .flat_map(|j| (i.max(1) - 1..(i + 2).min(columns)).map(move |i| (i, j)));
        median(around.map(|(i, j)| runs[j * columns + i].and_then(|run| run.1).unwrap_or(0.0)))
    };
    let thirds = (0..runs.len()).map(|index| third(index % columns, index / columns)).collect();
    let map = Map { x: x.values.clone(), y: y.values.clone(), values: thirds };
    let label = format!("line f0/3 at {:.0} % of the drive's", 100.0 * THIRD);
    panel = panel.layer(Layer::Contour { label, map, level: THIRD, stroke: Stroke::new(Colour::Black).width(0.7) });
    if let Some(fit) = fit {
        let stroke = Stroke::new(Colour::Vermillion).width(1.2);
        panel = panel
            .layer(Layer::Strokes { label: "90 % region of the fit".into(), strokes: fit.regions.clone(), stroke })
            .points("fit", vec![fit.value], Colour::Vermillion, Marker::Ring);
    }
    Figure::new(format!("Regime of the last bead over {} and {}", x.name, y.name)).sized(PAGE_WIDTH_MM, 1).panel(panel)
}

/// Heights that differ in a bifurcation diagram.
const LEVELS: f64 = 400.0;

/// Velocities (m/s) of the last bead once a drive period, over one parameter; each run with its regime, in the order of the values.
#[must_use]
pub fn bifurcation(x: &Varied, runs: &[(f64, Regime, Vec<f64>)]) -> Figure {
    // A slow transient may reach into the first half.
    let late = |section: &[f64]| section[section.len() / 2..].to_vec();
    let (low, high) = extent(runs.iter().flat_map(|(.., section)| late(section)));
    let edges = x.edges();
    let half = 0.4 * x.values.windows(2).map(|pair| pair[1] - pair[0]).fold(f64::INFINITY, f64::min);
    let mut strokes: [Vec<Vec<(f64, f64)>>; CLASSES.len()] = Default::default();
    for (at, regime, section) in runs {
        let step = ((high - low) / LEVELS).max(f64::MIN_POSITIVE);
        let mut levels: Vec<i64> = late(section).iter().map(|value| ((value - low) / step).round() as i64).collect();
        levels.sort_unstable();
        levels.dedup();
        let mark = |level: i64| low + level as f64 * step;
        strokes[class(*regime)]
            .extend(levels.into_iter().map(|level| vec![(at - half, mark(level)), (at + half, mark(level))]));
    }
    let mut panel = Panel::new(
        x.axis().range(edges[0], edges[edges.len() - 1]),
        Axis::new("Velocity once a drive period", "mm/s").times(1e3),
    )
    .height(75.0);
    for (strokes, (name, (colour, _))) in strokes.into_iter().zip(CLASSES).filter(|(strokes, _)| !strokes.is_empty()) {
        let (label, stroke) = (name.into(), Stroke::new(colour).width(0.9));
        panel = panel.layer(Layer::Strokes { label, strokes, stroke });
    }
    let title = format!(
        "Velocity of the last bead once a drive period, as the piston passes its middle towards the chain, over {}",
        x.name
    );
    Figure::new(title).sized(PAGE_WIDTH_MM, 1).panel(panel)
}
