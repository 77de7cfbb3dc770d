//! What can be drawn between two axes.

use super::Colour;

/// Dash pattern of a stroke.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Dash {
    Solid,
    Dashed,
    Dotted,
    DashDotted,
}

impl Dash {
    /// Lengths of strokes and gaps in turn, pt; empty when unbroken.
    pub(crate) fn pattern(self) -> &'static [f64] {
        match self {
            Self::Solid => &[],
            Self::Dashed => &[4.0, 2.2],
            Self::Dotted => &[1.1, 1.7],
            Self::DashDotted => &[4.0, 1.7, 1.1, 1.7],
        }
    }
}

/// How a curve is drawn.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Stroke {
    pub colour: Colour,
    pub dash: Dash,
    /// Width, pt.
    pub width: f64,
}

impl Stroke {
    /// An unbroken stroke of 1 pt.
    #[must_use]
    pub const fn new(colour: Colour) -> Self {
        Self { colour, dash: Dash::Solid, width: 1.0 }
    }

    /// The same stroke with this dash pattern.
    #[must_use]
    pub const fn dash(self, dash: Dash) -> Self {
        Self { dash, ..self }
    }

    /// The same stroke with this width, pt.
    #[must_use]
    pub const fn width(self, width: f64) -> Self {
        Self { width, ..self }
    }
}

#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Marker {
    Disc,
    /// Small filled dot, for sets of runs.
    Dot,
    /// Circle with a white face.
    Ring,
    Square,
    Diamond,
    Cross,
    /// Open triangle hanging from its ordinate: an upper limit, the value lies somewhere below.
    Below,
}

/// A point with optional error bars; `low` and `high` are positions, not distances.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct ErrorPoint {
    pub x: f64,
    pub y: f64,
    /// Ends of the vertical bar, lower first.
    pub y_interval: Option<(f64, f64)>,
    /// Ends of the horizontal bar, lower first.
    pub x_interval: Option<(f64, f64)>,
}

impl ErrorPoint {
    #[must_use]
    pub(crate) const fn exact(x: f64, y: f64) -> Self {
        Self { x, y, y_interval: None, x_interval: None }
    }

    /// A point with a vertical bar from `low` to `high`.
    #[must_use]
    pub const fn vertical(x: f64, y: f64, low: f64, high: f64) -> Self {
        Self { x, y, y_interval: Some((low, high)), x_interval: None }
    }
}

/// One bar of a histogram.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Bar {
    pub from: f64,
    pub to: f64,
    pub height: f64,
}

/// Values on a rectangular grid.
#[derive(Debug, Clone, PartialEq)]
pub struct Map {
    /// Grid positions along x, ascending, at least two.
    pub x: Vec<f64>,
    /// Grid positions along y, ascending, at least two.
    pub y: Vec<f64>,
    /// Values, row by row from the lowest y: `values[j * x.len() + i]` belongs to (`x[i]`, `y[j]`).
    pub values: Vec<f64>,
}

#[derive(Debug, Clone, PartialEq)]
pub struct Polygon {
    /// Corners (x, y) in order; closed by itself.
    pub corners: Vec<(f64, f64)>,
    /// A tint: a colour, and the share of it on white, 0 to 1.
    pub fill: (Colour, f64),
}

/// One layer of a panel.
#[derive(Debug, Clone, PartialEq)]
pub enum Layer {
    Line {
        /// Name in the legend; empty keeps it out.
        label: String,
        points: Vec<(f64, f64)>,
        stroke: Stroke,
    },
    /// Single points, with or without error bars.
    Points {
        /// Name in the legend; empty keeps it out.
        label: String,
        points: Vec<ErrorPoint>,
        colour: Colour,
        marker: Marker,
    },
    /// A filled band, drawn in a light tint of its colour.
    Band {
        /// Name in the legend; empty keeps it out.
        label: String,
        /// (x, low, high), x ascending.
        points: Vec<(f64, f64, f64)>,
        /// Colour whose tint fills it.
        colour: Colour,
    },
    Bars {
        /// Name in the legend; empty keeps it out.
        label: String,
        bars: Vec<Bar>,
        colour: Colour,
    },
    /// Words right above points: (x, y, words).
    Names(Vec<(f64, f64, String)>),
    /// A thin vertical line over the whole height, named above the frame.
    MarkX { at: f64, label: String },
    /// A horizontal line over the whole width.
    MarkY {
        at: f64,
        /// Name in the legend; empty keeps it out.
        label: String,
        stroke: Stroke,
    },
    /// A map with a colour bar: in shades of one hue, dark where the value is large; or, where its range is −x to x, signed: white at zero,
    /// blue below, red above; or, where it is −x to 0, levels: viridis.
    HeatMap {
        /// What the colour means, with its unit, along the colour bar.
        label: String,
        map: Map,
        /// Values at both ends of the colours, (light, dark) or (−x, x); beyond them the shade stays. `None`: smallest and largest value.
        range: Option<(f64, f64)>,
    },
    /// The lines where a map takes the value `level`.
    Contour {
        /// Name in the legend; empty keeps it out.
        label: String,
        map: Map,
        level: f64,
        stroke: Stroke,
    },
    /// Many strokes of one kind, such as the sides of a mesh.
    Strokes {
        /// Name in the legend; empty keeps it out.
        label: String,
        /// Points (x, y) of every stroke.
        strokes: Vec<Vec<(f64, f64)>>,
        stroke: Stroke,
    },
    /// Filled polygons in the order given, later over earlier.
    Polygons {
        /// Name in the legend; empty keeps it out.
        label: String,
        polygons: Vec<Polygon>,
    },
}

impl Layer {
    /// Every place that the layer takes: index of its item, x, y. Bars, marks and maps take up each axis by itself.
    pub(super) fn places(&self, see: &mut dyn FnMut(usize, Option<f64>, Option<f64>)) {
        match self {
            Self::Line { points, .. } => {
                points.iter().enumerate().for_each(|(index, (x, y))| see(index, Some(*x), Some(*y)));
            }
            Self::Points { points, .. } => {
                for (index, point) in points.iter().enumerate() {
                    see(index, Some(point.x), Some(point.y));
                    let ends = |interval: Option<(f64, f64)>| interval.into_iter().flat_map(|(low, high)| [low, high]);
                    ends(point.x_interval).for_each(|x| see(index, Some(x), None));
                    ends(point.y_interval).for_each(|y| see(index, Some(point.x), Some(y)));
                }
            }
            Self::Band { points, .. } => {
                for (index, (x, low, high)) in points.iter().enumerate() {
                    [low, high].into_iter().for_each(|y| see(index, Some(*x), Some(*y)));
                }
            }
            Self::Bars { bars, .. } => {
                for (index, bar) in bars.iter().enumerate() {
                    [bar.from, bar.to].into_iter().for_each(|x| see(index, Some(x), None));
                    see(index, None, Some(bar.height));
                }
            }
            Self::Names(names) => {
                names.iter().enumerate().for_each(|(index, (x, y, _))| see(index, Some(*x), Some(*y)));
            }
            Self::MarkX { at, .. } => see(0, Some(*at), None),
            Self::MarkY { at, .. } => see(0, None, Some(*at)),
            Self::HeatMap { map, .. } | Self::Contour { map, .. } => {
                map.x.iter().enumerate().for_each(|(index, x)| see(index, Some(*x), None));
                map.y.iter().enumerate().for_each(|(index, y)| see(index, None, Some(*y)));
            }
            Self::Strokes { strokes, .. } => {
                let points = strokes.iter().flatten().enumerate();
                points.for_each(|(index, (x, y))| see(index, Some(*x), Some(*y)));
            }

            Self::Polygons { polygons, .. } => {
                for (index, polygon) in polygons.iter().enumerate() {
                    polygon.corners.iter().for_each(|(x, y)| see(index, Some(*x), Some(*y)));
                }
            }
        }
    }

    /// Every value that a colour or a contour stands for.
    pub(super) fn values(&self) -> &[f64] {
        match self {
            Self::HeatMap { map, .. } | Self::Contour { map, .. } => &map.values,
            _ => &[],
        }
    }
}
