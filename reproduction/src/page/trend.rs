//! What the pages of trends share: a number along the values, its table cell, all numbers as CSV and JSON.

use std::fmt::Write as _;

use serde_json::Value;

use crate::portrait::Trait;
use crate::trend::TrendPoint;
use granchain_report::{
    figure::{Colour, ErrorPoint, Marker, Panel, Stroke},
    number::fixed,
    page::{Files, ReportError},
};

/// `NAME.json` with all there is, and `NAME.csv` with one row a law and value; `value` is the CSV's name of the value.
///
/// # Errors
/// [`ReportError::Json`].
pub(super) fn tables<'a>(
    name: &str,
    value: &str,
    laws: impl Iterator<Item = (&'static str, &'a Vec<TrendPoint>)>,
    all: &Value,
) -> Result<Files, ReportError> {
    let mut json = serde_json::to_vec_pretty(all)?;
    json.push(b'\n');
    Ok(vec![(format!("{name}.json").into(), json), (format!("{name}.csv").into(), csv(value, laws))])
}

/// Mean and scatter of a number along a trend, points joined.
pub(super) fn curve(
    panel: Panel,
    label: &str,
    points: &[TrendPoint],
    what: Trait,
    colour: Colour,
    marker: Marker,
) -> Panel {
    let points: Vec<ErrorPoint> = points
        .iter()
        .filter_map(|point| {
            let own = point.moments.get(what)?;
            Some(ErrorPoint::vertical(point.value, own.mean, own.mean - own.deviation, own.mean + own.deviation))
        })
        .collect();
    let line = points.iter().map(|point| (point.x, point.y)).collect();
    panel.line("", line, Stroke::new(colour).width(0.7)).error_points(label, points, colour, marker)
}

/// Mean ± scatter of a number times `factor`, a dash where it was not seen.
pub(super) fn cell(point: &TrendPoint, what: Trait, factor: f64, digits: usize) -> String {
    point.moments.get(what).map_or("–".to_owned(), |own| {
        format!("{} ± {}", fixed(factor * own.mean, digits), fixed(factor * own.deviation, digits))
    })
}

/// All numbers of a portrait along a trend, one row a law and value.
fn csv<'a>(value: &str, laws: impl Iterator<Item = (&'static str, &'a Vec<TrendPoint>)>) -> Vec<u8> {
    let traits = Trait::all();
    let mut text = format!("law,{value},failed_runs");
    for what in &traits {
        // Writing to a string cannot fail.
        let _ = write!(text, ",{0},scatter_{0}", what.key());
    }
    text.push('\n');
    for (law, points) in laws {
        for point in points {
            let _ = write!(text, "{law},{},{}", point.value, point.failed);
            for what in &traits {
                match point.moments.get(*what) {
                    Some(own) => {
                        let _ = write!(text, ",{:e},{:e}", own.mean, own.deviation);
                    }
                    None => text.push_str(",,"),
                }
            }
            text.push('\n');
        }
    }
    text.into_bytes()
}
