//! What the report of a calibration is made from: its outcome, and what only a figure shows.

use serde::{Deserialize, Serialize};

use super::BenchReport;
use granchain_calibration::outcome::CalibrationOutcome;
use granchain_model::response::{EnergyBalance, ObservedPoint};
use granchain_signal::{Series, feature::Window};

/// Everything the report says, plain and in SI.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct CalibrationReport {
    pub outcome: CalibrationOutcome,
    pub scene: String,
    /// One sentence on the scene.
    pub scene_description: String,
    pub drive_frequency: f64,
    /// What stands on the bench.
    #[serde(default)]
    pub bench: BenchReport,
    /// Every record, the first one first; at least one.
    pub records: Vec<RecordReport>,
    /// What is drawn of every law of the outcome, in its order.
    pub laws: Vec<LawReport>,
    /// Where the piston's work went in the calibrated run.
    pub energy: Option<EnergyBalance>,
    /// Settings worth knowing: name and value with unit.
    pub settings: Vec<(String, String)>,
    pub command_line: String,
}

/// One record and the calibrated response held against it.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct RecordReport {
    /// What it is called beside the others; empty where it is fitted by itself.
    pub label: String,
    /// The file, such as `measurements/annulus-73khz/vib.csv`.
    pub title: String,
    /// What the record is to be called in legends and tables: `recorded`, or `reconstruction` or `synthetic` if it is
    /// no measurement.
    pub record_label: String,
    /// What a reader must know of the record's origin; shown before any result. Empty for a plain measurement.
    pub record_notes: Vec<String>,
    /// Displacement of its drive at α = 1, m.
    pub drive: Series,
    /// Where that comes from, in a few words.
    pub drive_origin: String,
    /// The record after the reader's conditioning, m/s or Pa.
    pub recorded: Series,
    /// The calibrated response through the same conditioning, already aligned with the record, m/s or Pa.
    pub simulated: Option<Series>,
    /// Instant (s), record less simulated, and standard deviation of that by noise and from run to run, where the waveform was compared.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub residual: Vec<(f64, f64, f64)>,
    /// How the simulated trace was aligned, such as `onset at 14.2 µs in both; shifted by one drive period`.
    pub alignment: String,
    /// Stretches that were bridged in it and in every simulated run, s, record time.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub masked: Vec<(f64, f64)>,
    /// Point of the last bead whose velocity is compared.
    #[serde(default)]
    pub observed: ObservedPoint,
    /// What else was found of its instrument: averages, crosstalk; sentences of the first figure's caption.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub instrument: Vec<String>,
    pub window: Option<Window>,
    /// Names of the fitted features, in the order they are compared.
    pub compared: Vec<String>,
}

/// What is drawn of a law's fit.
#[derive(Debug, Clone, PartialEq, Default, Serialize, Deserialize)]
pub struct LawReport {
    /// Its parameters in the order fitted; the first two span the map.
    pub parameters: Vec<String>,
    /// Density over both of two parameters.
    pub map: Option<DensityMap>,
    /// Density over every pair of more than two parameters, the others summed over.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub pairs: Vec<PairMap>,
    /// Every run, in the order made.
    pub runs: Vec<RunPoint>,
    /// Density over both parameters by each of several records alone.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub alone: Vec<Option<DensityMap>>,
    /// The fit on the model below, from which the correction started.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub below: Option<Box<LawReport>>,
    /// Seconds of each model's part of the fit, the chain's first.
    #[serde(skip)]
    pub took: Vec<f64>,
}

/// Density over two of several parameters.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct PairMap {
    /// Index of the parameter along x.
    pub first: usize,
    /// Index of the parameter along y.
    pub second: usize,
    pub map: DensityMap,
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
