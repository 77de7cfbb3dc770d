//! SVG: the plotters backend at ten units a point, its output packed.
//!
//! The backend writes one verbose element a primitive, on integer coordinates. Packing merges neighbours of equal style into
//! one `<path>` with relative coordinates and names the font once: a tenth of a point is a fortieth of a millimetre, and the
//! page stays small.

use std::fmt::Write as _;

use plotters_backend::DrawingBackend;
use plotters_svg::SVGBackend;

use super::{FONT_STACK, Figure, FigureError, canvas::Canvas, draw, layout};

const UNITS_PER_POINT: f64 = 10.0;

pub(super) fn render(figure: &Figure) -> Result<String, FigureError> {
    let sheet = layout::plan(figure)?;
    let size = ((sheet.width * UNITS_PER_POINT).ceil() as u32, (sheet.height * UNITS_PER_POINT).ceil() as u32);
    let mut raw = String::new();
    let mut backend = SVGBackend::with_string(&mut raw, size);
    let mut canvas = Canvas::new(&mut backend, UNITS_PER_POINT);
    canvas
        .rectangle((0.0, 0.0), (sheet.width, sheet.height), (255, 255, 255))
        .and_then(|()| draw::sheet(&sheet, &mut canvas))
        .and_then(|()| backend.present())
        .map_err(|error| FigureError::Drawing { figure: figure.title.clone(), reason: error.to_string() })?;
    drop(backend);

    let mut svg = format!(
        "<svg xmlns=\"http://www.w3.org/2000/svg\" width=\"{:.1}pt\" height=\"{:.1}pt\" viewBox=\"0 0 {} {}\" role=\"img\" font-family=\"{FONT_STACK}\" font-size=\"{}\" stroke-linejoin=\"round\">\n<title>{}</title>\n",
        f64::from(size.0) / UNITS_PER_POINT,
        f64::from(size.1) / UNITS_PER_POINT,
        size.0,
        size.1,
        layout::TEXT * UNITS_PER_POINT,
        escape(&figure.title)
    );
    pack(&raw, &mut svg);
    Ok(svg)
}

/// Text safe between tags and in attributes.
fn escape(text: &str) -> String {
    let mut escaped = String::with_capacity(text.len());
    for letter in text.chars() {
        match letter {
            '<' => escaped.push_str("&lt;"),
            '>' => escaped.push_str("&gt;"),
            '&' => escaped.push_str("&amp;"),
            '"' => escaped.push_str("&quot;"),
            letter if letter.is_control() => escaped.push(' '),
            letter => escaped.push(letter),
        }
    }
    escaped
}

/// Rewrite the backend's elements (one a line) as few short ones, in the same order.
fn pack(raw: &str, svg: &mut String) {
    let mut open: Option<(String, String)> = None;
    let mut lines = raw.lines().skip(1);
    while let Some(line) = lines.next() {
        let shape = shape_of(line);
        if let (Some((style, outline)), Some((open_style, open_outline))) = (&shape, &mut open)
            && style == open_style
        {
            open_outline.push_str(outline);
            continue;
        }
        if let Some((style, outline)) = open.take() {
            let _ = writeln!(svg, "<path {style} d=\"{outline}\"/>");
        }
        open = shape;
        if open.is_some() {
            continue;
        }
        if line.starts_with("<text ") {
            let content = lines.next().unwrap_or_default();
            let head = ["x", "y", "dy", "text-anchor", "fill", "transform"]
                .iter()
                .filter_map(|name| attribute(line, name).map(|value| (name, value)))
                .fold(String::from("<text"), |mut head, (name, value)| {
                    let _ = write!(head, " {name}=\"{value}\"");
                    head
                });
            let _ = writeln!(svg, "{head}>{content}</text>");
            lines.next();
        } else {
            svg.push_str(line);
            svg.push('\n');
        }
    }
}

/// Style and path data of a polyline, polygon, rectangle or disc; `None` for anything else.
fn shape_of(line: &str) -> Option<(String, String)> {
    let number = |name: &str| attribute(line, name)?.parse::<i64>().ok();
    let fill = attribute(line, "fill");
    let filled = || fill.map(|fill| format!("fill=\"{fill}\""));
    if line.starts_with("<polyline ") {
        let (stroke, width) = (attribute(line, "stroke")?, attribute(line, "stroke-width")?);
        let style = format!("fill=\"none\" stroke=\"{stroke}\" stroke-width=\"{width}\"");
        return Some((style, path(attribute(line, "points")?, false)?));
    }
    if line.starts_with("<polygon ") {
        return Some((filled()?, path(attribute(line, "points")?, true)?));
    }
    if line.starts_with("<rect ") {
        let (x, y, width, height) = (number("x")?, number("y")?, number("width")?, number("height")?);
        return Some((
            format!("{} shape-rendering=\"crispEdges\"", filled()?),
            format!("M{x},{y}h{width}v{height}h-{width}z"),
        ));
    }
    if line.starts_with("<circle ") {
        let (x, y, r) = (number("cx")?, number("cy")?, number("r")?);
        let d = 2 * r;
        return Some((filled()?, format!("M{},{y}a{r},{r} 0 1,1 {d},0a{r},{r} 0 1,1 -{d},0z", x - r)));
    }
    None
}

/// Absolute points as path data with relative steps.
fn path(points: &str, closed: bool) -> Option<String> {
    let mut previous: Option<(i64, i64)> = None;
    let mut data = String::new();
    for point in points.split_whitespace() {
        let (x, y) = point.split_once(',')?;
        let (x, y): (i64, i64) = (x.parse().ok()?, y.parse().ok()?);
        let _ = match previous {
            None => write!(data, "M{x},{y}"),
            Some((_, last_y)) if last_y == y => write!(data, "h{}", x - previous.map_or(0, |last| last.0)),
            Some((last_x, _)) if last_x == x => write!(data, "v{}", y - previous.map_or(0, |last| last.1)),
            Some((last_x, last_y)) if y < last_y => write!(data, "l{}{}", x - last_x, y - last_y),
            Some((last_x, last_y)) => write!(data, "l{},{}", x - last_x, y - last_y),
        };
        previous = Some((x, y));
    }
    if closed {
        data.push('z');
    }
    Some(data)
}

/// Value of an attribute of the element on `line`, still escaped.
fn attribute<'a>(line: &'a str, name: &str) -> Option<&'a str> {
    let key = format!(" {name}=\"");
    let from = line.find(&key)? + key.len();
    let length = line[from..].find('"')?;
    Some(&line[from..from + length])
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn neighbours_of_one_style_become_one_path() {
        let raw = "<svg>\n\
            <polyline fill=\"none\" opacity=\"1\" stroke=\"#000000\" stroke-width=\"6\" points=\"1,2 4,2 4,7 3,1 \"/>\n\
            <polyline fill=\"none\" opacity=\"1\" stroke=\"#000000\" stroke-width=\"6\" points=\"9,9 10,10 \"/>\n\
            <circle cx=\"5\" cy=\"5\" r=\"2\" opacity=\"1\" fill=\"#0072B2\" stroke=\"none\" stroke-width=\"1\"/>\n</svg>\n";
        let mut packed = String::new();
        pack(raw, &mut packed);
        assert_eq!(
            packed,
            "<path fill=\"none\" stroke=\"#000000\" stroke-width=\"6\" d=\"M1,2h3v5l-1-6M9,9l1,1\"/>\n\
             <path fill=\"#0072B2\" d=\"M3,5a2,2 0 1,1 4,0a2,2 0 1,1 -4,0z\"/>\n</svg>\n"
        );
    }
}
