//! The page of the study of precompression: at which static force the impulses vanish.

use serde_json::json;

use super::trend::{cell, tables};
use crate::portrait::{IMPULSIVE_CREST, Trait};
use crate::precompression::{COMPANION_FORCE, FORCES, Precompressions};
use crate::trend::TrendPlan;
use granchain_report::{
    figure::{Axis, Colour, Dash, ErrorPoint, Figure, Marker, PAGE_WIDTH_MM, Panel, Stroke},
    number::{engineering, fixed},
    page::{Block, Column, Files, Page, Plate, ReportError, Table, Tone, provenance},
    sweep::capitalised,
};

/// The study and where it comes from.
#[derive(Debug, Clone, PartialEq)]
pub struct PrecompressionReport {
    pub program: String,
    pub model: &'static str,
    pub plan: TrendPlan,
    pub laws: Vec<Precompressions>,
    pub command_line: String,
}

/// Where no force stands on the logarithmic axis, N.
const NONE_AT: f64 = 4e-5;

impl PrecompressionReport {
    /// `report.html`, `report.md`, the figures, `precompression.json`, `precompression.csv`.
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
        files.extend(tables("precompression", "precompression_n", points, &all)?);
        Ok(files)
    }

    fn page(&self) -> Page {
        let mut blocks = vec![
            self.headline(),
            Block::Paragraph(format!(
                "The annulus scene of the paper pressed together by a static force before the drive starts, {} perturbed runs each on model \
                 `{}`, both damping laws at the paper’s α. A response counts as a train of impulses from a crest factor of {} on, twice that of \
                 a sine.",
                self.plan.replicates,
                self.model,
                fixed(IMPULSIVE_CREST, 2)
            )),
            Block::List(self.laws.iter().map(sentence).collect()),
            Block::Plates(vec![Plate::new("precompression", self.figure())]),
        ];
        blocks.extend(self.laws.iter().map(|law| Block::Table(table(law))));
        blocks.push(Block::Paragraph(
            "The companion work is known by its abstract: impulses only at precompressions of order 0.01 N and below. How its force was \
             measured, and at which drive level, is not printed. Here the force is an exact static equilibrium of all contacts, the annulus \
             included; gaps are then closed and only the drive is jittered, except on the chain, which starts a third of a nanometre off."
                .into(),
        ));
        let facts = vec![("version".into(), self.program.clone()), ("seed".into(), self.plan.seed.to_string())];
        blocks.extend(provenance(facts, &self.command_line));
        Page {
            title: "Precompression".into(),
            subtitle: "At which static force along the chain the impulses vanish".into(),
            blocks,
        }
    }

    fn headline(&self) -> Block {
        // Of order 0.01 N: within a factor of √10 to either side.
        let near = |force: f64| (COMPANION_FORCE / 10f64.sqrt()..=COMPANION_FORCE * 10f64.sqrt()).contains(&force);
        let met = self
            .laws
            .iter()
            .filter(|law| law.vanishing().is_some_and(|(last, next)| near((last * next).sqrt()) || near(last)))
            .count();
        let (tone, verdict) = if met == self.laws.len() {
            (Tone::Good, "Impulses vanish at the order of 0.01 N, as in the companion work.".to_owned())
        } else {
            (Tone::Careful, format!("Impulses vanish at the order of 0.01 N with {met} of {} laws.", self.laws.len()))
        };
        Block::Headline {
            tone,
            verdict,
            text: format!(" {}", self.laws.iter().map(sentence).collect::<Vec<_>>().join(" ")),
        }
    }

    fn figure(&self) -> Figure {
        let force = || {
            let mut ticks = vec![(NONE_AT, "0".to_owned())];
            ticks.extend(
                [(1e-4, "0.1"), (1e-3, "1"), (1e-2, "10"), (1e-1, "100")].map(|(at, name)| (at, name.to_owned())),
            );
            Axis::new("Static force", "mN").logarithmic().range(0.8 * NONE_AT, 0.13).named_ticks(ticks)
        };
        let mark = |panel: Panel| panel.mark_x(COMPANION_FORCE, "companion");
        let dotted = Stroke::new(Colour::Grey).dash(Dash::Dotted);
        let crest = mark(Panel::new(force(), Axis::new("Crest factor", "1")).height(45.0)).mark_y(
            IMPULSIVE_CREST,
            "impulses from here on",
            dotted,
        );
        let peak = mark(Panel::new(force(), Axis::new("Positive peak", "mm/s").times(1e3)).height(45.0));
        let width = mark(Panel::new(force(), Axis::new("Bandwidth at −20 dB", "kHz").times(1e-3)).height(45.0));
        let looks = [(Colour::Vermillion, Marker::Disc), (Colour::Blue, Marker::Square)];
        let panels = [(crest, Trait::Crest), (peak, Trait::PositivePeak), (width, Trait::Bandwidth)];
        let figure = Figure::new(
            "Crest factor, positive peak and bandwidth of the pole’s velocity against the static force; bars: scatter of a single run. Left of \
             the axis’ first decade: no force. The mark is the companion work’s 0.01 N.",
        )
        .sized(PAGE_WIDTH_MM, 3);
        panels.into_iter().fold(figure, |figure, (panel, what)| {
            let panel = self.laws.iter().zip(looks).fold(panel, |panel, (law, (colour, marker))| {
                let points: Vec<ErrorPoint> = law
                    .points
                    .iter()
                    .filter_map(|point| {
                        let own = point.moments.get(what)?;
                        let at = point.value.max(NONE_AT);
                        Some(ErrorPoint::vertical(at, own.mean, own.mean - own.deviation, own.mean + own.deviation))
                    })
                    .collect();
                let line = points.iter().map(|point| (point.x, point.y)).collect();
                panel.line("", line, Stroke::new(colour).width(0.7)).error_points(law.law.name, points, colour, marker)
            });
            figure.panel(panel)
        })
    }
}

fn sentence(law: &Precompressions) -> String {
    let start = format!("With {} dampers at α = {}", law.law.name, law.law.alpha);
    let largest = FORCES[FORCES.len() - 1];
    let impulsive: Vec<String> =
        law.points.iter().filter(|point| point.moments.is_impulsive()).map(|point| force(point.value)).collect();
    match law.vanishing() {
        Some((last, next)) => format!(
            "{start} the last force with impulses is {}, the first without, here and above, {}; the companion work says of order {}.",
            force(last),
            force(next),
            engineering(COMPANION_FORCE, "N", 1)
        ),
        None if impulsive.is_empty() => format!("{start} no force has impulses, not even none."),
        None => format!("{start} impulses last up to {}, the largest force run.", force(largest)),
    }
}

fn force(value: f64) -> String {
    if value == 0.0 { "none".into() } else { engineering(value, "N", 1) }
}

fn table(law: &Precompressions) -> Table {
    let rows = law.points.iter().map(|point| {
        vec![
            force(point.value),
            cell(point, Trait::PositivePeak, 1e3, 0),
            cell(point, Trait::NegativePeak, 1e3, 0),
            cell(point, Trait::Crest, 1.0, 2),
            cell(point, Trait::Bandwidth, 1e-3, 0),
            cell(point, Trait::Level(law.law.own_line), 1.0, 3),
            if point.moments.is_impulsive() { "yes" } else { "no" }.to_owned(),
        ]
    });
    Table {
        caption: format!(
            "{} dampers at α = {}: mean ± scatter of a single run.",
            capitalised(law.law.name),
            law.law.alpha
        ),
        columns: vec![
            Column::words("Static force"),
            Column::words("Positive peak").unit("mm/s"),
            Column::words("Negative peak").unit("mm/s"),
            Column::words("Crest factor"),
            Column::words("−20 dB").unit("kHz"),
            Column::words(format!("A({}·f0)/A(f0)", law.law.own_line)),
            Column::words("Impulses"),
        ],
        rows: rows.collect(),
    }
}
