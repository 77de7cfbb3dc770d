//! A declarative figure and its drawing, the same code for SVG and PNG.
//!
//! A figure says what is to be seen: axes with units, curves, points with error bars, bands, marks, a map. How it is laid
//! out follows from its printed width: text is 8 pt at that width whatever the content, colours are those of Okabe and Ito
//! (2008, *Color Universal Design*), and no two curves differ by colour alone. Data outside an axis range is clipped at the
//! frame; a legend stands above the frame, never on the data.
//!
//! ```
//! use granchain_report::figure::{Axis, Colour, Figure, Panel, Stroke};
//!
//! let decay = (0..100).map(|i| (i as f64 * 1e-6, (-(i as f64) / 30.0).exp())).collect();
//! let panel = Panel::new(Axis::new("Time", "µs").times(1e6), Axis::new("Velocity", "m/s"))
//!     .line("decay", decay, Stroke::new(Colour::Blue));
//! let figure = Figure::new("An exponential decay").panel(panel);
//! let svg = figure.to_svg()?;
//! assert!(svg.starts_with("<svg"));
//! # Ok::<(), granchain_report::figure::FigureError>(())
//! ```

mod axis;

mod bitmap;
mod canvas;
mod check;
mod clip;
mod contour;
mod decimate;
mod draw;
mod error;
mod font;
mod layer;
mod layout;
mod palette;
mod vector;

pub use axis::{Axis, Scale};
pub use error::FigureError;
pub use font::{FONT_STACK, embedded_font};
pub use layer::{Bar, Dash, ErrorPoint, Layer, Map, Marker, Polygon, Stroke};
pub use palette::Colour;

use granchain_signal::Series;

/// Width of one column of a journal page, mm: the default width of a figure.
pub(crate) const COLUMN_WIDTH_MM: f64 = 85.0;
/// Width of both columns of a journal page, mm.
pub const PAGE_WIDTH_MM: f64 = 174.0;

#[derive(Debug, Clone, PartialEq)]
pub struct Figure {
    /// What the figure shows, in one sentence: the caption, and the title element of the SVG for those who cannot see it.
    pub title: String,
    pub width_mm: f64,
    /// Panels side by side in one row.
    pub columns: usize,
    /// The panels, row by row.
    pub panels: Vec<Panel>,
}

/// One pair of axes and what is drawn between them, bottom layer first.
#[derive(Debug, Clone, PartialEq)]
pub struct Panel {
    /// A few words above the frame, such as `(a) recorded`.
    pub title: Option<String>,
    /// Height of the frame, mm.
    pub height_mm: f64,
    /// Whether a length is as long upwards as sideways; the height then follows from the width.
    pub equal_scales: bool,
    pub x: Axis,
    pub y: Axis,
    /// What is drawn, bottom first.
    pub layers: Vec<Layer>,
}

impl Figure {
    /// An empty figure one journal column wide.
    #[must_use]
    pub fn new(title: impl Into<String>) -> Self {
        Self { title: title.into(), width_mm: COLUMN_WIDTH_MM, columns: 1, panels: Vec::new() }
    }

    /// The same figure with this printed width, mm, and this many panels in a row.
    #[must_use]
    pub fn sized(self, width_mm: f64, columns: usize) -> Self {
        Self { width_mm, columns: columns.max(1), ..self }
    }

    /// The same figure with one more panel.
    #[must_use]
    pub fn panel(mut self, panel: Panel) -> Self {
        self.panels.push(panel);
        self
    }

    /// Draw as SVG: one `<svg>` element, no XML header, no external reference, so that it can stand in a page as it is.
    pub fn to_svg(&self) -> Result<String, FigureError> {
        vector::render(self)
    }

    /// Draw as PNG at four pixels a point (288 dpi at the printed width).
    pub fn to_png(&self) -> Result<Vec<u8>, FigureError> {
        self.png_of(&self.to_svg()?)
    }

    /// The same of what [`to_svg`](Self::to_svg) gave.
    pub(crate) fn png_of(&self, svg: &str) -> Result<Vec<u8>, FigureError> {
        bitmap::render(svg).map_err(|reason| FigureError::Drawing { figure: self.title.clone(), reason })
    }
}

impl Panel {
    /// An empty panel with these axes.
    #[must_use]
    pub fn new(x: Axis, y: Axis) -> Self {
        Self { title: None, height_mm: 40.0, equal_scales: false, x, y, layers: Vec::new() }
    }

    /// The same panel with a few words above the frame.
    #[must_use]
    pub fn titled(mut self, title: impl Into<String>) -> Self {
        self.title = Some(title.into());
        self
    }

    /// The same panel with this frame height, mm.
    #[must_use]
    pub fn height(mut self, height_mm: f64) -> Self {
        self.height_mm = height_mm;
        self
    }

    /// The same panel with one scale for both axes, which must be linear: its height follows from its width.
    #[must_use]
    pub fn equal_scales(mut self) -> Self {
        self.equal_scales = true;
        self
    }

    /// Add any layer on top.
    #[must_use]
    pub fn layer(mut self, layer: Layer) -> Self {
        self.layers.push(layer);
        self
    }

    /// Add a curve through `points` (x, y); an empty label keeps it out of the legend.
    #[must_use]
    pub fn line(self, label: impl Into<String>, points: Vec<(f64, f64)>, stroke: Stroke) -> Self {
        self.layer(Layer::Line { label: label.into(), points, stroke })
    }

    #[must_use]
    pub fn points(self, label: impl Into<String>, points: Vec<(f64, f64)>, colour: Colour, marker: Marker) -> Self {
        let points = points.into_iter().map(|(x, y)| ErrorPoint::exact(x, y)).collect();
        self.layer(Layer::Points { label: label.into(), points, colour, marker })
    }

    /// Add points with error bars.
    #[must_use]
    pub fn error_points(
        self,
        label: impl Into<String>,
        points: Vec<ErrorPoint>,
        colour: Colour,
        marker: Marker,
    ) -> Self {
        self.layer(Layer::Points { label: label.into(), points, colour, marker })
    }

    /// Add a filled band between `low` and `high` at each x: (x, low, high).
    #[must_use]
    pub fn band(self, label: impl Into<String>, points: Vec<(f64, f64, f64)>, colour: Colour) -> Self {
        self.layer(Layer::Band { label: label.into(), points, colour })
    }

    /// Add shapes, each by its corners (x, y), in one tint: a colour, and the share of it on white, 0 to 1.
    #[must_use]
    pub(crate) fn shapes(
        self,
        label: impl Into<String>,
        shapes: impl IntoIterator<Item = Vec<(f64, f64)>>,
        fill: (Colour, f64),
    ) -> Self {
        let polygons = shapes.into_iter().map(|corners| Polygon { corners, fill }).collect();
        self.layer(Layer::Polygons { label: label.into(), polygons })
    }

    /// Add a vertical mark over the whole height, named above the frame.
    #[must_use]
    pub fn mark_x(self, at: f64, label: impl Into<String>) -> Self {
        self.layer(Layer::MarkX { at, label: label.into() })
    }

    /// Add a horizontal mark over the whole width, named in the legend when labelled.
    #[must_use]
    pub fn mark_y(self, at: f64, label: impl Into<String>, stroke: Stroke) -> Self {
        self.layer(Layer::MarkY { at, label: label.into(), stroke })
    }
}

/// The smallest and the largest of values; ∞ and −∞ of none.
pub(crate) fn extent(values: impl IntoIterator<Item = f64>) -> (f64, f64) {
    values.into_iter().fold((f64::INFINITY, f64::NEG_INFINITY), |(low, high), value| (low.min(value), high.max(value)))
}

/// The points (time s, value) of a series, for [`Panel::line`].
#[must_use]
pub fn trace(series: &Series) -> Vec<(f64, f64)> {
    series.values.iter().enumerate().map(|(index, value)| (series.time(index), *value)).collect()
}
