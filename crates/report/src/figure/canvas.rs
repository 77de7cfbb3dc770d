//! Points (1/72 inch) on a plotters backend.

use plotters_backend::{BackendColor, BackendCoord, BackendStyle, DrawingBackend, DrawingErrorKind, text_anchor::HPos};

use super::font::{CAP_HEIGHT, TextStyle, X_HEIGHT};

/// A colour with a stroke width in pixels.
#[derive(Clone, Copy)]
struct Pen {
    colour: (u8, u8, u8),
    width: u32,
}

impl BackendStyle for Pen {
    fn color(&self) -> BackendColor {
        BackendColor { alpha: 1.0, rgb: self.colour }
    }

    fn stroke_width(&self) -> u32 {
        self.width
    }
}

/// Which part of a text stands at its anchor.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Anchor {
    Left,
    Middle,
    Right,
}

/// What the backend says when it cannot draw.
pub(super) type DrawResult<B> = Result<(), DrawingErrorKind<<B as DrawingBackend>::ErrorType>>;

/// A backend addressed in points from the upper left corner.
pub(super) struct Canvas<'a, B: DrawingBackend> {
    backend: &'a mut B,
    scale: f64,
}

impl<'a, B: DrawingBackend> Canvas<'a, B> {
    pub fn new(backend: &'a mut B, scale: f64) -> Self {
        Self { backend, scale }
    }

    fn at(&self, (x, y): (f64, f64)) -> BackendCoord {
        ((x * self.scale).round() as i32, (y * self.scale).round() as i32)
    }

    fn pen(&self, colour: (u8, u8, u8), width: f64) -> Pen {
        Pen { colour, width: (width * self.scale).round().max(1.0) as u32 }
    }

    /// A curve, broken up by `dashes` (lengths of strokes and gaps in turn, pt; empty: unbroken).
    pub fn curve(&mut self, points: &[(f64, f64)], colour: (u8, u8, u8), width: f64, dashes: &[f64]) -> DrawResult<B> {
        let pen = self.pen(colour, width);
        let pieces = if dashes.is_empty() { vec![points.to_vec()] } else { dashed(points, dashes) };
        for piece in pieces {
            let mut path: Vec<BackendCoord> = piece.into_iter().map(|point| self.at(point)).collect();
            path.dedup();
            if path.len() > 1 {
                self.backend.draw_path(path, &pen)?;
            }
        }
        Ok(())
    }

    pub fn polygon(&mut self, corners: &[(f64, f64)], colour: (u8, u8, u8)) -> DrawResult<B> {
        let pen = self.pen(colour, 0.0);
        let corners: Vec<BackendCoord> = corners.iter().map(|corner| self.at(*corner)).collect();
        self.backend.fill_polygon(corners, &pen)
    }

    /// A filled rectangle between two opposite corners.
    pub fn rectangle(&mut self, from: (f64, f64), to: (f64, f64), colour: (u8, u8, u8)) -> DrawResult<B> {
        let pen = self.pen(colour, 0.0);
        let (from, to) = (self.at(from), self.at(to));
        let upper_left = (from.0.min(to.0), from.1.min(to.1));
        let lower_right = (from.0.max(to.0), from.1.max(to.1));
        if upper_left.0 == lower_right.0 || upper_left.1 == lower_right.1 {
            return Ok(());
        }
        self.backend.draw_rect(upper_left, lower_right, &pen, true)
    }

    pub fn disc(&mut self, centre: (f64, f64), radius: f64, colour: (u8, u8, u8)) -> DrawResult<B> {
        let pen = self.pen(colour, 0.0);
        let radius = (radius * self.scale).round().max(1.0) as u32;
        let centre = self.at(centre);
        self.backend.draw_circle(centre, radius, &pen, true)
    }

    /// A text whose digits are centred on the height of `position`.
    pub fn text(
        &mut self,
        text: &str,
        position: (f64, f64),
        size: f64,
        anchor: Anchor,
        colour: (u8, u8, u8),
    ) -> DrawResult<B> {
        let shift = 0.5 * (CAP_HEIGHT - X_HEIGHT) * size;
        self.draw_text(text, (position.0, position.1 + shift), size, anchor, colour, false)
    }

    /// A text running upwards, centred on `position`.
    pub(crate) fn text_upwards(
        &mut self,
        text: &str,
        position: (f64, f64),
        size: f64,
        colour: (u8, u8, u8),
    ) -> DrawResult<B> {
        self.draw_text(text, position, size, Anchor::Middle, colour, true)
    }

    fn draw_text(
        &mut self,
        text: &str,
        position: (f64, f64),
        size: f64,
        anchor: Anchor,
        colour: (u8, u8, u8),
        upwards: bool,
    ) -> DrawResult<B> {
        let horizontal = match anchor {
            Anchor::Left => HPos::Left,
            Anchor::Middle => HPos::Center,
            Anchor::Right => HPos::Right,
        };
        let style = TextStyle { size: size * self.scale, colour, horizontal, upwards };
        let position = self.at(position);
        self.backend.draw_text(text, &style, position)
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
