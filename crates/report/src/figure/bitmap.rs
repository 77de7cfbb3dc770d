//! PNG: the plotters bitmap backend at three times the resolution in both directions, averaged down.

use plotters_backend::{BackendColor, BackendCoord, BackendStyle, DrawingBackend, DrawingErrorKind};
use plotters_bitmap::BitMapBackend;

use super::{Figure, FigureError, canvas::Canvas, draw, layout};

const PIXELS_PER_POINT: u32 = 4;
const OVERSAMPLING: u32 = 3;

pub(super) fn render(figure: &Figure) -> Result<Vec<u8>, FigureError> {
    let refuse = |reason: String| FigureError::Drawing { figure: figure.title.clone(), reason };
    let sheet = layout::plan(figure)?;
    let pixels = |points: f64| (points * f64::from(PIXELS_PER_POINT)).ceil() as u32;
    let (width, height) = (pixels(sheet.width), pixels(sheet.height));
    let fine = (width * OVERSAMPLING, height * OVERSAMPLING);
    let mut buffer = vec![255_u8; fine.0 as usize * fine.1 as usize * 3];
    {
        let mut backend = RoundStrokes(BitMapBackend::with_buffer(&mut buffer, fine));
        let scale = f64::from(PIXELS_PER_POINT * OVERSAMPLING);
        draw::sheet(&sheet, &mut Canvas::new(&mut backend, scale))
            .and_then(|()| backend.present())
            .map_err(|error| refuse(error.to_string()))?;
    }
    encode(&averaged(&buffer, width, height), width, height).map_err(|error| refuse(error.to_string()))
}

/// Mean of each `OVERSAMPLING`² block.
fn averaged(fine: &[u8], width: u32, height: u32) -> Vec<u8> {
    let (width, height, side) = (width as usize, height as usize, OVERSAMPLING as usize);
    let row = width * side * 3;
    let mut coarse = Vec::with_capacity(width * height * 3);
    for y in 0..height {
        for x in 0..width {
            for channel in 0..3 {
                let mut sum = 0_u32;
                for j in 0..side {
                    for i in 0..side {
                        sum += u32::from(fine[(y * side + j) * row + (x * side + i) * 3 + channel]);
                    }
                }
                let count = OVERSAMPLING * OVERSAMPLING;
                coarse.push(((sum + count / 2) / count) as u8);
            }
        }
    }
    coarse
}

fn encode(pixels: &[u8], width: u32, height: u32) -> Result<Vec<u8>, png::EncodingError> {
    let mut bytes = Vec::new();
    let mut encoder = png::Encoder::new(&mut bytes, width, height);
    encoder.set_color(png::ColorType::Rgb);
    encoder.set_depth(png::BitDepth::Eight);
    let per_metre = (f64::from(PIXELS_PER_POINT) * 72.0 / 0.0254).round() as u32;
    encoder.set_pixel_dims(Some(png::PixelDimensions { xppu: per_metre, yppu: per_metre, unit: png::Unit::Meter }));
    let mut writer = encoder.write_header()?;
    writer.write_image_data(pixels)?;
    writer.finish()?;
    Ok(bytes)
}

/// The bitmap backend with strokes drawn segment by segment and rounded at the joints: its own polygon of a whole stroke leaves
/// holes where a dense oscillation overlaps itself.
struct RoundStrokes<'a>(BitMapBackend<'a>);

impl DrawingBackend for RoundStrokes<'_> {
    type ErrorType = <BitMapBackend<'static> as DrawingBackend>::ErrorType;

    fn get_size(&self) -> (u32, u32) {
        self.0.get_size()
    }

    fn ensure_prepared(&mut self) -> Result<(), DrawingErrorKind<Self::ErrorType>> {
        self.0.ensure_prepared()
    }

    fn present(&mut self) -> Result<(), DrawingErrorKind<Self::ErrorType>> {
        self.0.present()
    }

    fn draw_pixel(
        &mut self,
        point: BackendCoord,
        colour: BackendColor,
    ) -> Result<(), DrawingErrorKind<Self::ErrorType>> {
        self.0.draw_pixel(point, colour)
    }

    fn draw_rect<S: BackendStyle>(
        &mut self,
        upper_left: BackendCoord,
        lower_right: BackendCoord,
        style: &S,
        fill: bool,
    ) -> Result<(), DrawingErrorKind<Self::ErrorType>> {
        if !fill {
            return self.0.draw_rect(upper_left, lower_right, style, fill);
        }
        // Upper left pixels included, lower right ones not: neighbouring rectangles meet without seam or overlap.
        let (width, height) = self.get_size();
        for y in upper_left.1.max(0)..lower_right.1.min(height as i32) {
            for x in upper_left.0.max(0)..lower_right.0.min(width as i32) {
                self.0.draw_pixel((x, y), style.color())?;
            }
        }
        Ok(())
    }

    fn draw_path<S: BackendStyle, I: IntoIterator<Item = BackendCoord>>(
        &mut self,
        path: I,
        style: &S,
    ) -> Result<(), DrawingErrorKind<Self::ErrorType>> {
        let path: Vec<BackendCoord> = path.into_iter().collect();
        let radius = 0.5 * f64::from(style.stroke_width());
        let last = path.len().saturating_sub(2);
        for (index, pair) in path.windows(2).enumerate() {
            // Flat at the ends of the stroke, round where segments meet.
            self.segment(pair[0], pair[1], radius, (index > 0, index < last), style.color())?;
        }
        Ok(())
    }
}

impl RoundStrokes<'_> {
    /// Fill the pixels within `radius` of a segment, beyond its ends only where `round`.
    fn segment(
        &mut self,
        from: BackendCoord,
        to: BackendCoord,
        radius: f64,
        round: (bool, bool),
        colour: BackendColor,
    ) -> Result<(), DrawingErrorKind<<Self as DrawingBackend>::ErrorType>> {
        let (width, height) = self.get_size();
        let (a, b) = ((f64::from(from.0), f64::from(from.1)), (f64::from(to.0), f64::from(to.1)));
        let (dx, dy) = (b.0 - a.0, b.1 - a.1);
        let squared = (dx * dx + dy * dy).max(1e-12);
        let lowest = (a.1.min(b.1) - radius).floor().max(0.0) as i32;
        let highest = ((a.1.max(b.1) + radius).ceil() as i32).min(height as i32 - 1);
        for y in lowest..=highest {
            // Pixel y covers y … y + 1, its middle lies half a pixel below its upper edge.
            let middle_y = f64::from(y) + 0.5;
            // Only the part of the segment within `radius` of this row can reach it.
            let shares = if dy.abs() < 1e-12 {
                (0.0, 1.0)
            } else {
                let ends = ((middle_y - radius - a.1) / dy, (middle_y + radius - a.1) / dy);
                (ends.0.min(ends.1).clamp(0.0, 1.0), ends.0.max(ends.1).clamp(0.0, 1.0))
            };
            let reach = (a.0 + shares.0 * dx, a.0 + shares.1 * dx);
            let left = (reach.0.min(reach.1) - radius).floor().max(0.0) as i32;
            let right = ((reach.0.max(reach.1) + radius).ceil() as i32).min(width as i32 - 1);
            for x in left..=right {
                let middle_x = f64::from(x) + 0.5;
                let along = ((middle_x - a.0) * dx + (middle_y - a.1) * dy) / squared;
                if (along < 0.0 && !round.0) || (along > 1.0 && !round.1) {
                    continue;
                }
                let along = along.clamp(0.0, 1.0);
                if (middle_x - a.0 - along * dx).hypot(middle_y - a.1 - along * dy) <= radius {
                    self.0.draw_pixel((x, y), colour)?;
                }
            }
        }
        Ok(())
    }
}
