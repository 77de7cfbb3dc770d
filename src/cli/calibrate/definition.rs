//! Plan file and flags merged into one checked definition of a fit; flags win.

use std::{
    collections::{BTreeMap, BTreeSet},
    path::PathBuf,
};

use anyhow::{Context, bail};

use super::{
    Arguments, ConfirmChoice, FeatureChoice, QuantityChoice, SearchChoice,
    companion::{RecordDefinition, records},
    measured::is_published,
    uncertainty::Told,
};
use crate::{
    calibration::{
        joint::TESTED_TOGETHER,
        parameter::{Parameter, ParameterError},
        plan::{Number, Plan},
        search::Search,
    },
    cli::{
        arguments::{SceneArguments, usage},
        reading::ReadArguments,
    },
    feature::{Measurand, fingerprint::FeatureSet},
    scene::Scene,
    signal::{Quantity, Unit},
};

/// The scenes that are taken where none is named.
const SCENE: &str = "annulus";
const SCENE_WITH_WATER: &str = "water";

/// The parameters that are fitted where none is named.
const FITTED: [&str; 2] = ["alpha", "damping"];

/// Numbers of runs that can be asked for: fewer give no regression.
const EVALUATION_RANGE: std::ops::RangeInclusive<usize> = 200..=100_000;

/// What is fitted to what.
pub struct Definition {
    /// The record, or the published features; of several records the first.
    pub measured: PathBuf,
    /// The plan, where there is one.
    pub plan: Option<PathBuf>,
    /// Plan and line that name it, where a plan names several.
    pub origin: Option<(PathBuf, usize)>,
    /// Further records that are fitted together with it.
    pub companions: Vec<RecordDefinition>,
    /// What was recorded.
    pub quantity: Measurand,
    /// Mounts of the disc asked for, by name; empty for the usual ones.
    pub mounts: Vec<String>,
    /// Scene flags with the plan's merged in.
    pub scene: SceneArguments,
    /// How the record is read.
    pub reading: ReadArguments,
    /// Which features.
    pub features: FeatureSet,
    /// How the box is searched.
    pub search: SearchChoice,
    /// Runs a law.
    pub evaluations: usize,
    /// Seed of the plan; the flag wins.
    pub seed: Option<u64>,
    /// Weights of features by name.
    pub weights: BTreeMap<String, f64>,
    /// What was assumed.
    pub assumptions: Vec<String>,
    /// The model run once at the answer.
    pub confirm: Option<ConfirmChoice>,
    /// What was told of what is drawn into every run.
    pub uncertainty: Told,
    damping: Vec<String>,
    fitted: Vec<String>,
    bounds: BTreeMap<String, (Number, Number)>,
}

impl Definition {
    /// Merge plan and flags.
    ///
    /// # Errors
    /// A usage error without a record or with an unknown parameter; whatever is wrong with the plan.
    pub fn new(arguments: Arguments) -> anyhow::Result<Self> {
        let plan = arguments.plan.as_deref().map(Plan::read).transpose()?.unwrap_or_default();
        let mut assumptions = Vec::new();
        let quantity = match arguments.quantity {
            Some(QuantityChoice::Velocity) => Measurand::Velocity,
            Some(QuantityChoice::Pressure) => Measurand::Pressure,
            None => plan.quantity.unwrap_or_default(),
        };
        let usual = if quantity == Measurand::Pressure { SCENE_WITH_WATER } else { SCENE };
        let mut records = records(&arguments, &plan, usual, &mut assumptions)?;
        let companions = records.split_off(1);
        let Some(RecordDefinition { measured, scene, origin }) = records.pop() else {
            return Err(usage("--measured FILE is needed"));
        };
        if !companions.is_empty() {
            refuse_several(
                quantity,
                std::iter::once(&measured).chain(companions.iter().map(|record| &record.measured)),
            )?;
        }
        if quantity == Measurand::Pressure {
            if is_published(&measured) {
                return Err(usage(
                    "--quantity pressure needs a hydrophone's record (CSV): published features are of the velocity only",
                ));
            }
            if arguments.features == Some(FeatureChoice::Paper) || plan.features == Some(FeatureSet::Paper) {
                return Err(usage(
                    "the features `paper` are those that the source paper compares of a velocity; leave --features out for a pressure",
                ));
            }
        }
        if is_published(&measured) {
            if arguments.features.is_some() || plan.features.is_some() {
                return Err(usage(
                    "`features` would do nothing: a file of published features says itself what is compared",
                ));
            }
            if arguments.reading != ReadArguments::default() {
                return Err(usage("flags on how a record is read would do nothing: published features are no record"));
            }
        }
        let planned = plan.fit.clone().unwrap_or_else(|| FITTED.map(String::from).to_vec());
        let mut fitted = if arguments.fit.is_empty() { planned } else { arguments.fit.clone() };
        let mut seen = BTreeSet::new();
        fitted.retain(|name| seen.insert(name.clone()));
        let known = || Parameter::NAMES.join(", ");
        let unknown = |name: &&String| !Parameter::NAMES.contains(&name.as_str());
        if let Some(unknown) = fitted.iter().find(unknown) {
            return Err(usage(format!("--fit {unknown}: expected {}", known())));
        }
        if ["gap", "precompression"].iter().all(|name| fitted.iter().any(|fitted| fitted == name)) {
            return Err(usage(ParameterError::ClosedGap.to_string()));
        }
        if let Some(alpha) = scene.alpha
            && fitted.iter().any(|name| name == "alpha")
        {
            fitted.retain(|name| name != "alpha");
            assumptions.push(format!("alpha fixed at {alpha} by --alpha; fitted: {}", fitted.join(", ")));
        }
        if fitted.is_empty() {
            return Err(usage("nothing is left to fit; drop --alpha or name a parameter with --fit"));
        }
        let mut bounds: BTreeMap<String, (Number, Number)> =
            plan.parameters.into_iter().map(|(name, bounds)| (name, (bounds.low, bounds.high))).collect();
        for text in &arguments.bounds {
            let parts = text.split_once('=').and_then(|(name, range)| Some((name, range.split_once(':')?)));
            let Some((name, (low, high))) = parts else {
                return Err(usage(format!("--bounds {text}: expected NAME=LOW:HIGH such as alpha=0.3:1.5")));
            };
            bounds.insert(name.trim().into(), (Number::Text(low.trim().into()), Number::Text(high.trim().into())));
        }
        if let Some(unknown) = bounds.keys().find(unknown) {
            bail!("bounds of `{unknown}`: expected {}", known());
        }
        let several = !companions.is_empty();
        let tested = if several { TESTED_TOGETHER } else { Search::tested(fitted.len()) };
        let evaluations = arguments.evaluations.map(|n| n as usize).or(plan.evaluations).unwrap_or(tested);
        if !EVALUATION_RANGE.contains(&evaluations) {
            let (low, high) = (EVALUATION_RANGE.start(), EVALUATION_RANGE.end());
            bail!("`evaluations` of the plan: expected {low} to {high}, found {evaluations}");
        }
        let uncertainty = Told::new(plan.uncertainty, &arguments.uncertainty)?;
        let mut damping =
            if arguments.damping.is_empty() { plan.damping.unwrap_or_default() } else { arguments.damping };
        let mut seen = BTreeSet::new();
        damping.retain(|law| seen.insert(law.clone()));
        let mounts = if arguments.mount.is_empty() { plan.mount.unwrap_or_default() } else { arguments.mount };
        let features = match arguments.features {
            Some(FeatureChoice::Full) => FeatureSet::Full,
            Some(FeatureChoice::Paper) => FeatureSet::Paper,
            None => plan.features.unwrap_or(FeatureSet::Full),
        };
        Ok(Self {
            measured,
            plan: arguments.plan,
            origin,
            companions,
            quantity,
            mounts,
            scene,
            reading: arguments.reading,
            features,
            search: arguments.search,
            evaluations,
            seed: plan.seed,
            weights: plan.weights,
            assumptions,
            confirm: arguments.confirm,
            uncertainty,
            damping,
            fitted,
            bounds,
        })
    }

    /// The damping laws to fit: those asked for, else the scene's own.
    #[must_use]
    pub fn laws(&self, scene: &Scene) -> Vec<String> {
        if self.damping.is_empty() { vec![scene.damping.kind.name().into()] } else { self.damping.clone() }
    }

    /// Whether a parameter is fitted.
    #[must_use]
    pub fn fits(&self, name: &str) -> bool {
        self.fitted.iter().any(|fitted| fitted == name)
    }

    /// The parameters of one law with their bounds.
    ///
    /// # Errors
    /// When the scene has no such parameter, or bounds are no positive, ascending pair of the right unit.
    pub fn parameters(&self, scene: &Scene) -> anyhow::Result<Vec<Parameter>> {
        let mut parameters = Vec::new();
        for name in &self.fitted {
            parameters.extend(Parameter::named(name, scene)?);
        }
        for parameter in &mut parameters {
            let Some((low, high)) = self.bounds.get(&parameter.name) else { continue };
            let name = parameter.name.clone();
            parameter.low = in_si(low, &parameter.unit).with_context(|| format!("lower bound of {name}"))?;
            parameter.high = in_si(high, &parameter.unit).with_context(|| format!("upper bound of {name}"))?;
            if !(parameter.low > 0.0 && parameter.low < parameter.high && parameter.high.is_finite()) {
                bail!(
                    "bounds of {name}: expected 0 < low < high (it is searched in its logarithm), found {} and {}",
                    parameter.low,
                    parameter.high
                );
            }
        }
        Ok(parameters)
    }
}

/// A number in SI; a pure one stands for SI.
pub(super) fn in_si(number: &Number, unit: &str) -> anyhow::Result<f64> {
    let text = match number {
        Number::Plain(value) => return Ok(*value),
        Number::Text(text) => text,
    };
    if let Ok(value) = text.parse::<f64>() {
        return Ok(value);
    }
    Ok(Quantity::parse_as(text, Unit::parse(unit)?.dimension)?)
}

/// Several records are velocities with waveforms.
fn refuse_several<'a>(quantity: Measurand, mut measured: impl Iterator<Item = &'a PathBuf>) -> anyhow::Result<()> {
    if quantity == Measurand::Pressure {
        return Err(usage("records of a pressure are fitted one by one: name one hydrophone's record with --measured"));
    }
    match measured.find(|path| is_published(path)) {
        Some(path) => Err(usage(format!(
            "{}: published features are fitted by themselves; name records (CSV) where several are fitted together",
            path.display()
        ))),
        None => Ok(()),
    }
}
