//! `granchain twins`: make records with known truth, fit them, count.

mod laboratory;
mod levels;

use std::{fmt::Write, ops::Range, path::Path};

use clap::{Args, ValueEnum};
use serde::{Deserialize, Serialize};
use serde_json::Value;

use super::{
    Outcome,
    arguments::{OutputArguments, Session, usage},
    calibrate::{
        QuantityChoice,
        definition::{refused, uncertainties},
    },
    interrupt,
    output::{OutputFolder, page_results},
    parts::{self, Divisible, PartArguments, Parts},
    progress, summary,
    timing::{self, Timing},
};
use crate::{
    calibration::{
        joint::TESTED_TOGETHER, parameter::Parameter, search::Search, twin::Flaw, uncertainty::StatedUncertainty,
    },
    report::{
        number::significant,
        twins::{TwinFit as PageFit, TwinInterval, TwinsReport},
    },
    scene::{self, DampingKind, Scene},
    study::laboratory::LaboratoryPlan,
    study::twins::{FittedBy, TwinOutcome, TwinPlan, TwinProof, proof, twins, water_twins},
};

/// Overrides of the built-in annulus from which twins are made: long enough for the burst, a slow onset and the decay.
const OVERRIDES: [&str; 1] = ["duration=900us"];

/// The same of the built-in scene with water: the sound of the burst has passed.
const WATER_OVERRIDES: [&str; 1] = ["duration=480us"];

/// Most twins of a kind: a day of eight cores.
const MOST_TWINS: u64 = 1_000_000;

/// Twins of each condition of a laboratory.
const LABORATORY_COUNT: u64 = 8;

/// Arguments of `granchain twins`.
#[derive(Debug, Args)]
#[command(after_help = "Example:\n  granchain twins --count 8 --out twins")]
pub struct Arguments {
    /// Twins whose model is right: both supports, both damping laws, 0–3 % noise, five sample rates [default: 80; 8 of each --laboratory]
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u64).range(..=MOST_TWINS), help_heading = "Study")]
    pub count: Option<u64>,
    /// Records as other laboratories store them, made by a path that no fit shares and put through the whole of `calibrate`: all, right, wrong, or
    /// conditions by name, such as pretrigger,eight-bit
    #[arg(long, value_name = "NAME,…", value_delimiter = ',', help_heading = "Study")]
    pub laboratory: Vec<String>,
    /// Keep the files of every --laboratory record and the plan that fits them, in records/ below --out
    #[arg(long, requires_all = ["laboratory", "out"], conflicts_with = "part", help_heading = "Study")]
    pub records: bool,
    /// What the twins record: velocity on annulus and rigid wall, or pressure behind a disc on three mounts [default: velocity]
    #[arg(long, value_enum, help_heading = "Study")]
    pub quantity: Option<QuantityChoice>,
    /// Twins of each kind of wrong model: support 30 % softer, other damping law, a missing bead; of a velocity only [default: 1]
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u64).range(..=MOST_TWINS), help_heading = "Study")]
    pub wrong: Option<u64>,
    /// Runs of the chain's search, a fit [default: 600; 1800 for more than two parameters; 1200 for several levels]
    #[arg(long, value_name = "N",
          value_parser = clap::value_parser!(u32).range(200..=100_000), help_heading = "Study")]
    pub evaluations: Option<u32>,
    /// Model that makes the twins
    #[arg(long, value_enum, default_value = "chain", help_heading = "Study")]
    pub model: TwinModel,
    /// Mesh density of the reduced bodies [default: the model's]
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u32).range(2..=128), help_heading = "Study")]
    pub mesh_density: Option<u32>,
    /// Drive levels each twin is recorded at, every one half the level before, fitted together and each by itself
    #[arg(long, value_name = "N", default_value_t = 1, value_parser = clap::value_parser!(u32).range(1..=6), help_heading = "Study")]
    pub levels: u32,
    /// Parameters of the twins, as of `calibrate --fit`
    #[arg(long, value_name = "NAME,…", value_delimiter = ',', default_value = "alpha,damping", help_heading = "Study")]
    pub parameters: Vec<String>,
    /// What is drawn into every truth and into every run of a fit, as of `calibrate --uncertainty`; repeatable
    #[arg(long, value_name = "NAME=VALUE", help_heading = "Study")]
    pub uncertainty: Vec<String>,
    /// Damping law of all twins [default: linear and Kuwabara–Kono alternate]
    #[arg(long, value_name = "LAW", help_heading = "Study")]
    pub damping: Option<String>,
    /// What fits them [default: the chain for twins of the chain, else the whole ladder]
    #[arg(long, value_enum, help_heading = "Study")]
    pub fit: Option<FitChoice>,
    /// Which part of the twins is made and fitted.
    #[command(flatten)]
    pub part: PartArguments,
    /// Where results go.
    #[command(flatten)]
    pub output: OutputArguments,
    /// Session flags.
    #[command(flatten)]
    pub session: Session,
}

/// `--model`.
#[derive(Debug, Clone, Copy, PartialEq, Eq, ValueEnum)]
pub enum TwinModel {
    /// One unknown a bead
    Chain,
    /// Modes and quasi-static contact nodes; some 90 runs of it a fit
    Reduced,
}

impl TwinModel {
    /// The word of the scene key `model.kind`.
    fn kind(self) -> &'static str {
        match self {
            Self::Chain => "chain",
            Self::Reduced => "reduced",
        }
    }
}

/// `--fit`.
#[derive(Debug, Clone, Copy, PartialEq, Eq, ValueEnum)]
pub enum FitChoice {
    /// The search on the chain with Hertz contacts alone, to see what it leaves out
    Chain,
    /// The same with contacts as the twins' bodies have them at rest
    FiniteBody,
    /// That search, corrected on the model that made the twins
    Ladder,
}

/// `twins.json`.
#[derive(Debug, Serialize)]
struct TwinsSummary<'a> {
    program: String,
    /// Which made them; `plan.fit` says what fitted them.
    model: &'a str,
    plan: TwinPlan,
    proof: &'a TwinProof,
    twins: &'a [TwinOutcome],
}

/// A twin in a part file. JSON has one word, null, for a law or mount that was not tested and for one left undecided; a part keeps them apart.
#[derive(Debug, Serialize, Deserialize)]
struct PartTwin {
    twin: TwinOutcome,
    law_tested: bool,
    mount_tested: bool,
}

impl From<TwinOutcome> for PartTwin {
    fn from(twin: TwinOutcome) -> Self {
        Self { law_tested: twin.named_law.is_some(), mount_tested: twin.named_mount.is_some(), twin }
    }
}

impl From<PartTwin> for TwinOutcome {
    fn from(PartTwin { twin, law_tested, mount_tested }: PartTwin) -> Self {
        let named_law = law_tested.then(|| twin.named_law.flatten());
        let named_mount = mount_tested.then(|| twin.named_mount.flatten());
        Self { named_law, named_mount, ..twin }
    }
}

/// Run it.
///
/// # Errors
/// A folder that cannot be written; Ctrl-C.
pub fn execute(arguments: Arguments) -> anyhow::Result<Outcome> {
    if let Some(part) = arguments.part.part {
        let session = arguments.session.clone();
        return parts::write(part, divisible(arguments)?.as_ref(), &session);
    }
    let records = arguments.records;
    match Kind::of(arguments)? {
        Kind::Usual(study) => study.run_here(),
        Kind::Levels(study) => study.run_here(),
        Kind::Laboratory(study) => study.run_here(records),
    }
}

/// The twins that flags ask for.
enum Kind {
    Usual(Box<Study>),
    Levels(Box<levels::Study>),
    Laboratory(Box<laboratory::Study>),
}

impl Kind {
    fn of(arguments: Arguments) -> anyhow::Result<Self> {
        let laboratory = !arguments.laboratory.is_empty();
        if !laboratory && arguments.levels == 1 {
            return Ok(Self::Usual(Box::new(Study::new(arguments)?)));
        }
        let plan = plan_of(&arguments)?;
        if laboratory {
            let plan = laboratory_plan(&arguments, &plan)?;
            return Ok(Self::Laboratory(Box::new(laboratory::Study::new(plan, arguments.output, arguments.session))));
        }
        refuse_beside_levels(&arguments)?;
        let Arguments { levels, output, session, .. } = arguments;
        Ok(Self::Levels(Box::new(levels::Study::new(plan, levels, output, session)?)))
    }
}

/// The twins that flags ask for, to be run in parts.
pub(super) fn divisible(arguments: Arguments) -> anyhow::Result<Box<dyn Divisible>> {
    Ok(match Kind::of(arguments)? {
        Kind::Usual(study) => study,
        Kind::Levels(study) => study,
        Kind::Laboratory(study) => study,
    })
}

/// The folder of results whose summary is `summary`, where one is asked for.
fn staged(output: &OutputArguments, summary: &str) -> anyhow::Result<Option<OutputFolder>> {
    let stage = |out| OutputFolder::stage(out, &page_results(summary), output.force);
    Ok(output.out.as_deref().map(stage).transpose()?)
}

fn refuse_beside_levels(arguments: &Arguments) -> anyhow::Result<()> {
    let Arguments { quantity, wrong, model, fit, .. } = arguments;
    let wrong = wrong.is_some_and(|wrong| wrong > 0);
    if *quantity == Some(QuantityChoice::Pressure) || *model == TwinModel::Reduced || fit.is_some() || wrong {
        return Err(usage(
            "twins at several drive levels are velocities made and fitted by the chain: --quantity pressure, --model reduced, --fit and \
             --wrong do not go with --levels",
        ));
    }
    Ok(())
}

/// Twins of one record each, with the bench they are made on.
pub(super) struct Study {
    base: Scene,
    plan: TwinPlan,
    pressure: bool,
    model: TwinModel,
    mesh_density: Option<u32>,
    output: OutputArguments,
    session: Session,
    timing: Timing,
}

impl Study {
    /// Refuse flags that do not go together, and read the bench.
    pub fn new(arguments: Arguments) -> anyhow::Result<Self> {
        let study = plan_of(&arguments)?;
        let Arguments { quantity, wrong, model, mesh_density, fit, output, session, .. } = arguments;
        let timing = Timing::start();
        let pressure = quantity == Some(QuantityChoice::Pressure);
        if pressure && (model == TwinModel::Reduced || fit.is_some() || wrong.is_some_and(|wrong| wrong > 0)) {
            return Err(usage(
                "twins of a pressure are made and fitted by the chain before the disc, on all three mounts: --model reduced, --fit and --wrong \
                 do not go with --quantity pressure",
            ));
        }
        let wrong = if pressure { 0 } else { wrong.unwrap_or(1) };
        if mesh_density.is_some() && model == TwinModel::Chain {
            return Err(usage("--mesh-density would do nothing: twins of the chain have no bodies"));
        }
        let (scene, own) = if pressure { ("water", WATER_OVERRIDES) } else { ("annulus", OVERRIDES) };
        let mut overrides = own.map(String::from).to_vec();
        overrides.push(format!("model.kind={}", model.kind()));
        overrides.extend(mesh_density.map(|density| format!("model.mesh_density={density}")));
        let base = scene::load(scene, &overrides)?;
        let fit = match (model, fit) {
            (TwinModel::Chain, Some(FitChoice::Ladder | FitChoice::FiniteBody)) => {
                return Err(usage(
                    "twins of the chain have no bodies: --fit ladder and --fit finite-body need --model reduced",
                ));
            }
            (TwinModel::Chain, _) | (_, Some(FitChoice::Chain)) => FittedBy::Chain,
            (TwinModel::Reduced, Some(FitChoice::FiniteBody)) => FittedBy::FiniteBody,
            (TwinModel::Reduced, _) => FittedBy::Ladder,
        };
        let plan = TwinPlan { wrong, fit, ..study };
        Ok(Self { base, plan, pressure, model, mesh_density, output, session, timing })
    }

    /// Make and fit the twins `part`.
    fn outcomes(&self, part: Range<u64>) -> anyhow::Result<Vec<TwinOutcome>> {
        let bar = progress::bar(&self.session, part.end - part.start, "twins");
        let outcomes = if self.pressure {
            water_twins(&self.base, &self.plan, part, &|| bar.inc(1), &interrupt::requested)
        } else {
            twins(&self.base, &self.plan, part, &|| bar.inc(1), &interrupt::requested)?
        };
        bar.finish_and_clear();
        Ok(outcomes.ok_or(interrupt::Interrupted)?)
    }

    fn run_here(mut self) -> anyhow::Result<Outcome> {
        let folder = staged(&self.output, "twins.json")?;
        let outcomes = self.outcomes(0..self.plan.total())?;
        self.timing.stage("twins");
        self.conclude(&outcomes, folder)
    }

    /// Count, write and print what came out.
    fn conclude(mut self, outcomes: &[TwinOutcome], folder: Option<OutputFolder>) -> anyhow::Result<Outcome> {
        let proof = proof(outcomes);
        let summary = TwinsSummary {
            program: summary::program(),
            model: self.model.kind(),
            plan: self.plan.clone(),
            proof: &proof,
            twins: outcomes,
        };
        if let Some(folder) = folder {
            folder.write("twins.json", summary::json(&summary)?)?;
            let made_by = (self.model.kind(), self.pressure);
            for (name, bytes) in page(outcomes, &proof, &self.plan, made_by, self.mesh_density).files()? {
                folder.write(name, bytes)?;
            }
            self.timing.stage("write");
            folder.write(timing::FILE, self.timing.to_json())?;
            let place = folder.finish()?;
            self.session.note(format_args!("written to {}", place.display()));
        }
        self.session.result(text(&proof, self.output.out.as_deref()), &summary)?;
        Ok(Outcome::Done)
    }
}

impl Divisible for Study {
    fn points(&self) -> usize {
        self.plan.total() as usize
    }

    fn out(&self) -> Option<&Path> {
        self.output.out.as_deref()
    }

    fn plan(&self) -> anyhow::Result<Vec<u8>> {
        let scene = summary::scene_digest(&self.base);
        summary::json(&serde_json::json!({ "program": summary::program(), "scene_sha256": scene, "twins": self.plan }))
    }

    fn run(&self, part: Range<usize>) -> anyhow::Result<Vec<Value>> {
        let twins = self.outcomes(part.start as u64..part.end as u64)?.into_iter().map(PartTwin::from);
        parts::values(&twins.collect::<Vec<_>>())
    }

    fn finish(self: Box<Self>, parts: &Parts) -> anyhow::Result<Outcome> {
        let folder = staged(&self.output, "twins.json")?;
        let twins = parts.all::<PartTwin>()?.into_iter().map(TwinOutcome::from).collect::<Vec<_>>();
        self.conclude(&twins, folder)
    }
}

/// What flags say of any kind of twins.
fn plan_of(arguments: &Arguments) -> anyhow::Result<TwinPlan> {
    let Arguments { count, evaluations, levels, parameters, uncertainty, damping, session, .. } = arguments;
    if let Some(unknown) = parameters.iter().find(|name| !Parameter::names().contains(&name.as_str())) {
        return Err(usage(format!("--parameters {unknown}: expected {}", Parameter::names().join(", "))));
    }
    let law = |name: &String| {
        let known = || DampingKind::ALL.into_iter().filter(|kind| *kind != DampingKind::None);
        let expected = || known().map(DampingKind::name).collect::<Vec<_>>().join(", ");
        let found = known().find(|kind| kind.name() == name);
        found.ok_or_else(|| usage(format!("--damping {name}: expected one of {}", expected())))
    };
    let tested = if *levels > 1 { TESTED_TOGETHER } else { Search::tested(parameters.len()) };
    let usual = scene::load("annulus", &[])?;
    Ok(TwinPlan {
        count: count.unwrap_or(TwinPlan::default().count),
        wrong: 0,
        evaluations: evaluations.map_or(tested, |runs| runs as usize),
        seed: session.seed(),
        fit: FittedBy::Chain,
        parameters: parameters.clone(),
        uncertainty: StatedUncertainty::new(&uncertainties(uncertainty)?.into_iter().collect())
            .and_then(|stated| stated.of(&usual, None))
            .map_err(refused)?,
        law: damping.as_ref().map(law).transpose()?,
    })
}

/// What flags say of records of other laboratories.
fn laboratory_plan(arguments: &Arguments, study: &TwinPlan) -> anyhow::Result<LaboratoryPlan> {
    let usual = TwinPlan::default();
    let drawn_otherwise =
        study.parameters != usual.parameters || study.uncertainty != usual.uncertainty || study.law.is_some();
    let other = arguments.quantity == Some(QuantityChoice::Pressure) || arguments.levels > 1 || arguments.fit.is_some();
    if drawn_otherwise || other || arguments.wrong.is_some() {
        return Err(usage(
            "records of other laboratories are velocities from which α and one damping coefficient are fitted, and their conditions say what is \
             drawn: --quantity pressure, --levels, --fit, --wrong, --parameters, --uncertainty and --damping do not go with --laboratory",
        ));
    }
    if arguments.mesh_density.is_some() && arguments.model == TwinModel::Chain {
        return Err(usage("--mesh-density would do nothing: the chain has no bodies; add --model reduced"));
    }
    Ok(LaboratoryPlan {
        conditions: laboratory::conditions(&arguments.laboratory)?,
        count: arguments.count.unwrap_or(LABORATORY_COUNT),
        seed: study.seed,
        evaluations: study.evaluations,
        model: if arguments.model == TwinModel::Chain { "chain" } else { "reduced" }.into(),
        mesh_density: arguments.mesh_density,
    })
}

fn statements(proof: &TwinProof) -> Vec<String> {
    let count = proof.parameters.first().map_or(0, |parameter| parameter.count);
    let mut said: Vec<String> = proof
        .parameters
        .iter()
        .map(|parameter| {
            format!(
                "{}: {} of {} intervals hold the truth ({:.1} ± {:.1} %; 90 % is claimed); median width {}, median error {} and \
                 median signed error {:+.4} in ln",
                parameter.name,
                parameter.covered,
                parameter.count,
                100.0 * parameter.covered as f64 / parameter.count.max(1) as f64,
                100.0 * parameter.binomial_error,
                significant(parameter.median_width, 2),
                significant(parameter.median_error, 2),
                parameter.median_bias,
            )
        })
        .collect();
    said.push(format!(
        "of {count} right models {} were called outside scatter, {} not converged, {} gave no fit at all",
        proof.false_alarms, proof.unconverged, proof.without_fit
    ));
    if proof.law_tests > 0 {
        said.push(format!(
            "of {} twins fitted with both damping laws the right one was named in {}, {} were left undecided",
            proof.law_tests, proof.right_law, proof.undecided_law
        ));
    }
    if proof.mount_tests > 0 {
        said.push(format!(
            "of {} twins fitted on every mount the right one was named in {}, {} were left undecided",
            proof.mount_tests, proof.right_mount, proof.undecided_mount
        ));
    }
    for (flaw, unmasked, count) in &proof.unmasked {
        let kind = match flaw {
            Flaw::None => continue,
            Flaw::SofterSupport => "support 30 % softer than the model's",
            Flaw::OtherLaw => "other damping law than the model's",
            Flaw::MissingBead => "one bead fewer than the model",
        };
        said.push(format!("wrong model, {kind}: {unmasked} of {count} did not end within scatter"));
    }
    said
}

fn text(proof: &TwinProof, out: Option<&Path>) -> String {
    let mut text = String::new();
    for statement in statements(proof) {
        let _ = writeln!(text, "{statement}");
    }
    if out.is_none() {
        text.push_str("Nothing was written; pass --out DIR for the figure and the table of all twins.\n");
    }
    text
}

fn page(
    outcomes: &[TwinOutcome],
    proof: &TwinProof,
    plan: &TwinPlan,
    (model, pressure): (&str, bool),
    mesh_density: Option<u32>,
) -> TwinsReport {
    let fitted = outcomes.iter().filter(|outcome| outcome.flaw == Flaw::None).filter_map(|outcome| {
        let (truth, fit) = (outcome.truth.as_ref()?, outcome.fit.as_ref().ok()?);
        let interval = |(estimate, truth): (&crate::calibration::fit::Estimate, &f64)| TwinInterval {
            truth: *truth,
            value: estimate.median,
            low: estimate.low,
            high: estimate.high,
        };
        Some(PageFit {
            index: truth.index,
            group: format!("{}, {}", truth.support, truth.damping_kind),
            intervals: fit.estimates.iter().zip(&truth.values).map(interval).collect(),
        })
    });
    let description = if pressure {
        format!(
            "{} records of a hydrophone made with known parameters by the chain before a disc on water at half the step (six beads; disc \
             clamped, supported, free; linear and Kuwabara–Kono damping, 0–3 % noise, 2.5–20 MHz sampling, unknown trigger and baseline), \
             each fitted with {} runs on every mount; intervals are those on the true mount",
            plan.count, plan.evaluations
        )
    } else {
        format!(
            "{} records made with known parameters by {} (six beads, annulus and rigid wall, linear and Kuwabara–Kono damping, 0–3 % \
             noise, 1.25–10 MHz sampling, unknown trigger and baseline), each fitted with {} runs of the chain{}",
            plan.count,
            if model == "chain" { "the chain's accurate integrator" } else { "the reduced model" },
            plan.evaluations,
            if plan.fit == FittedBy::Ladder { " and corrected on the reduced model" } else { "" },
        )
    };
    let command_line = if pressure {
        format!(
            "granchain twins --quantity pressure --count {} --evaluations {} --seed {}{}",
            plan.count,
            plan.evaluations,
            plan.seed,
            further_flags(plan)
        )
    } else {
        format!(
            "granchain twins --count {} --wrong {} --evaluations {} --seed {} --model {model} --fit {}{}{}",
            plan.count,
            plan.wrong,
            plan.evaluations,
            plan.seed,
            match plan.fit {
                FittedBy::Chain => "chain",
                FittedBy::FiniteBody => "finite-body",
                FittedBy::Ladder => "ladder",
            },
            mesh_density.map_or_else(String::new, |density| format!(" --mesh-density {density}")),
            further_flags(plan),
        )
    };
    TwinsReport {
        description,
        level: 0.9,
        parameters: proof.parameters.iter().map(|parameter| shown_name(&parameter.name)).collect(),
        twins: fitted.collect(),
        statements: statements(proof),
        version: env!("CARGO_PKG_VERSION").into(),
        seed: plan.seed,
        command_line,
    }
}

/// Flags on what is fitted and drawn, where they differ from the usual.
fn further_flags(plan: &TwinPlan) -> String {
    let usual = TwinPlan::default();
    let mut flags = String::new();
    if plan.parameters != usual.parameters {
        let _ = write!(flags, " --parameters {}", plan.parameters.join(","));
    }
    for ((name, _, value), (.., usual)) in plan.uncertainty.named().into_iter().zip(usual.uncertainty.named()) {
        if value != usual {
            let _ = write!(flags, " --uncertainty {name}={value}");
        }
    }
    if let Some(law) = plan.law {
        let _ = write!(flags, " --damping {}", law.name());
    }
    flags
}

/// Name of a parameter for people.
fn shown_name(name: &str) -> String {
    match name {
        "alpha" => "amplitude scale α".into(),
        "damping" => "damping coefficient".into(),
        "support_stiffness" => "stiffness factor of the annulus".into(),
        other => Parameter::term_named(other).map_or(other, |term| term.description().coefficient).into(),
    }
}
