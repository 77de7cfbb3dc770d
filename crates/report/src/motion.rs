//! The chain in motion: a drawing of beads and contact forces at one instant, and the numbers by which a page's script moves it.

use std::fmt::Write as _;

use base64::{Engine, engine::general_purpose::STANDARD};

use super::{
    figure::FONT_STACK,
    number::{engineering, fixed, significant},
};
use granchain_model::response::Response;

/// Most frames, and most numbers of a byte in all.
const MOST_FRAMES: usize = 2000;
const MOST_BYTES: usize = 140_000;
/// Chains of more beads are no picture of beads.
const MOST_BEADS: usize = 60;
/// Width of the drawing, its own units.
const WIDTH: f64 = 1000.0;
const TOP: f64 = 40.0;
/// Height of the bar of the largest force.
const BAR: f64 = 90.0;
/// Largest displacement drawn, in bead diameters.
const TRAVEL: f64 = 0.3;

/// A drawing of the chain and the numbers that move it.
#[derive(Debug, Clone, PartialEq)]
pub struct Motion {
    /// The chain at the instant of the largest contact force, one `<svg>`.
    pub svg: String,
    /// What moves it, as JSON: of every frame the displacements of piston and beads and the contact forces, a byte each.
    pub data: String,
    pub caption: String,
}

/// One frame: displacements of piston and beads in the largest, forces in the largest.
struct Frame {
    displacements: Vec<f64>,
    forces: Vec<f64>,
}

impl Motion {
    /// Of a run with beads of this diameter, m, and something behind the last or nothing; `None` where nothing moves or the chain is too long to be drawn bead by bead.
    #[must_use]
    pub(crate) fn of(response: &Response, diameter: f64, has_support: bool) -> Option<Self> {
        let beads = response.bead_displacement.len();
        let samples = response.piston_displacement.len();
        let places: Vec<_> = [&response.piston_displacement].into_iter().chain(&response.bead_displacement).collect();
        let forces = &response.contact_force;
        let travel = places.iter().map(|series| series.peak()).fold(0.0, f64::max);
        let strongest = forces.iter().map(|series| series.peak()).fold(0.0, f64::max);
        let alike = places.iter().copied().chain(forces).all(|series| series.len() == samples);
        if beads == 0 || beads > MOST_BEADS || forces.len() != beads + 1 || !alike || travel <= 0.0 || strongest <= 0.0
        {
            return None;
        }
        let most = MOST_FRAMES.min(MOST_BYTES / (2 * beads + 2));
        let every = samples.div_ceil(most).max(1);
        let frames: Vec<Frame> = (0..samples / every)
            .map(|frame| {
                let run = frame * every..(frame + 1) * every;
                let largest = |values: &[f64]| values[run.clone()].iter().copied().fold(0.0, f64::max);
                Frame {
                    displacements: places.iter().map(|series| series.values[run.start] / travel).collect(),
                    forces: forces.iter().map(|series| largest(&series.values) / strongest).collect(),
                }
            })
            .collect();
        let force = |frame: &Frame| frame.forces.iter().copied().fold(0.0, f64::max);
        let shown = (0..frames.len())
            .fold(0, |best, index| if force(&frames[index]) > force(&frames[best]) { index } else { best });
        let bytes: Vec<u8> = frames.iter().flat_map(Frame::bytes).collect();
        let start = 1e6 * response.piston_displacement.start;
        let step = 1e6 * response.piston_displacement.step * every as f64;
        let pitch = WIDTH / (beads as f64 + 0.6);
        let data = serde_json::json!({
            "beads": beads, "frames": frames.len(), "from": start, "step": step, "shown": shown, "travel": TRAVEL * pitch,
            "bar": BAR, "floor": floor(pitch), "q": STANDARD.encode(bytes),
        });
        let caption = format!(
            "The chain at the instant of its largest contact force; with scripts it can be played. Displacements are drawn {} times as large, the \
             largest is {}; a full bar is a contact force of {}, of every contact the largest within {} µs.",
            significant(TRAVEL * diameter / travel, 2),
            engineering(travel, "m", 3),
            engineering(strongest, "N", 3),
            fixed(step, 2),
        );
        let clock = start + step * shown as f64;
        Some(Self { svg: drawing(frames.get(shown)?, pitch, clock, has_support), data: data.to_string(), caption })
    }
}

impl Frame {
    fn bytes(&self) -> impl Iterator<Item = u8> {
        let places = self.displacements.iter().map(|share| (127.5 + 127.5 * share).round() as u8);
        places.chain(self.forces.iter().map(|share| (255.0 * share).round() as u8))
    }
}

/// Height at which the bars of force stand.
fn floor(pitch: f64) -> f64 {
    TOP + pitch + 20.0 + BAR
}

/// Piston, beads, support and forces of one frame.
fn drawing(frame: &Frame, pitch: f64, time: f64, has_support: bool) -> String {
    let (middle, floor) = (TOP + 0.5 * pitch, floor(pitch));
    let contact = |index: usize| 0.3 * pitch + index as f64 * pitch;
    let beads = frame.displacements.len() - 1;
    let mut svg = format!(
        "<svg xmlns=\"http://www.w3.org/2000/svg\" viewBox=\"0 0 {WIDTH} {:.0}\" role=\"img\" font-family=\"{FONT_STACK}\" font-size=\"18\">\n\
         <title>Piston, {beads} beads{}, with the contact forces as bars</title>\n\
         <rect width=\"100%\" height=\"100%\" fill=\"#FFFFFF\"/>\n<text data-clock=\"\" x=\"8\" y=\"24\" fill=\"#1E1E1E\">{time:.2} µs</text>\n",
        floor + 40.0,
        if has_support { " and support" } else { "" }
    );
    let mut put = |text: std::fmt::Arguments<'_>| {
        // Writing to a string cannot fail.
        let _ = svg.write_fmt(text);
    };
    let (top, height, thick) = (middle - 0.55 * pitch, 1.1 * pitch, 0.28 * pitch);
    if has_support {
        put(format_args!(
            "<rect x=\"{:.2}\" y=\"{top:.2}\" width=\"{thick:.2}\" height=\"{height:.2}\" fill=\"#787878\"/>\n",
            contact(beads)
        ));
    }
    for (index, share) in frame.displacements.iter().enumerate() {
        let shift = format!("data-x=\"\" transform=\"translate({:.2} 0)\"", share * TRAVEL * pitch);
        if index == 0 {
            let left = contact(0) - thick;
            put(format_args!(
                "<rect {shift} x=\"{left:.2}\" y=\"{top:.2}\" width=\"{thick:.2}\" height=\"{height:.2}\" fill=\"#0072B2\"/>\n"
            ));
        } else {
            let (x, radius) = (contact(index - 1) + 0.5 * pitch, 0.49 * pitch);
            put(format_args!(
                "<circle {shift} cx=\"{x:.2}\" cy=\"{middle:.2}\" r=\"{radius:.2}\" fill=\"#D6E5F3\" stroke=\"#1E1E1E\" stroke-width=\"1.5\" fill-opacity=\"0.8\"/>\n"
            ));
        }
    }
    let width = (0.3 * pitch).min(24.0);
    for (index, share) in frame.forces.iter().enumerate() {
        let (x, tall) = (contact(index) - 0.5 * width, BAR * share);
        put(format_args!(
            "<rect data-force=\"\" x=\"{x:.2}\" y=\"{:.2}\" width=\"{width:.2}\" height=\"{tall:.2}\" fill=\"#D55E00\"/>\n",
            floor - tall
        ));
    }
    put(format_args!("<path d=\"M0,{floor:.2}H{WIDTH}\" stroke=\"#1E1E1E\"/>\n"));
    put(format_args!("<text x=\"8\" y=\"{:.2}\" fill=\"#1E1E1E\">contact forces</text>\n</svg>\n", floor + 24.0));
    svg
}
