//! Coverage of calibrations by measurement scenario: synthetic records of known truth, made as laboratories store them, through the whole of `calibrate`.

use std::{fs, path::PathBuf, process::ExitCode};

use anyhow::{Context, bail};
use clap::{Parser, Subcommand, ValueEnum};
use serde_json::json;

use granchain_calibration::{plan::Likelihood, problem::program, search::Search};
use granchain_report::page::Table;
use granchain_signal::closest;
use granchain_validate::{
    laboratory::{Condition, Files, LaboratoryCount, LaboratoryPlan, LaboratoryRecord, NAMES, laboratory},
    page::laboratory::{LaboratoryReport, tables},
};

#[derive(Debug, Parser)]
#[command(version, about = "Studies of calibrations that take longer than tests")]
struct Arguments {
    #[command(subcommand)]
    what: What,
}

#[derive(Debug, Subcommand)]
enum What {
    /// How many intervals hold the truth, how many right records are called wrong, how many wrong ones are named
    Coverage(Coverage),
}

#[derive(Debug, clap::Args)]
struct Coverage {
    /// Measurement scenarios: `right`: all whose bench is correct; `wrong`: all with a wrong bench or a faulty record; `all`; or names such as
    /// pretrigger,bits (an unknown name lists all)
    #[arg(long, value_name = "NAME,…", value_delimiter = ',', default_value = "right")]
    scenario: Vec<String>,
    /// Number of synthetic records of each scenario
    #[arg(long, value_name = "N", default_value_t = 8, value_parser = clap::value_parser!(u64).range(1..))]
    count: u64,
    #[arg(long, value_name = "N", default_value_t = 1)]
    seed: u64,
    /// Number of runs of the chain in each fit [default: as calibrate]
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u32).range(200..))]
    evaluations: Option<u32>,
    /// Model that simulates the records (with finer steps) and also fits them
    #[arg(long, default_value = "chain")]
    model: Model,
    /// Compare peaks and bands only, not every sample
    #[arg(long)]
    amplitudes: bool,
    /// Mesh density of the reduced bodies [default: the model's]
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u32).range(2..=128))]
    mesh_density: Option<u32>,
    /// Folder for coverage.json, the report and laboratory.csv
    #[arg(long, value_name = "DIR")]
    out: Option<PathBuf>,
    /// Keep the files of every record and the plan that fits them, in records/ below --out
    #[arg(long, requires = "out")]
    keep_records: bool,
}

#[derive(Debug, Clone, Copy, PartialEq, Eq, ValueEnum)]
enum Model {
    Chain,
    Reduced,
}

fn main() -> ExitCode {
    let What::Coverage(coverage) = Arguments::parse().what;
    match coverage.execute() {
        Ok(()) => ExitCode::SUCCESS,
        Err(error) => {
            eprintln!("error: {error:#}");
            ExitCode::FAILURE
        }
    }
}

/// The scenarios that `all`, `right`, `wrong` and names stand for, each once, in the order of the table.
fn scenarios(names: &[String]) -> anyhow::Result<Vec<Condition>> {
    let all = Condition::all();
    let mut chosen: Vec<Condition> = Vec::new();
    for name in names {
        match name.trim() {
            "all" => chosen.extend(&all),
            "right" => chosen.extend(all.iter().filter(|condition| condition.expected().is_none())),
            "wrong" => chosen.extend(all.iter().filter(|condition| condition.expected().is_some())),
            name => match Condition::named(name) {
                Some(condition) => chosen.push(condition),
                None => {
                    let known: Vec<&str> = all.iter().map(|condition| condition.name()).collect();
                    match closest(name, known.iter().copied()) {
                        Some(near) => bail!("--scenario: unknown scenario `{name}`; did you mean `{near}`?"),
                        None => bail!(
                            "--scenario: unknown scenario `{name}`; expected all, right, wrong or some of {}",
                            known.join(", ")
                        ),
                    }
                }
            },
        }
    }
    Ok(all.into_iter().filter(|condition| chosen.contains(condition)).collect())
}

impl Coverage {
    fn execute(&self) -> anyhow::Result<()> {
        if self.mesh_density.is_some() && self.model == Model::Chain {
            bail!("--mesh-density would do nothing: the chain has no bodies; add --model reduced");
        }
        let plan = LaboratoryPlan {
            conditions: scenarios(&self.scenario)?,
            count: self.count,
            seed: self.seed,
            evaluations: self.evaluations.map_or(Search::tested(2), |runs| runs as usize),
            model: if self.model == Model::Chain { "chain" } else { "reduced" }.into(),
            likelihood: if self.amplitudes { Likelihood::Amplitudes } else { Likelihood::Waveform },
            mesh_density: self.mesh_density,
        };
        let keep = |record: &LaboratoryRecord, files: Option<&Files>| {
            let folder = self.out.as_ref().filter(|_| self.keep_records);
            if let (Some(folder), Some(files)) = (folder, files)
                && let Err(error) = keep(folder, &plan, record, files)
            {
                eprintln!("warning: {error:#}");
            }
        };
        let records = laboratory(&plan, 0..plan.total(), &keep, &|| false)?.unwrap_or_default();
        let count = LaboratoryCount::of(&records);
        println!("made and fitted by model {}", plan.model);
        tables(&count).iter().for_each(print);
        let Some(folder) = &self.out else { return Ok(()) };
        let summary = json!({"program": program(), "plan": plan, "count": count, "records": records});
        write(folder.join("coverage.json"), &serde_json::to_vec_pretty(&summary)?)?;
        for (name, bytes) in page(&plan, count, records).files()? {
            write(folder.join(name), &bytes)?;
        }
        Ok(())
    }
}

/// One line a row, cells parted by two bars.
fn print(table: &Table) {
    let heads: Vec<&str> = table.columns.iter().map(|column| column.title.as_str()).collect();
    println!("\n{}\n{}", table.caption, heads.join(" | "));
    table.rows.iter().for_each(|row| println!("{}", row.join(" | ")));
}

fn write(path: PathBuf, bytes: &[u8]) -> anyhow::Result<()> {
    let folder = path.parent().map_or(Ok(()), fs::create_dir_all);
    folder.and_then(|()| fs::write(&path, bytes)).with_context(|| format!("{}: cannot be written", path.display()))
}

/// `records/SCENARIO-NUMBER/`: the two files, and the plan by which `calibrate` fits them.
fn keep(
    folder: &std::path::Path,
    plan: &LaboratoryPlan,
    record: &LaboratoryRecord,
    files: &Files,
) -> anyhow::Result<()> {
    let setting = &record.setting;
    let place = folder.join(format!("records/{}-{}", setting.condition.name(), setting.number));
    let [horn, vibrometer] = NAMES.map(|name| place.join(name));
    write(horn, &files.horn)?;
    write(vibrometer, &files.vibrometer)?;
    let definition = format!(
        "# {}; fitted by: granchain calibrate --plan {}/plan.toml --drive-frequency {}Hz\n{}",
        setting.condition.words(),
        place.display(),
        setting.given_frequency_hz,
        toml::to_string(&plan.definition(setting))?
    );
    write(place.join("plan.toml"), definition.as_bytes())
}

fn page(plan: &LaboratoryPlan, count: LaboratoryCount, records: Vec<LaboratoryRecord>) -> LaboratoryReport {
    let names: Vec<&str> = plan.conditions.iter().map(|condition| condition.name()).collect();
    let all = plan.conditions.len() == Condition::all().len();
    let density = plan.mesh_density.map_or_else(String::new, |density| format!(" --mesh-density {density}"));
    LaboratoryReport {
        description: format!(
            "{} synthetic records of each scenario, made by {} under an analytic drive (both damping laws, rigid wall, annulus and spring, half-normal \
             gaps of 0.3 nm), written as files, read by the reader, fitted by the model `{}` with {} runs of the chain, and judged as `calibrate` does",
            plan.count,
            if plan.model == "chain" {
                "the chain's adaptive integrator"
            } else {
                "the reduced model on a mesh 2.5 times as dense, at half the step"
            },
            plan.model,
            plan.evaluations
        ),
        conditions: plan.conditions.iter().map(|it| (it.name().to_owned(), it.words().to_owned())).collect(),
        count,
        synthetics: records,
        version: env!("CARGO_PKG_VERSION").into(),
        seed: plan.seed,
        command_line: format!(
            "cargo run --release -p granchain-validate -- coverage --scenario {} --count {} --evaluations {} --seed {} --model {}{density}",
            if all { "all".to_owned() } else { names.join(",") },
            plan.count,
            plan.evaluations,
            plan.seed,
            plan.model
        ),
    }
}
