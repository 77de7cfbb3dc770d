//! `granchain coverage`: coverage on the bench of a plan, and expected interval widths of experiments not yet made.

use std::{
    ops::Range,
    path::{Path, PathBuf},
    sync::Arc,
};

use clap::Args;
use serde_json::{Value, json};

use super::{
    Outcome,
    arguments::{OutputArguments, Session, Words, one_of, usage, whole},
    calibrate::{definition::refused, manifest},
    experiment,
    interrupt::{self, Interrupted},
    output::{OutputFolder, aligned, page_results, publish},
    parts::{self, Divisible, PartArguments, Parts},
    progress, summary,
    timing::Timing,
};
use crate::{
    calibration::{
        Plan, Problem,
        bench::Bench,
        design::{Experiment, OwnBench, OwnCount, OwnPlan, OwnRecord},
        plan::Likelihood,
        problem::DEFAULT_SEED,
    },
    measurement::shell_line,
    report::design::{files, sentences, tables},
    scene::ModelKind,
    study::{Axis, Grid, Value as AxisValue},
};

/// Most records of an experiment: a day of eight cores.
const MOST: u64 = 1_000_000;

const SUMMARY: &str = "coverage.json";

/// Records where no number is given.
const COUNT: u64 = 8;

#[derive(Debug, Args)]
#[command(after_help = "Examples:\n  granchain coverage --plan plan.toml --count 40 --out coverage\n  \
                  granchain coverage --plan plan.toml --vary drive=0.4:1.6:0.4")]
pub struct Arguments {
    /// Plan (TOML) of your own records: their bench, with true values drawn from the posterior of its fit
    #[arg(long, value_name = "FILE")]
    pub plan: PathBuf,
    /// Experiments to plan: values of a scene key, KEY=START:STOP:STEP or KEY=A,B,C, or factors on the recorded horn motion, drive=0.4:1.6:0.4.
    /// Without --count and --wrong nothing is fitted: the expected interval widths are printed within seconds
    #[arg(long, value_name = "KEY=VALUES", value_parser = Axis::parse)]
    pub vary: Vec<Axis>,
    /// Also fit each record on wrong benches (support, beads, damping law, first gap, radius) and count how often these are rejected
    #[arg(long)]
    pub wrong: bool,
    /// Print the widths expected if each experiment of --vary is fitted together with the plan's records
    #[arg(long, requires = "vary", conflicts_with = "wrong")]
    pub add_record: bool,
    /// Number of synthetic records of each experiment [default: 8]
    #[arg(long, value_name = "N", value_parser = whole(1_u64, Some(MOST)))]
    pub count: Option<u64>,
    /// Number of runs of the chain in each fit [default: as calibrate]
    #[arg(long, value_name = "N", value_parser = whole(200_u32, Some(100_000)))]
    pub evaluations: Option<u32>,
    /// Model that simulates the records (with finer steps) and also fits them [default: as calibrate; chain if nothing is fitted]
    #[arg(long, value_parser = one_of(&MODELS))]
    pub model: Option<ModelKind>,
    /// Compare peaks and bands only, not every sample (`likelihood = "amplitudes"` in a plan)
    #[arg(long)]
    pub amplitudes: bool,
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

pub fn execute(arguments: Arguments, session: &Session) -> anyhow::Result<Outcome> {
    if let Some(part) = arguments.part.part {
        let words: Vec<String> = super::typed().skip(1).collect();
        return parts::write(part, &*divisible(arguments, session.clone(), &words)?, session);
    }
    Study::new(arguments, session.clone(), super::typed().skip(1))?.run_here()
}

/// The study that the arguments of parts ask for.
pub(super) fn divisible(
    arguments: Arguments,
    session: Session,
    typed: &[String],
) -> anyhow::Result<Box<dyn Divisible>> {
    Ok(Box::new(Study::new(arguments, session, typed.iter().cloned())?))
}

/// Records of each experiment that is bounded and not fitted.
const BOUNDED: u64 = 3;

/// The axis of `--vary` that is no key of a scene: a factor on the horn's motion.
const LEVEL: &str = "drive";

/// The experiments of a grid; the bench as it was recorded without one.
fn experiments(axes: Vec<Axis>, bench: &Bench) -> anyhow::Result<Vec<Experiment>> {
    if axes.is_empty() {
        return Ok(vec![Experiment::as_recorded()]);
    }
    let grid = Grid::new(axes)?;
    experiment::refuse_wrong_units(bench, &grid)?;
    let experiment = |index: usize| {
        let (mut level, mut set) = (1.0, Vec::new());
        for (axis, value) in grid.axes.iter().zip(grid.values(index)) {
            match value {
                AxisValue::Number(factor) if axis.key == LEVEL && *factor > 0.0 && axis.unit.is_empty() => {
                    level = *factor
                }
                _ if axis.key == LEVEL => {
                    return Err(usage(format!(
                        "--vary {LEVEL}: expected positive factors on the recorded horn motion, such as {LEVEL}=0.4:1.6:0.4, found `{value}`"
                    )));
                }
                value => set.push(format!("{}={value}", axis.key)),
            }
        }
        Ok(Experiment { name: grid.overrides(index).join(" "), level, set, ..Experiment::as_recorded() })
    };
    (0..grid.len()).map(experiment).collect()
}

/// A plan whose bench is to be studied.
struct Study {
    plan: Plan,
    /// The arguments that make it again.
    words: Vec<String>,
    problem: Problem,
    own: OwnPlan,
    output: OutputArguments,
    session: Session,
    timing: Timing,
}

impl Study {
    /// Read what the plan names; `typed` is the command line.
    fn new(arguments: Arguments, session: Session, typed: impl Iterator<Item = String>) -> anyhow::Result<Self> {
        let Arguments { plan, vary, wrong, add_record, count, evaluations, model, amplitudes, output, .. } = arguments;
        let timing = Timing::start();
        let fits = vary.is_empty() || wrong || count.is_some();
        let mut plan = Plan::read(&plan)?;
        // The chain alone says what the waveform bounds.
        let model = model.or((!fits).then_some(ModelKind::Chain));
        plan.set.extend(model.map(|model| format!("model.kind={}", model.name())));
        plan.evaluations = evaluations.map(|runs| runs as usize).or(plan.evaluations);
        plan.seed = session.seed.or(plan.seed).or(Some(DEFAULT_SEED));
        plan.likelihood = amplitudes.then_some(Likelihood::Amplitudes).or(plan.likelihood);
        let problem = Problem::read(&plan).map_err(refused)?;
        let mut experiments = experiments(vary, &problem.lead().bench)?;
        for experiment in &experiments {
            problem.lead().bench.scene_with(&experiment.set)?;
        }
        if add_record {
            if problem.model() != ModelKind::Chain.name() {
                return Err(usage(format!(
                    "--add-record with --count: expected the model `chain`, which alone fits several records together, found `{}`; add --model chain, or \
                     leave --count out: the expected widths are those of the chain",
                    problem.model()
                )));
            }
            let added = experiments.into_iter().map(Experiment::in_addition);
            experiments = std::iter::once(Experiment::as_recorded()).chain(added).collect();
        }
        if wrong {
            let both = |it: Experiment| [it.with_wrong_benches(&problem), vec![it]].into_iter().rev().flatten();
            experiments = experiments.into_iter().flat_map(both).collect();
        }
        let count = count.unwrap_or(if fits { COUNT } else { BOUNDED });
        let own = OwnPlan { experiments, count, seed: session.seed(), fits, widen: plan.widen };
        Ok(Self { plan, words: manifest::typed(typed), problem, own, output, session, timing })
    }

    fn records(&self, part: Range<usize>) -> anyhow::Result<Vec<OwnRecord>> {
        let bench =
            OwnBench::fit(self.plan.clone(), &self.problem, Arc::new(interrupt::requested))?.ok_or(Interrupted)?;
        let bar = progress::bar(&self.session, part.len() as u64, "records");
        let records = bench.records(&self.own, part, &|| bar.inc(1))?;
        bar.finish_and_clear();
        Ok(records.ok_or(Interrupted)?)
    }

    fn run_here(mut self) -> anyhow::Result<Outcome> {
        let folder = self.output.stage(&page_results(SUMMARY))?;
        let records = self.records(0..self.own.total())?;
        self.timing.stage("records");
        self.conclude(&records, folder)
    }

    fn conclude(self, records: &[OwnRecord], folder: Option<OutputFolder>) -> anyhow::Result<Outcome> {
        let Self { plan, words, problem, own, session, timing, .. } = self;
        let (count, model) = (OwnCount::of(&own, records), problem.model());
        let summary = json!({
            "program": summary::program(), "plan": plan, "model": model, "study": own, "count": count, "records": records
        });
        for it in &count.0 {
            let why = it.refusal.iter().filter(|_| it.wrong.is_none());
            why.for_each(|why| {
                session.note(format_args!("warning: {}: {} records without a fit: {why}", it.name, it.refused))
            });
        }
        if let Some(folder) = folder {
            folder.write(SUMMARY, summary::json(&summary)?)?;
            let facts = [("version", env!("CARGO_PKG_VERSION").to_owned()), ("seed", own.seed.to_string())];
            let command_line = shell_line(["granchain"].into_iter().chain(words.iter().map(String::as_str)));
            let facts = facts.map(|(name, value)| (name.to_owned(), value)).to_vec();
            publish(folder, files(&own, &count, model, facts, &command_line)?, timing, &session)?;
        }
        let tables: Vec<String> = tables(&own, &count).iter().map(aligned).collect();
        session.result(format!("{}{}\n", tables.join("\n"), sentences(&count).join("\n")), &summary)?;
        Ok(Outcome::Done)
    }
}

impl Divisible for Study {
    fn points(&self) -> usize {
        self.own.total()
    }

    fn out(&self) -> Option<&Path> {
        self.output.out.as_deref()
    }

    fn plan(&self) -> anyhow::Result<Vec<u8>> {
        let keys: Vec<String> = self.problem.candidates.iter().map(|candidate| self.problem.key(candidate)).collect();
        summary::json(&json!({ "program": summary::program(), "plan": self.plan, "study": self.own, "fits": keys }))
    }

    fn run(&self, part: Range<usize>) -> anyhow::Result<Vec<Value>> {
        parts::values(&self.records(part)?)
    }

    fn finish(self: Box<Self>, parts: &Parts) -> anyhow::Result<Outcome> {
        let folder = self.output.stage(&page_results(SUMMARY))?;
        self.conclude(&parts.all()?, folder)
    }
}
