//! Why there is no problem to be solved, or no answer to it.

use std::path::PathBuf;

use thiserror::Error;

use super::{
    bench::BenchError,
    comparison::WeightError,
    fit::FitError,
    forward::Uncertainty,
    joint::JointError,
    observation::ObservationError,
    parameter::{Parameter, ParameterError},
    printed::PrintedError,
    problem::EVALUATION_RANGE,
};
use granchain_model::{ModelError, scene::SceneError};
use granchain_record::{MeasurementError, PublishedError};
use granchain_signal::{QuantityError, feature::FeatureError};

/// What was asked for contradicts itself or the scene: nothing that was measured is at fault.
#[derive(Debug, Clone, PartialEq, Error)]
#[non_exhaustive]
pub enum Contradiction {
    /// No record.
    #[error(
        "--measured FILE is needed: a vibrometer record, such as measurements/annulus-73khz/vib.csv, or with --quantity pressure a \
         hydrophone's"
    )]
    NoRecord,
    /// One record and several.
    #[error(
        "the plan names `measured` or `drive` and {records} of [[record]]; write `measured` and `drive` into each [[record]]"
    )]
    OneAndSeveral {
        /// How many.
        records: usize,
    },
    /// A parameter that nobody knows.
    #[error("--fit {name}: expected {}", Parameter::names().join(", "))]
    Parameter {
        /// The name.
        name: String,
    },
    /// Gap and precompression.
    #[error(transparent)]
    Parameters(ParameterError),
    /// The mean of several shots above the chain.
    #[error(
        "the record is the mean of {averages} shots, which is simulated on the chain only, and the scene's model is `{model}`: pass --model chain"
    )]
    AveragesAbove {
        /// How many.
        averages: usize,
        /// The model.
        model: &'static str,
    },
    /// No parameter.
    #[error("nothing is left to fit; drop --alpha or name a parameter with --fit")]
    NothingFitted,
    /// Several pressures.
    #[error("records of a pressure are fitted one by one: name one hydrophone's record with --measured")]
    SeveralPressures,
    /// Published features among several records.
    #[error(
        "{}: published features are fitted by themselves; name records (CSV) where several are fitted together", path.display()
    )]
    SeveralPublished {
        /// The file.
        path: PathBuf,
    },
    /// Published features of a pressure.
    #[error("--quantity pressure needs a hydrophone's record (CSV): published features are of the velocity only")]
    PublishedPressure,
    /// The source paper's features of a pressure.
    #[error(
        "the features `paper` are those that the source paper compares of a velocity; leave --features out for a pressure"
    )]
    PaperPressure,
    /// A choice among published features.
    #[error("`features` would do nothing: a file of published features says itself what is compared")]
    PublishedSet,
    /// How published features are read.
    #[error("flags on how a record is read would do nothing: published features are no record")]
    PublishedReading,
    /// A pressure without water.
    #[error("--quantity pressure: the scene `{scene}` has {}", if *disc {
        "a vacuum behind its disc; leave `water.medium = \"none\"` out"
    } else {
        "no disc with water behind it; take --scene water, or set support.kind=disc"
    })]
    Silent {
        /// Its name.
        scene: String,
        /// Whether it has a disc.
        disc: bool,
    },
    /// Mounts of no disc.
    #[error(
        "--mount compares mounts of a disc, and the scene `{scene}` has none; take --scene water, or set support.kind=disc"
    )]
    NoDisc {
        /// Its name.
        scene: String,
    },
    /// A mount that nobody knows.
    #[error("--mount {name}: expected clamped, supported or free")]
    Mount {
        /// The name.
        name: String,
    },
    /// A free disc under a precompression.
    #[error(
        "--mount free cannot be: a precompression would push a disc away that nothing holds; leave `free` out, or set \
         chain.precompression=0 and do not fit it"
    )]
    PressedFree,
    /// Several records above the chain.
    #[error(
        "model `{model}` corrects one record at a time, and several are fitted together here; use --model chain, or fit the records one by one"
    )]
    Together {
        /// The model.
        model: &'static str,
    },
    /// A correction before a disc.
    #[error(
        "model `{model}` corrects no calibration in front of a disc: a run takes twenty times the chain's or more, and its weak hits differ by \
         the nodes of a contact patch, not by physics (docs/water.md); use --model chain, and replay --model {model} at the answer"
    )]
    UpperBeforeDisc {
        /// The model.
        model: &'static str,
    },
    /// An uncertainty that nobody knows.
    #[error("uncertainty of `{name}`: expected one of {}", Uncertainty::default().named().map(|(name, ..)| name).join(", "))]
    Uncertainty {
        /// The name.
        name: String,
    },
}

/// Why there is no problem, or no answer to it.
#[derive(Debug, Error)]
#[non_exhaustive]
pub enum Refusal {
    /// What was asked for cannot be.
    #[error(transparent)]
    Asked(#[from] Contradiction),
    /// A reading that says nothing.
    #[error(transparent)]
    Reading(#[from] granchain_record::ReadingError),
    /// Bounds of a parameter that nobody knows.
    #[error("bounds of `{name}`: expected {}", Parameter::names().join(", "))]
    UnknownBounds {
        /// The name.
        name: String,
    },
    /// Bounds that are none.
    #[error("bounds of {name}: expected 0 < low < high (it is searched in its logarithm), found {low} and {high}")]
    Bounds {
        /// The parameter.
        name: String,
        /// Lower bound, SI.
        low: f64,
        /// Upper bound, SI.
        high: f64,
    },
    /// A number of another unit.
    #[error("{what}")]
    NotSi {
        /// What it is of.
        what: String,
        /// Why.
        source: QuantityError,
    },
    /// Too few runs, or too many.
    #[error(
        "`evaluations` of the plan: expected {} to {}, found {found}", EVALUATION_RANGE.start(), EVALUATION_RANGE.end()
    )]
    Evaluations {
        /// The number.
        found: usize,
    },
    /// An uncertainty that is none.
    #[error("uncertainty of {name}: expected a finite number ≥ 0, found {value}")]
    Uncertainty {
        /// Of what.
        name: String,
        /// The value, SI.
        value: f64,
    },
    /// An uncertain stiffness of a support that has none.
    #[error("uncertainty of support_stiffness")]
    UncertainStiffness(#[source] ParameterError),
    /// The same record twice.
    #[error(
        "{}: expected another record than {}, found the same bytes; what one record says would count twice: name it once, or record again",
        path.display(), known.display()
    )]
    Twice {
        /// The record.
        path: PathBuf,
        /// The one before it.
        known: PathBuf,
    },
    /// Scene or drive cannot be read.
    #[error(transparent)]
    Bench(#[from] BenchError),
    /// A record cannot be read.
    #[error(transparent)]
    Measurement(#[from] MeasurementError),
    /// Published features cannot be read.
    #[error(transparent)]
    Published(#[from] PublishedError),
    /// The drive cannot be measured.
    #[error("the drive has no analysis window")]
    NoWindow(#[source] FeatureError),
    /// Published features of another experiment.
    #[error("{}", path.display())]
    Printed {
        /// The file.
        path: PathBuf,
        /// Why.
        source: PrintedError,
    },
    /// A record that cannot be compared.
    #[error("{}: nothing can be fitted to it", path.display())]
    Observation {
        /// The file.
        path: PathBuf,
        /// Why.
        source: ObservationError,
    },
    /// A record of another drive.
    #[error(
        "{}: expected the lines of a drive at {:.4} kHz, its fractions and multiples, found the strongest line at {:.4} kHz and at most {:.0} % of it \
         at {:.4} kHz, its fractions and its double; name the horn record of this experiment with --drive, or the frequency of its drive with \
         --drive-frequency", path.display(), frequency / 1e3, found / 1e3, 100.0 * share, frequency / 1e3
    )]
    OtherDrive {
        /// The file.
        path: PathBuf,
        /// Drive frequency that is simulated, Hz.
        frequency: f64,
        /// Strongest line of the record, Hz.
        found: f64,
        /// Largest of the drive's lines over that.
        share: f64,
    },
    /// Records at different frequencies.
    #[error(transparent)]
    Joint(#[from] JointError),
    /// Weights that are none.
    #[error(transparent)]
    Weight(#[from] WeightError),
    /// The scene has no such parameter.
    #[error(transparent)]
    Parameter(#[from] ParameterError),
    /// The scene cannot be run.
    #[error(transparent)]
    Model(#[from] ModelError),
    /// A candidate has no answer.
    #[error("{}: {candidate} cannot be fitted", path.display())]
    Fit {
        /// The record.
        path: PathBuf,
        /// Law and mount, in words.
        candidate: String,
        /// Why.
        source: FitError,
    },
    /// No candidate has an answer.
    #[error("{}: no candidate can be fitted: {reasons}", path.display())]
    NoFit {
        /// The record.
        path: PathBuf,
        /// Why, candidate by candidate.
        reasons: String,
    },
    /// The state of a search cannot be taken up.
    #[error(transparent)]
    Checkpoint(#[from] super::checkpoint::CheckpointError),
    /// The finished runs of a rung cannot be read or kept.
    #[error("the finished runs of the fit")]
    Kept(#[source] granchain_record::run_log::RunLogError),
    /// Whoever watched said so.
    #[error("stopped")]
    Stopped,
}

impl From<SceneError> for Refusal {
    fn from(error: SceneError) -> Self {
        Self::Bench(error.into())
    }
}
