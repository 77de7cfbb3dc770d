//! Refusing what cannot be drawn, before anything is.

use super::{Axis, Figure, FigureError, Layer, Map, Panel, Scale, layout::Spread};

/// Every value of every layer can be placed on its axis, every axis has a name and a unit.
pub(super) fn values(figure: &Figure, number: usize, panel: &Panel) -> Result<(), FigureError> {
    for (axis, name) in [(&panel.x, "x"), (&panel.y, "y")] {
        // Where the ticks are names, nothing is counted.
        if axis.label.trim().is_empty() || (axis.unit.trim().is_empty() && axis.named_ticks.is_none()) {
            return Err(FigureError::UnnamedAxis { figure: figure.title.clone(), panel: number, axis: name });
        }
    }
    let plain = Axis::new("value", "1");
    for (position, layer) in panel.layers.iter().enumerate() {
        let layer_number = position + 1;
        if let Layer::HeatMap { map, .. } | Layer::Contour { map, .. } = layer {
            grid(figure, number, layer_number, map)?;
        }
        let heights_on = if matches!(layer, Layer::Bars { .. }) { &plain } else { &panel.y };
        let mut refused = None;
        let mut place = |axis: &Axis, index: usize, found: f64| {
            if refused.is_none() && !axis.carries(found) {
                let expected = if axis.scale == Scale::Linear { "number" } else { "positive number" };
                let (figure, panel) = (figure.title.clone(), number);
                refused = Some(FigureError::Unplaceable { figure, panel, layer: layer_number, index, expected, found });
            }
        };
        layer.places(&mut |index, x, y| {
            x.into_iter().for_each(|x| place(&panel.x, index, x));
            y.into_iter().for_each(|y| place(heights_on, index, y));
        });
        layer.values().iter().enumerate().for_each(|(index, value)| place(&plain, index, *value));
        if let Some(error) = refused {
            return Err(error);
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
    spread: Option<Spread>,
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
