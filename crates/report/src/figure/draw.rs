//! Drawing a laid-out sheet: the one place where layers become strokes and fills.

use plotters::{
    coord::ranged1d::{KeyPointHint, NoDefaultFormatting, ValueFormatter},
    prelude::{ChartBuilder, LabelAreaPosition, Ranged},
    style::text_anchor::HPos,
};

use super::{
    Colour, ErrorPoint, Layer, Map, Marker,
    axis::{Resolved, Tick},
    canvas::{Canvas, Drawn, Ink, letters, stroke, units},
    clip, contour, decimate,
    font::text_width,
    layout::{self, COLOUR_BAR, COLOUR_BAR_GAP, Frame, LINE, Placed, SAMPLE, Sheet, TEXT, TICK},
    palette::{shade, signed, viridis},
};

const INK: Ink = (30, 30, 30);
const MARK_INK: Ink = (130, 130, 130);
const WHITE: Ink = (255, 255, 255);
const FRAME_WIDTH: f64 = 0.6;
/// Width of the columns to which a curve is thinned, pt: a quarter of the thinnest stroke's blur in print.
const COLUMN: f64 = 0.4;

/// Steps of a heat map's shade.
const SHADES: f64 = 24.0;
const TINT: f64 = 0.28;

/// Draw the whole sheet on a ground that is white already.
pub(super) fn sheet(sheet: &Sheet<'_>, canvas: &Canvas<'_>) -> Drawn {
    for placed in &sheet.panels {
        let layers = &placed.panel.layers;
        // The ground first, then marks, then what lies over both.
        let rank = |layer: &Layer| match layer {
            Layer::HeatMap { .. } | Layer::Band { .. } | Layer::Polygons { .. } => 0,
            Layer::MarkX { .. } => 1,
            _ => 2,
        };
        for own in 0..=2 {
            layers.iter().filter(|layer| rank(layer) == own).try_for_each(|layer| draw_layer(placed, layer, canvas))?;
        }
        surroundings(placed, canvas)?;
    }
    Ok(())
}

fn draw_layer(placed: &Placed<'_>, layer: &Layer, canvas: &Canvas<'_>) -> Drawn {
    let place = |x: f64, y: f64| (placed.x.place(x), placed.y.place(y));
    let frame = &placed.frame;
    match layer {
        Layer::Line { points, stroke, .. } => {
            let points: Vec<_> = points.iter().map(|(x, y)| place(*x, *y)).collect();
            let thinned = decimate::thin(&points, COLUMN / frame.width);
            clipped_curve(frame, &thinned, stroke.colour.rgb(), stroke.width, stroke.dash.pattern(), canvas)
        }
        Layer::Strokes { strokes, stroke, .. } => {
            for points in strokes {
                let points: Vec<_> = points.iter().map(|(x, y)| place(*x, *y)).collect();
                clipped_curve(frame, &points, stroke.colour.rgb(), stroke.width, stroke.dash.pattern(), canvas)?;
            }
            Ok(())
        }
        Layer::Polygons { polygons, .. } => {
            for polygon in polygons {
                let (colour, share) = polygon.fill;
                let corners: Vec<_> = polygon.corners.iter().map(|(x, y)| place(*x, *y)).collect();
                let seen = clip::polygon(&corners);
                if seen.len() > 2 {
                    canvas.polygon(&on_sheet(frame, &seen), colour.tint(share))?;
                }
            }
            Ok(())
        }
        Layer::Points { points, colour, marker, .. } => {
            for point in points {
                error_bars(placed, point, *colour, canvas)?;
            }
            for point in points {
                let at = place(point.x, point.y);
                if inside(at) {
                    draw_marker(frame.at(at), *marker, *colour, canvas)?;
                }
            }
            Ok(())
        }
        Layer::Band { points, colour, .. } => {
            let tint = colour.tint(TINT);
            for pair in points.windows(2) {
                let (left, right) = (placed.x.place(pair[0].0), placed.x.place(pair[1].0));
                if right < 0.0 || left > 1.0 || right <= left {
                    continue;
                }
                let edge = |pick: fn(&(f64, f64, f64)) -> f64, x: f64| {
                    let (from, to) = (placed.y.place(pick(&pair[0])), placed.y.place(pick(&pair[1])));
                    (from + (x - left) / (right - left) * (to - from)).clamp(0.0, 1.0)
                };
                let (from, to) = (left.max(0.0), right.min(1.0));
                let corners = [
                    (from, edge(|point| point.1, from)),
                    (from, edge(|point| point.2, from)),
                    (to, edge(|point| point.2, to)),
                    (to, edge(|point| point.1, to)),
                ];
                canvas.polygon(&corners.map(|corner| frame.at(corner)), tint)?;
            }
            Ok(())
        }
        Layer::Bars { bars, colour, .. } => {
            let floor = placed.y.place(0.0);
            let floor = if floor.is_finite() { floor.clamp(0.0, 1.0) } else { 0.0 };
            for bar in bars {
                let (left, right) = (placed.x.place(bar.from), placed.x.place(bar.to));
                let top = placed.y.place(bar.height);
                if !top.is_finite() || right < 0.0 || left > 1.0 {
                    continue;
                }
                let lower = frame.at((left.max(0.0), floor));
                let upper = frame.at((right.min(1.0), top.clamp(0.0, 1.0)));
                canvas.rectangle((lower.0 + 0.4, lower.1), (upper.0 - 0.4, upper.1), colour.tint(0.75))?;
            }
            Ok(())
        }
        Layer::Names(names) => {
            for (x, y, words) in names {
                let (at, near) = (place(*x, *y), 2.5);
                if inside(at) {
                    let (x, y) = frame.at(at);
                    // Near the right side there is room on the left alone.
                    let (side, by) = if at.0 > 0.8 { (HPos::Right, -near) } else { (HPos::Left, near) };
                    canvas.text(words, (x + by, y - near), side, INK)?;
                }
            }
            Ok(())
        }
        Layer::MarkX { at, .. } => {
            let x = placed.x.place(*at);
            if (0.0..=1.0).contains(&x) {
                canvas.curve(&[frame.at((x, 0.0)), frame.at((x, 1.0))], MARK_INK, 0.5, &[2.0, 2.0])?;
            }
            Ok(())
        }
        Layer::MarkY { at, stroke, .. } => {
            let y = placed.y.place(*at);
            if (0.0..=1.0).contains(&y) {
                let ends = [frame.at((0.0, y)), frame.at((1.0, y))];
                canvas.curve(&ends, stroke.colour.rgb(), stroke.width, stroke.dash.pattern())?;
            }
            Ok(())
        }

        Layer::HeatMap { map, range, .. } => heat_map(placed, map, *range, canvas),
        Layer::Contour { map, level, stroke, .. } => {
            let placed_map = Map {
                x: map.x.iter().map(|x| placed.x.place(*x)).collect(),
                y: map.y.iter().map(|y| placed.y.place(*y)).collect(),
                values: map.values.clone(),
            };
            for curve in contour::join(contour::segments(&placed_map, *level), 1e-9) {
                clipped_curve(frame, &curve, stroke.colour.rgb(), stroke.width, stroke.dash.pattern(), canvas)?;
            }
            Ok(())
        }
    }
}

fn inside((x, y): (f64, f64)) -> bool {
    const SLACK: f64 = 1e-9;
    (-SLACK..=1.0 + SLACK).contains(&x) && (-SLACK..=1.0 + SLACK).contains(&y)
}

/// Draw what of a curve (in fractions of the frame) lies inside the frame.
fn clipped_curve(
    frame: &Frame,
    points: &[(f64, f64)],
    colour: Ink,
    width: f64,
    dashes: &[f64],
    canvas: &Canvas<'_>,
) -> Drawn {
    let mut piece: Vec<(f64, f64)> = Vec::new();
    for pair in points.windows(2) {
        match clip::segment(pair[0], pair[1]) {
            Some((from, to)) => {
                if piece.last() != Some(&from) {
                    canvas.curve(&on_sheet(frame, &piece), colour, width, dashes)?;
                    piece = vec![from];
                }
                piece.push(to);
            }
            None => {
                canvas.curve(&on_sheet(frame, &piece), colour, width, dashes)?;
                piece.clear();
            }
        }
    }
    canvas.curve(&on_sheet(frame, &piece), colour, width, dashes)
}

fn on_sheet(frame: &Frame, points: &[(f64, f64)]) -> Vec<(f64, f64)> {
    points.iter().map(|point| frame.at(*point)).collect()
}

fn error_bars(placed: &Placed<'_>, point: &ErrorPoint, colour: Colour, canvas: &Canvas<'_>) -> Drawn {
    let (x, y) = (placed.x.place(point.x), placed.y.place(point.y));
    let bars = [
        point.y_interval.map(|(low, high)| ((x, placed.y.place(low)), (x, placed.y.place(high)), (1.3, 0.0))),
        point.x_interval.map(|(low, high)| ((placed.x.place(low), y), (placed.x.place(high), y), (0.0, 1.3))),
    ];
    for (low, high, cap) in bars.into_iter().flatten() {
        let Some((from, to)) = clip::segment(low, high) else { continue };
        canvas.curve(&[placed.frame.at(from), placed.frame.at(to)], colour.rgb(), 0.7, &[])?;
        for (end, wanted) in [(from, low), (to, high)] {
            if end == wanted {
                let (x, y) = placed.frame.at(end);
                canvas.curve(&[(x - cap.0, y - cap.1), (x + cap.0, y + cap.1)], colour.rgb(), 0.7, &[])?;
            }
        }
    }
    Ok(())
}

fn draw_marker((x, y): (f64, f64), marker: Marker, colour: Colour, canvas: &Canvas<'_>) -> Drawn {
    let ink = colour.rgb();
    match marker {
        Marker::Disc => canvas.disc((x, y), 2.1, ink),
        Marker::Dot => canvas.disc((x, y), 0.9, ink),
        Marker::Ring => {
            canvas.disc((x, y), 2.4, ink)?;
            canvas.disc((x, y), 1.5, WHITE)
        }
        Marker::Square => canvas.rectangle((x - 1.9, y - 1.9), (x + 1.9, y + 1.9), ink),
        Marker::Diamond => canvas.polygon(&[(x - 2.8, y), (x, y - 2.8), (x + 2.8, y), (x, y + 2.8)], ink),
        Marker::Cross => {
            let arm = 2.4;
            canvas.curve(&[(x - arm, y - arm), (x + arm, y + arm)], ink, 1.1, &[])?;
            canvas.curve(&[(x - arm, y + arm), (x + arm, y - arm)], ink, 1.1, &[])
        }
        Marker::Below => {
            canvas.polygon(&[(x - 2.8, y), (x + 2.8, y), (x, y + 4.8)], ink)?;
            canvas.polygon(&[(x - 1.4, y + 0.8), (x + 1.4, y + 0.8), (x, y + 3.2)], WHITE)
        }
    }
}

fn heat_map(placed: &Placed<'_>, map: &Map, range: Option<(f64, f64)>, canvas: &Canvas<'_>) -> Drawn {
    let (low, high) = range.unwrap_or_else(|| layout::map_ends(map));
    let colour = map_colours(low, high);
    let step = |value: f64| (((value - low) / (high - low)).clamp(0.0, 1.0) * SHADES).round();
    let x = cell_edges(&map.x.iter().map(|x| placed.x.place(*x)).collect::<Vec<_>>());
    let y = cell_edges(&map.y.iter().map(|y| placed.y.place(*y)).collect::<Vec<_>>());
    let columns = map.x.len();
    for j in 0..map.y.len() {
        let row = &map.values[j * columns..(j + 1) * columns];
        let mut first = 0;
        for i in 1..=columns {
            if i < columns && step(row[i]) == step(row[first]) {
                continue;
            }
            let colour = colour(step(row[first]) / SHADES);
            let lower = placed.frame.at((x[first], y[j]));
            let upper = placed.frame.at((x[i], y[j + 1]));
            canvas.rectangle(lower, upper, colour)?;
            first = i;
        }
    }
    Ok(())
}

/// Colours of a map whose values lie between these ends.
fn map_colours(low: f64, high: f64) -> fn(f64) -> Ink {
    match low < 0.0 {
        true if high == 0.0 => viridis,
        true if low == -high => signed,
        _ => shade,
    }
}

/// Edges half-way between ascending positions, kept inside the frame.
fn cell_edges(positions: &[f64]) -> Vec<f64> {
    let last = positions.len() - 1;
    let first_edge = positions[0] - 0.5 * (positions[1] - positions[0]);
    let last_edge = positions[last] + 0.5 * (positions[last] - positions[last - 1]);
    let between = positions.windows(2).map(|pair| 0.5 * (pair[0] + pair[1]));
    std::iter::once(first_edge).chain(between).chain([last_edge]).map(|edge| edge.clamp(0.0, 1.0)).collect()
}

/// The ticks of an axis as plotters takes them: places from 0 to 1 along it, each with its name.
struct Ticks(Vec<Tick>);

impl Ranged for Ticks {
    type FormatOption = NoDefaultFormatting;
    type ValueType = f64;

    fn map(&self, place: &f64, (low, high): (i32, i32)) -> i32 {
        low + (place * f64::from(high - low)).round() as i32
    }

    fn key_points<Hint: KeyPointHint>(&self, _: Hint) -> Vec<f64> {
        self.0.iter().map(|tick| tick.place).collect()
    }

    fn range(&self) -> std::ops::Range<f64> {
        0.0..1.0
    }
}

impl ValueFormatter<f64> for Ticks {
    fn format_ext(&self, place: &f64) -> String {
        let name = self.0.iter().find(|tick| tick.place == *place).and_then(|tick| tick.name.as_deref());
        clean(name.unwrap_or_default())
    }
}

/// Ticks and their names below a frame and on one side of it, minor ticks shorter.
fn axes(frame: &Frame, (x, y): (Option<&Resolved>, &Resolved), side: LabelAreaPosition, canvas: &Canvas<'_>) -> Drawn {
    const ROOM: f64 = 60.0;
    let (left, top) = (units(frame.left), units(frame.top));
    let (width, height, room) = (units(frame.width), units(frame.height), units(ROOM));
    let before = if matches!(side, LabelAreaPosition::Left) { room } else { 0 };
    let area = canvas.0.clone().shrink((left - before, top), (width + room + 1, height + room + 1));
    let has_minor = x.into_iter().chain([y]).any(|axis| axis.ticks.iter().any(|tick| tick.name.is_none()));
    for (is_named, length) in [(false, 0.6 * TICK), (true, TICK)].into_iter().skip(usize::from(!has_minor)) {
        let ticks = |axis: Option<&Resolved>| {
            let ticks = axis.into_iter().flat_map(|axis| &axis.ticks);
            Ticks(ticks.filter(|tick| tick.name.is_some() == is_named).cloned().collect())
        };
        ChartBuilder::on(&area)
            .set_label_area_size(side, room)
            .set_label_area_size(LabelAreaPosition::Bottom, room)
            .build_cartesian_2d(ticks(x), ticks(Some(y)))?
            .configure_mesh()
            .disable_mesh()
            .axis_style(stroke(INK, FRAME_WIDTH))
            .label_style(letters(INK))
            .set_all_tick_mark_size(units(length))
            .draw()?;
    }
    // The two sides without an axis.
    let near = if matches!(side, LabelAreaPosition::Left) { 1.0 } else { 0.0 };
    let sides = [(1.0 - near, 1.0), (near, 1.0), (near, 0.0)].map(|corner| frame.at(corner));
    canvas.curve(&sides, INK, FRAME_WIDTH, &[])
}

/// Axes with their titles, legend, names of marks, colour bar.
fn surroundings(placed: &Placed<'_>, canvas: &Canvas<'_>) -> Drawn {
    let frame = &placed.frame;
    axes(frame, (Some(&placed.x), &placed.y), LabelAreaPosition::Left, canvas)?;
    let (middle_x, middle_y) = frame.at((0.5, 0.5));
    // A title longer than its frame leans to where there is room.
    let half = 0.5 * text_width(&placed.x.title, TEXT) + 1.0;
    let middle_x = middle_x.min(placed.cell.1 - half).max(placed.cell.0 + half);
    let below = frame.top + frame.height + 2.0 * TICK + 1.45 * LINE;
    canvas.text(&clean(&placed.x.title), (middle_x, below), HPos::Center, INK)?;
    canvas.text_upwards(&clean(&placed.y.title), (frame.left - placed.y_title_offset, middle_y), INK)?;
    if let Some(title) = &placed.panel.title {
        canvas.text(&clean(title), placed.title_at, HPos::Left, INK)?;
    }
    for (row, entries) in placed.legend.iter().enumerate() {
        let y = placed.legend_top + row as f64 * LINE;
        for (x, index) in entries {
            legend_entry(&placed.panel.layers[*index], (*x, y), canvas)?;
        }
    }
    for (x, row, index) in &placed.marks {
        if let Layer::MarkX { label, .. } = &placed.panel.layers[*index] {
            let y = frame.top - 5.5 - *row as f64 * (LINE - 1.5);
            canvas.text(&clean(label), (*x, y), HPos::Center, INK)?;
        }
    }
    colour_bar(placed, canvas)
}

fn legend_entry(layer: &Layer, (x, y): (f64, f64), canvas: &Canvas<'_>) -> Drawn {
    let Some(label) = layout::legend_label(layer) else { return Ok(()) };
    let middle = (x + 0.5 * SAMPLE, y);
    let filled = |colour: Colour, share: f64| {
        canvas.rectangle((x + 2.0, y - 3.2), (x + SAMPLE - 2.0, y + 3.2), colour.tint(share))
    };
    match layer {
        Layer::Line { stroke, .. }
        | Layer::Strokes { stroke, .. }
        | Layer::MarkY { stroke, .. }
        | Layer::Contour { stroke, .. } => {
            canvas.curve(&[(x, y), (x + SAMPLE, y)], stroke.colour.rgb(), stroke.width, stroke.dash.pattern())?;
        }
        Layer::Points { colour, marker, points, .. } => {
            if points.iter().any(|point| point.y_interval.is_some()) {
                canvas.curve(&[(middle.0, y - 4.0), (middle.0, y + 4.0)], colour.rgb(), 0.7, &[])?;
            }
            draw_marker(middle, *marker, *colour, canvas)?;
        }
        Layer::Band { colour, .. } => filled(*colour, TINT)?,
        Layer::Bars { colour, .. } => filled(*colour, 0.75)?,
        Layer::Polygons { polygons, .. } => {
            polygons.first().map_or(Ok(()), |first| filled(first.fill.0, first.fill.1))?
        }
        Layer::Names(_) | Layer::MarkX { .. } | Layer::HeatMap { .. } => {}
    }
    canvas.text(&clean(label), (x + SAMPLE + 4.0, y), HPos::Left, INK)
}

fn colour_bar(placed: &Placed<'_>, canvas: &Canvas<'_>) -> Drawn {
    let (Some(colours), Some((_, (low, high)))) = (&placed.colours, layout::heat(placed.panel)) else {
        return Ok(());
    };
    let frame = &placed.frame;
    let bar = Frame { left: frame.left + frame.width + COLOUR_BAR_GAP, width: COLOUR_BAR, ..*frame };
    let shade = map_colours(low, high);
    for index in 0..=SHADES as usize {
        // The shade of step i is shown around i / SHADES, as the map rounds it.
        let low = ((index as f64 - 0.5) / SHADES).max(0.0);
        let high = ((index as f64 + 0.5) / SHADES).min(1.0);
        canvas.rectangle(bar.at((0.0, low)), bar.at((1.0, high)), shade(index as f64 / SHADES))?;
    }
    axes(&bar, (None, colours), LabelAreaPosition::Right, canvas)?;
    let widest = colours.ticks.iter().filter_map(|tick| tick.name.as_deref());
    let widest = widest.map(|name| text_width(name, TEXT)).fold(0.0, f64::max);
    let title_x = bar.left + bar.width + 2.0 * TICK + widest + 0.5 * LINE;
    canvas.text_upwards(&clean(&colours.title), (title_x, bar.at((0.0, 0.5)).1), INK)
}

/// A label on one line without control characters, which XML does not carry.
fn clean(label: &str) -> String {
    label.chars().map(|letter| if letter.is_control() { ' ' } else { letter }).collect()
}
