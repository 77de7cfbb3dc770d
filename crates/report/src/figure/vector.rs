//! SVG: a plotters backend at ten units a point, which merges neighbours of equal style as it draws.
//!
//! Coordinates are whole numbers, as every plotters backend has them: a tenth of a point is a fortieth of a millimetre. Neighbours of equal
//! style become one `<path>` with relative steps, and the font is named once, so that a page stays small.

use std::{convert::Infallible, fmt::Write};

use maud::html;
use plotters::{
    prelude::{DrawingBackend, IntoDrawingArea, WHITE},
    style::{
        FontTransform,
        text_anchor::{HPos, VPos},
    },
};
use plotters_backend::{BackendColor, BackendCoord, BackendStyle, BackendTextStyle, DrawingErrorKind};

use super::{
    FONT_STACK, Figure, FigureError,
    canvas::{Canvas, UNITS_PER_POINT},
    draw,
    font::{CAP_HEIGHT, text_width},
    layout,
};

pub(super) fn render(figure: &Figure) -> Result<String, FigureError> {
    let sheet = layout::plan(figure)?;
    let size = ((sheet.width * UNITS_PER_POINT).ceil() as u32, (sheet.height * UNITS_PER_POINT).ceil() as u32);
    let mut text = format!(
        "<svg xmlns=\"http://www.w3.org/2000/svg\" width=\"{:.1}pt\" height=\"{:.1}pt\" viewBox=\"0 0 {} {}\" role=\"img\" font-family=\"{FONT_STACK}\" font-size=\"{}\" stroke-linejoin=\"round\">\n<title>{}</title>\n",
        f64::from(size.0) / UNITS_PER_POINT,
        f64::from(size.1) / UNITS_PER_POINT,
        size.0,
        size.1,
        layout::TEXT * UNITS_PER_POINT,
        escape(&figure.title)
    );
    let area = Svg { size, text: &mut text, style: String::new(), outline: String::new() }.into_drawing_area();
    area.fill(&WHITE)
        .and_then(|()| draw::sheet(&sheet, &Canvas(area.clone())))
        .and_then(|()| area.present())
        .map_err(|error| FigureError::Drawing { figure: figure.title.clone(), reason: error.to_string() })?;
    drop(area);
    text.push_str("</svg>\n");
    Ok(text)
}

/// Width of the rim of a filled polygon, units.
const RIM: u32 = 2;

/// Text safe between tags and in attributes.
fn escape(text: &str) -> String {
    let printable: String = text.chars().map(|letter| if letter.is_control() { ' ' } else { letter }).collect();
    html! { (printable) }.into_string()
}

/// A drawing being written: what is finished, and the path that the next shape of the same style goes on.
pub(super) struct Svg<'a> {
    size: (u32, u32),
    text: &'a mut String,
    style: String,
    outline: String,
}

/// What drawing into memory gives.
type Drawn = Result<(), DrawingErrorKind<Infallible>>;

impl Svg<'_> {
    fn close(&mut self) {
        if !self.outline.is_empty() {
            let _ = writeln!(self.text, "<path {} d=\"{}\"/>", self.style, self.outline);
            self.outline.clear();
        }
    }

    /// Where a shape of this style is to be written.
    fn outline(&mut self, style: String) -> &mut String {
        if style != self.style {
            self.close();
            self.style = style;
        }
        &mut self.outline
    }
}

impl DrawingBackend for Svg<'_> {
    type ErrorType = Infallible;

    fn get_size(&self) -> (u32, u32) {
        self.size
    }

    fn ensure_prepared(&mut self) -> Drawn {
        Ok(())
    }

    fn present(&mut self) -> Drawn {
        self.close();
        Ok(())
    }

    fn draw_pixel(&mut self, (x, y): BackendCoord, colour: BackendColor) -> Drawn {
        let _ = write!(self.outline(fill(colour)), "M{x},{y}h1v1h-1z");
        Ok(())
    }

    fn draw_path<S: BackendStyle, I: IntoIterator<Item = BackendCoord>>(&mut self, path: I, style: &S) -> Drawn {
        let (stroke, width) = (colour(style.color()), style.stroke_width());
        let style = format!("fill=\"none\" stroke=\"{stroke}\" stroke-width=\"{width}\"");
        steps(path, self.outline(style));
        Ok(())
    }

    fn fill_polygon<S: BackendStyle, I: IntoIterator<Item = BackendCoord>>(&mut self, corners: I, style: &S) -> Drawn {
        let colour = colour(style.color());
        // A thin rim, so that no ground shines through between neighbours of other colours.
        let outline = self.outline(format!("fill=\"{colour}\" stroke=\"{colour}\" stroke-width=\"{RIM}\""));
        steps(corners, outline);
        outline.push('z');
        Ok(())
    }

    fn draw_rect<S: BackendStyle>(
        &mut self,
        (left, top): BackendCoord,
        (right, bottom): BackendCoord,
        style: &S,
        filled: bool,
    ) -> Drawn {
        if !filled {
            return self.draw_path([(left, top), (right, top), (right, bottom), (left, bottom), (left, top)], style);
        }
        if left == right || top == bottom {
            return Ok(());
        }
        let outline = self.outline(format!("{} shape-rendering=\"crispEdges\"", fill(style.color())));
        let (width, height) = (right - left, bottom - top);
        let _ = write!(outline, "M{left},{top}h{width}v{height}h-{width}z");
        Ok(())
    }

    fn draw_circle<S: BackendStyle>(&mut self, (x, y): BackendCoord, radius: u32, style: &S, _filled: bool) -> Drawn {
        let d = 2 * radius;
        let outline = self.outline(fill(style.color()));
        let _ =
            write!(outline, "M{},{y}a{radius},{radius} 0 1,1 {d},0a{radius},{radius} 0 1,1 -{d},0z", x - radius as i32);
        Ok(())
    }

    fn estimate_text_size<S: BackendTextStyle>(
        &self,
        text: &str,
        style: &S,
    ) -> Result<(u32, u32), DrawingErrorKind<Infallible>> {
        Ok((text_width(text, style.size()).round() as u32, style.size().round() as u32))
    }

    fn draw_text<S: BackendTextStyle>(&mut self, text: &str, style: &S, (x, y): BackendCoord) -> Drawn {
        self.close();
        let pos = style.anchor();
        let anchor = match pos.h_pos {
            HPos::Left => "start",
            HPos::Center => "middle",
            HPos::Right => "end",
        };
        let capitals_below = match pos.v_pos {
            VPos::Top => 1.0,
            VPos::Center => 0.5,
            VPos::Bottom => 0.0,
        };
        let baseline = y + (capitals_below * CAP_HEIGHT * style.size()).round() as i32;
        let turn = match style.transform() {
            FontTransform::Rotate270 => format!(" transform=\"rotate(270, {x}, {y})\""),
            _ => String::new(),
        };
        let (fill, text) = (fill(style.color()), escape(text));
        let _ =
            writeln!(self.text, "<text x=\"{x}\" y=\"{baseline}\" text-anchor=\"{anchor}\" {fill}{turn}>{text}</text>");
        Ok(())
    }
}

fn colour(colour: BackendColor) -> String {
    let (red, green, blue) = colour.rgb;
    format!("#{red:02X}{green:02X}{blue:02X}")
}

fn fill(of: BackendColor) -> String {
    format!("fill=\"{}\"", colour(of))
}

/// Points as path data with relative steps.
fn steps(points: impl IntoIterator<Item = BackendCoord>, data: &mut String) {
    let mut previous: Option<BackendCoord> = None;
    for (x, y) in points {
        let _ = match previous {
            None => write!(data, "M{x},{y}"),
            Some((last_x, last_y)) if last_y == y => write!(data, "h{}", x - last_x),
            Some((last_x, last_y)) if last_x == x => write!(data, "v{}", y - last_y),
            Some((last_x, last_y)) if y < last_y => write!(data, "l{}{}", x - last_x, y - last_y),
            Some((last_x, last_y)) => write!(data, "l{},{}", x - last_x, y - last_y),
        };
        previous = Some((x, y));
    }
}

#[cfg(test)]
mod tests {
    use plotters::style::{BLACK, ShapeStyle};

    use super::*;

    #[test]
    fn neighbours_of_one_style_become_one_path() {
        let mut text = String::new();
        let mut svg = Svg { size: (10, 10), text: &mut text, style: String::new(), outline: String::new() };
        let black = ShapeStyle::from(&BLACK).stroke_width(6);
        svg.draw_path([(1, 2), (4, 2), (4, 7), (3, 1)], &black).unwrap();
        svg.draw_path([(9, 9), (10, 10)], &black).unwrap();
        svg.draw_circle((5, 5), 2, &black, true).unwrap();
        svg.present().unwrap();
        assert_eq!(
            text,
            "<path fill=\"none\" stroke=\"#000000\" stroke-width=\"6\" d=\"M1,2h3v5l-1-6M9,9l1,1\"/>\n\
             <path fill=\"#000000\" d=\"M3,5a2,2 0 1,1 4,0a2,2 0 1,1 -4,0z\"/>\n"
        );
    }
}
