//! The curves of a page as numbers, for the script that lets a reader zoom and read values.
//!
//! Every array stands in the page once, whichever figures show it: evenly spaced ones as start and step, ordinates as 16 bits over their own
//! range (of the logarithm on a logarithmic axis), which a reading of four digits does not feel.

use std::collections::HashMap;

use base64::{Engine, engine::general_purpose::STANDARD};
use serde_json::{Value, json};

use super::Drawn;
use crate::figure::{Axis, Colour, Figure, Layer, Marker, Panel, Scale, Stroke, extent};

/// A figure whose longest curve has fewer points has nothing to zoom into.
const FEWEST_POINTS: usize = 32;
/// More single points than this are a cloud and no curve.
const MOST_MARKERS: usize = 100;
/// Every second sample is left out where a straight line over it misses it by no more than this share of the range.
const LEFT_OUT: f64 = 1e-3;

/// The arrays met so far, and the panels that show them.
#[derive(Default)]
struct Arrays {
    values: Vec<Value>,
    known: HashMap<String, usize>,
    /// Link of the panels by curve (x, y).
    links: HashMap<(usize, usize), usize>,
    next_link: usize,
}

/// The data of all figures of a page that can be explored, by their places among its plates; `None` where there is none.
pub(super) fn of(drawn: &[Drawn<'_>]) -> Option<String> {
    let mut arrays = Arrays::default();
    let figures: serde_json::Map<String, Value> = drawn
        .iter()
        .filter(|drawn| is_explorable(&drawn.plate.figure))
        .map(|drawn| (drawn.number.to_string(), arrays.figure(&drawn.plate.figure)))
        .collect();
    // No `<` may end the element that holds the text.
    let text = || json!({"arrays": arrays.values, "figures": figures}).to_string().replace('<', "\\u003c");
    (!figures.is_empty()).then(text)
}

/// Whether every panel is nothing but curves over a numbered axis.
pub(super) fn is_explorable(figure: &Figure) -> bool {
    !figure.panels.is_empty() && figure.panels.iter().all(has_curves)
}

fn has_curves(panel: &Panel) -> bool {
    let ascends = |points: &[(f64, f64)]| points.windows(2).all(|pair| pair[0].0 <= pair[1].0);
    let shown = |layer: &Layer| match layer {
        Layer::Line { points, .. } => ascends(points),
        Layer::Points { points, .. } => {
            points.len() <= MOST_MARKERS && points.iter().all(|it| it.x_interval.is_none() && it.y_interval.is_none())
        }
        Layer::MarkX { .. } | Layer::MarkY { .. } => true,
        _ => false,
    };
    let long = |layer: &Layer| matches!(layer, Layer::Line { points, .. } if points.len() >= FEWEST_POINTS);
    let numbered = [&panel.x, &panel.y].into_iter().all(|axis| axis.named_ticks.is_none());
    numbered && panel.layers.iter().all(shown) && panel.layers.iter().any(long)
}

impl Arrays {
    fn figure(&mut self, figure: &Figure) -> Value {
        let mut alike: Vec<(&Axis, usize)> = Vec::new();
        let panels: Vec<Value> = figure
            .panels
            .iter()
            .map(|panel| {
                let own = alike.iter().find(|(axis, _)| **axis == panel.x).map(|(_, link)| *link);
                let (value, link) = self.panel(panel, own);
                alike.push((&panel.x, link));
                value
            })
            .collect();
        json!({"panels": panels})
    }

    /// A panel and its link: panels of one figure with the same axis share it, and so do those that show the same curve.
    fn panel(&mut self, panel: &Panel, own: Option<usize>) -> (Value, usize) {
        let mut curves = Vec::new();
        let (mut marks, mut levels) = (Vec::new(), Vec::new());
        let mut pairs = Vec::new();
        let mut curve =
            |arrays: &mut Self, label: &str, points: &[(f64, f64)], stroke: Stroke, marker: Option<&str>| {
                let points = &thinned(points, panel);
                let x = arrays.place(abscissas(points.iter().map(|point| panel.x.factor * point.0).collect()));
                let y = arrays.place(ordinates(points.iter().map(|point| panel.y.factor * point.1), panel.y.scale));
                pairs.push((x, y));
                curves.push(json!({
                    "label": label, "x": x, "y": y, "colour": hexadecimal(stroke.colour), "dash": stroke.dash.pattern(),
                    "width": stroke.width, "marker": marker,
                }));
            };
        for layer in &panel.layers {
            match layer {
                Layer::Line { label, points, stroke } if !points.is_empty() => {
                    curve(self, label, points, *stroke, None);
                }
                Layer::Points { label, points, colour, marker } if !points.is_empty() => {
                    let mut points: Vec<_> = points.iter().map(|point| (point.x, point.y)).collect();
                    points.sort_by(|a, b| a.0.total_cmp(&b.0));
                    curve(self, label, &points, Stroke::new(*colour), Some(face(*marker)));
                }
                Layer::MarkX { at, label } => marks.push(json!({"at": at * panel.x.factor, "label": label})),
                Layer::MarkY { at, stroke, .. } => {
                    levels.push(json!({"at": at * panel.y.factor, "colour": hexadecimal(stroke.colour)}));
                }
                _ => {}
            }
        }
        let known = own.or_else(|| pairs.iter().find_map(|pair| self.links.get(pair).copied()));
        let link = known.unwrap_or_else(|| {
            self.next_link += 1;
            self.next_link
        });
        for pair in pairs {
            self.links.entry(pair).or_insert(link);
        }
        let value = json!({
            "title": panel.title, "height": panel.height_mm, "x": axis(&panel.x), "y": axis(&panel.y), "link": link,
            "curves": curves, "marks": marks, "levels": levels,
        });
        (value, link)
    }

    /// Where an array stands among all, new or known.
    fn place(&mut self, array: Value) -> usize {
        let next = self.values.len();
        let at = *self.known.entry(array.to_string()).or_insert(next);
        if at == next {
            self.values.push(array);
        }
        at
    }
}

fn axis(axis: &Axis) -> Value {
    let range = axis.range.map(|(low, high)| [low * axis.factor, high * axis.factor]);
    json!({"label": axis.title(), "log": axis.scale == Scale::Logarithmic, "range": range})
}

/// Whether a marker has a filled or an open face.
fn face(marker: Marker) -> &'static str {
    match marker {
        Marker::Ring | Marker::Cross | Marker::Below => "open",
        Marker::Disc | Marker::Dot | Marker::Square | Marker::Diamond => "filled",
    }
}

fn hexadecimal(colour: Colour) -> String {
    let (red, green, blue) = colour.rgb();
    format!("#{red:02x}{green:02x}{blue:02x}")
}

/// A long curve without the samples that a straight line between their neighbours gives as well.
fn thinned(points: &[(f64, f64)], panel: &Panel) -> Vec<(f64, f64)> {
    let mut kept = points.to_vec();
    if [&panel.x, &panel.y].into_iter().any(|axis| axis.scale != Scale::Linear) {
        return kept;
    }
    let (low, high) = extent(points.iter().map(|point| point.1));
    let missed = |part: &[(f64, f64)]| (part[1].1 - 0.5 * (part[0].1 + part[2].1)).abs();
    let close = |part: &[(f64, f64)]| part.len() < 3 || missed(part) <= LEFT_OUT * (high - low);
    if kept.len() > FEWEST_POINTS
        && kept.chunks(2).zip(kept.chunks(2).skip(1)).all(|(a, b)| close(&[a, &b[..1]].concat()))
    {
        let last = kept.len().is_multiple_of(2);
        let end = kept[kept.len() - 1];
        kept = kept.into_iter().step_by(2).collect();
        kept.extend(last.then_some(end));
    }
    kept
}

/// Start and step of an even array, 32 bits a number of any other.
fn abscissas(values: Vec<f64>) -> Value {
    if let [first, .., last] = values.as_slice() {
        let step = (last - first) / (values.len() - 1) as f64;
        let even = |(index, value): (usize, &f64)| (value - first - index as f64 * step).abs() <= 1e-3 * step;
        if step > 0.0 && values.iter().enumerate().all(even) {
            return json!({"from": first, "step": step, "n": values.len()});
        }
    }
    let bytes: Vec<u8> = values.iter().flat_map(|value| (*value as f32).to_le_bytes()).collect();
    json!({"f": STANDARD.encode(bytes)})
}

/// 16 bits a number between the smallest and the largest.
fn ordinates(values: impl Iterator<Item = f64>, scale: Scale) -> Value {
    let logarithmic = scale == Scale::Logarithmic;
    let scaled: Vec<f64> = values.map(|value| if logarithmic { value.log10() } else { value }).collect();
    let (low, high) = extent(scaled.iter().copied());
    let step = if high > low { (high - low) / f64::from(u16::MAX) } else { 1.0 };
    let bytes: Vec<u8> =
        scaled.iter().flat_map(|value| (((value - low) / step).round() as u16).to_le_bytes()).collect();
    json!({"low": low, "step": step, "log": logarithmic, "q": STANDARD.encode(bytes)})
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::{figure::Dash, page::Plate};

    fn panel(height: f64) -> Panel {
        let points = (0..100).map(|i| (f64::from(i) * 1e-6, height * (f64::from(i) * 0.3).sin())).collect();
        Panel::new(Axis::new("Time", "µs").times(1e6), Axis::new("Velocity", "mm/s").times(1e3)).line(
            "synthetic",
            points,
            Stroke::new(Colour::Blue).dash(Dash::Dashed),
        )
    }

    fn data(figures: &[Figure]) -> Option<Value> {
        let plates: Vec<Plate> = figures.iter().map(|figure| Plate::new("f", figure.clone())).collect();
        let drawn: Vec<Drawn<'_>> = plates
            .iter()
            .enumerate()
            .map(|(index, plate)| Drawn { plate, number: index + 1, svg: String::new() })
            .collect();
        of(&drawn).map(|text| serde_json::from_str(&text).unwrap())
    }

    #[test]
    fn a_curve_shown_twice_stands_in_the_page_once_and_links_its_figures() {
        let figures = [0.2, 0.2, 0.3].map(|height| Figure::new("f").panel(panel(height)));
        let data = data(&figures).unwrap();
        // One time axis, two different curves.
        assert_eq!(data["arrays"].as_array().unwrap().len(), 3);
        let link = |number: &str| data["figures"][number]["panels"][0]["link"].as_u64().unwrap();
        assert_eq!(link("1"), link("2"));
        assert_ne!(link("1"), link("3"));
    }

    #[test]
    fn sixteen_bits_give_a_curve_back_to_a_thousandth_of_a_percent_of_its_range() {
        let data = data(&[Figure::new("f").panel(panel(0.2))]).unwrap();
        let array = &data["arrays"][1];
        let bytes = STANDARD.decode(array["q"].as_str().unwrap()).unwrap();
        let (low, step) = (array["low"].as_f64().unwrap(), array["step"].as_f64().unwrap());
        assert_eq!(bytes.len(), 200);
        for (index, pair) in bytes.chunks(2).enumerate() {
            let value = low + step * f64::from(u16::from_le_bytes([pair[0], pair[1]]));
            assert!((value - 200.0 * (index as f64 * 0.3).sin()).abs() < 400.0 * 1e-5, "{index}: {value}");
        }
    }

    #[test]
    fn a_curve_finer_than_it_needs_to_be_loses_every_second_sample_and_a_spike_none() {
        let dense = |height: &dyn Fn(f64) -> f64| {
            let points: Vec<_> = (0..4001).map(|i| (f64::from(i) * 1e-7, height(f64::from(i)))).collect();
            let panel = Panel::new(Axis::new("Time", "µs").times(1e6), Axis::new("u", "m"));
            data(&[Figure::new("f").panel(panel.line("", points, Stroke::new(Colour::Blue)))]).unwrap()["arrays"][0]["n"].clone()
        };
        assert_eq!(dense(&|i| (0.01 * i).sin()), 2001);
        assert_eq!(dense(&|i| if i == 2001.0 { 1.0 } else { 0.0 }), 4001);
    }

    #[test]
    fn bars_maps_named_ticks_and_short_curves_stay_as_they_are_printed() {
        let named = Panel { y: Axis::new("Bead", "").named_ticks(vec![(0.0, "1".into())]), ..panel(0.2) };
        let short = Panel::new(Axis::new("α", "1"), Axis::new("x", "1")).line(
            "",
            vec![(0.0, 1.0), (1.0, 2.0)],
            Stroke::new(Colour::Blue),
        );
        for other in [named, short, panel(0.2).band("", vec![(0.0, 0.0, 1.0)], Colour::Blue)] {
            assert!(data(&[Figure::new("f").panel(panel(0.2)).panel(other)]).is_none());
        }
    }

    #[test]
    fn a_label_cannot_end_the_element_that_holds_the_numbers() {
        let mut panel = panel(0.2);
        panel.title = Some("</script><script>alert(1)".into());
        let plate = Plate::new("f", Figure::new("f").panel(panel));
        let text = of(&[Drawn { plate: &plate, number: 1, svg: String::new() }]).unwrap();
        assert!(!text.contains('<') && text.contains("alert(1)"));
    }
}
