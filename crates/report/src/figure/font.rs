//! The one embedded font: measured and drawn the same on every machine.
//!
//! A subset of DejaVu Sans (`fonts/`): Latin, Greek, superscript and subscript digits, the operators used in labels.

use std::{convert::Infallible, sync::OnceLock};

use ab_glyph::{Font, FontRef, ScaleFont, point};
use plotters_backend::{
    BackendColor, BackendCoord, BackendTextStyle, FontFamily, FontTransform,
    text_anchor::{HPos, Pos, VPos},
};

/// CSS `font-family` of every text in an SVG: the embedded family where the page brings it, else one of equal widths.
pub const FONT_STACK: &str = "'DejaVu Sans',Verdana,sans-serif";

const FONT_BYTES: &[u8] = include_bytes!("../../fonts/DejaVuSans-subset.ttf");

/// The embedded TrueType font, for pages that bring it along.
#[must_use]
pub fn embedded_font() -> &'static [u8] {
    FONT_BYTES
}

fn font() -> Option<&'static FontRef<'static>> {
    static FONT: OnceLock<Option<FontRef<'static>>> = OnceLock::new();
    FONT.get_or_init(|| FontRef::try_from_slice(FONT_BYTES).ok()).as_ref()
}

/// `ab_glyph` scales by ascent − descent instead of the em; this is their ratio times `size`.
fn height_for(font: &FontRef<'_>, size: f64) -> f32 {
    let em = font.units_per_em().unwrap_or(2048.0);
    size as f32 * font.height_unscaled() / em
}

/// Width of `text` set in `size`, in the unit of `size`.
pub(super) fn text_width(text: &str, size: f64) -> f64 {
    let Some(font) = font() else { return 0.6 * size * text.chars().count() as f64 };
    let scaled = font.as_scaled(height_for(font, size));
    let mut previous = None;
    let mut width = 0.0;
    for letter in text.chars() {
        let glyph = font.glyph_id(letter);
        width += previous.map_or(0.0, |previous| scaled.kern(previous, glyph)) + scaled.h_advance(glyph);
        previous = Some(glyph);
    }
    f64::from(width)
}

/// Height of the lower-case x over the em: SVG's `0.5ex` centres on half of it.
pub(super) const X_HEIGHT: f64 = 0.547;
/// Height of digits and capitals over the em.
pub(super) const CAP_HEIGHT: f64 = 0.729;

/// A text as a plotters backend wants it; `size` in the backend's pixels.
pub(super) struct TextStyle {
    pub size: f64,
    pub colour: (u8, u8, u8),
    pub horizontal: HPos,
    /// Rotated by 90° counter-clockwise.
    pub upwards: bool,
}

impl BackendTextStyle for TextStyle {
    type FontError = Infallible;

    fn color(&self) -> BackendColor {
        BackendColor { alpha: 1.0, rgb: self.colour }
    }

    fn size(&self) -> f64 {
        self.size
    }

    fn transform(&self) -> FontTransform {
        if self.upwards { FontTransform::Rotate270 } else { FontTransform::None }
    }

    fn anchor(&self) -> Pos {
        Pos::new(
            match self.horizontal {
                HPos::Left => HPos::Left,
                HPos::Center => HPos::Center,
                HPos::Right => HPos::Right,
            },
            VPos::Center,
        )
    }

    fn family(&self) -> FontFamily<'_> {
        FontFamily::Name(FONT_STACK)
    }

    fn layout_box(&self, text: &str) -> Result<((i32, i32), (i32, i32)), Self::FontError> {
        Ok(((0, 0), (text_width(text, self.size).round() as i32, self.size.round() as i32)))
    }

    fn draw<E, DrawFunc: FnMut(i32, i32, BackendColor) -> Result<(), E>>(
        &self,
        text: &str,
        (left, top): BackendCoord,
        mut draw: DrawFunc,
    ) -> Result<Result<(), E>, Self::FontError> {
        let Some(font) = font() else { return Ok(Ok(())) };
        let height = height_for(font, self.size);
        let scaled = font.as_scaled(height);
        // Baseline half an ex below the middle of the layout box, as the SVG backend has it.
        let baseline = (self.size / 2.0 + 0.5 * X_HEIGHT * self.size) as f32;
        let mut pen = 0.0;
        let mut previous = None;
        for letter in text.chars() {
            let id = font.glyph_id(letter);
            pen += previous.map_or(0.0, |previous| scaled.kern(previous, id));
            previous = Some(id);
            let glyph = id.with_scale_and_position(height, point(pen, baseline));
            pen += scaled.h_advance(id);
            let Some(outline) = font.outline_glyph(glyph) else { continue };
            let bounds = outline.px_bounds();
            let mut covered = Vec::new();
            outline.draw(|x, y, coverage| covered.push((x, y, coverage)));
            for (x, y, coverage) in covered {
                let (x, y) = (bounds.min.x as i32 + x as i32, bounds.min.y as i32 + y as i32);
                let colour = BackendColor { alpha: f64::from(coverage.clamp(0.0, 1.0)), rgb: self.colour };
                if coverage > 0.0
                    && let Err(error) = draw(left + x, top + y, colour)
                {
                    return Ok(Err(error));
                }
            }
        }
        Ok(Ok(()))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_letter_used_in_labels_has_a_glyph() {
        let font = font().unwrap();
        for letter in "αβγδκµμωΔΩ±−×·≤≥°¹²³⁰⁴⁵⁶⁷⁸⁹⁻₀₁₂₃₄₅₆₇₈₉½⅓⅔→…–—’“”√ /()%".chars()
        {
            assert_ne!(font.glyph_id(letter).0, 0, "{letter:?}");
        }
    }

    #[test]
    fn a_digit_is_as_wide_as_the_font_says() {
        // DejaVu Sans: every digit advances 1303 of 2048 units.
        assert!((text_width("0123456789", 10.0) - 10.0 * 10.0 * 1303.0 / 2048.0).abs() < 1e-3);
    }
}
