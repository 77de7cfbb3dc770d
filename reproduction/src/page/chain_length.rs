//! The page of the study of chain lengths: which numbers of beads give which lines, and how wide the spectra are.

use serde_json::json;

use super::trend::{cell, curve, tables};
use crate::chain_length::{BEADS, ChainLengths, SUBHARMONICS};
use crate::portrait::{IMPULSIVE_CREST, PRESENT_LEVEL, PRESENT_PROMINENCE, Trait};
use crate::trend::{SPECTRUM_POINTS, SPECTRUM_SPAN, TrendPlan};
use granchain_report::{
    figure::{Axis, Colour, Dash, Figure, Layer, Map, Marker, PAGE_WIDTH_MM, Panel, Stroke},
    number::{fixed, significant},
    page::{Block, Column, Files, Page, Plate, ReportError, Table, Tone, provenance},
    sweep::capitalised,
};
use granchain_signal::feature::Ratio;

/// The study and where it comes from.
#[derive(Debug, Clone, PartialEq)]
pub struct ChainLengthReport {
    pub program: String,
    pub model: &'static str,
    pub plan: TrendPlan,
    pub laws: Vec<ChainLengths>,
    pub drive_frequency: f64,
    pub command_line: String,
}

/// Least rank correlation that is called a growth: 5 % of chance with nine points, one-sided.
const GROWTH: f64 = 0.6;

impl ChainLengthReport {
    /// `report.html`, `report.md`, the figures, `chain-length.json`, `chain-length.csv`.
    ///
    /// # Errors
    /// [`ReportError`] when there is no law, or a figure cannot be drawn.
    pub fn files(&self) -> Result<Files, ReportError> {
        if self.laws.is_empty() {
            return Err(ReportError::Missing { field: "laws" });
        }
        let mut files = self.page().files()?;
        let points = self.laws.iter().map(|law| (law.law.kind, &law.points));
        let all = json!({"program": self.program, "model": self.model, "plan": self.plan, "laws": self.laws});
        files.extend(tables("chain-length", "beads", points, &all)?);
        Ok(files)
    }

    fn page(&self) -> Page {
        let mut blocks = vec![
            self.headline(),
            Block::Paragraph(format!(
                "The annulus scene of the paper with two to ten beads, {} perturbed runs each on model `{}`, both damping laws at the paper’s α. \
                 A line counts as present from {PRESENT_LEVEL} of the drive line and {PRESENT_PROMINENCE:.0} times the floor around it on; a \
                 response counts as a train of impulses from a crest factor of {} on.",
                self.plan.replicates,
                self.model,
                fixed(IMPULSIVE_CREST, 2)
            )),
            Block::List(self.laws.iter().map(sentence).collect()),
            Block::Plates(vec![Plate::new("spectra", self.spectra()), Plate::new("bandwidth", self.bandwidth())]),
        ];
        blocks.extend(self.laws.iter().map(|law| Block::Table(table(law))));
        blocks.push(Block::Paragraph(
            "The companion work is known by its abstract: impulses for certain numbers of beads only, and more bandwidth in longer chains. Its \
             drive level, support and precompression at each length are not printed; here they are the same at every length, so agreement in \
             kind is all that can be asked for."
                .into(),
        ));
        let facts = vec![("version".into(), self.program.clone()), ("seed".into(), self.plan.seed.to_string())];
        blocks.extend(provenance(facts, &self.command_line));
        Page {
            title: "Chains of two to ten beads".into(),
            subtitle: "Which numbers of beads give fractional lines and impulses, and how wide the spectra are".into(),
            blocks,
        }
    }

    fn headline(&self) -> Block {
        let selective = self.laws.iter().all(|law| {
            let count = law.impulsive().len();
            count > 0 && count < law.points.len()
        });
        let grows = self.laws.iter().any(|law| law.bandwidth_correlation >= GROWTH);
        let tone = if selective && grows { Tone::Good } else { Tone::Careful };
        let first = if selective {
            "Only some numbers of beads give impulses, as in the companion work."
        } else {
            "Impulses do not single out certain numbers of beads with both laws."
        };
        let second = if grows {
            " The bandwidth grows with the number of beads for at least one law."
        } else {
            " A bandwidth that grows with the number of beads is not seen."
        };
        Block::Headline { tone, verdict: first.into(), text: second.into() }
    }

    /// Spectra against the number of beads, one map a law.
    fn spectra(&self) -> Figure {
        let width = SPECTRUM_SPAN * self.drive_frequency / SPECTRUM_POINTS as f64;
        let figure = Figure::new(
            "Spectra of the pole’s velocity against the number of beads, in dB relative to the drive line of that chain, mean amplitudes of the \
             perturbed runs. A dark column is a line all chains have; a dark spot between is a fractional line of that number of beads only.",
        )
        .sized(PAGE_WIDTH_MM, 1);
        self.laws.iter().fold(figure, |figure, law| {
            let values = law.points.iter().flat_map(|point| {
                let drive = point.moments.get(Trait::DriveLine).map_or(1.0, |line| line.mean);
                point.spectrum_m_per_s.iter().map(move |a| (20.0 * (a / drive).max(1e-6).log10()).clamp(-60.0, 20.0))
            });
            let map = Map {
                x: (0..SPECTRUM_POINTS).map(|band| (band as f64 + 0.5) * width).collect(),
                y: law.points.iter().map(|point| point.value).collect(),
                values: values.collect(),
            };
            let x = Axis::new("Frequency", "kHz").times(1e-3).range(0.0, SPECTRUM_SPAN * self.drive_frequency);
            let (first, last) = (*BEADS.start() as f64, *BEADS.end() as f64);
            let y = Axis::new("Number of beads", "1")
                .range(first - 0.5, last + 0.5)
                .named_ticks(BEADS.map(|beads| (beads as f64, beads.to_string())).collect());
            let panel = Panel::new(x, y)
                .titled(format!("{} dampers, α = {}", capitalised(law.law.name), law.law.alpha))
                .height(42.0)
                .layer(Layer::HeatMap { label: "Level re f0 (dB)".into(), map, range: Some((-50.0, 0.0)) });
            let lines = [
                Ratio::new(1, 4),
                Ratio::new(1, 3),
                Ratio::new(1, 2),
                Ratio::new(2, 3),
                Ratio::ONE,
                Ratio::new(2, 1),
                Ratio::new(3, 1),
            ];
            let panel = lines
                .into_iter()
                .fold(panel, |panel, line| panel.mark_x(line.value() * self.drive_frequency, line.to_string()));
            figure.panel(panel)
        })
    }

    /// Bandwidth and crest factor against the number of beads.
    fn bandwidth(&self) -> Figure {
        let beads = || {
            let ticks = BEADS.map(|beads| (beads as f64, beads.to_string())).collect();
            Axis::new("Number of beads", "1")
                .range(*BEADS.start() as f64 - 0.4, *BEADS.end() as f64 + 0.4)
                .named_ticks(ticks)
        };
        let looks = [(Colour::Vermillion, Marker::Disc), (Colour::Blue, Marker::Square)];
        let width = Panel::new(beads(), Axis::new("Bandwidth at −20 dB", "kHz").times(1e-3)).height(45.0);
        let crest = Panel::new(beads(), Axis::new("Crest factor", "1")).height(45.0).mark_y(
            IMPULSIVE_CREST,
            "impulses from here on",
            Stroke::new(Colour::Grey).dash(Dash::Dotted),
        );
        let with = |panel: Panel, what: Trait| {
            self.laws.iter().zip(looks).fold(panel, |panel, (law, (colour, marker))| {
                curve(panel, law.law.name, &law.points, what, colour, marker)
            })
        };
        Figure::new(
            "Highest frequency at −20 dB re the drive line (left) and crest factor (right) against the number of beads; bars: scatter of a single \
             run.",
        )
        .sized(PAGE_WIDTH_MM, 2)
        .panel(with(width, Trait::Bandwidth))
        .panel(with(crest, Trait::Crest))
    }
}

fn list(beads: &[usize]) -> String {
    match beads {
        [] => "no number of beads".into(),
        [one] => format!("N = {one}"),
        several => format!("N = {}", several.iter().map(usize::to_string).collect::<Vec<_>>().join(", ")),
    }
}

fn sentence(law: &ChainLengths) -> String {
    let lines: Vec<String> =
        SUBHARMONICS.iter().map(|line| format!("a line at {line} for {}", list(&law.with_line(*line)))).collect();
    let growth = if law.bandwidth_correlation >= GROWTH {
        "it grows"
    } else if law.bandwidth_correlation <= -GROWTH {
        "it falls"
    } else {
        "no clear growth"
    };
    format!(
        "{} dampers, α = {}: {}; impulses for {}. Rank correlation of the bandwidth with the number of beads {} ({growth}; {GROWTH} is the 5 % \
         bound of chance for nine points).",
        capitalised(law.law.name),
        law.law.alpha,
        lines.join(", "),
        list(&law.impulsive()),
        fixed(law.bandwidth_correlation, 2)
    )
}

fn table(law: &ChainLengths) -> Table {
    let rows = law.points.iter().map(|point| {
        let mut row = vec![
            point.value.to_string(),
            cell(point, Trait::PositivePeak, 1e3, 0),
            cell(point, Trait::NegativePeak, 1e3, 0),
            cell(point, Trait::Crest, 1.0, 2),
            cell(point, Trait::Bandwidth, 1e-3, 0),
        ];
        for line in SUBHARMONICS {
            let level = cell(point, Trait::Level(line), 1.0, 3);
            let floor = point.moments.get(Trait::Prominence(line)).map_or(f64::NAN, |own| own.mean);
            let mark = if point.moments.has_line(line) { ", present" } else { "" };
            row.push(format!("{level} ({} ×{mark})", significant(floor, 2)));
        }
        row.push(if point.moments.is_impulsive() { "yes" } else { "no" }.into());
        row
    });
    let mut columns = vec![
        Column::numbers("N"),
        Column::words("Positive peak").unit("mm/s"),
        Column::words("Negative peak").unit("mm/s"),
        Column::words("Crest factor"),
        Column::words("−20 dB").unit("kHz"),
    ];
    columns.extend(SUBHARMONICS.iter().map(|line| Column::words(format!("A({line}·f0)/A(f0)"))));
    columns.push(Column::words("Impulses"));
    Table {
        caption: format!(
            "{} dampers at α = {}: mean ± scatter of a single run. In brackets the line over the floor around it.",
            capitalised(law.law.name),
            law.law.alpha
        ),
        columns,
        rows: rows.collect(),
    }
}
