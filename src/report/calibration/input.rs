//! What the report of a calibration is made from.

use serde::{Deserialize, Serialize};

use crate::{
    calibration::fit::Verdict,
    feature::{Measurand, Window},
    report::sweep::SweepReport,
    response::EnergyLedger,
    signal::Series,
};

/// Everything the report says, plain and in SI.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct CalibrationReport {
    /// What was calibrated, such as `measurements/annulus-73khz/vib.csv`.
    pub title: String,
    /// What was recorded.
    #[serde(default)]
    pub measurand: Measurand,
    /// What the record is to be called in legends and tables: `recorded`, or `reconstruction` or `twin` where it is
    /// no measurement.
    pub record_label: String,
    /// What a reader must know of the record's origin; shown before any result. Empty for a plain measurement.
    pub record_notes: Vec<String>,
    /// What looked wrong in the records: shown beside the verdict.
    #[serde(default)]
    pub warnings: Vec<String>,
    /// What would explain a record that the model does not, likeliest first.
    #[serde(default)]
    pub diagnosis: Vec<String>,
    /// Name of the scene.
    pub scene: String,
    /// One sentence on the scene.
    pub scene_description: String,
    /// Which model was run, such as `chain`.
    pub model: String,
    /// f0, Hz.
    pub drive_frequency: f64,
    /// Every law fitted, the one the report leads with first; at least one.
    pub laws: Vec<LawReport>,
    /// Laws on mounts of which no run could be compared with the record, with the reason.
    #[serde(default)]
    pub excluded: Vec<(String, String)>,
    /// Which law and mount the record prefers, in a sentence each, where several were fitted.
    pub preference: Option<String>,
    /// What the data cannot separate, and which further record would: one statement each.
    pub separation: Vec<String>,
    /// Displacement of the drive at α = 1, m.
    pub drive: Series,
    /// Where the drive comes from, in a few words.
    pub drive_origin: String,
    /// The record after the reader's conditioning, m/s or Pa; absent where only published numbers exist.
    pub recorded: Option<Series>,
    /// The calibrated response through the same conditioning, already aligned with the record, m/s or Pa.
    pub simulated: Option<Series>,
    /// How the simulated trace was aligned, such as `onset at 14.2 µs in both; shifted by one drive period`.
    pub alignment: String,
    /// Where features were measured.
    pub window: Option<Window>,
    /// The feature table.
    pub features: Vec<FeatureRow>,
    /// Features against α around the fit.
    pub alpha_sweep: Option<AlphaSweep>,
    /// Where the piston's work went in the calibrated run.
    pub energy: Option<EnergyLedger>,
    /// What was understood and assumed on reading, one statement each.
    pub assumptions: Vec<String>,
    /// What the record is called beside others; empty where it is fitted by itself.
    #[serde(default, skip_serializing_if = "String::is_empty")]
    pub label: String,
    /// Further records that were fitted together with it.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub companions: Vec<RecordReport>,
    /// Where everything comes from.
    pub provenance: Provenance,
}

/// One further record and the calibrated response held against it.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct RecordReport {
    /// What it is called beside the others.
    pub label: String,
    /// The file.
    pub title: String,
    /// As [`CalibrationReport::record_label`].
    pub record_label: String,
    /// As [`CalibrationReport::record_notes`].
    pub record_notes: Vec<String>,
    /// Displacement of its drive at α = 1, m.
    pub drive: Series,
    /// Where that comes from, in a few words.
    pub drive_origin: String,
    /// As [`CalibrationReport::recorded`].
    pub recorded: Option<Series>,
    /// As [`CalibrationReport::simulated`].
    pub simulated: Option<Series>,
    /// As [`CalibrationReport::alignment`].
    pub alignment: String,
    /// Where features were measured.
    pub window: Option<Window>,
    /// Its feature table.
    pub features: Vec<FeatureRow>,
}

/// What one of several records says by itself, by the runs made for all.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct ShareReport {
    /// The record.
    pub label: String,
    /// Its estimates.
    pub parameters: Vec<Estimate>,
    /// Correlation of the first two, in ln.
    pub correlation: Option<f64>,
    /// Its density over the first two.
    pub map: Option<DensityMap>,
    /// Its misfit per feature at the joint answer, in scatters.
    pub misfit: f64,
}

/// The sweep of α at the fitted damping.
pub type AlphaSweep = SweepReport;

/// One damping law and its fit.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct LawReport {
    /// Name for people, such as `linear`, `Kuwabara–Kono` or `linear dampers`.
    pub damping_kind: String,
    /// Mount of the disc, where mounts are compared.
    #[serde(default)]
    pub mount: Option<String>,
    /// What the fit says of the model.
    pub verdict: Verdict,
    /// Share of right records that are as far from the model as this one; absent where it was not told.
    #[serde(default)]
    pub p_value: Option<f64>,
    /// What is left of every fitted feature at the answer: what the verdict is made of.
    #[serde(default)]
    pub pulls: Vec<Pull>,
    /// FIT: misfit per feature in units of the local scatter, 1.
    pub misfit: f64,
    /// Free parameters; the first two span the map.
    pub parameters: Vec<Estimate>,
    /// Correlation of the first two parameters (in ln), 1.
    pub correlation: Option<f64>,
    /// Connected parts of the 90 % region.
    pub lobes: Vec<Lobe>,
    /// ln evidence, where it can be compared with other laws.
    pub log_evidence: Option<f64>,
    /// Density over both of two parameters.
    pub map: Option<DensityMap>,
    /// Density over every pair of more than two parameters, the others summed over.
    #[serde(default)]
    pub pairs: Vec<PairMap>,
    /// Every run, in the order made.
    pub runs: Vec<RunPoint>,
    /// Search history: (runs made, misfit of the fit judged with the scatter known by then); it may rise as scatter is learnt.
    pub history: Vec<(u64, f64)>,
    /// Runs made.
    pub evaluations: u64,
    /// Runs that failed.
    pub failed_runs: u64,
    /// Why runs failed, each reason once.
    pub failures: Vec<String>,
    /// The rungs of the ladder side by side; absent where only one was run.
    pub rungs: Option<RungsReport>,
    /// What each of several records says by itself.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub shares: Vec<ShareReport>,
}

/// One fitted feature at the answer.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Pull {
    /// Its name.
    pub name: String,
    /// Model less record, in scatters of a single run.
    pub pull: f64,
    /// By how much its scatter was multiplied because no run has it; 1 where it agrees.
    pub widened: f64,
}

/// The rungs of the ladder at the answer.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct RungsReport {
    /// Every rung, the lowest first.
    pub rungs: Vec<RungReport>,
    /// The fit on the lowest, from which the correction started.
    pub below: Box<LawReport>,
    /// What they say of each fitted feature.
    pub features: Vec<RungRow>,
}

/// One rung.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct RungReport {
    /// Its model.
    pub model: String,
    /// What its own fit found; empty where it was only run at the answer.
    pub parameters: Vec<Estimate>,
    /// How its own fit ended.
    pub verdict: Option<Verdict>,
    /// Runs made.
    pub runs: u64,
    /// Of them failed.
    pub failed_runs: u64,
}

/// One fitted feature on every rung, SI.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct RungRow {
    /// Name for people.
    pub name: String,
    /// Unit in SI.
    pub unit: String,
    /// Of the record.
    pub recorded: Option<f64>,
    /// Expected at the answer, rung by rung.
    pub expected: Vec<Option<f64>>,
    /// Scatter of a single run in ln, rung by rung.
    pub scatter: Vec<Option<f64>>,
    /// Rung above less rung below under the same nuisances, in ln.
    pub difference: f64,
    /// Its standard error, in ln.
    pub standard_error: f64,
}

/// Density over two of several parameters.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct PairMap {
    /// Index of the parameter along x.
    pub first: usize,
    /// Index of the parameter along y.
    pub second: usize,
    /// The density.
    pub map: DensityMap,
}

impl LawReport {
    /// The law as it reads in a sentence: `linear damping`, `linear dampers`, `linear damping on the free disc`.
    pub(super) fn name(&self) -> String {
        let mount = self.mount.as_ref().map_or_else(String::new, |mount| format!(" on the {mount} disc"));
        if self.damping_kind.contains("damp") {
            format!("{}{mount}", self.damping_kind)
        } else {
            format!("{} damping{mount}", self.damping_kind)
        }
    }

    /// The law in the names of files: `linear`, `linear-clamped`.
    pub(super) fn key(&self) -> String {
        let law = self.damping_kind.to_lowercase().replace(|letter: char| !letter.is_ascii_alphanumeric(), "-");
        self.mount.as_ref().map_or_else(|| law.clone(), |mount| format!("{law}-{mount}"))
    }
}

/// One fitted parameter, SI.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Estimate {
    /// Name for people, such as `amplitude scale`.
    pub name: String,
    /// Symbol, such as `α`.
    pub symbol: String,
    /// Unit; `1` for a pure number.
    pub unit: String,
    /// Point estimate.
    pub value: f64,
    /// 5 % quantile; `None` where no interval may be quoted.
    pub low: Option<f64>,
    /// 95 % quantile; `None` where no interval may be quoted.
    pub high: Option<f64>,
    /// Lower and upper end of the search.
    pub bounds: (f64, f64),
    /// Whether the fit leans on an end.
    pub at_bound: bool,
}

/// A connected part of the 90 % region.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Lobe {
    /// Its share of the probability, 1.
    pub mass: f64,
    /// Ends of the region along each parameter, SI: (low, high).
    pub extent: Vec<(f64, f64)>,
}

/// Density over two parameters, relative to its largest value.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct DensityMap {
    /// Positions along the first parameter, SI, ascending.
    pub x: Vec<f64>,
    /// Positions along the second parameter, SI, ascending.
    pub y: Vec<f64>,
    /// Density over its largest value, row by row from the lowest y.
    pub density: Vec<f64>,
    /// The accepted set (90 % region) is where the density is at least this.
    pub accepted_level: f64,
}

/// One run of the search, SI.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct RunPoint {
    /// Parameters, in the order of the law's.
    pub parameters: Vec<f64>,
    /// Misfit; `None` for a failed run.
    pub misfit: Option<f64>,
}

/// One row of the feature table, SI.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct FeatureRow {
    /// Name for people, such as `positive peak` or `line 1/3`.
    pub name: String,
    /// Unit in SI: `m/s`, `Pa`, or `1` for a pure number.
    pub unit: String,
    /// Of the record.
    pub recorded: Option<f64>,
    /// Of the calibrated model (mean over the ensemble, where there is one).
    pub simulated: Option<f64>,
    /// Standard deviation under perturbations far below what the laboratory controls: the chaos floor.
    pub scatter: Option<f64>,
    /// Change for +1 % drive.
    pub sensitivity: Option<f64>,
    /// As published.
    pub published: Option<f64>,
    /// Uncertainty of the published number.
    pub published_uncertainty: Option<f64>,
    /// Whether the fit used it.
    pub fitted: bool,
}

/// Where everything comes from.
#[derive(Debug, Clone, PartialEq, Default, Serialize, Deserialize)]
pub struct Provenance {
    /// Version of the program.
    pub version: String,
    /// Command line as typed.
    pub command_line: String,
    /// Seed.
    pub seed: u64,
    /// Files read.
    pub inputs: Vec<InputFile>,
    /// Settings worth knowing: name and value with unit.
    pub settings: Vec<(String, String)>,
}

/// One file read.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct InputFile {
    /// What it is, such as `vibrometer record`.
    pub role: String,
    /// Its path as given.
    pub path: String,
    /// Digest of its bytes, hexadecimal.
    pub sha256: String,
}
