//! The page of a scene's effects: what each costs, and what leaving it out changes.

use crate::effects::{Advice, Advised, EffectCosts, Marginal, Measured};
use granchain_report::{
    figure::{Axis, Colour, Figure, Marker, PAGE_WIDTH_MM, Panel, Stroke},
    number::{engineering, fixed, significant},
    page::{Block, Column, Files, Page, Plate, ReportError, Table, Tone, provenance},
};

/// Changes below this are drawn at it, 1: no reader asks for less.
const LEAST_CHANGE: f64 = 1e-5;
/// Height of a row of the figure, mm.
const ROW_MM: f64 = 4.6;

/// The effects and where they come from.
#[derive(Debug, Clone, PartialEq)]
pub struct EffectsReport {
    pub program: String,
    /// Command line that makes the same page, but for the times.
    pub command_line: String,
    pub costs: EffectCosts,
    /// What an accuracy target needs, where one was given.
    pub advice: Option<Advice>,
}

impl EffectsReport {
    /// `report.html`, `report.md`, the figure, `effects.json`.
    ///
    /// # Errors
    /// [`ReportError`] when nothing was measured, or the figure cannot be drawn.
    pub fn files(&self) -> Result<Files, ReportError> {
        if measured(&self.costs).next().is_none() {
            return Err(ReportError::Missing { field: "effects" });
        }
        let mut files = self.page().files()?;
        let all = serde_json::json!({"program": self.program, "costs": self.costs, "advice": self.advice});
        let mut json = serde_json::to_vec_pretty(&all)?;
        json.push(b'\n');
        files.push(("effects.json".into(), json));
        Ok(files)
    }

    fn page(&self) -> Page {
        let EffectCosts { scene, model, window_s, base, effects } = &self.costs;
        let on = effects.iter().filter(|row| row.on).count();
        let mut blocks = vec![Block::Headline {
            tone: Tone::Good,
            verdict: format!("{on} of {} effects are in this scene.", effects.len()),
            text: format!(
                " A run of {} takes {} on one thread of this machine, {} unknowns, {} steps.",
                engineering(*window_s, "s", 3),
                engineering(base.run_s, "s", 2),
                base.work.unknowns,
                base.work.steps
            ),
        }];
        if let Some(advice) = &self.advice {
            blocks.push(Block::List(sentences(advice)));
        }
        blocks.push(Block::Plates(vec![Plate::new("effects", figure(&self.costs))]));
        blocks.push(Block::Table(table(&self.costs)));
        let refused: Vec<String> = effects
            .iter()
            .filter_map(|row| row.refused.as_ref().map(|reason| format!("{}: not measured, {reason}.", row.name)))
            .collect();
        if !refused.is_empty() {
            blocks.push(Block::List(refused));
        }
        let facts = vec![
            ("version".into(), self.program.clone()),
            ("scene".into(), scene.clone()),
            ("model".into(), (*model).into()),
        ];
        blocks.extend(provenance(facts, &self.command_line));
        Page {
            title: format!("Effects of the scene {scene}"),
            subtitle: "What each costs, and what leaving it out would change".into(),
            blocks,
        }
    }
}

fn measured(costs: &EffectCosts) -> impl Iterator<Item = (&Marginal, &Measured)> {
    costs.effects.iter().filter_map(|row| row.measured.as_ref().map(|measured| (row, measured)))
}

/// Time and change of every effect measured, one row each.
#[must_use]
pub fn figure(costs: &EffectCosts) -> Figure {
    let rows: Vec<_> = measured(costs).collect();
    let count = rows.len();
    let at = |index: usize| (count - 1 - index) as f64;
    let names = |text: &dyn Fn(&Marginal) -> String| {
        rows.iter().enumerate().map(|(index, (row, _))| (at(index), text(row))).collect::<Vec<_>>()
    };
    let axis = |ticks| Axis::new("Effect", "").named_ticks(ticks).range(-0.7, count as f64 - 0.3);
    let panel = |x: Axis, ticks, [own, other]: [&str; 2], value: &dyn Fn(&Measured) -> f64| {
        let of = |on: bool| {
            let chosen = rows.iter().enumerate().filter(|(_, (row, _))| row.on == on);
            chosen.map(|(index, (_, measured))| (value(measured), at(index))).collect::<Vec<_>>()
        };
        Panel::new(x, axis(ticks))
            .height(ROW_MM * (count as f64 + 1.0))
            .points(own, of(true), Colour::Blue, Marker::Disc)
            .points(other, of(false), Colour::Vermillion, Marker::Ring)
    };
    let cost = Axis::new("Time, with over without", "1").logarithmic();
    let time = panel(cost, names(&|row| row.name.into()), ["in this scene", "put in"], &|measured| measured.factor())
        .line("", vec![(1.0, -0.7), (1.0, count as f64 - 0.3)], Stroke::new(Colour::Grey).width(0.5));
    let worth = Axis::new("Largest change without it", "1").logarithmic();
    let change = panel(worth, names(&|_| String::new()), [""; 2], &|measured| measured.change.size().max(LEAST_CHANGE));
    let title = format!(
        "Effects of the scene {} ({}), each alone, over the first {}: what it costs and what leaving it out changes.",
        costs.scene,
        costs.model,
        engineering(costs.window_s, "s", 2)
    );
    Figure::new(title).sized(PAGE_WIDTH_MM, 2).panel(time.titled("(a) cost")).panel(change.titled("(b) change"))
}

fn percent(value: f64) -> String {
    format!("{} %", significant(100.0 * value, 2))
}

fn table(costs: &EffectCosts) -> Table {
    let rows = measured(costs).map(|(row, measured)| {
        let change = &measured.change;
        vec![
            row.name.to_owned(),
            if row.on { "on" } else { "off" }.to_owned(),
            format!("{:+}", measured.unknowns()),
            significant(1e6 * measured.without.run_s / measured.without.work.steps.max(1) as f64, 3),
            significant(1e6 * measured.with.run_s / measured.with.work.steps.max(1) as f64, 3),
            fixed(measured.factor(), 2),
            percent(change.waveform),
            percent(change.peak),
            change.ratio_third.map_or("–".into(), |ratio| fixed(ratio, 3)),
            change.pressure.map_or("–".into(), percent),
            row.key.to_owned(),
        ]
    });
    Table {
        caption: "Every effect that can be switched, each alone: what a run with it costs beside one without, and what leaving it out \
                  changes at the last bead's centre; the key takes it out, or puts it in."
            .into(),
        columns: vec![
            Column::words("Effect"),
            Column::words("Here"),
            Column::numbers("Unknowns"),
            Column::numbers("A step without").unit("µs"),
            Column::numbers("A step with").unit("µs"),
            Column::numbers("Time, with over without"),
            Column::numbers("Waveform, rms"),
            Column::numbers("Peak"),
            Column::numbers("A(f₀/3)/A(f₀)"),
            Column::numbers("Pressure"),
            Column::words("Key"),
        ],
        rows: rows.collect(),
    }
}

/// What a target needs, in sentences.
#[must_use]
pub fn sentences(advice: &Advice) -> Vec<String> {
    let listed = |effects: &[Advised]| {
        let one = |effect: &Advised| format!("{} ({}, `{}`)", effect.name, percent(effect.change), effect.key);
        effects.iter().map(one).collect::<Vec<_>>().join("; ")
    };
    let target = percent(advice.target);
    let lists = [
        (&advice.needed, "Needed and here"),
        (&advice.dispensable, "Here, and could be left out together"),
        (&advice.missing, "Not here, and worth more than the target"),
        (&advice.rightly_off, "Not here, and not needed"),
    ];
    let mut out =
        vec![format!("For {target}, of the effects of the model (what stands on the bench is never left out):")];
    out.extend(
        lists.into_iter().filter(|(list, _)| !list.is_empty()).map(|(list, what)| format!("{what}: {}.", listed(list))),
    );
    out
}
