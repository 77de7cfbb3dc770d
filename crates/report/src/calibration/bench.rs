//! The bench as fitted: a table of what stands on it, and a drawing to scale.

use serde::{Deserialize, Serialize};

use crate::{
    figure::{Axis, Colour, Figure, PAGE_WIDTH_MM, Panel},
    page::{Block, Column, Plate, Table},
};

/// What stands on the bench.
#[derive(Debug, Clone, PartialEq, Default, Serialize, Deserialize)]
pub struct BenchReport {
    pub rows: Vec<BenchRow>,
    /// Radii of the beads, m, the first at the piston.
    pub radii: Vec<f64>,
    /// What holds the last bead.
    pub support: DrawnSupport,
    /// Plan, bench and scene files: what each is, and its text.
    pub texts: Vec<(String, String)>,
}

/// A row of the table.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct BenchRow {
    pub part: String,
    pub value: String,
    /// Who says so: `stated`, `fitted`, or a default.
    pub origin: String,
}

/// The support as it is drawn.
#[derive(Debug, Clone, Copy, PartialEq, Default, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum DrawnSupport {
    /// A flat, or a body that is not drawn.
    #[default]
    Flat,
    Ring {
        /// Radius of the circle of the sections' centres, m.
        ring_radius: f64,
        /// Radius of the section, m.
        section_radius: f64,
    },
    /// A disc in front of water.
    Disc {
        radius: f64,
        thickness: f64,
        /// Whether water lies behind it.
        water: bool,
    },
    Free,
}

/// Most beads that are drawn.
const DRAWN: usize = 24;

impl BenchReport {
    /// Heading, drawing, table and the texts of the files.
    pub(super) fn blocks(&self) -> Vec<Block> {
        if self.rows.is_empty() {
            return Vec::new();
        }
        let mut blocks = vec![Block::Heading("Bench".into())];
        if (1..=DRAWN).contains(&self.radii.len()) {
            let mut plate = Plate::new("bench", self.drawing());
            plate.caption = "Section through the axis of the chain, to scale, with the piston on the left.".into();
            blocks.push(Block::Plates(vec![plate]));
        }
        let rows = self.rows.iter().map(|row| vec![row.part.clone(), row.value.clone(), row.origin.clone()]);
        blocks.push(Block::Table(Table {
            caption: "Bench, drive and model of the drawn run. “default”: neither given in a file nor on the command line; “fitted”: the value found by the fit."
                .into(),
            columns: ["Part", "Value", "From"].map(Column::words).into(),
            rows: rows.collect(),
        }));
        for (name, text) in &self.texts {
            blocks.push(Block::Paragraph(format!("{name}:")));
            blocks.push(Block::Code(text.trim_end().to_owned()));
        }
        blocks
    }

    fn drawing(&self) -> Figure {
        let length: f64 = self.radii.iter().map(|radius| 2.0 * radius).sum();
        let (largest, last) =
            (self.radii.iter().copied().fold(0.0, f64::max), self.radii.last().copied().unwrap_or(0.0));
        let block = |from: f64, to: f64, low: f64, high: f64| vec![(from, low), (to, low), (to, high), (from, high)];
        let half = 1.5 * largest;
        let mut behind = length + 0.4 * largest;
        let mut top = half;
        let circle = |centre: f64, radius: f64, from: f64, to: f64, at: f64| -> Vec<(f64, f64)> {
            let angle = |i: u32| (from + (to - from) * f64::from(i) / 48.0).to_radians();
            (0..=48).map(|i| (centre + radius * angle(i).cos(), at + radius * angle(i).sin())).collect()
        };
        let mut left = 0.0;
        let beads = self.radii.iter().map(|radius| {
            left += 2.0 * radius;
            circle(left - radius, *radius, 0.0, 360.0, 0.0)
        });
        let beads: Vec<_> = beads.collect();
        let (mut support, mut water) = (Vec::new(), Vec::new());
        match self.support {
            DrawnSupport::Flat => support.push(block(length, behind, -half, half)),
            DrawnSupport::Free => {}
            DrawnSupport::Ring { ring_radius, section_radius } => {
                let ahead = ((last + section_radius).powi(2) - ring_radius.powi(2)).max(0.0).sqrt();
                let centre = length - last + ahead;
                support.push(circle(centre, section_radius, 180.0, 360.0, ring_radius));
                support.push(circle(centre, section_radius, 0.0, 180.0, -ring_radius));
                behind = centre + section_radius + 0.1 * largest;
                top = top.max(ring_radius + 0.2 * largest);
            }
            DrawnSupport::Disc { radius, thickness, water: wet } => {
                support.push(block(length, length + thickness, -radius, radius));
                behind = length + thickness + 0.8 * largest;
                top = top.max(radius);
                if wet {
                    water.push(block(length + thickness, behind, -top, top));
                }
            }
        }
        let piston = vec![block(-0.4 * largest, 0.0, -half, half)];
        let x = Axis::new("z", "mm").times(1e3).range(-0.5 * largest, behind + 0.1 * largest);
        let y = Axis::new("r", "mm").times(1e3).range(-1.08 * top, 1.08 * top);
        let mut panel = Panel::new(x, y).equal_scales();
        for (label, shapes, colour, share) in [
            ("piston", piston, Colour::Grey, 0.5),
            ("beads", beads, Colour::Blue, 0.3),
            ("support", support, Colour::Orange, 0.5),
            ("water", water, Colour::SkyBlue, 0.3),
        ] {
            if !shapes.is_empty() {
                panel = panel.shapes(label, shapes, (colour, share));
            }
        }
        Figure::new("The bench in section: piston, beads and support, to scale.").sized(PAGE_WIDTH_MM, 1).panel(panel)
    }
}
