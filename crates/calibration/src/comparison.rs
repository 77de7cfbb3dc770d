//! Comparison of runs with a record: conditioning, features and their weights.

use std::{borrow::Cow, collections::BTreeMap};

use rand::Rng;
use thiserror::Error;

use super::observation::{Observation, Passband};
use granchain_model::scene::Drive;
use granchain_signal::{
    Gap, Series, bridge,
    feature::{Measurand, fingerprint::Fingerprint},
};

/// Drive periods allowed between the piston's first motion and the onset at the last bead: a few for the pulse through
/// the chain, and more for a weak drive to reach the threshold.
const ONSET_ALLOWANCE: f64 = 25.0;

/// Drive periods allowed between the end of the burst and the decay: a few through the chain, and those over which the
/// rms is taken.
const FALL_ALLOWANCE: f64 = 15.0;

/// Drive periods after the burst within which a record may end before its decay is visible.
const UNSEEN_FALL: f64 = 3.0;

/// Drive periods simulated beyond the fingerprint if the onset is known from another fidelity level: the onset may
/// come that much later, and the filter needs a margin.
const AFTER_ONSET: f64 = 3.0;

/// The quantities to be fitted and how runs are compared with them.
#[derive(Debug, Clone)]
pub struct Comparison {
    /// Cutoff applied to every run, Hz.
    pub cutoff: f64,
    /// Stated bandwidth of the instrument, Hz; runs are filtered by it too if it is below the cutoff.
    pub bandwidth: Option<f64>,
    /// Its filter, if that is stated: runs pass it.
    pub passband: Option<Passband>,
    /// Clipping levels of the record's input, below and above, m/s or Pa; every run is clipped there after its noise.
    pub clipped: [Option<f64>; 2],
    /// Stretches in which the record has no valid samples, relative to its alignment reference; every run is bridged
    /// there too.
    pub masked: Vec<Gap>,
    /// Interval of the record's samples, s; the position of a gap between two samples is drawn for each run.
    pub sampling: f64,
    /// Spectral density of the noise added to every run, one-sided, (m/s)²/Hz or Pa²/Hz.
    pub noise_density: f64,
    /// Density of the 1/f part of that noise times the frequency, (m/s)² or Pa².
    pub flicker: f64,
    /// Additional noise density from rounding a moving signal, (m/s)²/Hz or Pa²/Hz.
    pub rounding: f64,
    /// Density of noise that grows with the velocity, over its square, 1/Hz.
    pub speckle: f64,
    /// Number of independent quiet samples from which the noise was estimated.
    pub noise_freedom: f64,
    /// Number of shots averaged in the record.
    pub averages: usize,
    /// Conversion of a conditioned trace to features z: onset, early peaks, bands.
    pub fingerprint: Fingerprint,
    /// Features z₀ of the record.
    pub features: Vec<f64>,
    /// Smallest scatter allowed to each feature, in ln.
    pub nuggets: Vec<f64>,
    /// Weight of each feature in the log-likelihood's quadratic form; 1 by default, 0 leaves it out.
    pub weights: Vec<f64>,
    /// Tempering exponent β of the likelihood, for which 90 % intervals cover 90 % of synthetic records.
    pub power: f64,
    /// Standard deviation of the logarithm of the instrument's unknown sensitivity factor, 1.
    pub sensitivity: f64,
}

#[derive(Debug, Clone, PartialEq, Error)]
#[non_exhaustive]
pub enum WeightError {
    #[error("weight of `{name}`: expected one of {known}")]
    UnknownFeature { name: String, known: String },
    #[error("weight of `{name}`: expected a finite number ≥ 0, found {weight}")]
    Weight { name: String, weight: f64 },
}

impl From<Observation> for Comparison {
    fn from(observation: Observation) -> Self {
        observation.comparison
    }
}

impl Comparison {
    /// Names of the features, in order.
    pub fn names(&self) -> Vec<Cow<'static, str>> {
        self.fingerprint.names()
    }

    /// Recorded value of feature `index`, SI.
    pub(crate) fn measured(&self, index: usize) -> Option<f64> {
        Some(self.amplitude(index, *self.features.get(index)?))
    }

    /// The same for a record with all amplitudes multiplied by `factor`.
    pub(crate) fn scaled(&self, factor: f64) -> Self {
        let scaled = |(index, z): (usize, &f64)| if self.unit(index) == "1" { *z } else { z + factor.ln() };
        Self {
            features: self.features.iter().enumerate().map(scaled).collect(),
            noise_density: factor * factor * self.noise_density,
            flicker: factor * factor * self.flicker,
            rounding: factor * factor * self.rounding,
            clipped: self.clipped.map(|limit| limit.map(|limit| factor * limit)),
            fingerprint: self.fingerprint.clone().scaled(factor),
            ..self.clone()
        }
    }

    /// Derivative of each feature z with respect to the logarithm of a factor on the trace: 1 for an amplitude, less
    /// near the floor, 0 for a ratio.
    pub(crate) fn answers(&self) -> Vec<f64> {
        let answer = |(index, z): (usize, &f64)| match self.unit(index) {
            "1" => 0.0,
            _ => (self.amplitude(index, *z) / z.exp()).powi(2),
        };
        self.features.iter().enumerate().map(answer).collect()
    }

    /// Value behind z of feature `index`, SI.
    pub(crate) fn amplitude(&self, index: usize, z: f64) -> f64 {
        self.fingerprint.amplitude(index, z)
    }

    /// SI unit of feature `index`, `1` for a pure number.
    pub(crate) fn unit(&self, index: usize) -> &'static str {
        let pure = self.names().get(index).is_some_and(|name| name.starts_with("ratio"));
        if pure { "1" } else { self.measurand().unit() }
    }

    pub(crate) fn measurand(&self) -> Measurand {
        self.fingerprint.measurand()
    }

    /// Required duration of a run under `drive`, s.
    pub(crate) fn duration(&self, drive: &Drive) -> f64 {
        match self.fingerprint.by_onset() {
            false => drive.burst().1 + FALL_ALLOWANCE / drive.frequency,
            true => drive.burst().0 + (self.fingerprint.cycles_needed() as f64 + ONSET_ALLOWANCE) / drive.frequency,
        }
    }

    /// First crossing of the onset threshold by a conditioned trace, s; `None` if there is none, or if the comparison
    /// does not align by onset.
    pub(crate) fn onset(&self, trace: &Series) -> Option<f64> {
        let found = self.fingerprint.by_onset().then(|| self.fingerprint.alignment(trace).ok());
        found.flatten().map(|index| trace.time(index))
    }

    /// Cuts the beginning of a trace if the record's position in the response is unknown: the start is drawn uniformly
    /// between the onset and the last start that leaves enough before the decay. Other comparisons leave the trace
    /// unchanged.
    pub(super) fn begun(&self, mut trace: Series, drive: &Drive, random: &mut impl Rng) -> Series {
        let fingerprint = &self.fingerprint;
        if fingerprint.lies_somewhere()
            && let Ok(onset) = fingerprint.alignment(&trace)
        {
            let end = drive.burst().1 + (UNSEEN_FALL - fingerprint.cycles_needed() as f64) / drive.frequency;
            let last = (end - trace.start) / trace.step;
            let first = random.random_range(onset..=usize::max(onset, (last as usize).min(trace.len())));
            trace = Series::new(trace.time(first), trace.step, trace.values.split_off(first));
        }
        trace
    }

    /// Bridges a run where the record is bridged; the alignment uses `filtered`, the run as conditioned for features.
    ///
    /// - `within`: where between two samples of the record a gap begins, −½ to ½
    pub(super) fn bridge(&self, trace: &mut Series, filtered: &Series, within: f64) {
        if let Ok(at) = self.fingerprint.alignment_time(filtered) {
            let at = at + within * self.sampling;
            bridge(trace, &self.masked.iter().map(|gap| gap.later(at)).collect::<Vec<_>>());
        }
    }

    /// Required duration of a run with its onset at `onset`, s.
    pub(crate) fn end_of_run(&self, onset: f64, drive: &Drive) -> f64 {
        onset + (self.fingerprint.cycles_needed() as f64 + AFTER_ONSET) / drive.frequency
    }

    /// Features z of a conditioned trace (m/s or Pa).
    pub(crate) fn reduce(&self, trace: &Series) -> Result<Vec<f64>, String> {
        self.fingerprint.measure(trace).map_err(|error| error.to_string())
    }

    /// The same with other weights for the features named.
    pub(crate) fn weighted(mut self, weights: &BTreeMap<String, f64>) -> Result<Self, WeightError> {
        let names = self.names();
        for (name, &weight) in weights {
            let Some(index) = names.iter().position(|known| known == name) else {
                return Err(WeightError::UnknownFeature { name: name.clone(), known: names.join(", ") });
            };
            if !(weight.is_finite() && weight >= 0.0) {
                return Err(WeightError::Weight { name: name.clone(), weight });
            }
            self.weights[index] = weight;
        }
        Ok(self)
    }
}
