//! Result of a fit: `calibration.json`, with the keys of `granchain calibrate` where they mean the same.

use std::{collections::BTreeMap, path::Path};

use serde::{Deserialize, Serialize};

use granchain_record::SensorRecord;
use granchain_signal::number::{engineering, significant};

use granchain_calibration::{
    fit::{Estimate, Verdict},
    outcome::{FittedParameter, InputDigest},
    recorded_run::labels,
};

use crate::{
    Experiment, Finding, Foot, ImpactFit, Parameter,
    hit::{Features, NAMES},
    likelihood::student,
};

#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct ImpactOutcome {
    pub program: String,
    /// Scene as named on the command line or in the plan.
    pub scene: String,
    pub overrides: Vec<String>,
    pub verdict: Verdict,
    pub p_value: f64,
    /// The fitted parameters by name; no interval where the model does not explain the hits.
    pub parameters: BTreeMap<String, FittedParameter>,
    pub correlation: f64,
    pub return_time: ReturnTime,
    /// The mean of the hits and the model at the answer.
    pub fitted_features: BTreeMap<String, HitFeature>,
    pub hits: Vec<HitOutcome>,
    /// The contact with the ground; none without a foundation, or under a plate.
    pub foot: Option<Foot>,
    /// What several set-ups say of the parameters, or that there is one.
    pub set_up: String,
    /// Likely causes if the model does not explain the hits, most likely first.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub diagnosis: Vec<Finding>,
    pub evaluations: u64,
    pub failed_runs: u64,
    pub seed: u64,
    pub inputs: BTreeMap<String, InputDigest>,
    pub warnings: Vec<String>,
    pub assumptions: Vec<String>,
}

/// Time from the incident to the returned impulse, s.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct ReturnTime {
    /// Geometric mean of the hits.
    pub measured: f64,
    pub predicted: f64,
    /// 90 % interval of the prediction for one hit.
    pub low: f64,
    pub high: f64,
    /// Hits within it.
    pub within: u64,
}

/// One compared feature, 1 or s.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct HitFeature {
    /// Geometric mean of the hits.
    pub measured: f64,
    pub expected: f64,
    /// Standard deviation of the logarithm over hits.
    pub scatter: f64,
    /// Expected minus measured, in standard deviations of the mean.
    pub deviation: f64,
}

/// What was measured of one record.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct HitOutcome {
    pub label: String,
    pub measured: String,
    /// s.
    pub return_time: f64,
    pub peak_ratio: f64,
    /// Of the incident and the returned impulse, s.
    pub widths: [f64; 2],
    /// Largest value of the incident impulse, in the unit of the file.
    pub peak: f64,
    /// Whether its return time lies in the predicted interval.
    pub within: bool,
}

/// Standard deviation of ln of a feature over hits from which it is warned of, 1.
const SCATTER: f64 = 0.1;

pub(crate) fn shown(value: f64, unit: &str) -> String {
    if unit == "1" { significant(value, 3) } else { engineering(value, unit, 3) }
}

/// What set-ups say, in a sentence.
fn set_up(fit: &ImpactFit) -> String {
    if fit.set_ups.is_empty() {
        return "one set-up tells of one set-up: a new one of the same specimen has changed the modulus by a factor of 1.3 to 2; fit several, the \
                hits of each in a folder, with --set-ups"
            .into();
    }
    let of = |(d, estimate): (usize, &Estimate)| {
        let shown = |value: f64| shown(value, &estimate.unit);
        let values: Vec<f64> = fit.set_ups.iter().map(|(_, medians)| medians[d].ln()).collect();
        let mean = values.iter().sum::<f64>() / values.len() as f64;
        let square = values.iter().map(|value| (value - mean).powi(2)).sum::<f64>() / (values.len() as f64 - 1.0);
        let each = fit.set_ups.iter().map(|(name, medians)| format!("{} ({name})", shown(medians[d])));
        let each = each.collect::<Vec<_>>().join(", ");
        format!("{} {each}: a factor of {} from one to another", estimate.name, significant(square.sqrt().exp(), 3))
    };
    let all: Vec<String> = fit.estimates.iter().enumerate().map(of).collect();
    format!("{} set-ups: {}", fit.set_ups.len(), all.join("; "))
}

/// The parameters by name; intervals only if the verdict allows.
fn parameters(fit: &ImpactFit) -> BTreeMap<String, FittedParameter> {
    let quoted = fit.verdict.explains();
    let entry = |(estimate, parameter): (&Estimate, &Parameter)| {
        (estimate.name.clone(), FittedParameter::of(estimate, [parameter.low, parameter.high], quoted))
    };
    fit.estimates.iter().zip(&fit.parameters).map(entry).collect()
}

impl ImpactOutcome {
    /// Of a fit; what was read and named is added by who knows it.
    pub fn of(experiment: &Experiment, fit: &ImpactFit, diagnosis: Vec<Finding>) -> Self {
        let [mean, of_hit] = fit.return_time;
        let reach = student(fit.freedom, 0.95) * of_hit;
        let (low, high) = ((mean - reach).exp(), (mean + reach).exp());
        let within = |time: f64| (low..=high).contains(&time);
        let paths: Vec<_> = experiment.hits.iter().map(|hit| hit.record.path.as_path()).collect();
        let several = |path: &Path| paths.iter().filter(|other| **other == path).count() > 1;
        let hits: Vec<HitOutcome> = experiment
            .hits
            .iter()
            .zip(labels(&paths))
            .map(|(hit, label)| {
                // Several hits of one file have their channels' names.
                let label = if several(&hit.record.path) { hit.record.column.clone() } else { label };
                HitOutcome {
                    label,
                    measured: hit.record.path.display().to_string(),
                    return_time: hit.impulses.delay,
                    peak_ratio: hit.impulses.ratio,
                    widths: hit.impulses.widths,
                    peak: hit.impulses.peak,
                    within: within(hit.impulses.delay),
                }
            })
            .collect();
        let (_, set_ups) = experiment.set_ups();
        let mean_of =
            |hits: &Vec<Features>, feature: usize| hits.iter().map(|hit| hit[feature]).sum::<f64>() / hits.len() as f64;
        let measured =
            |feature: usize| set_ups.iter().map(|hits| mean_of(hits, feature)).sum::<f64>() / set_ups.len() as f64;
        let compared = |(feature, name): (usize, &&str)| {
            let compared = HitFeature {
                measured: measured(feature).exp(),
                expected: fit.expected[feature].exp(),
                scatter: fit.scatter[feature],
                deviation: fit.deviations[feature],
            };
            ((*name).to_owned(), compared)
        };
        let noise = |record: &SensorRecord| {
            format!(
                "{}: left out: its largest excursion is below a tenth of the median one of all hits; it holds noise, no hit",
                record.path.display()
            )
        };
        let mut warnings: Vec<String> = experiment.noise.iter().map(noise).collect();
        warnings.extend(fit.foot.and_then(|foot| foot.warning()));
        let scatter = |feature: usize| {
            let about = |hits: &Vec<Features>| -> f64 {
                let mean = mean_of(hits, feature);
                hits.iter().map(|hit| (hit[feature] - mean).powi(2)).sum()
            };
            let freedom = hits.len().saturating_sub(set_ups.len()).max(1) as f64;
            (set_ups.iter().map(about).sum::<f64>() / freedom).sqrt()
        };
        let wide = NAMES.iter().enumerate().filter(|(feature, _)| scatter(*feature) > SCATTER);
        let wide: Vec<String> =
            wide.map(|(feature, name)| format!("{} % in {name}", significant(100.0 * scatter(feature), 2))).collect();
        if !wide.is_empty() {
            let wide = wide.join(", ");
            warnings.push(format!(
                "the hits scatter by {wide}, more than 10 %; look at each in the table of hits, and leave out what is no clean hit"
            ));
        }
        for hit in &experiment.hits {
            warnings.extend(hit.record.warnings.iter().map(|text| format!("{}: {text}", hit.record.path.display())));
        }
        Self {
            program: format!("granchain-impact {}", env!("CARGO_PKG_VERSION")),
            scene: experiment.scene.name.clone(),
            overrides: Vec::new(),
            verdict: fit.verdict,
            p_value: fit.p_value,
            parameters: parameters(fit),
            correlation: fit.correlation,
            return_time: ReturnTime {
                measured: measured(0).exp(),
                predicted: mean.exp(),
                low,
                high,
                within: hits.iter().filter(|hit| hit.within).count() as u64,
            },
            fitted_features: NAMES.iter().enumerate().map(compared).collect(),
            hits,
            foot: fit.foot,
            set_up: set_up(fit),
            diagnosis,
            evaluations: fit.runs.len() as u64,
            failed_runs: fit.runs.iter().filter(|run| run.features.is_err()).count() as u64,
            seed: experiment.seed,
            inputs: BTreeMap::new(),
            warnings,
            assumptions: Vec::new(),
        }
    }
}
