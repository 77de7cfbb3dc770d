//! The von Mises stress of the whole chain in motion: one SVG that any browser plays.
//!
//! Every frame is a picture of the section (mirrored at the axis, undeformed: displacements are a thousandth of a pixel) in viridis on one
//! logarithmic scale, 1 MPa to 10 GPa, so that frames and runs can be compared. The pictures are PNGs of 256 colours within the SVG, its
//! axes, bar and clock are drawn.

use std::fmt::Write;

use base64::{Engine, engine::general_purpose::STANDARD};

use super::figure::{FONT_STACK, viridis};
use granchain_model::{
    fea::{element::interpolate, mesh::Shape},
    response::{CellKind, Field},
};

/// Most frames of an animation: a few megabytes, half a minute of watching.
pub const MOST_FRAMES: usize = 300;

/// Pixels along the chain.
const WIDTH: usize = 1100;
/// Ends of the scale as powers of ten of 1 Pa.
const DECADES: (f64, f64) = (6.0, 10.0);
/// Time a frame is shown, s.
const FRAME_TIME: f64 = 0.12;

/// Which nodes of which body a pixel shows.
#[derive(Debug, Clone)]
struct Sample {
    body: usize,
    nodes: [u32; 8],
    weights: [f32; 8],
}

/// From nodes to pixels; made once for all frames.
#[derive(Debug, Clone)]
pub struct Raster {
    /// Ends of the chain along z, m.
    ends: (f64, f64),
    /// Largest r, m.
    radius: f64,
    width: usize,
    /// Rows of pixels from the axis outwards.
    rows: usize,
    samples: Vec<Option<Sample>>,
}

impl Raster {
    /// For the bodies of a field.
    #[must_use]
    pub fn new(field: &Field) -> Self {
        let places =
            || field.bodies.iter().flat_map(|body| body.mesh.points.iter().map(|[r, z]| [*r, z + body.offset]));
        let low = places().map(|place| place[1]).fold(f64::INFINITY, f64::min);
        let high = places().map(|place| place[1]).fold(f64::NEG_INFINITY, f64::max);
        let radius = places().map(|place| place[0]).fold(0.0, f64::max);
        let pixel = (high - low) / WIDTH as f64;
        let rows = (radius / pixel).ceil() as usize;
        let mut raster = Self { ends: (low, high), radius, width: WIDTH, rows, samples: vec![None; WIDTH * rows] };
        for (index, body) in field.bodies.iter().enumerate() {
            let mut first = 0;
            for &kind in &body.mesh.kinds {
                let nodes = &body.mesh.connectivity[first..first + kind.nodes()];
                first += kind.nodes();
                raster.paint(index, body.offset, kind, nodes, &body.mesh.points, pixel);
            }
        }
        raster
    }

    /// Give one element's pixels their nodes: it is sampled twice as finely as the pixels.
    fn paint(&mut self, body: usize, offset: f64, kind: CellKind, nodes: &[u32], points: &[[f64; 2]], pixel: f64) {
        let place = |k: usize| points[nodes[k] as usize];
        let reach = |axis: usize| {
            let values = || (0..nodes.len()).map(|k| place(k)[axis]);
            values().fold(f64::NEG_INFINITY, f64::max) - values().fold(f64::INFINITY, f64::min)
        };
        let steps = (2.0 * reach(0).max(reach(1)) / pixel).ceil() as usize + 1;
        let at = |i: usize| (i as f64 + 0.5) / steps as f64;
        for (i, j) in (0..steps).flat_map(|i| (0..steps).map(move |j| (i, j))) {
            let shape = match kind {
                CellKind::QuadraticQuadrilateral => {
                    interpolate(Shape::Quadrilateral8, 2.0 * at(i) - 1.0, 2.0 * at(j) - 1.0)
                }
                CellKind::QuadraticTriangle if i + j < steps => interpolate(Shape::Triangle6, at(i), at(j)),
                CellKind::QuadraticTriangle => continue,
            };
            let value = |axis: usize| (0..nodes.len()).map(|k| shape.value[k] * place(k)[axis]).sum::<f64>();
            let column = ((value(1) + offset - self.ends.0) / pixel) as usize;
            let row = (value(0) / pixel) as usize;
            if column < self.width && row < self.rows {
                let mut sample = Sample { body, nodes: [0; 8], weights: [0.0; 8] };
                sample.nodes[..nodes.len()].copy_from_slice(nodes);
                sample.weights.iter_mut().zip(shape.value).for_each(|(weight, value)| *weight = value as f32);
                self.samples[row * self.width + column].get_or_insert(sample);
            }
        }
    }

    /// One frame as a PNG of 256 colours: 0 is empty, 1…255 the scale.
    ///
    /// # Errors
    /// Whatever the encoder says.
    pub fn png(&self, field: &Field) -> Result<Vec<u8>, png::EncodingError> {
        let colour = |sample: &Option<Sample>| {
            let Some(Sample { body, nodes, weights }) = sample else { return 0 };
            let values = &field.bodies[*body].von_mises;
            let stress: f64 = nodes.iter().zip(weights).map(|(&node, &w)| f64::from(w) * values[node as usize]).sum();
            let share = (stress.max(1.0).log10() - DECADES.0) / (DECADES.1 - DECADES.0);
            1 + (254.0 * share.clamp(0.0, 1.0)).round() as u8
        };
        let half: Vec<u8> = self.samples.iter().map(colour).collect();
        let rows = || half.chunks_exact(self.width);
        let pixels: Vec<u8> = rows().rev().chain(rows()).flatten().copied().collect();
        let mut palette = vec![255, 255, 255];
        palette.extend((0..255).flat_map(|i| {
            let (red, green, blue) = viridis(f64::from(i) / 254.0);
            [red, green, blue]
        }));
        let mut bytes = Vec::new();
        let mut encoder = png::Encoder::new(&mut bytes, self.width as u32, 2 * self.rows as u32);
        encoder.set_color(png::ColorType::Indexed);
        encoder.set_depth(png::BitDepth::Eight);
        encoder.set_palette(palette);
        let mut writer = encoder.write_header()?;
        writer.write_image_data(&pixels)?;
        writer.finish()?;
        Ok(bytes)
    }

    /// The frames (time in s, PNG) as one animated SVG.
    #[must_use]
    pub fn svg(&self, frames: &[(f64, Vec<u8>)]) -> String {
        const LEFT: f64 = 70.0;
        const TOP: f64 = 50.0;
        let (width, height) = (self.width as f64, 2.0 * self.rows as f64);
        let whole = FRAME_TIME * frames.len() as f64;
        let share = 100.0 / frames.len().max(1) as f64;
        let mut svg = String::new();
        // Writing to a string cannot fail.
        let mut put = |text: std::fmt::Arguments<'_>| {
            let _ = svg.write_fmt(text);
        };
        put(format_args!(
            "<svg xmlns=\"http://www.w3.org/2000/svg\" viewBox=\"0 0 {} {}\" font-family=\"{}\" font-size=\"20\">\n\
             <style>.f{{visibility:hidden;animation:f {whole}s steps(1,end) infinite}}\
             @keyframes f{{0%{{visibility:visible}}{share}%{{visibility:hidden}}}}</style>\n\
             <rect width=\"100%\" height=\"100%\" fill=\"white\"/>\n",
            LEFT + width + 150.0,
            TOP + height + 70.0,
            FONT_STACK.replace('"', "'"),
        ));
        for (index, (time, picture)) in frames.iter().enumerate() {
            let delay = FRAME_TIME * index as f64 - whole;
            put(format_args!(
                "<g class=\"f\" style=\"animation-delay:{delay:.3}s\"><image x=\"{LEFT}\" y=\"{TOP}\" width=\"{width}\" \
                 height=\"{height}\" href=\"data:image/png;base64,{}\"/><text x=\"{LEFT}\" y=\"34\">{:.2} µs</text></g>\n",
                STANDARD.encode(picture),
                1e6 * time,
            ));
        }
        put(format_args!(
            "<rect x=\"{LEFT}\" y=\"{TOP}\" width=\"{width}\" height=\"{height}\" fill=\"none\" stroke=\"black\"/>\n"
        ));
        let pixel = (self.ends.1 - self.ends.0) / width;
        let (first, last) = ((1e3 * self.ends.0).ceil() as i32, (1e3 * self.ends.1).floor() as i32);
        let floor = TOP + height;
        for millimetre in first..=last {
            let x = LEFT + (1e-3 * f64::from(millimetre) - self.ends.0) / pixel;
            put(format_args!(
                "<path d=\"M{x:.1} {floor}v6\" stroke=\"black\"/><text x=\"{x:.1}\" y=\"{:.1}\" text-anchor=\"middle\">{millimetre}</text>\n",
                floor + 26.0
            ));
        }
        put(format_args!(
            "<text x=\"{:.1}\" y=\"{:.1}\" text-anchor=\"middle\">z, from the piston's face (mm)</text>\n",
            LEFT + 0.5 * width,
            floor + 54.0
        ));
        let tenth = (self.radius * 1e4).floor() / 10.0;
        for r in [-tenth, 0.0, tenth] {
            let y = TOP + 0.5 * height - 1e-3 * r / pixel;
            put(format_args!(
                "<path d=\"M{} {y:.1}h6\" stroke=\"black\"/><text x=\"{}\" y=\"{:.1}\" text-anchor=\"end\">{r:.1}</text>\n",
                LEFT - 6.0,
                LEFT - 10.0,
                y + 7.0
            ));
        }
        put(format_args!(
            "<text transform=\"translate(20 {:.1}) rotate(-90)\" text-anchor=\"middle\">r (mm)</text>\n",
            TOP + 0.5 * height
        ));
        let bar = LEFT + width + 20.0;
        for step in 0..64 {
            let (red, green, blue) = viridis(f64::from(step) / 63.0);
            put(format_args!(
                "<rect x=\"{bar}\" y=\"{:.2}\" width=\"18\" height=\"{:.2}\" fill=\"rgb({red},{green},{blue})\"/>\n",
                TOP + height * f64::from(63 - step) / 64.0,
                height / 64.0 + 0.5
            ));
        }
        for (decade, label) in ["1 MPa", "10 MPa", "100 MPa", "1 GPa", "10 GPa"].iter().enumerate() {
            let y = TOP + height * (1.0 - decade as f64 / (DECADES.1 - DECADES.0));
            put(format_args!("<text x=\"{}\" y=\"{:.1}\">{label}</text>\n", bar + 24.0, y + 7.0));
        }
        put(format_args!("<text x=\"{}\" y=\"34\" text-anchor=\"end\">von Mises stress</text>\n</svg>\n", bar + 120.0));
        svg
    }
}

#[cfg(test)]
mod tests {
    use std::sync::Arc;

    use super::*;
    use granchain_model::response::{FieldBody, FieldMesh};

    /// A square of 1 mm with the stress 10^(6 + 4 r/mm) Pa at its nodes.
    fn field() -> Field {
        let points = [[0.0, 0.0], [1.0, 0.0], [1.0, 1.0], [0.0, 1.0], [0.5, 0.0], [1.0, 0.5], [0.5, 1.0], [0.0, 0.5]];
        let mesh = FieldMesh {
            points: points.iter().map(|[r, z]| [1e-3 * r, 1e-3 * z]).collect(),
            kinds: vec![CellKind::QuadraticQuadrilateral],
            connectivity: (0..8).collect(),
            materials: vec![0],
        };
        let mut body = FieldBody::at_rest("bead1", Arc::new(mesh), 0.0);
        body.von_mises = vec![1e8; 8];
        Field { time: 2e-6, bodies: vec![body] }
    }

    #[test]
    fn every_pixel_of_a_body_shows_its_stress_on_the_logarithmic_scale() {
        let field = field();
        let raster = Raster::new(&field);
        assert!(raster.samples.iter().all(Option::is_some));
        let bytes = raster.png(&field).unwrap();
        let mut reader = png::Decoder::new(std::io::Cursor::new(bytes)).read_info().unwrap();
        let mut pixels = vec![0; reader.output_buffer_size().unwrap()];
        let info = reader.next_frame(&mut pixels).unwrap();
        assert_eq!((info.width as usize, info.height as usize), (WIDTH, 2 * raster.rows));
        // 100 MPa is half of the four decades.
        assert!(pixels[..info.buffer_size()].iter().all(|&pixel| pixel == 128));
    }

    #[test]
    fn an_animation_holds_every_frame_with_its_time() {
        let field = field();
        let raster = Raster::new(&field);
        let frame = raster.png(&field).unwrap();
        let svg = raster.svg(&[(0.0, frame.clone()), (2e-6, frame)]);
        let document = roxmltree::Document::parse(&svg).unwrap();
        let images = document.descendants().filter(|node| node.has_tag_name("image")).count();
        assert_eq!(images, 2);
        assert!(svg.contains("2.00 µs") && svg.contains("(mm)") && svg.contains("10 GPa"));
    }
}
