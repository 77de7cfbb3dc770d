//! PNG: a plotters backend on the rasteriser of tiny-skia, three units a pixel.

use std::convert::Infallible;

use plotters_backend::{
    BackendColor, BackendCoord, BackendStyle, BackendTextStyle, DrawingBackend, DrawingErrorKind, FontTransform,
    text_anchor::HPos,
};
use tiny_skia::{Color, FillRule, LineJoin, Paint, Path, PathBuilder, Pixmap, Rect, Stroke, Transform};

use super::{
    Figure, FigureError,
    canvas::Canvas,
    draw,
    font::{TextStyle, text_width},
    layout,
};

const PIXELS_PER_POINT: u32 = 4;
/// Coordinates of a backend are whole numbers: thirds of a pixel keep a curve smooth.
const UNITS_PER_PIXEL: u32 = 3;
const PIXEL: f32 = 1.0 / UNITS_PER_PIXEL as f32;

pub(super) fn render(figure: &Figure) -> Result<Vec<u8>, FigureError> {
    let refuse = |reason: String| FigureError::Drawing { figure: figure.title.clone(), reason };
    let sheet = layout::plan(figure)?;
    let pixels = |points: f64| (points * f64::from(PIXELS_PER_POINT)).ceil() as u32;
    let (width, height) = (pixels(sheet.width), pixels(sheet.height));
    let blank = Pixmap::new(width, height).ok_or_else(|| refuse(format!("no sheet of {width} by {height} pixels")))?;
    let mut bitmap = Bitmap(blank);
    bitmap.0.fill(Color::WHITE);
    let scale = f64::from(PIXELS_PER_POINT * UNITS_PER_PIXEL);
    draw::sheet(&sheet, &mut Canvas::new(&mut bitmap, scale)).map_err(|error| refuse(error.to_string()))?;
    encode(bitmap.0).map_err(|error| refuse(error.to_string()))
}

fn encode(pixels: Pixmap) -> Result<Vec<u8>, png::EncodingError> {
    let mut bytes = Vec::new();
    let mut encoder = png::Encoder::new(&mut bytes, pixels.width(), pixels.height());
    encoder.set_color(png::ColorType::Rgb);
    encoder.set_depth(png::BitDepth::Eight);
    encoder.set_compression(png::Compression::Fast);
    let per_metre = (f64::from(PIXELS_PER_POINT) * 72.0 / 0.0254).round() as u32;
    encoder.set_pixel_dims(Some(png::PixelDimensions { xppu: per_metre, yppu: per_metre, unit: png::Unit::Meter }));
    let mut writer = encoder.write_header()?;
    // Nothing shows through a white sheet: the pixels move together where they lie, the next one over the fourth number of each.
    let mut opaque = pixels.take();
    let count = opaque.len() / 4;
    for pixel in 0..count {
        opaque.copy_within(4 * pixel..4 * pixel + 4, 3 * pixel);
    }
    opaque.truncate(3 * count);
    writer.write_image_data(&opaque)?;
    writer.finish()?;
    Ok(bytes)
}

/// What drawing into memory gives.
type Drawn = Result<(), DrawingErrorKind<Infallible>>;

struct Bitmap(Pixmap);

fn paint(colour: BackendColor, smooth: bool) -> Paint<'static> {
    let (red, green, blue) = colour.rgb;
    let mut paint = Paint { anti_alias: smooth, ..Paint::default() };
    paint.set_color_rgba8(red, green, blue, 255);
    paint
}

/// The path through some points, where there are enough of them.
fn path(points: impl IntoIterator<Item = BackendCoord>, closed: bool) -> Option<Path> {
    let mut builder = PathBuilder::new();
    for (x, y) in points {
        match builder.is_empty() {
            true => builder.move_to(x as f32, y as f32),
            false => builder.line_to(x as f32, y as f32),
        }
    }
    if closed {
        builder.close();
    }
    builder.finish()
}

impl Bitmap {
    fn fill(&mut self, path: Option<Path>, colour: BackendColor, smooth: bool) {
        if let Some(path) = path {
            let to_pixels = Transform::from_scale(PIXEL, PIXEL);
            self.0.fill_path(&path, &paint(colour, smooth), FillRule::Winding, to_pixels, None);
        }
    }

    /// Lay a colour over a pixel.
    fn blend(&mut self, (x, y): BackendCoord, colour: BackendColor) {
        let (width, height) = (self.0.width() as i32, self.0.height() as i32);
        if (0..width).contains(&x) && (0..height).contains(&y) {
            let at = 4 * (y * width + x) as usize;
            let (red, green, blue) = colour.rgb;
            for (under, over) in self.0.data_mut()[at..at + 3].iter_mut().zip([red, green, blue]) {
                let mixed = f64::from(*under) + colour.alpha * (f64::from(over) - f64::from(*under));
                *under = mixed.round() as u8;
            }
        }
    }
}

impl DrawingBackend for Bitmap {
    type ErrorType = Infallible;

    fn get_size(&self) -> (u32, u32) {
        (self.0.width() * UNITS_PER_PIXEL, self.0.height() * UNITS_PER_PIXEL)
    }

    fn ensure_prepared(&mut self) -> Drawn {
        Ok(())
    }

    fn present(&mut self) -> Drawn {
        Ok(())
    }

    fn draw_pixel(&mut self, (x, y): BackendCoord, colour: BackendColor) -> Drawn {
        self.fill(path([(x, y), (x + 1, y), (x + 1, y + 1), (x, y + 1)], true), colour, true);
        Ok(())
    }

    fn draw_path<S: BackendStyle, I: IntoIterator<Item = BackendCoord>>(&mut self, points: I, style: &S) -> Drawn {
        if let Some(path) = path(points, false) {
            let stroke = Stroke { width: style.stroke_width() as f32, line_join: LineJoin::Round, ..Stroke::default() };
            let to_pixels = Transform::from_scale(PIXEL, PIXEL);
            self.0.stroke_path(&path, &paint(style.color(), true), &stroke, to_pixels, None);
        }
        Ok(())
    }

    fn fill_polygon<S: BackendStyle, I: IntoIterator<Item = BackendCoord>>(&mut self, corners: I, style: &S) -> Drawn {
        let path = path(corners, true);
        // First every pixel whose middle lies within, then the smooth edge over it: no background shines through between neighbours.
        self.fill(path.clone(), style.color(), false);
        self.fill(path, style.color(), true);
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
        // On whole pixels: neighbours meet without seam or overlap.
        let edge = |at: i32| (at as f32 * PIXEL).round();
        if let Some(rectangle) = Rect::from_ltrb(edge(left), edge(top), edge(right), edge(bottom)) {
            self.0.fill_rect(rectangle, &paint(style.color(), false), Transform::identity(), None);
        }
        Ok(())
    }

    fn draw_circle<S: BackendStyle>(&mut self, (x, y): BackendCoord, radius: u32, style: &S, _filled: bool) -> Drawn {
        self.fill(PathBuilder::from_circle(x as f32, y as f32, radius as f32), style.color(), true);
        Ok(())
    }

    /// Letters are drawn on whole pixels, in the shades of the font's own rasteriser.
    fn draw_text<S: BackendTextStyle>(&mut self, text: &str, style: &S, (x, y): BackendCoord) -> Drawn {
        let anchor = style.anchor();
        let (size, colour) = (style.size() * f64::from(PIXEL), style.color().rgb);
        let upwards = matches!(style.transform(), FontTransform::Rotate270);
        let coarse = TextStyle { size, colour, horizontal: anchor.h_pos, upwards };
        let width = text_width(text, size);
        let left = match coarse.horizontal {
            HPos::Left => 0.0,
            HPos::Center => -0.5 * width,
            HPos::Right => -width,
        };
        let to_pixel = |at: i32| f64::from(at) * f64::from(PIXEL);
        let corner = (left.round() as i32, (-0.5 * size).round() as i32);
        let (x, y) = (to_pixel(x).round() as i32, to_pixel(y).round() as i32);
        let Ok(drawn) = coarse.draw(text, corner, |along, down, colour| {
            self.blend(if upwards { (x + down, y - along) } else { (x + along, y + down) }, colour);
            Ok::<(), DrawingErrorKind<Infallible>>(())
        });
        drawn
    }
}
