//! Result of a calibration: `calibration.json`.
//!
//! Scripts depend on its keys. It holds no times, no command line and nothing that depends on the number of threads.

use std::{collections::BTreeMap, path::Path};

use serde::{Deserialize, Serialize};

use super::{
    comparison::Comparison,
    diagnosis::Finding,
    fit::{Estimate, Fit, Verdict},
    parameter::{Parameter, Target},
    statement::is_open,
    waveform::{Origin, QUANTILE, WaveformFit, contradicts},
};
use granchain_record::{Masked, ReadOptions, Reading, ReadingError, RecordKind};
use granchain_signal::feature::Measurand;

/// Preferred law or mount where the record does not decide.
pub const UNDECIDED: &str = "undecided";

#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct CalibrationOutcome {
    pub program: String,
    /// Scene as named on the command line or in the plan.
    pub scene: String,
    pub overrides: Vec<String>,
    pub model: String,
    /// Measured quantity; absent for a velocity.
    #[serde(default, skip_serializing_if = "is_velocity")]
    pub quantity: Measurand,
    /// The leading law and mount: first of `laws`, its keys at the top level.
    #[serde(flatten)]
    pub best: FitOutcome,
    pub seed: u64,
    pub inputs: BTreeMap<String, InputDigest>,
    /// Which parameters the data cannot separate, and which further record would.
    pub statements: Vec<String>,
    /// Every law fitted, best first.
    pub laws: Vec<FitOutcome>,
    /// Which law the record prefers, or `undecided`; absent when only one was fitted.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub preferred_law: Option<String>,
    /// Which mount the record prefers, or `undecided`; absent when only one was fitted.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub preferred_mount: Option<String>,
    /// Factor by which the 90 % intervals are widened, if requested.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub widened: Option<f64>,
    /// Mounts without a run that can be compared with the record, with the reason.
    #[serde(default, skip_serializing_if = "BTreeMap::is_empty")]
    pub excluded: BTreeMap<String, String>,
    /// Likely causes if the model does not explain the record, most likely first.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub diagnosis: Vec<Finding>,
    /// Masked samples, which were not compared.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub masked: Vec<MaskedStretch>,
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub warnings: Vec<String>,
    pub assumptions: Vec<String>,
}

/// One of the numbers named first: of the record, and of the model with its run-to-run standard deviation, SI.
#[derive(Debug, Clone, PartialEq)]
pub struct NamedNumber {
    pub name: &'static str,
    pub measured: f64,
    pub simulated: f64,
    pub deviation: f64,
    pub unit: &'static str,
}

impl NamedNumber {
    /// Simulated over measured, less 1.
    #[must_use]
    pub fn difference(&self) -> f64 {
        self.simulated / self.measured - 1.0
    }
}

impl CalibrationOutcome {
    /// Both peaks of the velocity after the onset, and the lines at 1/3 and 2/3 of the drive over that at the drive, in the analysis window; empty
    /// without a record of a velocity.
    #[must_use]
    pub fn named_numbers(&self) -> Vec<NamedNumber> {
        let peak = |name, key: &str, sign: f64| {
            let feature = self.best.fitted_features.get(key).filter(|feature| feature.unit == "m/s")?;
            let (measured, simulated) = feature.measured.zip(feature.expected)?;
            let deviation = simulated * feature.scatter?;
            Some(NamedNumber { name, measured: sign * measured, simulated: sign * simulated, deviation, unit: "m/s" })
        };
        let ratio = |name, key: &str| {
            let OutcomeFeature { measured, simulated, scatter, .. } = self.best.features.get(key)?;
            let (measured, simulated) = measured.zip(*simulated)?;
            Some(NamedNumber { name, measured, simulated, deviation: scatter.unwrap_or(0.0), unit: "1" })
        };
        let peaks = [("positive peak", "positive_peak", 1.0), ("negative peak", "negative_peak", -1.0)];
        let ratios = [("ratio 1/3", "ratio_1/3"), ("ratio 2/3", "ratio_2/3")];
        let mut numbers: Vec<_> = peaks.into_iter().filter_map(|(name, key, sign)| peak(name, key, sign)).collect();
        if !numbers.is_empty() {
            numbers.extend(ratios.into_iter().filter_map(|(name, key)| ratio(name, key)));
        }
        numbers
    }

    /// The best fit of every damping law, first the leading one, if the record does not decide between them; otherwise
    /// none.
    pub fn undecided_laws(&self) -> Vec<&FitOutcome> {
        let Some(best) = self.laws.first().filter(|_| self.preferred_law.as_deref() == Some(UNDECIDED)) else {
            return vec![];
        };
        let mut open = vec![best];
        for law in &self.laws[1..] {
            let known = open.iter().any(|other| other.damping_kind == law.damping_kind);
            if !known && is_open((best.verdict, best.log_evidence), (law.verdict, law.log_evidence)) {
                open.push(law);
            }
        }
        open
    }
}

/// Samples bridged in a record and in every simulated run.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct MaskedStretch {
    pub file: String,
    /// Last valid instant before them and first one after them, s on the record's clock; absent at an end of the
    /// record.
    pub from_s: Option<f64>,
    pub to_s: Option<f64>,
    pub samples: usize,
    pub reason: String,
}

impl MaskedStretch {
    pub(crate) fn of(file: &Path, masked: &[Masked]) -> Vec<Self> {
        let stretch = |masked: &Masked| Self {
            file: file.display().to_string(),
            from_s: Some(masked.gap.from).filter(|t| t.is_finite()),
            to_s: Some(masked.gap.to).filter(|t| t.is_finite()),
            samples: masked.samples,
            reason: masked.reason.words()[0].into(),
        };
        masked.iter().map(stretch).collect()
    }
}

/// Fit of one damping law and one mount of the disc.
#[derive(Debug, Clone, PartialEq, Default, Serialize, Deserialize)]
pub struct FitOutcome {
    pub damping_kind: String,
    /// Mount of the disc, if mounts are compared.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub mount: Option<String>,
    /// `within scatter`, `doubtful`, `outside scatter`, `not converged`.
    pub verdict: Verdict,
    /// The fitted parameters by name.
    pub parameters: BTreeMap<String, FittedParameter>,
    /// Correlation of the logarithms of the first two parameters.
    pub correlation: f64,
    /// The same of every pair of more than two, named by both.
    #[serde(default, skip_serializing_if = "BTreeMap::is_empty")]
    pub correlations: BTreeMap<String, f64>,
    /// Posterior predictive p-value: below 0.05 `doubtful`, below 0.01 `outside scatter`.
    pub p_value: f64,
    /// Comparison of the waveform; absent without one.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub waveform: Option<WaveformOutcome>,
    /// Median misfit per feature of the ten best runs, in units of the local scatter.
    pub misfit: f64,
    /// ln of the evidence, up to a constant that depends on the record only.
    pub log_evidence: f64,
    /// Features of record and model, best law only.
    #[serde(default, skip_serializing_if = "BTreeMap::is_empty")]
    pub features: BTreeMap<String, OutcomeFeature>,
    /// Features compared by the fit.
    pub fitted_features: BTreeMap<String, FittedFeature>,
    /// Every record, if several were fitted together; `features` and `fitted_features` above are those of the first.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub records: Vec<RecordOutcome>,
    /// Connected parts of the 90 % region, heaviest first.
    pub lobes: Vec<OutcomeLobe>,
    /// Result of each fidelity level, lowest first; the answer is that of `model`.
    #[serde(rename = "rungs")]
    pub fidelities: Vec<FidelityOutcome>,
    /// Difference between the top level and the chain in ln of each fitted feature, over pairs of runs with the same
    /// nuisances, and its standard error.
    #[serde(default, skip_serializing_if = "BTreeMap::is_empty")]
    #[serde(rename = "rung_differences")]
    pub fidelity_differences: BTreeMap<String, [f64; 2]>,
    /// Runs made, on all fidelity levels.
    pub evaluations: u64,
    /// Runs that failed, on all fidelity levels.
    pub failed_runs: u64,
    /// Reasons of failed runs, with their counts.
    pub failures: BTreeMap<String, u64>,
}

#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct WaveformOutcome {
    /// Whether the waveform decided; otherwise amplitudes did.
    pub decided: bool,
    pub p_value: f64,
    /// Mean square of the whitened residual per sample: near 1 for a correct model.
    pub residual: f64,
    /// Cycles after the onset that runs can predict.
    pub predictable_cycles: f64,
    /// Whether the record ends within these cycles.
    pub whole_record: bool,
    /// Number of samples left out: drop-outs, masked or detected by the runs.
    #[serde(default)]
    pub left_out: u64,
    /// Interval of α × horn scale (true over recorded motion of the horn), the product that a record determines; absent if α
    /// is not fitted.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub alpha_times_level: Option<[f64; 2]>,
    /// Interval of the beads' stiffness over their mass, relative to the scene's; absent if it is not drawn.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub stiffness_over_mass: Option<[f64; 2]>,
    /// Share of the variance of ln of every parameter by where it comes from.
    #[serde(default, skip_serializing_if = "BTreeMap::is_empty")]
    pub width_from: BTreeMap<String, BTreeMap<Origin, f64>>,
    pub rounds: u64,
    pub runs: u64,
}

impl WaveformOutcome {
    /// Whether a waveform that did not decide misses even the few cycles that were compared: the verdict is not `within scatter`.
    pub fn contradicts(&self) -> bool {
        contradicts(self.decided, self.p_value)
    }

    /// Of a fit that has one.
    pub(crate) fn of(fit: &Fit) -> Option<Self> {
        let waveform = fit.waveform.as_ref()?;
        let around = |middle: f64, deviation: f64| [-1.0, 1.0].map(|side| middle * (side * QUANTILE * deviation).exp());
        let alpha = fit.parameters.iter().zip(&waveform.at).find(|(parameter, _)| parameter.target == Target::Alpha);
        let product = alpha.zip(waveform.product);
        Some(Self {
            decided: waveform.decides(),
            p_value: waveform.p,
            residual: waveform.reduced,
            predictable_cycles: waveform.cycles,
            whole_record: waveform.whole,
            left_out: waveform.left_out as u64,
            alpha_times_level: product.map(|((parameter, u), [mean, sd])| around(parameter.value(*u) * mean.exp(), sd)),
            width_from: width_from(fit, waveform),
            stiffness_over_mass: waveform.modulus.map(|[middle, deviation]| around(middle.exp(), deviation)),
            rounds: waveform.rounds as u64,
            runs: waveform.runs,
        })
    }
}

/// Shares of the variance of every parameter that the waveform decided.
fn width_from(fit: &Fit, waveform: &WaveformFit) -> BTreeMap<String, BTreeMap<Origin, f64>> {
    let mut shares: BTreeMap<String, BTreeMap<Origin, f64>> = BTreeMap::new();
    if !waveform.decides() || !fit.verdict.explains() {
        return shares;
    }
    for (origin, variance) in &waveform.origins {
        for (d, parameter) in fit.parameters.iter().enumerate() {
            let share = variance[d] / waveform.covariance[d][d];
            *shares.entry(parameter.name.clone()).or_default().entry(*origin).or_default() += share;
        }
    }
    shares
}

fn is_velocity(quantity: &Measurand) -> bool {
    *quantity == Measurand::Velocity
}

#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct FittedParameter {
    /// The jointly most likely value.
    pub value: f64,
    /// Lower end of the 90 % interval; absent if intervals are not quoted.
    pub low: Option<f64>,
    /// Upper end of the 90 % interval; absent if intervals are not quoted.
    pub high: Option<f64>,
    pub median: f64,
    /// SI unit, `1` for a pure number.
    pub unit: String,
    /// Whether the value or the interval touches a bound of the search.
    pub at_bound: bool,
    /// Whether the interval is hardly narrower than the box.
    #[serde(default, skip_serializing_if = "std::ops::Not::not")]
    pub unidentified: bool,
    pub bounds: [f64; 2],
}

impl FittedParameter {
    /// Of an estimate and the bounds of its search; with an interval if `quoted`.
    #[must_use]
    pub fn of(estimate: &Estimate, bounds: [f64; 2], quoted: bool) -> Self {
        Self {
            value: estimate.value,
            low: quoted.then_some(estimate.low),
            high: quoted.then_some(estimate.high),
            median: estimate.median,
            unit: estimate.unit.clone(),
            at_bound: estimate.at_bound,
            unidentified: estimate.unidentified,
            bounds,
        }
    }
}

/// One feature of record and calibrated model, SI.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct OutcomeFeature {
    pub measured: Option<f64>,
    /// Model: mean over predictive runs.
    pub simulated: Option<f64>,
    /// Run-to-run standard deviation.
    pub scatter: Option<f64>,
    /// Change for +1 % drive.
    pub sensitivity: Option<f64>,
    /// SI unit, `1` for a pure number.
    pub unit: String,
}

impl FittedFeature {
    /// One standard deviation of a run below and above the expected value, in the logarithm as `deviation`.
    #[must_use]
    pub fn range(&self) -> Option<[f64; 2]> {
        let (expected, scatter) = self.expected.zip(self.scatter)?;
        Some([-1.0, 1.0].map(|side: f64| expected * (side * scatter).exp()))
    }
}

/// One feature of the fit, SI.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct FittedFeature {
    /// Measured value.
    pub measured: Option<f64>,
    /// ln of expected over measured at the most likely point, in units of the run-to-run standard deviation; the verdict is
    /// based on it.
    pub deviation: Option<f64>,
    /// Expected value; absent if the record has none.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub expected: Option<f64>,
    /// Standard deviation of a single run, of the feature's logarithm.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub scatter: Option<f64>,
    /// Factor by which its scatter was widened because no run reproduces it, √(1 + γ²); absent if the model agrees.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub widened: Option<f64>,
    /// ln of the correction for the discretisation error, and its uncertainty.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub model_error: Option<[f64; 2]>,
    /// SI unit, `1` for a pure number.
    pub unit: String,
}

/// One of several records fitted together.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct RecordOutcome {
    /// Its label among the records.
    pub label: String,
    pub measured: String,
    pub overrides: Vec<String>,
    /// p-value of this record at the joint answer.
    pub p_value: f64,
    /// Misfit per feature of this record at the runs that are best for all records.
    pub misfit: f64,
    /// Correlation of the logarithms of the first two parameters, from this record alone.
    pub correlation: f64,
    /// Parameters from this record alone, with the runs made for all.
    pub alone: BTreeMap<String, FittedParameter>,
    /// Features of record and model.
    pub features: BTreeMap<String, OutcomeFeature>,
    /// Features of this record compared by the fit.
    pub fitted_features: BTreeMap<String, FittedFeature>,
}

/// A connected part of the 90 % region, SI.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct OutcomeLobe {
    /// Its share of the posterior.
    pub mass: f64,
    /// Lower and upper end of each parameter.
    pub extent: BTreeMap<String, [f64; 2]>,
}

#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct FidelityOutcome {
    pub model: String,
    pub runs: u64,
    pub failed_runs: u64,
    /// Verdict of its own fit; absent if it was only run at the answer.
    pub verdict: Option<Verdict>,
    /// Its fitted parameters, or those it was run at.
    pub parameters: BTreeMap<String, FittedParameter>,
    /// Its expected features at the answer.
    pub features: BTreeMap<String, FidelityFeature>,
}

/// Expected value of one fitted feature at the answer on one fidelity level, SI.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct FidelityFeature {
    pub value: f64,
    /// Standard deviation of its logarithm over runs; absent for a single run.
    pub scatter: Option<f64>,
    /// SI unit, `1` for a pure number.
    pub unit: String,
}

impl FidelityOutcome {
    /// A fidelity level with a fit of its own.
    pub(crate) fn of(model: &str, fit: &Fit, features: BTreeMap<String, FidelityFeature>) -> Self {
        Self {
            model: model.into(),
            runs: fit.runs.len() as u64,
            failed_runs: fit.failed() as u64,
            verdict: Some(fit.verdict),
            parameters: fitted_parameters(fit),
            features,
        }
    }
}

#[derive(Debug, Clone, PartialEq, Default, Serialize, Deserialize)]
pub struct InputDigest {
    pub path: String,
    /// SHA-256 of its bytes, hexadecimal.
    pub sha256: String,
    /// Reading options from flags, plan and bench file; absent if there are none.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub reading: Option<Reading>,
    /// Drive frequency stated for a horn-tip record, Hz.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub drive_frequency: Option<f64>,
    /// Whether that frequency was accepted although the strongest line of the record is another.
    #[serde(default, skip_serializing_if = "std::ops::Not::not")]
    pub force_frequency: bool,
}

impl InputDigest {
    /// A file with its reading options. The drive frequency is stored for a horn tip only; other records take that of
    /// their drive.
    pub fn read_with(path: &Path, sha256: &str, kind: RecordKind, options: &ReadOptions) -> Self {
        let is_horn = kind == RecordKind::HornTip;
        Self {
            path: path.display().to_string(),
            sha256: sha256.into(),
            reading: Some(Reading::of(options)).filter(|reading| !reading.is_empty()),
            drive_frequency: options.drive_frequency.filter(|_| is_horn),
            force_frequency: options.force_frequency && is_horn,
        }
    }

    /// The options it was read with.
    pub fn options(&self) -> Result<ReadOptions, ReadingError> {
        let stated = ReadOptions {
            drive_frequency: self.drive_frequency,
            force_frequency: self.force_frequency,
            ..ReadOptions::default()
        };
        self.reading.as_ref().map_or(Ok(stated.clone()), |reading| reading.below(stated))
    }
}

/// Feature `index` of the fit, number `own` of its record.
pub(crate) fn fitted_feature(fit: &Fit, index: usize, comparison: &Comparison, own: usize) -> FittedFeature {
    let (measured, unit) = (comparison.measured(own), comparison.unit(own));
    let (pull, scatter) = (fit.agreement.pulls.get(index).copied(), fit.scatter.get(index).copied());
    let expected = || Some(comparison.amplitude(own, comparison.features.get(own)? + pull? * scatter?));
    let shift = fit.discrepancy.shift.get(index).copied().filter(|_| fit.discrepancy.pairs > 0);
    FittedFeature {
        measured,
        deviation: pull,
        expected: measured.and_then(|_| expected()),
        scatter: scatter.filter(|_| measured.is_some()),
        widened: fit.inflation.get(index).filter(|more| **more > 0.0).map(|more| (1.0 + more).sqrt()),
        model_error: shift.zip(fit.discrepancy.nuggets.get(index).copied()).map(|(shift, left)| [shift, left]),
        unit: unit.into(),
    }
}

/// The fitted parameters by name; intervals only if the verdict allows.
pub(crate) fn fitted_parameters(fit: &Fit) -> BTreeMap<String, FittedParameter> {
    estimates_by_name(&fit.estimates, &fit.parameters, fit.verdict.explains())
}

/// Estimates of `parameters` by name, with intervals if `quoted`.
pub(crate) fn estimates_by_name(
    estimates: &[Estimate],
    parameters: &[Parameter],
    quoted: bool,
) -> BTreeMap<String, FittedParameter> {
    let entry = |(estimate, parameter): (&Estimate, &Parameter)| {
        (estimate.name.clone(), FittedParameter::of(estimate, [parameter.low, parameter.high], quoted))
    };
    estimates.iter().zip(parameters).map(entry).collect()
}

/// Correlations of every pair of more than two parameters.
pub(crate) fn correlations(fit: &Fit) -> BTreeMap<String, f64> {
    let count = if fit.parameters.len() > 2 { fit.parameters.len() } else { 0 };
    let pairs = (0..count).flat_map(|a| (a + 1..count).map(move |b| (a, b)));
    let name = |index: usize| fit.parameters[index].name.as_str();
    pairs.map(|(a, b)| (format!("{},{}", name(a), name(b)), fit.posterior.correlation(a, b))).collect()
}

/// Failure messages and their counts; numbers in them are removed so that equal messages merge.
pub(crate) fn failures(fit: &Fit) -> BTreeMap<String, u64> {
    let mut counted = BTreeMap::new();
    for reason in fit.runs.iter().filter_map(|run| run.outcome.as_ref().err()) {
        *counted.entry(without_numbers(reason)).or_insert(0) += 1;
    }
    counted
}

fn without_numbers(reason: &str) -> String {
    reason
        .split(' ')
        .map(|word| if word.starts_with(|c: char| c.is_ascii_digit()) { "…" } else { word })
        .collect::<Vec<_>>()
        .join(" ")
}

pub(crate) fn lobes(fit: &Fit) -> Vec<OutcomeLobe> {
    let extent = |lobe: &super::posterior::Lobe| {
        fit.parameters
            .iter()
            .enumerate()
            .map(|(d, parameter)| {
                (parameter.name.clone(), [parameter.value(lobe.low[d]), parameter.value(lobe.high[d])])
            })
            .collect()
    };
    fit.lobes.iter().map(|lobe| OutcomeLobe { mass: lobe.mass, extent: extent(lobe) }).collect()
}
