//! Where everything stands on the sheet, in points (1/72 inch), before anything is drawn.

use super::{Axis, Figure, FigureError, Layer, Map, Panel, Scale, axis::Resolved, extent, font::text_width};

/// Size of all text, pt.
pub(super) const TEXT: f64 = 8.0;
/// Height of one line of text, pt.
pub(super) const LINE: f64 = 11.0;
/// Length of a tick outside the frame, pt.
pub(super) const TICK: f64 = 2.5;
/// Width of the sample before a legend entry, pt.
pub(super) const SAMPLE: f64 = 17.0;
/// Width of a colour bar, pt.
pub(super) const COLOUR_BAR: f64 = 7.0;
/// Distance between frame and colour bar, pt.
pub(super) const COLOUR_BAR_GAP: f64 = 6.0;

const GAP: f64 = 2.0;
/// Left and right of a frame together, about, pt.
const USUAL_MARGINS: f64 = 44.0;
const PANEL_GAP: f64 = 9.0;
const POINTS_PER_MM: f64 = 72.0 / 25.4;

/// A sheet whose every panel has its place.
pub(super) struct Sheet<'a> {
    pub width: f64,
    pub height: f64,
    pub panels: Vec<Placed<'a>>,
}

/// A panel with its frame and what surrounds it.
pub(super) struct Placed<'a> {
    pub panel: &'a Panel,
    pub frame: Frame,
    pub x: Resolved,
    pub y: Resolved,
    /// Left and right end of the panel's share of the sheet.
    pub cell: (f64, f64),
    /// Distance between the y axis's title (its middle) and the frame.
    pub y_title_offset: f64,
    /// Rows of the legend, top first: x of the sample and index of the layer.
    pub legend: Vec<Vec<(f64, usize)>>,
    /// Height of the first legend row's middle.
    pub legend_top: f64,
    /// Names above the frame: x of the middle, row from the frame up, index of the layer.
    pub marks: Vec<(f64, usize, usize)>,
    /// Scale of the heat map's colour bar, if there is one.
    pub colours: Option<Resolved>,
    /// Height of the panel title's middle.
    pub title_at: (f64, f64),
}

/// A rectangle, upper left corner and size.
#[derive(Debug, Clone, Copy)]
pub(super) struct Frame {
    pub left: f64,
    pub top: f64,
    pub width: f64,
    pub height: f64,
}

impl Frame {
    /// The point at fractions (0…1 rightwards, 0…1 upwards) of the frame.
    pub(crate) fn at(&self, (x, y): (f64, f64)) -> (f64, f64) {
        (self.left + x * self.width, self.top + (1.0 - y) * self.height)
    }
}

/// Name of a layer in the legend, if it has one there.
pub(super) fn legend_label(layer: &Layer) -> Option<&str> {
    let label = match layer {
        Layer::Line { label, .. }
        | Layer::Points { label, .. }
        | Layer::Band { label, .. }
        | Layer::Bars { label, .. }
        | Layer::MarkY { label, .. }
        | Layer::Strokes { label, .. }
        | Layer::Polygons { label, .. }
        | Layer::Contour { label, .. } => label,
        Layer::Names(_) | Layer::MarkX { .. } | Layer::HeatMap { .. } => return None,
    };
    (!label.is_empty()).then_some(label)
}

/// What is known of a panel before its place on the sheet is.
struct Measured<'a> {
    panel: &'a Panel,
    x_ends: (f64, f64),
    y_ends: (f64, f64),
    y: Resolved,
    height: f64,
    tick_width: f64,
    colours: Option<Resolved>,
}

impl Measured<'_> {
    /// Give a panel of equal scales the height that belongs to its width.
    fn scale_equally(&mut self, width: f64) {
        if !self.panel.equal_scales {
            return;
        }
        let shown = |(low, high): (f64, f64), axis: &Axis| (high - low) * axis.factor;
        self.height = width * shown(self.y_ends, &self.panel.y) / shown(self.x_ends, &self.panel.x);
        self.y = Resolved::new(&self.panel.y, self.y_ends, self.height, 22.0);
        self.tick_width = tick_width(&self.y);
        self.colours = colours(self.panel, self.height);
    }
}

/// Check the figure and give everything its place.
pub(super) fn plan(figure: &Figure) -> Result<Sheet<'_>, FigureError> {
    if figure.panels.is_empty() {
        return Err(FigureError::NoPanel { figure: figure.title.clone() });
    }
    let mut measured = Vec::new();
    for (index, panel) in figure.panels.iter().enumerate() {
        measured.push(measure(figure, index + 1, panel)?);
    }
    let width = figure.width_mm * POINTS_PER_MM;
    let columns = figure.columns.max(1);
    let cell = width / columns as f64;
    // Margins depend on ticks, ticks on the height, the height on the width between the margins: once with a guess, then as it is.
    for panel in &mut measured {
        panel.scale_equally(cell - USUAL_MARGINS);
    }
    let left = |panel: &Measured<'_>| 2.0 + LINE + GAP + panel.tick_width + 2.0 * TICK;
    let right = |panel: &Measured<'_>| {
        panel
            .colours
            .as_ref()
            .map_or(9.0, |colours| COLOUR_BAR_GAP + COLOUR_BAR + 2.0 * TICK + tick_width(colours) + LINE)
    };
    // Frames of a column share their left edge, and their right one where they share the horizontal axis; else only a panel
    // with a colour bar gives way to it.
    let widest_left = |column: usize| measured.iter().skip(column).step_by(columns).map(left).fold(0.0, f64::max);
    let left_margins: Vec<f64> = (0..columns).map(widest_left).collect();
    let widest_right = |index: usize| {
        let same_axis = |panel: &&Measured<'_>| panel.panel.x == measured[index].panel.x;
        measured.iter().skip(index % columns).step_by(columns).filter(same_axis).map(right).fold(0.0, f64::max)
    };
    let right_margins: Vec<f64> = (0..measured.len()).map(widest_right).collect();
    let frame_width = |index: usize| (cell - left_margins[index % columns] - right_margins[index]).max(30.0);
    let widths: Vec<f64> = (0..measured.len()).map(frame_width).collect();
    for (measured, width) in measured.iter_mut().zip(&widths) {
        measured.scale_equally(*width);
    }
    let mut widths = widths.into_iter();

    let mut panels: Vec<Placed<'_>> = Vec::new();
    let mut top = 0.0;
    let mut rest = measured.into_iter();
    loop {
        let row: Vec<_> = rest.by_ref().take(columns).collect();
        if row.is_empty() {
            break;
        }
        let mut placed: Vec<Placed<'_>> = row
            .into_iter()
            .enumerate()
            .map(|(column, panel)| {
                let left = left_margins[column];
                let width = widths.next().unwrap_or(30.0);
                place(panel, column as f64 * cell, left, width, cell)
            })
            .collect();
        // Frames of a row share their upper edge: the tallest head decides.
        let head = placed.iter().map(|panel| panel.frame.top).fold(0.0, f64::max);
        let mut bottom = top;
        for panel in &mut placed {
            let shift = top + head - panel.frame.top;
            panel.frame.top += shift;
            panel.legend_top += shift;
            panel.title_at.1 += shift;
            bottom = f64::max(bottom, panel.frame.top + panel.frame.height + TICK + 2.0 + 2.0 * LINE);
        }
        panels.extend(placed);
        top = bottom + PANEL_GAP;
    }
    Ok(Sheet { width, height: top - PANEL_GAP + 2.0, panels })
}

fn tick_width(axis: &Resolved) -> f64 {
    axis.ticks.iter().filter_map(|tick| tick.name.as_deref()).map(|name| text_width(name, TEXT)).fold(0.0, f64::max)
}

fn measure<'a>(figure: &Figure, number: usize, panel: &'a Panel) -> Result<Measured<'a>, FigureError> {
    super::check::values(figure, number, panel)?;
    let ends = |axis: &Axis, name: &'static str, spread: Option<Spread>| {
        super::check::ends(figure, number, axis, name, spread)
    };
    let x_ends = ends(&panel.x, "x", spread_x(panel))?;
    let y_ends = ends(&panel.y, "y", spread_y(panel, x_ends))?;
    let height = panel.height_mm * POINTS_PER_MM;
    let y = Resolved::new(&panel.y, y_ends, height, 22.0);
    Ok(Measured { panel, x_ends, y_ends, tick_width: tick_width(&y), y, height, colours: colours(panel, height) })
}

/// Scale of the first heat map's colour bar.
fn colours(panel: &Panel, height: f64) -> Option<Resolved> {
    let (title, ends) = heat(panel)?;
    let mut colours = Resolved::new(&Axis::new("", ""), ends, height, 22.0);
    title.clone_into(&mut colours.title);
    Some(colours)
}

/// What the colours of the first heat map mean, and the values at their ends.
pub(super) fn heat(panel: &Panel) -> Option<(&str, (f64, f64))> {
    panel.layers.iter().find_map(|layer| match layer {
        Layer::HeatMap { label, map, range } => Some((label.as_str(), range.unwrap_or_else(|| map_ends(map)))),
        _ => None,
    })
}

/// Smallest and largest value of a map, apart if they are equal.
pub(super) fn map_ends(map: &Map) -> (f64, f64) {
    let (low, high) = extent(map.values.iter().copied());
    if high > low { (low, high) } else { (low - 0.5, high + 0.5) }
}

fn place<'a>(measured: Measured<'a>, cell_left: f64, left: f64, width: f64, cell: f64) -> Placed<'a> {
    let Measured { panel, x_ends, y, height, tick_width, colours, .. } = measured;
    let x = Resolved::new(&panel.x, x_ends, width, 38.0);
    let frame_left = cell_left + left;

    let mut legend: Vec<Vec<(f64, usize)>> = Vec::new();
    let mut pen = f64::INFINITY;
    for (index, layer) in panel.layers.iter().enumerate() {
        let Some(label) = legend_label(layer) else { continue };
        let entry = SAMPLE + 4.0 + text_width(label, TEXT);
        if pen + entry > cell_left + cell - 2.0 {
            legend.push(Vec::new());
            pen = frame_left;
        }
        if let Some(row) = legend.last_mut() {
            row.push((pen, index));
        }
        pen += entry + 10.0;
    }

    let mut marks: Vec<(f64, usize, usize)> = Vec::new();
    let mut taken: Vec<f64> = Vec::new();
    let mut wanted: Vec<(f64, usize, &str)> = panel
        .layers
        .iter()
        .enumerate()
        .filter_map(|(index, layer)| match layer {
            Layer::MarkX { at, label } if !label.is_empty() && (0.0..=1.0).contains(&x.place(*at)) => {
                Some((frame_left + x.place(*at) * width, index, label.as_str()))
            }
            _ => None,
        })
        .collect();
    wanted.sort_by(|a, b| a.0.total_cmp(&b.0));
    for (middle, index, label) in wanted {
        let half = 0.5 * text_width(label, TEXT) + 1.5;
        let row = taken.iter().position(|end| middle - half >= *end).unwrap_or(taken.len());
        if row == taken.len() {
            taken.push(0.0);
        }
        taken[row] = middle + half;
        marks.push((middle, row, index));
    }

    let title_height = if panel.title.is_some() { LINE + 2.0 } else { 0.0 };
    let legend_height = legend.len() as f64 * LINE + if legend.is_empty() { 0.0 } else { 2.0 };
    let marks_height = taken.len() as f64 * (LINE - 1.5);
    let frame_top = 3.0 + title_height + legend_height + marks_height + if marks.is_empty() { 2.0 } else { 1.0 };
    Placed {
        panel,
        frame: Frame { left: frame_left, top: frame_top, width, height },
        x,
        y,
        cell: (cell_left, cell_left + cell),
        y_title_offset: 2.0 * TICK + tick_width + GAP + 0.5 * LINE,
        legend,
        legend_top: 3.0 + title_height + 0.5 * LINE,
        marks,
        colours,
        title_at: (frame_left, 3.0 + 0.5 * LINE),
    }
}

/// Smallest and largest x, and the share of the span to leave free on both sides.
fn spread_x(panel: &Panel) -> Option<Spread> {
    let mut seen = Vec::new();
    for layer in panel.layers.iter().filter(|layer| !matches!(layer, Layer::MarkX { .. })) {
        layer.places(&mut |_, x, _| seen.extend(x));
    }
    // A map spans the frame, whatever points lie on it.
    let has = |kind: fn(&Layer) -> bool| panel.layers.iter().any(kind);
    let roomy =
        has(|layer| matches!(layer, Layer::Points { .. })) && !has(|layer| matches!(layer, Layer::HeatMap { .. }));
    spread(seen, if roomy { 0.04 } else { 0.0 })
}

/// Smallest and largest y among what lies between the ends of the x axis, and the share of the span to leave free.
fn spread_y(panel: &Panel, (low_x, high_x): (f64, f64)) -> Option<Spread> {
    let inside = |x: f64| x >= low_x && x <= high_x;
    let (mut seen, mut pad) = (Vec::new(), 0.05);
    for layer in &panel.layers {
        layer.places(&mut |_, x, y| seen.extend(y.filter(|_| x.is_none_or(inside))));
        match layer {
            Layer::Bars { .. } => seen.push(0.0),
            Layer::HeatMap { .. } | Layer::Contour { .. } => pad = 0.0,
            _ => {}
        }
    }
    let bars_only = panel.layers.iter().all(|layer| matches!(layer, Layer::Bars { .. } | Layer::MarkX { .. }));
    match spread(seen, pad) {
        Some((low, high, pad)) if bars_only && panel.y.scale == Scale::Linear => {
            Some((low, high + 2.0 * pad * (high - low), 0.0))
        }
        other => other,
    }
}

/// Low, high, and the share of the span to leave free on both sides.
pub(super) type Spread = (f64, f64, f64);

fn spread(values: Vec<f64>, pad: f64) -> Option<Spread> {
    let (low, high) = extent(values);
    (low <= high).then_some((low, high, pad))
}
