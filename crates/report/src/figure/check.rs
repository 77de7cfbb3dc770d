//! Refusing what cannot be drawn, before anything is.

use super::{Axis, Cell, Figure, FigureError, Fill, Layer, Map, Panel, Scale};

/// Every value of every layer can be placed on its axis, every axis has a name and a unit.
pub(super) fn values(figure: &Figure, number: usize, panel: &Panel) -> Result<(), FigureError> {
    for (axis, name) in [(&panel.x, "x"), (&panel.y, "y")] {
        // Where the ticks are names, nothing is counted.
        if axis.label.trim().is_empty() || (axis.unit.trim().is_empty() && axis.named_ticks.is_none()) {
            return Err(FigureError::UnnamedAxis { figure: figure.title.clone(), panel: number, axis: name });
        }
    }
    for (position, layer) in panel.layers.iter().enumerate() {
        let place = |axis: &Axis, index: usize, value: f64| {
            if axis.carries(value) {
                return Ok(());
            }
            Err(FigureError::Unplaceable {
                figure: figure.title.clone(),
                panel: number,
                layer: position + 1,
                index,
                expected: if axis.scale == Scale::Linear { "number" } else { "positive number" },
                found: value,
            })
        };
        let plain = Axis::new("value", "1");
        match layer {
            Layer::Line { points, .. } => {
                for (index, (x, y)) in points.iter().enumerate() {
                    place(&panel.x, index, *x)?;
                    place(&panel.y, index, *y)?;
                }
            }
            Layer::Points { points, .. } => {
                for (index, point) in points.iter().enumerate() {
                    let (x_low, x_high) = point.x_interval.unwrap_or((point.x, point.x));
                    let (y_low, y_high) = point.y_interval.unwrap_or((point.y, point.y));
                    for x in [point.x, x_low, x_high] {
                        place(&panel.x, index, x)?;
                    }
                    for y in [point.y, y_low, y_high] {
                        place(&panel.y, index, y)?;
                    }
                }
            }
            Layer::Band { points, .. } => {
                for (index, (x, low, high)) in points.iter().enumerate() {
                    place(&panel.x, index, *x)?;
                    place(&panel.y, index, *low)?;
                    place(&panel.y, index, *high)?;
                }
            }
            Layer::Bars { bars, .. } => {
                for (index, bar) in bars.iter().enumerate() {
                    place(&panel.x, index, bar.from)?;
                    place(&panel.x, index, bar.to)?;
                    place(&plain, index, bar.height)?;
                }
            }
            Layer::Strokes { strokes, .. } => {
                for (index, (x, y)) in strokes.iter().flatten().enumerate() {
                    place(&panel.x, index, *x)?;
                    place(&panel.y, index, *y)?;
                }
            }
            Layer::Polygons { polygons, range, .. } => {
                for (index, polygon) in polygons.iter().enumerate() {
                    for (x, y) in &polygon.corners {
                        place(&panel.x, index, *x)?;
                        place(&panel.y, index, *y)?;
                    }
                    let (Fill::Value(value) | Fill::Tint(_, value)) = polygon.fill;
                    place(&plain, index, value)?;
                }
                if let Some((low, high)) = range {
                    place(&plain, 0, *low)?;
                    place(&plain, 1, *high)?;
                }
            }
            Layer::Field { colours, cells } => {
                if cells.is_empty() {
                    return Err(FigureError::NoCells {
                        figure: figure.title.clone(),
                        panel: number,
                        layer: position + 1,
                    });
                }
                if colours.label.trim().is_empty() || colours.unit.trim().is_empty() {
                    return Err(FigureError::UnnamedAxis {
                        figure: figure.title.clone(),
                        panel: number,
                        axis: "colour",
                    });
                }
                for (index, Cell(corners)) in cells.iter().enumerate() {
                    for (x, y, value) in corners {
                        place(&panel.x, index, *x)?;
                        place(&panel.y, index, *y)?;
                        place(colours, index, *value)?;
                    }
                }
            }
            Layer::MarkX { at, .. } => place(&panel.x, 0, *at)?,
            Layer::MarkY { at, .. } => place(&panel.y, 0, *at)?,
            Layer::HeatMap { map, .. } | Layer::Contour { map, .. } => {
                grid(figure, number, position + 1, map)?;
                for (index, x) in map.x.iter().enumerate() {
                    place(&panel.x, index, *x)?;
                }
                for (index, y) in map.y.iter().enumerate() {
                    place(&panel.y, index, *y)?;
                }
                for (index, value) in map.values.iter().enumerate() {
                    place(&plain, index, *value)?;
                }
            }
        }
    }
    Ok(())
}

fn grid(figure: &Figure, panel: usize, layer: usize, map: &Map) -> Result<(), FigureError> {
    let (columns, rows) = (map.x.len(), map.y.len());
    let ascending = |positions: &[f64]| positions.windows(2).all(|pair| pair[0] < pair[1]);
    if columns >= 2 && rows >= 2 && map.values.len() == columns * rows && ascending(&map.x) && ascending(&map.y) {
        return Ok(());
    }
    Err(FigureError::BadMap {
        figure: figure.title.clone(),
        panel,
        layer,
        columns,
        rows,
        expected: columns * rows,
        found: map.values.len(),
    })
}

/// The ends of an axis in given values: its range, or the data's spread (low, high, share left free on both sides).
pub(super) fn ends(
    figure: &Figure,
    panel: usize,
    axis: &Axis,
    name: &'static str,
    spread: Option<(f64, f64, f64)>,
) -> Result<(f64, f64), FigureError> {
    if let Some((low, high)) = axis.range {
        let fits = axis.carries(low) && axis.carries(high) && low < high && axis.factor > 0.0;
        return if fits {
            Ok((low, high))
        } else {
            Err(FigureError::BadRange { figure: figure.title.clone(), panel, axis: name, low, high })
        };
    }
    let Some((low, high, pad)) = spread else {
        return Err(FigureError::NoExtent { figure: figure.title.clone(), panel, axis: name });
    };
    if axis.scale == Scale::Logarithmic {
        let grow = if high > low { (high / low).powf(pad) } else { 2.0 };
        return Ok((low / grow, high * grow));
    }
    let room = if high > low {
        pad * (high - low)
    } else if low == 0.0 {
        1.0 / axis.factor.abs()
    } else {
        0.1 * low.abs()
    };
    Ok((low - room, high + room))
}
