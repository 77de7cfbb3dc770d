//! `granchain twins --laboratory`: records as other laboratories store them, through the whole of `calibrate`.

use std::{
    fmt::Write,
    sync::{Mutex, PoisonError},
};

use serde::Serialize;

use crate::{
    cli::{
        Outcome,
        arguments::{OutputArguments, Session, usage},
        interrupt,
        output::{OutputFolder, page_results},
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

/// Make, write, read, fit, count.
///
/// # Errors
/// A folder that cannot be written; Ctrl-C.
pub fn execute(
    plan: &LaboratoryPlan,
    records: bool,
    output: &OutputArguments,
    session: &Session,
    mut timing: Timing,
) -> anyhow::Result<Outcome> {
    let folder = output
        .out
        .as_deref()
        .map(|out| OutputFolder::stage(out, &page_results("laboratory.json"), output.force))
        .transpose()?;
    let bar = progress::bar(session, plan.conditions.len() as u64 * plan.count, "records");
    let unwritten = Mutex::new(None);
    let keep = |twin: &LaboratoryTwin, files: Option<&Files>| {
        if let (true, Some(folder), Some(files)) = (records, &folder, files)
            && let Err(error) = keep(folder, plan, &twin.setting, files)
        {
            unwritten.lock().unwrap_or_else(PoisonError::into_inner).get_or_insert(error);
        }
        bar.inc(1);
    };
    let twins = laboratory(plan, &keep, &interrupt::requested)?;
    bar.finish_and_clear();
    let twins = twins.ok_or(interrupt::Interrupted)?;
    if let Some(error) = unwritten.into_inner().unwrap_or_else(PoisonError::into_inner) {
        return Err(error);
    }
    timing.stage("twins");
    let count = LaboratoryCount::of(&twins);
    let summary = LaboratorySummary { program: summary::program(), plan, count: &count, twins: &twins };
    let tables: Vec<String> = tables(&count).iter().map(aligned).collect();
    let mut text = format!("made and fitted by model {}\n{}", plan.model, tables.join("\n"));
    if let Some(folder) = folder {
        folder.write("laboratory.json", summary::json(&summary)?)?;
        for (name, bytes) in page(plan, &count, &twins).files()? {
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
