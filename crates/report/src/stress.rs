//! The page of the hard cases: every criterion, what was measured, and the instructive ones as figures.

use std::fmt::Write as _;

use super::{
    figure::{Axis, Colour, Dash, Figure, PAGE_WIDTH_MM, Panel, Stroke},
    number::{short, significant},
    page::{Block, Column, Files, Page, Plate, ReportError, Table, Tone, provenance},
    sweep::capitalised,
};
use granchain_studies::stress::{CASES, Case, Check, Curve, Limit, StressOutcome, StressPlan};

/// The cases and where they come from.
#[derive(Debug, Clone, PartialEq)]
pub struct StressReport {
    /// Program and version.
    pub program: String,
    /// Command line that makes the same page.
    pub command_line: String,
    /// What was run.
    pub plan: StressPlan,
    /// What was found.
    pub outcome: StressOutcome,
}

/// What a check measured, with its unit.
#[must_use]
pub fn measured(check: &Check) -> String {
    check.measured.map_or("nothing".into(), |value| with_unit(significant(value, 3), check.unit))
}

/// What it is held against.
#[must_use]
pub fn limit(check: &Check) -> String {
    match check.limit {
        Limit::AtMost(most) => with_unit(format!("at most {}", short(most)), check.unit),
        Limit::AtLeast(least) => with_unit(format!("at least {}", short(least)), check.unit),
    }
}

fn with_unit(number: String, unit: &str) -> String {
    if unit == "1" { number } else { format!("{number} {unit}") }
}

impl StressReport {
    /// `report.html`, `report.md`, the figures, `stress.json`, `stress.csv`.
    ///
    /// # Errors
    /// [`ReportError`] when nothing was run, or a figure cannot be drawn.
    pub fn files(&self) -> Result<Files, ReportError> {
        if self.outcome.checks.is_empty() {
            return Err(ReportError::Missing { field: "checks" });
        }
        let mut files = self.page().files()?;
        let all = serde_json::json!({"program": self.program, "plan": self.plan, "outcome": self.outcome});
        let mut json = serde_json::to_vec_pretty(&all)?;
        json.push(b'\n');
        files.push(("stress.json".into(), json));
        files.push(("stress.csv".into(), self.csv().into_bytes()));
        Ok(files)
    }

    fn csv(&self) -> String {
        let mut text = "case,model,criterion,measured,limit,unit,pass\n".to_owned();
        for check in &self.outcome.checks {
            let found = check.measured.map_or(String::new(), |value| format!("{value:e}"));
            let bound = match check.limit {
                Limit::AtMost(most) => format!("<= {most:e}"),
                Limit::AtLeast(least) => format!(">= {least:e}"),
            };
            let (case, model, unit) = (check.case, check.rung.name(), check.unit);
            let criterion = check.criterion.replace('"', "\"\"");
            // Writing to a string cannot fail.
            let _ = writeln!(text, "{case},\"{model}\",\"{criterion}\",{found},{bound},{unit},{}", check.holds);
        }
        text
    }

    fn page(&self) -> Page {
        let (all, broken) = (self.outcome.checks.len(), self.outcome.broken().count());
        let (tone, verdict) = if broken == 0 {
            (Tone::Good, format!("All {all} checks hold."))
        } else {
            (Tone::Bad, format!("{broken} of {all} checks do not hold."))
        };
        let form = if self.plan.quick { "quick form: shorter runs and coarser meshes" } else { "full form" };
        let mut blocks = vec![Block::Headline { tone, verdict, text: format!(" {form}.") }];
        if broken > 0 {
            blocks.push(Block::List(self.outcome.broken().map(sentence).collect()));
        }
        let plates: Vec<Plate> = CASES.iter().filter_map(|case| self.plate(case)).collect();
        blocks.push(Block::Plates(plates));
        for case in CASES {
            let checks: Vec<&Check> = self.outcome.checks.iter().filter(|check| check.case == case.number).collect();
            if checks.is_empty() {
                continue;
            }
            blocks.push(Block::Heading(format!("{}. {}", case.number, capitalised(case.name))));
            blocks.push(Block::Paragraph(case.what.into()));
            blocks.push(Block::Table(table(case, &checks)));
        }
        let facts = vec![("version".into(), self.program.clone()), ("seed".into(), self.plan.seed.to_string())];
        blocks.extend(provenance(facts, &self.command_line));
        Page {
            title: "Hard cases".into(),
            subtitle: "What the models must survive: criterion, what was measured, limit".into(),
            blocks,
        }
    }

    /// The figure of a case that has one.
    fn plate(&self, case: &Case) -> Option<Plate> {
        let curves: Vec<&Curve> = self.outcome.curves.iter().filter(|curve| curve.case == case.number).collect();
        if curves.is_empty() {
            return None;
        }
        let (name, x, y, title) = match case.number {
            1 => (
                "vacuum",
                Axis::new("Simulated time", "ms").times(1e3).logarithmic(),
                Axis::new("Energy unaccounted for", "1").logarithmic(),
                "Energy that is unaccounted for over the largest, against the simulated time: undamped chain, no precompression.",
            ),
            2 => (
                "precompression",
                Axis::new("Static force", "N").logarithmic(),
                Axis::new("Largest deviation", "1").logarithmic(),
                "Largest relative deviation of the six frequencies of small motions from the linear chain of Hertz contacts.",
            ),
            4 => (
                "steps",
                Axis::new("Step", "µs").times(1e6).logarithmic(),
                Axis::new("Error of the force", "1").logarithmic(),
                "Error of the force of a hit over its peak, rms over the contact, against a finer step.",
            ),
            15 => (
                "bar",
                Axis::new("Time over 2L/c", "1"),
                Axis::new("Force over ρ c v A", "1"),
                "Force between an elastic bar and a rigid wall, every sample as computed; exact is 1 up to the time 1 and 0 after it. The reduced model rings at its last mode.",
            ),
            _ => return None,
        };
        let looks = [
            Stroke::new(Colour::Black),
            Stroke::new(Colour::Blue).dash(Dash::Dashed),
            Stroke::new(Colour::Vermillion),
            Stroke::new(Colour::Green).dash(Dash::Dotted),
        ];
        let panel = curves.iter().zip(looks).fold(Panel::new(x, y).height(50.0), |panel, (curve, stroke)| {
            panel.line(curve.label.clone(), curve.points.clone(), stroke)
        });
        Some(Plate::new(name, Figure::new(title).sized(0.5 * PAGE_WIDTH_MM, 1).panel(panel)))
    }
}

fn sentence(check: &Check) -> String {
    let note = check.note.as_ref().map_or(String::new(), |note| format!(" ({note})"));
    format!(
        "{}, {}, {}: {} instead of {}{note}.",
        check.name,
        check.rung.name(),
        check.criterion,
        measured(check),
        limit(check)
    )
}

fn table(case: &Case, checks: &[&Check]) -> Table {
    let rows = checks.iter().map(|check| {
        vec![
            check.rung.name().to_owned(),
            check.criterion.clone(),
            measured(check),
            limit(check),
            if check.holds { "pass" } else { "fail" }.to_owned(),
        ]
    });
    Table {
        caption: format!("Case {}: {}.", case.number, case.name),
        columns: vec![
            Column::words("Model"),
            Column::words("Criterion"),
            Column::words("Measured"),
            Column::words("Limit"),
            Column::words("Result"),
        ],
        rows: rows.collect(),
    }
}
