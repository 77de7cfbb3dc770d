//! `granchain coverage`: synthetic records of known truth, made as laboratories store them, through the whole of `calibrate`: how many intervals hold
//! the truth, how many right models are called wrong, how many wrong ones are named.

mod bench;
mod plan;

use std::{
    ops::Range,
    path::{Path, PathBuf},
    sync::{Mutex, PoisonError},
};

use clap::Args;
use serde::Serialize;
use serde_json::{Value, json};

use super::{
    Outcome,
    arguments::{OutputArguments, Session, Words, one_of, usage, whole},
    calibrate::QUANTITIES,
    interrupt,
    output::{OutputFolder, aligned, page_results, publish},
    parts::{self, Divisible, PartArguments, Parts},
    progress, summary,
    timing::Timing,
};
use crate::{
    calibration::{plan::Likelihood, search::Search},
    feature::Measurand,
    scene::ModelKind,
    signal::closest,
    study::Axis,
    validate::{
        laboratory::{Condition, Files, LaboratoryCount, LaboratoryPlan, LaboratoryRecord, NAMES, Setting, laboratory},
        page::laboratory::{LaboratoryReport, tables},
    },
};

/// Most records of a scenario: a day of eight cores.
const MOST: u64 = 1_000_000;

const SUMMARY: &str = "coverage.json";

/// Records where no number is given.
const COUNT: u64 = 8;

#[derive(Debug, Args)]
#[command(after_help = "Examples:\n  granchain coverage --scenario pretrigger,bits --count 4 --out coverage\n  \
                  granchain coverage --plan plan.toml --count 40 --out coverage\n  \
                  granchain coverage --plan plan.toml --vary drive=0.4:1.6:0.4")]
pub struct Arguments {
    /// Measurement scenarios: `right`: all whose bench is correct; `wrong`: all with a wrong bench or a faulty record; `all`; names such as
    /// pretrigger,bits (an unknown name lists all) [default: right]
    #[arg(long, value_name = "NAME,…", value_delimiter = ',', default_value = "right", hide_default_value = true)]
    pub scenario: Vec<String>,
    /// Recorded quantity, without --scenario only; for a pressure every mount of the disc is fitted [default: velocity]
    #[arg(long, value_parser = one_of(&QUANTITIES), conflicts_with = "scenario")]
    pub quantity: Option<Measurand>,
    /// Records of each bench, at drive levels 1, 1/2, 1/4 …, fitted together (not with --scenario)
    #[arg(long, value_name = "N", default_value_t = 1, value_parser = whole(1_u32, Some(6)), conflicts_with = "scenario")]
    pub records: u32,
    /// Parameters to fit, as with `calibrate --fit` (not with --scenario) [default: alpha,damping]
    #[arg(long, value_name = "NAME,…", value_delimiter = ',', conflicts_with = "scenario")]
    pub fit: Vec<String>,
    /// Plan (TOML) of your own record: its bench, with true values drawn from the posterior of its fit
    #[arg(long, value_name = "FILE", conflicts_with_all = ["scenario", "quantity", "records", "fit", "mesh_density", "keep_records"])]
    pub plan: Option<PathBuf>,
    /// Experiments to plan: values of a scene key, KEY=START:STOP:STEP or KEY=A,B,C, or factors on the recorded horn motion, drive=0.4:1.6:0.4.
    /// Without --count and --wrong nothing is fitted: the expected interval widths take seconds
    #[arg(long, value_name = "KEY=VALUES", value_parser = Axis::parse, requires = "plan")]
    pub vary: Vec<Axis>,
    /// Also fit each record on wrong benches (support, beads, damping law, first gap, radius) and count how often these are rejected
    #[arg(long, requires = "plan")]
    pub wrong: bool,
    /// Print the widths expected if each experiment of --vary is fitted together with the plan's record
    #[arg(long, requires = "vary", conflicts_with = "wrong")]
    pub add_record: bool,
    /// Number of synthetic records of each scenario or experiment; with --fit, --quantity or --records number of benches [default: 8]
    #[arg(long, value_name = "N", value_parser = whole(1_u64, Some(MOST)))]
    pub count: Option<u64>,
    /// Number of runs of the chain in each fit [default: as calibrate]
    #[arg(long, value_name = "N", value_parser = whole(200_u32, Some(100_000)))]
    pub evaluations: Option<u32>,
    /// Model that simulates the records (with finer steps) and also fits them [default: chain; with --plan as calibrate]
    #[arg(long, value_parser = one_of(&MODELS))]
    pub model: Option<ModelKind>,
    /// Compare peaks and bands only, not every sample (`likelihood = "amplitudes"` in a plan)
    #[arg(long)]
    pub amplitudes: bool,
    /// Mesh density of the reduced bodies [default: the model's]
    #[arg(long, value_name = "N", value_parser = whole(2_u32, Some(128)))]
    pub mesh_density: Option<u32>,
    /// Keep the files of every record and the plan that fits them, in records/ below --out
    #[arg(long, requires = "out", conflicts_with = "part")]
    pub keep_records: bool,
    #[command(flatten)]
    pub part: PartArguments,
    #[command(flatten)]
    pub output: OutputArguments,
}

const MODELS: Words<ModelKind, 2> = [
    ("chain", "One degree of freedom per bead", ModelKind::Chain),
    (
        "reduced",
        "Elastic bodies, each described by a few modes and static contact flexibility; about 90 runs with this model in each fit",
        ModelKind::Reduced,
    ),
];

#[derive(Debug, Serialize)]
struct CoverageSummary<'a> {
    program: String,
    plan: &'a LaboratoryPlan,
    count: &'a LaboratoryCount,
    records: &'a [LaboratoryRecord],
}

pub fn execute(arguments: Arguments, session: &Session) -> anyhow::Result<Outcome> {
    if arguments.quantity.is_some() || arguments.records > 1 || !arguments.fit.is_empty() {
        return bench::execute(&arguments, session);
    }
    let keep_records = arguments.keep_records;
    if let Some(part) = arguments.part.part {
        let words: Vec<String> = super::typed().skip(1).collect();
        return parts::write(part, &*divisible(arguments, session.clone(), &words)?, session);
    }
    if let Some(path) = arguments.plan.clone() {
        return plan::Study::new(&path, arguments, session.clone(), super::typed().skip(1))?.run_here();
    }
    Study::new(arguments, session.clone())?.run_here(keep_records)
}

/// The study that the arguments of parts ask for.
pub(super) fn divisible(
    arguments: Arguments,
    session: Session,
    typed: &[String],
) -> anyhow::Result<Box<dyn Divisible>> {
    Ok(match arguments.plan.clone() {
        Some(path) => Box::new(plan::Study::new(&path, arguments, session, typed.iter().cloned())?),
        None => Box::new(Study::new(arguments, session)?),
    })
}

/// The scenarios that `all`, `right`, `wrong` and names stand for, each once, in the order of the table.
fn scenarios(names: &[String]) -> anyhow::Result<Vec<Condition>> {
    let all = Condition::all();
    let mut chosen: Vec<Condition> = Vec::new();
    for name in names {
        match name.trim() {
            "all" => chosen.extend(&all),
            "impact" => {
                return Err(usage("--scenario impact is gone; instead of it write `granchain-impact coverage`"));
            }
            "right" => chosen.extend(all.iter().filter(|condition| condition.expected().is_none())),
            "wrong" => chosen.extend(all.iter().filter(|condition| condition.expected().is_some())),
            name => chosen.push(Condition::named(name).ok_or_else(|| {
                let known = || all.iter().map(|condition| condition.name());
                let remedy = closest(name, known()).map_or_else(
                    || format!("expected all, right, wrong or some of {}", known().collect::<Vec<_>>().join(", ")),
                    |near| format!("did you mean `{near}`?"),
                );
                usage(format!("--scenario: unknown scenario `{name}`; {remedy}"))
            })?),
        }
    }
    Ok(all.into_iter().filter(|condition| chosen.contains(condition)).collect())
}

/// Synthetic records to be made, fitted and counted.
struct Study {
    plan: LaboratoryPlan,
    output: OutputArguments,
    session: Session,
    timing: Timing,
}

impl Study {
    pub(super) fn new(arguments: Arguments, session: Session) -> anyhow::Result<Self> {
        let Arguments { scenario, count, evaluations, model, mesh_density, amplitudes, output, .. } = arguments;
        let model = model.unwrap_or(ModelKind::Chain);
        if mesh_density.is_some() && model == ModelKind::Chain {
            return Err(usage("--mesh-density would do nothing: the chain has no bodies; add --model reduced"));
        }
        let plan = LaboratoryPlan {
            conditions: scenarios(&scenario)?,
            count: count.unwrap_or(COUNT),
            seed: session.seed(),
            evaluations: evaluations.map_or(Search::tested(2), |runs| runs as usize),
            model: model.name().into(),
            likelihood: if amplitudes { Likelihood::Amplitudes } else { Likelihood::Waveform },
            mesh_density,
        };
        Ok(Self { plan, output, session, timing: Timing::start() })
    }

    /// Make, write, read and fit the records `part`, the files of each kept in `kept` where there is such a folder.
    fn outcomes(&self, part: Range<usize>, kept: Option<&OutputFolder>) -> anyhow::Result<Vec<LaboratoryRecord>> {
        let bar = progress::bar(&self.session, part.len() as u64, "records");
        let unwritten = Mutex::new(None);
        let keep = |record: &LaboratoryRecord, files: Option<&Files>| {
            if let (Some(folder), Some(files)) = (kept, files)
                && let Err(error) = keep(folder, &self.plan, &record.setting, files)
            {
                unwritten.lock().unwrap_or_else(PoisonError::into_inner).get_or_insert(error);
            }
            bar.inc(1);
        };
        let records = laboratory(&self.plan, part, &keep, &interrupt::requested)?;
        bar.finish_and_clear();
        let records = records.ok_or(interrupt::Interrupted)?;
        match unwritten.into_inner().unwrap_or_else(PoisonError::into_inner) {
            Some(error) => Err(error),
            None => Ok(records),
        }
    }

    fn run_here(mut self, keep_records: bool) -> anyhow::Result<Outcome> {
        let folder = self.output.stage(&page_results(SUMMARY))?;
        let records = self.outcomes(0..self.plan.total(), folder.as_ref().filter(|_| keep_records))?;
        self.timing.stage("records");
        self.conclude(&records, folder)
    }

    fn conclude(self, records: &[LaboratoryRecord], folder: Option<OutputFolder>) -> anyhow::Result<Outcome> {
        let Self { plan, session, timing, .. } = self;
        let count = LaboratoryCount::of(records);
        let summary = CoverageSummary { program: summary::program(), plan: &plan, count: &count, records };
        let tables: Vec<String> = tables(&count).iter().map(aligned).collect();
        let mut text = format!("made and fitted by model {}\n{}", plan.model, tables.join("\n"));
        if let Some(folder) = folder {
            folder.write(SUMMARY, summary::json(&summary)?)?;
            publish(folder, page(&plan, &count, records).files()?, timing, &session)?;
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
        summary::json(&json!({ "program": summary::program(), "coverage": self.plan }))
    }

    fn run(&self, part: Range<usize>) -> anyhow::Result<Vec<Value>> {
        parts::values(&self.outcomes(part, None)?)
    }

    fn finish(self: Box<Self>, parts: &Parts) -> anyhow::Result<Outcome> {
        let folder = self.output.stage(&page_results(SUMMARY))?;
        self.conclude(&parts.all()?, folder)
    }
}

/// `records/SCENARIO-NUMBER/`: the two files, and the plan by which `calibrate` fits them.
fn keep(folder: &OutputFolder, plan: &LaboratoryPlan, setting: &Setting, files: &Files) -> anyhow::Result<()> {
    let place = format!("records/{}-{}", setting.condition.name(), setting.number);
    let [horn, vibrometer] = NAMES.map(|name| format!("{place}/{name}"));
    folder.write(horn, &files.horn)?;
    folder.write(vibrometer, &files.vibrometer)?;
    let definition = format!(
        "# {}; fitted by: granchain calibrate --plan {place}/plan.toml --drive-frequency {}Hz\n{}",
        setting.condition.words(),
        setting.given_frequency_hz,
        toml::to_string(&plan.definition(setting))?
    );
    folder.write(format!("{place}/plan.toml"), definition)?;
    Ok(())
}

fn page(plan: &LaboratoryPlan, count: &LaboratoryCount, records: &[LaboratoryRecord]) -> LaboratoryReport {
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
        count: count.clone(),
        synthetics: records.to_vec(),
        version: env!("CARGO_PKG_VERSION").into(),
        seed: plan.seed,
        command_line: format!(
            "granchain coverage --scenario {} --count {} --evaluations {} --seed {} --model {}{density}",
            if all { "all".to_owned() } else { names.join(",") },
            plan.count,
            plan.evaluations,
            plan.seed,
            plan.model
        ),
    }
}
