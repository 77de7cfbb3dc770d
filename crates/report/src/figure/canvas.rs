//! Shapes in points (1/72 inch) on a plotters drawing area whose unit is a tenth of a point.

use std::convert::Infallible;

use plotters::{
    coord::Shift,
    prelude::{
        Circle, Color, DrawingArea, DrawingAreaErrorKind, IntoFont, PathElement, Polygon, Rectangle, Text, TextStyle,
    },
    style::{
        FontTransform, RGBColor, ShapeStyle,
        text_anchor::{HPos, Pos, VPos},
    },
};

use super::{FONT_STACK, layout::TEXT, vector::Svg};

pub(super) const UNITS_PER_POINT: f64 = 10.0;

pub(super) type Ink = (u8, u8, u8);

pub(super) type Drawn = Result<(), DrawingAreaErrorKind<Infallible>>;

/// A sheet addressed in points from its upper left corner.
pub(super) struct Canvas<'a>(pub DrawingArea<Svg<'a>, Shift>);

pub(super) fn units(points: f64) -> i32 {
    (points * UNITS_PER_POINT).round() as i32
}

fn at((x, y): (f64, f64)) -> (i32, i32) {
    (units(x), units(y))
}

pub(super) fn filled((red, green, blue): Ink) -> ShapeStyle {
    ShapeStyle::from(RGBColor(red, green, blue)).filled()
}

pub(super) fn stroke((red, green, blue): Ink, width: f64) -> ShapeStyle {
    ShapeStyle::from(RGBColor(red, green, blue)).stroke_width(units(width).max(1) as u32)
}

/// All text has one size.
pub(super) fn letters((red, green, blue): Ink) -> TextStyle<'static> {
    let font = (FONT_STACK, TEXT * UNITS_PER_POINT).into_font();
    TextStyle { font, color: RGBColor(red, green, blue).to_backend_color(), pos: Pos::new(HPos::Left, VPos::Center) }
}

impl Canvas<'_> {
    /// A curve, broken up by `dashes` (lengths of strokes and gaps in turn, pt; empty: unbroken).
    pub(crate) fn curve(&self, points: &[(f64, f64)], ink: Ink, width: f64, dashes: &[f64]) -> Drawn {
        let pieces = if dashes.is_empty() { vec![points.to_vec()] } else { dashed(points, dashes) };
        for piece in pieces {
            let mut path: Vec<_> = piece.into_iter().map(at).collect();
            path.dedup();
            if path.len() > 1 {
                self.0.draw(&PathElement::new(path, stroke(ink, width)))?;
            }
        }
        Ok(())
    }

    pub(crate) fn polygon(&self, corners: &[(f64, f64)], ink: Ink) -> Drawn {
        self.0.draw(&Polygon::new(corners.iter().copied().map(at).collect::<Vec<_>>(), filled(ink)))
    }

    /// A filled rectangle between two opposite corners.
    pub(crate) fn rectangle(&self, from: (f64, f64), to: (f64, f64), ink: Ink) -> Drawn {
        self.0.draw(&Rectangle::new([at(from), at(to)], filled(ink)))
    }

    pub(crate) fn disc(&self, centre: (f64, f64), radius: f64, ink: Ink) -> Drawn {
        self.0.draw(&Circle::new(at(centre), units(radius).max(1), filled(ink)))
    }

    /// A text whose capitals are centred on the height of `position`.
    pub(crate) fn text(&self, text: &str, position: (f64, f64), side: HPos, ink: Ink) -> Drawn {
        self.0.draw(&Text::new(text, at(position), letters(ink).pos(Pos::new(side, VPos::Center))))
    }

    /// A text running upwards, centred on `position`.
    pub(crate) fn text_upwards(&self, text: &str, position: (f64, f64), ink: Ink) -> Drawn {
        let style = letters(ink).transform(FontTransform::Rotate270).pos(Pos::new(HPos::Center, VPos::Center));
        self.0.draw(&Text::new(text, at(position), style))
    }
}

/// The strokes of a dashed curve; the pattern runs on across corners.
fn dashed(points: &[(f64, f64)], dashes: &[f64]) -> Vec<Vec<(f64, f64)>> {
    let mut pieces = Vec::new();
    let mut phase = 0;
    let mut left = dashes[0];
    let mut piece: Vec<(f64, f64)> = points.first().copied().into_iter().collect();
    for pair in points.windows(2) {
        let (mut from, to) = (pair[0], pair[1]);
        let mut length = (to.0 - from.0).hypot(to.1 - from.1);
        while length > left {
            let share = left / length;
            from = (from.0 + share * (to.0 - from.0), from.1 + share * (to.1 - from.1));
            length -= left;
            if phase % 2 == 0 {
                piece.push(from);
                pieces.push(std::mem::take(&mut piece));
            } else {
                piece = vec![from];
            }
            phase = (phase + 1) % dashes.len();
            left = dashes[phase];
        }
        left -= length;
        if phase % 2 == 0 {
            piece.push(to);
        }
    }
    if piece.len() > 1 {
        pieces.push(piece);
    }
    pieces
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn dashes_of_a_straight_line_have_the_lengths_asked_for() {
        let pieces = dashed(&[(0.0, 0.0), (7.0, 0.0), (20.0, 0.0)], &[4.0, 2.0]);
        let ends: Vec<_> = pieces.iter().map(|piece| (piece[0].0, piece[piece.len() - 1].0)).collect();
        assert_eq!(ends, [(0.0, 4.0), (6.0, 10.0), (12.0, 16.0), (18.0, 20.0)]);
    }
}
