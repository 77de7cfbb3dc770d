//! Why a problem is invalid or has no answer.

use std::path::PathBuf;

use thiserror::Error;

use super::{
    bench::BenchError,
    comparison::WeightError,
    fit::FitError,
    forward::Uncertainty,
    multi_record::JointError,
    observation::ObservationError,
    parameter::{Parameter, ParameterError},
    search::EVALUATION_RANGE,
};
use granchain_model::{
    ModelError,
    scene::{DampingKind, SceneError},
};
use granchain_record::MeasurementError;
use granchain_signal::QuantityError;

/// Contradictions in the request, or between request and scene; the data are not at fault.
#[derive(Debug, Clone, PartialEq, Error)]
#[non_exhaustive]
pub enum Contradiction {
    #[error(
        "--measured FILE or --plan FILE is needed: a vibrometer record, or (with --quantity pressure) a hydrophone record"
    )]
    NoRecord,
    #[error(
        "the plan names `measured` or `drive` and {records} of [[record]]; write `measured` and `drive` into each [[record]]"
    )]
    OneAndSeveral { records: usize },
    #[error("--fit: `{name}` is not a parameter; choose from: {}", Parameter::names().join(", "))]
    Parameter { name: String },
    #[error(transparent)]
    Parameters(ParameterError),
    #[error(
        "the record is the mean of {averages} shots, which is simulated on the chain only, and the scene's model is `{model}`: pass --model chain"
    )]
    AveragesAbove { averages: usize, model: &'static str },
    #[error(
        "--widen, or `widen` of the plan: expected a factor from 1 to 100 on the intervals, found {found}; `granchain coverage --plan FILE` states the \
         one that your bench needs"
    )]
    Widen { found: f64 },
    #[error("nothing is left to fit; drop --alpha or name a parameter with --fit")]
    NothingFitted,
    #[error("records of a pressure are fitted one by one: name one hydrophone's record with --measured")]
    SeveralPressures,
    #[error("{}: fits to published values are in the reproduction (crates beside the program: reproduction/README.md); name a record", path.display())]
    Published { path: PathBuf },
    #[error(
        "the features `paper` are those that the source paper compares of a velocity; leave `features` of the plan out for a pressure"
    )]
    PaperPressure,
    #[error("--quantity pressure: the scene `{scene}` has {}", if *disc {
        "a vacuum behind its disc; leave `water.medium = \"none\"` out"
    } else {
        "no disc with water behind it; take --scene water, or set support.kind=disc"
    })]
    Silent { scene: String, disc: bool },
    #[error(
        "`mount` of the plan compares mounts of a disc, and the scene `{scene}` has none; take --scene water, or set support.kind=disc"
    )]
    NoDisc { scene: String },
    #[error("--damping {name}: expected one of {}", DampingKind::ALL.map(DampingKind::name).join(", "))]
    Damping { name: String },
    #[error("`mount` of the plan, `{name}`: expected clamped, supported or free")]
    Mount { name: String },
    #[error(
        "`mount` of the plan: `free` cannot be: a precompression would push a disc away that nothing holds; leave `free` out, or set \
         chain.precompression=0 and do not fit it"
    )]
    PressedFree,
    #[error(
        "model `{model}` corrects one record at a time, and several are fitted together here; use --model chain, or fit the records one by one"
    )]
    Together { model: &'static str },
    #[error("records of a chain on a disc are fitted with the model `chain` only, found `{model}`; use --model chain")]
    UpperBeforeDisc { model: &'static str },
    #[error("[uncertainty]: unknown `{name}`; choose from: {}", Uncertainty::default().named().map(|(name, ..)| name).join(", "))]
    Uncertainty { name: String },
}

/// Why a problem is invalid or has no answer.
#[derive(Debug, Error)]
#[non_exhaustive]
pub enum Refusal {
    #[error(transparent)]
    Contradiction(#[from] Contradiction),
    #[error(transparent)]
    Reading(#[from] granchain_record::ReadingError),
    #[error("[parameters.{name}]: `{name}` is not a parameter; choose from: {}", Parameter::names().join(", "))]
    UnknownBounds { name: String },
    #[error("[parameters.{name}]: `low` must be positive and smaller than `high`; found low = {low}, high = {high}")]
    Bounds { name: String, low: f64, high: f64 },
    #[error("{what}: {source}")]
    NotSi { what: String, name: String, source: QuantityError },
    #[error(
        "`evaluations` of the plan: expected {} to {}, found {found}", EVALUATION_RANGE.start(), EVALUATION_RANGE.end()
    )]
    Evaluations { found: usize },
    #[error("[uncertainty] {name}: expected a finite number ≥ 0, found {value}")]
    Uncertainty { name: String, value: f64 },
    #[error("[uncertainty] {name}: expected at most {most}, found {found}{}", meant.as_ref().map(|meant| format!("; did you mean \"{meant}\"?")).unwrap_or_default())]
    ImplausibleUncertainty { name: String, most: String, found: String, meant: Option<String> },
    #[error("[uncertainty] support_stiffness: the support has no stiffness that could vary; remove the line")]
    UncertainStiffness(#[source] ParameterError),
    #[error(
        "{}: expected another record than {}, found the same bytes, which would count twice; name it once",
        path.display(), known.display()
    )]
    Twice { path: PathBuf, known: PathBuf },
    #[error(transparent)]
    Bench(#[from] BenchError),
    #[error(transparent)]
    Measurement(#[from] MeasurementError),
    #[error("{}: the record cannot be fitted", path.display())]
    Observation { path: PathBuf, source: ObservationError },
    #[error(
        "{}: expected the lines of a drive at {:.4} kHz{}, its fractions and multiples, found the strongest line at {:.4} kHz and at most {:.0} % of it \
         at {:.4} kHz, its fractions and its double; name the horn record of this experiment with --drive, or the frequency of its drive with \
         --drive-frequency", path.display(), frequency / 1e3,
        drive.as_ref().map_or_else(String::new, |drive| format!(" as in {}", drive.display())),
        found / 1e3, 100.0 * share, frequency / 1e3
    )]
    OtherDrive {
        path: PathBuf,
        /// The horn's record, where there is one.
        drive: Option<PathBuf>,
        /// Drive frequency that is simulated, Hz.
        frequency: f64,
        /// Strongest line of the record, Hz.
        found: f64,
        share: f64,
    },
    #[error(transparent)]
    MultiRecord(#[from] JointError),
    #[error(transparent)]
    Weight(#[from] WeightError),
    #[error(transparent)]
    Parameter(#[from] ParameterError),
    #[error(transparent)]
    Model(#[from] ModelError),
    #[error("{}: {candidate} cannot be fitted", path.display())]
    Fit {
        path: PathBuf,
        /// Law and mount, in words.
        candidate: String,
        source: FitError,
    },
    #[error("{}: no candidate can be fitted: {reasons}", path.display())]
    NoFit { path: PathBuf, reasons: String },
    #[error("the finished runs of the fit")]
    Kept(#[source] granchain_record::run_log::RunLogError),
    #[error("stopped")]
    Stopped,
}

impl Refusal {
    /// Table and name of the plan's value that is at fault, if one is.
    pub fn stated(&self) -> Option<(&'static str, &str)> {
        match self {
            Self::UnknownBounds { name } | Self::Bounds { name, .. } => Some(("parameters", name)),
            Self::NotSi { what, name, .. } if what.starts_with("[parameters") => Some(("parameters", name)),
            Self::NotSi { name, .. }
            | Self::Uncertainty { name, .. }
            | Self::ImplausibleUncertainty { name, .. }
            | Self::Contradiction(Contradiction::Uncertainty { name }) => Some(("uncertainty", name)),
            _ => None,
        }
    }
}

impl From<SceneError> for Refusal {
    fn from(error: SceneError) -> Self {
        Self::Bench(error.into())
    }
}
