//! The one embedded font: measured and drawn the same on every machine.
//!
//! A subset of DejaVu Sans (`fonts/`): Latin, Greek, superscript and subscript digits, the operators used in labels.

use std::sync::OnceLock;

use skrifa::{
    FontRef, MetadataProvider,
    instance::{LocationRef, Size},
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
    FONT.get_or_init(|| FontRef::new(FONT_BYTES).ok()).as_ref()
}

/// Width of `text` set in `size`, in the unit of `size`. The font has no kerning.
pub(super) fn text_width(text: &str, size: f64) -> f64 {
    let Some(font) = font() else { return 0.6 * size * text.chars().count() as f64 };
    let metrics = font.glyph_metrics(Size::new(1.0), LocationRef::default());
    let letters = text.chars().map(|letter| font.charmap().map(letter).unwrap_or_default());
    size * letters.map(|glyph| f64::from(metrics.advance_width(glyph).unwrap_or(0.0))).sum::<f64>()
}

/// Height of digits and capitals over the em.
pub(super) const CAP_HEIGHT: f64 = 0.729;

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_letter_used_in_labels_has_a_glyph() {
        let font = font().unwrap();
        for letter in "αβγδκµμωΔΩ±−×·≤≥°¹²³⁰⁴⁵⁶⁷⁸⁹⁻₀₁₂₃₄₅₆₇₈₉½⅓⅔→…–—’“”√ /()%".chars()
        {
            assert!(font.charmap().map(letter).is_some(), "{letter:?}");
        }
    }

    #[test]
    fn a_digit_is_as_wide_as_the_font_says() {
        // DejaVu Sans: every digit advances 1303 of 2048 units.
        assert!((text_width("0123456789", 10.0) - 10.0 * 10.0 * 1303.0 / 2048.0).abs() < 1e-3);
    }
}
