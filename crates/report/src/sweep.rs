//! The page and the figures of a sweep: watched numbers against the swept key.

use serde::{Deserialize, Serialize};

use super::{
    figure::{Axis, Colour, Dash, ErrorPoint, Figure, Layer, Marker, PAGE_WIDTH_MM, Panel, Stroke},
    page::{Block, Files, Page, Plate, ReportError, Table},
};

/// Watched numbers against one swept key, SI.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct SweepReport {
    /// What was swept, for people, such as `amplitude scale α`.
    pub name: String,
    /// Its unit; `1` for a pure number.
    pub unit: String,
    /// The curves; those of one group share a panel.
    pub curves: Vec<SweepCurve>,
}

/// One watched number along the sweep, SI.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct SweepCurve {
    /// Which panel, and the name of its axis, such as `Peak velocity`.
    pub group: String,
    /// Name in the legend, such as `positive`.
    pub name: String,
    /// Unit in SI; `1` for a pure number.
    pub unit: String,
    /// The points, in the order of the sweep; a failed or unmeasured one is left out.
    pub points: Vec<SweepPoint>,
}

/// One point of a curve, SI.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct SweepPoint {
    /// Value of the swept key.
    pub at: f64,
    pub value: f64,
    /// Its scatter (one standard deviation), where known.
    pub scatter: Option<f64>,
}

/// A finished sweep as its page shows it.
#[derive(Debug)]
pub struct SweepPage<'a> {
    /// Name of the scene, and what it is.
    pub scene: (&'a str, &'a str),
    /// What was swept, for people: names and values.
    pub facts: Vec<(String, String)>,
    /// Map of the regimes, or bifurcation diagram.
    pub regimes: Option<Figure>,
    /// Names and data of the figures.
    pub figures: Vec<(String, SweepReport)>,
    pub table: Table,
    /// What was assumed on the way, and what was warned of.
    pub assumptions: Vec<String>,
}

impl SweepPage<'_> {
    /// `report.html`, and every figure as SVG and PNG beside it.
    pub fn files(self) -> Result<Files, ReportError> {
        let figures = self.figures.iter().map(|(name, report)| Plate::new(name.clone(), sweep_figure(report)));
        let plates = self.regimes.map(|figure| Plate::new("regime", figure)).into_iter().chain(figures).collect();
        let mut blocks = vec![Block::Facts(self.facts), Block::Plates(plates), Block::Table(self.table)];
        blocks.extend(Block::listed("Assumed on the way", self.assumptions));
        let (name, description) = self.scene;
        Page { title: format!("Sweep of the scene {name}"), subtitle: description.to_owned(), blocks }.files_beside()
    }
}

/// Factor and unit in which people read a quantity whose SI unit is `unit`: m/s as mm/s, Hz as kHz, m as µm, s as µs, J as nJ.
#[must_use]
pub(crate) fn shown_unit(unit: &str) -> (f64, &str) {
    match unit {
        "m/s" => (1e3, "mm/s"),
        "Hz" => (1e-3, "kHz"),
        "m" => (1e6, "µm"),
        "s" => (1e6, "µs"),
        "J" => (1e9, "nJ"),
        "" => (1.0, "1"),
        other => (1.0, other),
    }
}

/// One panel a group of curves: points with their scatter joined by a line.
#[must_use]
fn sweep_figure(report: &SweepReport) -> Figure {
    let mut groups: Vec<&str> = Vec::new();
    for curve in report.curves.iter().filter(|curve| !curve.points.is_empty()) {
        if !groups.contains(&curve.group.as_str()) {
            groups.push(&curve.group);
        }
    }
    let title = format!("Simulated values as a function of {}", report.name);
    let figure = Figure::new(title).sized(PAGE_WIDTH_MM, 2.min(groups.len().max(1)));
    groups.iter().enumerate().fold(figure, |figure, (index, group)| {
        let mut panel = panel(report, group);
        if groups.len() > 1 {
            panel = panel.titled(format!("({}) {group}", letter(index)));
        }
        figure.panel(panel)
    })
}

/// The text with its first letter in upper case, as on an axis.
pub fn capitalised(text: &str) -> String {
    let mut letters = text.chars();
    letters.next().map(|first| first.to_ascii_uppercase()).into_iter().chain(letters).collect()
}

/// a, b, c … for the panels of a figure.
pub(super) fn letter(index: usize) -> char {
    char::from(b'a' + (index % 26) as u8)
}

fn panel(report: &SweepReport, group: &str) -> Panel {
    const MARKERS: [Marker; 4] = [Marker::Disc, Marker::Square, Marker::Diamond, Marker::Ring];
    const DASHES: [Dash; 4] = [Dash::Solid, Dash::Dashed, Dash::DashDotted, Dash::Dotted];
    let curves: Vec<_> =
        report.curves.iter().filter(|curve| curve.group == group && !curve.points.is_empty()).collect();
    // A pressure that is watched is sound; one that is swept may be a modulus.
    let (factor, unit) = match curves.first().map_or("1", |curve| curve.unit.as_str()) {
        "Pa" => (1e-3, "kPa"),
        unit => shown_unit(unit),
    };
    let (swept_factor, swept_unit) = shown_unit(&report.unit);
    let x = Axis::new(capitalised(&report.name), swept_unit).times(swept_factor);
    let mut panel = Panel::new(x, Axis::new(group, unit).times(factor));
    for (index, curve) in curves.iter().enumerate() {
        let colour = Colour::CYCLE[(index + 1) % Colour::CYCLE.len()];
        let line = curve.points.iter().map(|point| (point.at, point.value)).collect();
        let dash = DASHES[index % DASHES.len()];
        panel = panel.layer(Layer::Line {
            label: String::new(),
            points: line,
            stroke: Stroke::new(colour).dash(dash).width(0.7),
        });
        let points = curve
            .points
            .iter()
            .map(|point| match point.scatter {
                Some(scatter) => {
                    ErrorPoint::vertical(point.at, point.value, point.value - scatter, point.value + scatter)
                }
                None => ErrorPoint::exact(point.at, point.value),
            })
            .collect();
        panel = panel.error_points(curve.name.clone(), points, colour, MARKERS[index % MARKERS.len()]);
    }
    panel
}
