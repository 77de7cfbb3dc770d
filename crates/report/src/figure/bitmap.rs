//! PNG: the SVG of a figure, rendered by resvg.

use std::sync::{Arc, OnceLock};

use resvg::{
    tiny_skia::{Pixmap, Transform},
    usvg::{Options, Tree, fontdb::Database},
};

use super::font::embedded_font;

const PIXELS_PER_POINT: f32 = 4.0;
/// What usvg makes of a point.
const CSS_PIXELS_PER_POINT: f32 = 96.0 / 72.0;

/// An opaque SVG at four pixels a point.
pub(super) fn render(svg: &str) -> Result<Vec<u8>, String> {
    static FONTS: OnceLock<Arc<Database>> = OnceLock::new();
    let fonts = FONTS.get_or_init(|| {
        let mut fonts = Database::new();
        fonts.load_font_data(embedded_font().to_vec());
        Arc::new(fonts)
    });
    let tree = Tree::from_str(svg, &Options { fontdb: fonts.clone(), ..Options::default() })
        .map_err(|error| error.to_string())?;
    let scale = PIXELS_PER_POINT / CSS_PIXELS_PER_POINT;
    let pixels = |length: f32| (length * scale).ceil() as u32;
    let (width, height) = (pixels(tree.size().width()), pixels(tree.size().height()));
    let mut sheet = Pixmap::new(width, height).ok_or_else(|| format!("no sheet of {width} by {height} pixels"))?;
    sheet.fill(resvg::tiny_skia::Color::WHITE);
    resvg::render(&tree, Transform::from_scale(scale, scale), &mut sheet.as_mut());
    encode(&sheet).map_err(|error| error.to_string())
}

fn encode(sheet: &Pixmap) -> Result<Vec<u8>, png::EncodingError> {
    let mut bytes = Vec::new();
    let mut encoder = png::Encoder::new(&mut bytes, sheet.width(), sheet.height());
    encoder.set_color(png::ColorType::Rgb);
    encoder.set_depth(png::BitDepth::Eight);
    encoder.set_compression(png::Compression::Fast);
    let per_metre = (f64::from(PIXELS_PER_POINT) * 72.0 / 0.0254).round() as u32;
    encoder.set_pixel_dims(Some(png::PixelDimensions { xppu: per_metre, yppu: per_metre, unit: png::Unit::Meter }));
    let mut writer = encoder.write_header()?;
    // Nothing shows through a white sheet.
    let opaque: Vec<u8> = sheet.data().chunks_exact(4).flat_map(|pixel| &pixel[..3]).copied().collect();
    writer.write_image_data(&opaque)?;
    writer.finish()?;
    Ok(bytes)
}
