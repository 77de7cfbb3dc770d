//! Coverage on the user's own bench, and expected interval widths of experiments not yet made: `--plan`, `--vary`, `--wrong`.

use std::{
    ops::Range,
    path::{Path, PathBuf},
};

use serde::Serialize;
use serde_json::{Value, json};

use super::{Arguments, SUMMARY, aligned};
use crate::{
    calibration::{Plan, Problem, plan::Likelihood, problem::DEFAULT_SEED},
    cli::{
        Outcome,
        arguments::{OutputArguments, Session, usage},
        calibrate::definition::refused,
        interrupt::{self, Interrupted},
        output::page_results,
        parts::{self, Divisible, Parts},
        progress, summary,
        timing::{self, Timing},
    },
    measurement::shell_line,
    study::{Axis, Grid, grid::Value as AxisValue},
    validate::{
        own_bench::{Experiment, OwnBench, OwnCount, OwnPlan, OwnRecord},
        page::own_bench::{OwnBenchReport, sentences, tables},
    },
};

/// Records of each experiment that is bounded and not fitted.
const BOUNDED: u64 = 3;

/// The axis of `--vary` that is no key of a scene: a factor on the horn's motion.
const LEVEL: &str = "drive";

/// The experiments of a grid; the bench as it was recorded without one.
fn experiments(axes: Vec<Axis>) -> anyhow::Result<Vec<Experiment>> {
    if axes.is_empty() {
        return Ok(vec![Experiment { name: "as recorded".into(), level: 1.0, set: vec![] }]);
    }
    let grid = Grid::new(axes)?;
    let experiment = |index: usize| {
        let (mut level, mut set) = (1.0, Vec::new());
        for (axis, value) in grid.axes.iter().zip(grid.values(index)) {
            match value {
                AxisValue::Number(factor) if axis.key == LEVEL && *factor > 0.0 && axis.unit.is_empty() => {
                    level = *factor
                }
                _ if axis.key == LEVEL => {
                    return Err(usage(format!(
                        "--vary {LEVEL}={value}: expected positive factors on the recorded horn motion, such as {LEVEL}=0.4:1.6:0.4"
                    )));
                }
                value => set.push(format!("{}={value}", axis.key)),
            }
        }
        Ok(Experiment { name: grid.overrides(index).join(" "), level, set })
    };
    (0..grid.len()).map(experiment).collect()
}

#[derive(Debug, Serialize)]
struct OwnSummary<'a> {
    program: String,
    plan: &'a Plan,
    study: &'a OwnPlan,
    model: &'a str,
    count: &'a OwnCount,
    records: &'a [OwnRecord],
}

fn words(path: &Path, arguments: &Arguments) -> Vec<String> {
    let mut words = vec!["granchain".into(), "coverage".into(), "--plan".into(), path.display().to_string()];
    let mut flag = |name: &str, value: Option<String>| {
        words.extend(value.map(|value| [format!("--{name}"), value]).into_iter().flatten())
    };
    for Axis { key, values, .. } in &arguments.vary {
        let values: Vec<String> = values.iter().map(ToString::to_string).collect();
        flag("vary", Some(format!("{key}={}", values.join(","))));
    }
    flag("count", arguments.count.map(|count| count.to_string()));
    flag("evaluations", arguments.evaluations.map(|runs| runs.to_string()));
    flag("model", arguments.model.map(|model| model.kind().to_owned()));
    flag("seed", arguments.session.seed.map(|seed| seed.to_string()));
    let switches = [("--wrong", arguments.wrong), ("--amplitudes", arguments.amplitudes)];
    words.extend(switches.into_iter().filter(|(_, on)| *on).map(|(name, _)| name.to_owned()));
    words
}

/// A plan whose bench is to be studied.
pub struct Study {
    path: PathBuf,
    /// The command line that makes it again.
    words: Vec<String>,
    plan: Plan,
    problem: Problem,
    own: OwnPlan,
    output: OutputArguments,
    session: Session,
    timing: Timing,
}

impl Study {
    /// Read what the plan names.
    pub fn new(path: PathBuf, arguments: Arguments) -> anyhow::Result<Self> {
        let words = words(&path, &arguments);
        let Arguments { vary, wrong, count, evaluations, model, amplitudes, output, session, .. } = arguments;
        let timing = Timing::start();
        let mut plan = Plan::read(&path)?;
        // Runs that are only bounded are the chain's.
        let fits = vary.is_empty() || wrong || count.is_some();
        let model = model.map(super::RecordModel::kind).or((!fits).then_some("chain"));
        plan.set.extend(model.map(|kind| format!("model.kind={kind}")));
        plan.evaluations = evaluations.map(|runs| runs as usize).or(plan.evaluations);
        plan.seed = session.seed.or(plan.seed).or(Some(DEFAULT_SEED));
        plan.likelihood = amplitudes.then_some(Likelihood::Amplitudes).or(plan.likelihood);
        let problem = Problem::read(&plan).map_err(refused)?;
        let experiments = experiments(vary)?;
        for experiment in &experiments {
            problem.lead().bench.scene_with(&experiment.set)?;
        }
        let count = count.unwrap_or(if fits { super::COUNT } else { BOUNDED });
        let own = OwnPlan { experiments, count, seed: session.seed(), wrong, fits };
        Ok(Self { path, words, plan, problem, own, output, session, timing })
    }

    fn records(&self, part: Range<usize>) -> anyhow::Result<Vec<OwnRecord>> {
        let bench = OwnBench::fit(self.plan.clone(), &self.problem, &interrupt::requested)?.ok_or(Interrupted)?;
        let bar = progress::bar(&self.session, part.len() as u64, "records");
        let records = bench.records(&self.own, part, &|| bar.inc(1), &interrupt::requested)?;
        bar.finish_and_clear();
        Ok(records.ok_or(Interrupted)?)
    }

    pub fn run_here(mut self) -> anyhow::Result<Outcome> {
        let records = self.records(0..self.own.total())?;
        self.timing.stage("records");
        self.conclude(&records)
    }

    fn conclude(mut self, records: &[OwnRecord]) -> anyhow::Result<Outcome> {
        let folder = self.output.stage(&page_results(SUMMARY))?;
        let Self { path, words, plan, problem, own, session, timing, .. } = &mut self;
        let (count, model) = (OwnCount::of(own, records), problem.model());
        let summary = OwnSummary { program: summary::program(), plan, study: own, model, count: &count, records };
        let mut text = tables(own, &count).iter().map(aligned).collect::<Vec<_>>().join("\n");
        text.extend(sentences(own, &count).into_iter().map(|sentence| sentence + "\n"));
        let refusals = count.0.iter().filter_map(|it| Some((it.name.as_str(), it.refusal.as_deref()?)));
        for (name, why) in refusals {
            session.note(format_args!("warning: {name}: a record gave no fit: {why}"));
        }
        if let Some(folder) = folder {
            folder.write(SUMMARY, summary::json(&summary)?)?;
            let facts = vec![
                ("plan".into(), path.display().to_string()),
                ("version".into(), env!("CARGO_PKG_VERSION").into()),
                ("seed".into(), own.seed.to_string()),
            ];
            let command_line = shell_line(words.iter().map(String::as_str));
            folder.write_all(OwnBenchReport { plan: own, count: &count, model, facts, command_line }.files()?)?;
            timing.stage("write");
            folder.write(timing::FILE, timing.to_json())?;
            session.note(format_args!("written to {}", folder.finish()?.display()));
        }
        session.result(text, &summary)?;
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
        let records = parts.all()?;
        self.conclude(&records)
    }
}
