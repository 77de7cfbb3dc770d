//! `granchain twins --laboratory`: records as other laboratories store them, through the whole of `calibrate`.

use std::{
    fmt::Write,
    ops::Range,
    path::Path,
    sync::{Mutex, PoisonError},
};

use serde::Serialize;
use serde_json::{Value, json};

use super::staged;
use crate::{
    cli::{
        Outcome,
        arguments::{OutputArguments, Session, usage},
        interrupt,
        output::OutputFolder,
        parts::{self, Divisible, Parts},
        progress, summary,
        timing::{self, Timing},
    },
    report::{
        laboratory::{LaboratoryReport, tables},
        page::Table,
    },
    study::laboratory::{
        Condition, Files, LaboratoryCount, LaboratoryPlan, LaboratoryTwin, NAMES, Setting, laboratory,
    },
};

/// `laboratory.json`.
#[derive(Debug, Serialize)]
struct LaboratorySummary<'a> {
    program: String,
    plan: &'a LaboratoryPlan,
    count: &'a LaboratoryCount,
    twins: &'a [LaboratoryTwin],
}

/// The conditions that `all`, `right`, `wrong` and names stand for, each once, in the order of the table.
///
/// # Errors
/// A usage error for a name that nobody knows.
pub fn conditions(names: &[String]) -> anyhow::Result<Vec<Condition>> {
    let all = Condition::all();
    let mut asked: Vec<Condition> = Vec::new();
    for name in names {
        match name.trim() {
            "all" => asked.extend(&all),
            "right" => asked.extend(all.iter().filter(|condition| condition.expected().is_none())),
            "wrong" => asked.extend(all.iter().filter(|condition| condition.expected().is_some())),
            name => asked.push(Condition::named(name).ok_or_else(|| {
                let known: Vec<&str> = all.iter().map(|condition| condition.name()).collect();
                usage(format!("--laboratory {name}: expected all, right, wrong or some of {}", known.join(", ")))
            })?),
        }
    }
    Ok(all.into_iter().filter(|condition| asked.contains(condition)).collect())
}

/// Records of other laboratories.
pub struct Study {
    plan: LaboratoryPlan,
    output: OutputArguments,
    session: Session,
    timing: Timing,
}

impl Study {
    /// Of a plan.
    #[must_use]
    pub fn new(plan: LaboratoryPlan, output: OutputArguments, session: Session) -> Self {
        Self { plan, output, session, timing: Timing::start() }
    }

    /// Make, write, read and fit the twins `part`, the files of each kept in `records` where there is such a folder.
    fn outcomes(&self, part: Range<usize>, records: Option<&OutputFolder>) -> anyhow::Result<Vec<LaboratoryTwin>> {
        let bar = progress::bar(&self.session, part.len() as u64, "records");
        let unwritten = Mutex::new(None);
        let keep = |twin: &LaboratoryTwin, files: Option<&Files>| {
            if let (Some(folder), Some(files)) = (records, files)
                && let Err(error) = keep(folder, &self.plan, &twin.setting, files)
            {
                unwritten.lock().unwrap_or_else(PoisonError::into_inner).get_or_insert(error);
            }
            bar.inc(1);
        };
        let twins = laboratory(&self.plan, part, &keep, &interrupt::requested)?;
        bar.finish_and_clear();
        let twins = twins.ok_or(interrupt::Interrupted)?;
        match unwritten.into_inner().unwrap_or_else(PoisonError::into_inner) {
            Some(error) => Err(error),
            None => Ok(twins),
        }
    }

    /// Make, write, read, fit, count; the files of every record are kept where `records` says so.
    ///
    /// # Errors
    /// A folder that cannot be written; Ctrl-C.
    pub fn run_here(mut self, records: bool) -> anyhow::Result<Outcome> {
        let folder = staged(&self.output, "laboratory.json")?;
        let twins = self.outcomes(0..self.plan.total(), folder.as_ref().filter(|_| records))?;
        self.timing.stage("twins");
        self.conclude(&twins, folder)
    }

    fn conclude(mut self, twins: &[LaboratoryTwin], folder: Option<OutputFolder>) -> anyhow::Result<Outcome> {
        let Self { plan, session, timing, .. } = &mut self;
        let count = LaboratoryCount::of(twins);
        let summary = LaboratorySummary { program: summary::program(), plan, count: &count, twins };
        let tables: Vec<String> = tables(&count).iter().map(aligned).collect();
        let mut text = format!("made and fitted by model {}\n{}", plan.model, tables.join("\n"));
        if let Some(folder) = folder {
            folder.write("laboratory.json", summary::json(&summary)?)?;
            for (name, bytes) in page(plan, &count, twins).files()? {
                folder.write(name, bytes)?;
            }
            timing.stage("write");
            folder.write(timing::FILE, timing.to_json())?;
            let place = folder.finish()?;
            session.note(format_args!("written to {}", place.display()));
        } else {
            text.push_str("Nothing was written; pass --out DIR for every record's truth, fit and diagnosis.\n");
        }
        session.result(text, &summary)?;
        Ok(Outcome::Done)
    }
}

impl Divisible for Study {
    fn points(&self) -> usize {
        self.plan.total()
    }

    fn out(&self) -> Option<&Path> {
        self.output.out.as_deref()
    }

    fn plan(&self) -> anyhow::Result<Vec<u8>> {
        summary::json(&json!({ "program": summary::program(), "laboratory": self.plan }))
    }

    fn run(&self, part: Range<usize>) -> anyhow::Result<Vec<Value>> {
        parts::values(&self.outcomes(part, None)?)
    }

    fn finish(self: Box<Self>, parts: &Parts) -> anyhow::Result<Outcome> {
        let folder = staged(&self.output, "laboratory.json")?;
        self.conclude(&parts.all()?, folder)
    }
}

/// `records/CONDITION-NUMBER/`: the two files, and the plan by which `calibrate` fits them.
fn keep(folder: &OutputFolder, plan: &LaboratoryPlan, setting: &Setting, files: &Files) -> anyhow::Result<()> {
    let place = format!("records/{}-{}", setting.condition.name(), setting.number);
    let [horn, vibrometer] = NAMES.map(|name| format!("{place}/{name}"));
    folder.write(horn, &files.horn)?;
    folder.write(vibrometer, &files.vibrometer)?;
    let told = format!(
        "# {}; fitted by: granchain calibrate --plan {place}/plan.toml --drive-frequency {}Hz\n{}",
        setting.condition.words(),
        setting.told_frequency_hz,
        toml::to_string(&plan.definition(setting))?
    );
    folder.write(format!("{place}/plan.toml"), told)?;
    Ok(())
}

/// A table for the terminal: caption, head and rows, columns two blanks apart.
fn aligned(table: &Table) -> String {
    let head: Vec<String> = table.columns.iter().map(|column| column.title.clone()).collect();
    let lines: Vec<&Vec<String>> = std::iter::once(&head).chain(&table.rows).collect();
    let width = |index: usize| {
        lines.iter().filter_map(|line| line.get(index)).map(|cell| cell.chars().count()).max().unwrap_or(0)
    };
    let widths: Vec<usize> = (0..head.len()).map(width).collect();
    let mut text = format!("{}.\n", table.caption);
    for line in lines {
        let cells = line.iter().zip(&widths).zip(&table.columns).map(|((cell, width), column)| {
            if column.numeric { format!("{cell:>width$}") } else { format!("{cell:<width$}") }
        });
        let _ = writeln!(text, "{}", cells.collect::<Vec<_>>().join("  ").trim_end());
    }
    text
}

fn page(plan: &LaboratoryPlan, count: &LaboratoryCount, twins: &[LaboratoryTwin]) -> LaboratoryReport {
    let names: Vec<&str> = plan.conditions.iter().map(|condition| condition.name()).collect();
    let all = plan.conditions.len() == Condition::all().len();
    let density = plan.mesh_density.map_or_else(String::new, |density| format!(" --mesh-density {density}"));
    LaboratoryReport {
        description: format!(
            "{} records a condition, made by {} under an analytic drive (both damping laws, rigid wall, annulus and spring, half-normal gaps of \
             0.3 nm), written as files, read by the reader, fitted by the model `{}` with {} runs of the chain, and judged as `calibrate` does",
            plan.count,
            if plan.model == "chain" {
                "the chain's adaptive integrator"
            } else {
                "the reduced model on a mesh 1.75 times as dense, at half the step"
            },
            plan.model,
            plan.evaluations
        ),
        conditions: plan.conditions.iter().map(|it| (it.name().to_owned(), it.words().to_owned())).collect(),
        count: count.clone(),
        twins: twins.to_vec(),
        version: env!("CARGO_PKG_VERSION").into(),
        seed: plan.seed,
        command_line: format!(
            "granchain twins --laboratory {} --count {} --evaluations {} --seed {} --model {}{density}",
            if all { "all".to_owned() } else { names.join(",") },
            plan.count,
            plan.evaluations,
            plan.seed,
            plan.model
        ),
    }
}
