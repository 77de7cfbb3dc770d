//! What every run is compared with, and how a run is reduced for it: a record's fingerprint, or published features.

use std::{borrow::Cow, collections::BTreeMap};

use rand::Rng;
use thiserror::Error;

use super::{
    observation::Observation,
    posterior::POWER,
    printed::{self, Meaning, Printed},
};
use granchain_model::scene::Drive;
use granchain_signal::{
    Gap, Series, bridge,
    feature::{Measurand, fingerprint::Fingerprint},
};

/// Drive periods allowed between the piston's first motion and the onset at the last bead: the pulse needs a few through
/// the chain, a weak drive a few more before it crosses the threshold.
const ONSET_ALLOWANCE: f64 = 25.0;

/// Drive periods allowed between the end of the burst and where the answer has fallen: a few through the chain, and those over which its
/// strength is taken.
const FALL_ALLOWANCE: f64 = 15.0;

/// Drive periods behind the end of the burst in which a record may end without showing that it falls.
const UNSEEN_FALL: f64 = 3.0;

/// Drive periods run beyond what a fingerprint needs, where the onset is known from another fidelity level: it may come that much later, and
/// the filter's edge lies outside.
const AFTER_ONSET: f64 = 3.0;

/// Drive periods run beyond the end of an analysis window, so that the filter's edge lies outside it.
const AFTER_WINDOW: f64 = 2.0;

/// β of a pressure: 27 features of 40 neighbours judge more sharply than 22. With the power of a velocity the first twins' α was missed; see
/// `docs/validation.md` for the counts.
const PRESSURE_POWER: f64 = 0.35;

/// How a conditioned trace becomes features z.
#[derive(Debug, Clone)]
pub enum Reduction {
    /// Of a record: onset, early peaks, bands.
    Fingerprint(Fingerprint),
    /// Of a publication: one z a statement.
    Printed(Printed),
}

/// The yardstick of a fit.
#[derive(Debug, Clone)]
pub struct Comparison {
    /// Cutoff applied to every run, Hz.
    pub cutoff: f64,
    /// Stated bandwidth of the instrument that recorded, Hz: runs pass through it too where it is below the cutoff.
    pub bandwidth: Option<f64>,
    /// Where every run is clipped after its noise, below and above, m/s or Pa: as the record's input was.
    pub clipped: [Option<f64>; 2],
    /// Stretches in which the record has no valid samples, counted from its landmark: every run is bridged there alike.
    pub masked: Vec<Gap>,
    /// Interval of the record's samples, s: where between two of them a gap begins in a run is drawn.
    pub sampling: f64,
    /// Spectral density of the noise every run is given, one-sided, (m/s)²/Hz or Pa²/Hz.
    pub noise_density: f64,
    /// Density of the 1/f part of that noise times the frequency, (m/s)² or Pa².
    pub flicker: f64,
    /// Density of what rounding adds to the noise of a moving signal, (m/s)²/Hz or Pa²/Hz.
    pub rounding: f64,
    /// Number of independent quiet samples of the record that tell its noise.
    pub noise_freedom: f64,
    /// Number of shots that the record is the mean of.
    pub averages: usize,
    pub reduction: Reduction,
    /// Features z₀ to be met.
    pub features: Vec<f64>,
    /// Smallest scatter allowed to each feature, in ln.
    pub nuggets: Vec<f64>,
    /// Weight of each feature on the log-likelihood's quadratic form; 1 unless asked for, 0 leaves it out.
    pub weights: Vec<f64>,
    /// β, the power on the likelihood for which 90 % intervals were found to cover 90 % of twins.
    pub power: f64,
    /// Standard deviation of the logarithm of an unknown factor on what was recorded, 1.
    pub sensitivity: f64,
}

/// Weights that cannot be used.
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
        let measurand = observation.fingerprint.measurand();
        Self {
            cutoff: observation.cutoff,
            bandwidth: observation.bandwidth,
            clipped: observation.clipped,
            masked: observation.masked,
            sampling: observation.sampling,
            noise_density: observation.noise_density,
            flicker: observation.flicker,
            rounding: observation.rounding,
            noise_freedom: observation.noise_freedom,
            averages: observation.averages,
            weights: vec![1.0; observation.features.len()],
            reduction: Reduction::Fingerprint(observation.fingerprint),
            features: observation.features,
            nuggets: observation.nuggets,
            power: match measurand {
                Measurand::Velocity => POWER,
                Measurand::Pressure => PRESSURE_POWER,
            },
            sensitivity: 0.0,
        }
    }
}

impl From<Printed> for Comparison {
    fn from(printed: Printed) -> Self {
        Self {
            cutoff: printed.cutoff(),
            bandwidth: None,
            clipped: [None; 2],
            masked: vec![],
            sampling: 0.0,
            noise_density: 0.0,
            flicker: 0.0,
            rounding: 0.0,
            noise_freedom: 0.0,
            averages: 1,
            features: printed.targets(),
            nuggets: printed.nuggets(),
            weights: vec![1.0; printed.statements().len()],
            reduction: Reduction::Printed(printed),
            power: printed::POWER,
            sensitivity: 0.0,
        }
    }
}

impl Comparison {
    /// Names of the features, in order.
    #[must_use]
    pub fn names(&self) -> Vec<Cow<'static, str>> {
        match &self.reduction {
            Reduction::Fingerprint(fingerprint) => fingerprint.names(),
            Reduction::Printed(printed) => {
                printed.statements().iter().map(|statement| Cow::Owned(statement.name.clone())).collect()
            }
        }
    }

    /// The number that feature `index` is to meet, SI; `None` for a one-sided statement.
    #[must_use]
    pub fn measured(&self, index: usize) -> Option<f64> {
        match &self.reduction {
            Reduction::Fingerprint(fingerprint) => Some(fingerprint.amplitude(index, *self.features.get(index)?)),
            Reduction::Printed(printed) => match printed.statements().get(index)?.meaning {
                Meaning::Value { value, .. } => Some(value),
                _ => None,
            },
        }
    }

    /// The same of a record whose every amplitude is `factor` times as large.
    #[must_use]
    pub fn scaled(&self, factor: f64) -> Option<Self> {
        let Reduction::Fingerprint(fingerprint) = &self.reduction else { return None };
        let scaled = |(index, z): (usize, &f64)| if self.unit(index) == "1" { *z } else { z + factor.ln() };
        Some(Self {
            features: self.features.iter().enumerate().map(scaled).collect(),
            noise_density: factor * factor * self.noise_density,
            flicker: factor * factor * self.flicker,
            rounding: factor * factor * self.rounding,
            clipped: self.clipped.map(|limit| limit.map(|limit| factor * limit)),
            reduction: Reduction::Fingerprint(fingerprint.clone().scaled(factor)),
            ..self.clone()
        })
    }

    /// How each feature z moves with the logarithm of a factor on the trace: 1 of an amplitude, less where it is lost in the floor, 0 of a ratio.
    #[must_use]
    pub fn answers(&self) -> Vec<f64> {
        let answer = |(index, z): (usize, &f64)| match self.amplitude(index, *z) {
            _ if self.unit(index) == "1" => 0.0,
            Some(amplitude) => (amplitude / z.exp()).powi(2),
            None => 1.0,
        };
        self.features.iter().enumerate().map(answer).collect()
    }

    /// The number behind a value z of feature `index`, SI; `None` for a printed statement.
    #[must_use]
    pub fn amplitude(&self, index: usize, z: f64) -> Option<f64> {
        match &self.reduction {
            Reduction::Fingerprint(fingerprint) => Some(fingerprint.amplitude(index, z)),
            Reduction::Printed(_) => None,
        }
    }

    /// SI unit of feature `index`, `1` for a pure number.
    #[must_use]
    pub fn unit(&self, index: usize) -> &'static str {
        let pure = match &self.reduction {
            Reduction::Fingerprint(fingerprint) => {
                fingerprint.names().get(index).is_some_and(|name| name.starts_with("ratio"))
            }
            Reduction::Printed(printed) => {
                printed.statements().get(index).is_some_and(|statement| !statement.meaning.is_velocity())
            }
        };
        if pure { "1" } else { self.measurand().unit() }
    }

    #[must_use]
    pub fn measurand(&self) -> Measurand {
        match &self.reduction {
            Reduction::Fingerprint(fingerprint) => fingerprint.measurand(),
            Reduction::Printed(_) => Measurand::Velocity,
        }
    }

    /// How long a run must be under `drive`, s.
    #[must_use]
    pub fn duration(&self, drive: &Drive) -> f64 {
        match &self.reduction {
            Reduction::Fingerprint(fingerprint) if !fingerprint.by_onset() => {
                drive.burst().1 + FALL_ALLOWANCE / drive.frequency
            }
            Reduction::Fingerprint(fingerprint) => {
                drive.burst().0 + (fingerprint.cycles_needed() as f64 + ONSET_ALLOWANCE) / drive.frequency
            }
            Reduction::Printed(printed) => printed.window().to + AFTER_WINDOW / drive.frequency,
        }
    }

    /// First crossing of the onset threshold by a conditioned trace, s; `None` where it stays below, or where features are measured in
    /// the model's own time, before a fall, or nobody knows where.
    #[must_use]
    pub fn onset(&self, trace: &Series) -> Option<f64> {
        match &self.reduction {
            Reduction::Fingerprint(fingerprint) if fingerprint.by_onset() => {
                fingerprint.landmark(trace).ok().map(|index| trace.time(index))
            }
            _ => None,
        }
    }

    /// A trace as a record has it that begins nobody knows where in the answer: what lies before a place drawn evenly, from the onset to the last that
    /// leaves enough before the answer is seen to fall, is gone. Any other comparison changes nothing and draws nothing.
    pub(super) fn begun(&self, mut trace: Series, drive: &Drive, random: &mut impl Rng) -> Series {
        if let Reduction::Fingerprint(fingerprint) = &self.reduction
            && fingerprint.lies_somewhere()
            && let Ok(onset) = fingerprint.landmark(&trace)
        {
            let end = drive.burst().1 + (UNSEEN_FALL - fingerprint.cycles_needed() as f64) / drive.frequency;
            let last = (end - trace.start) / trace.step;
            let first = random.random_range(onset..=usize::max(onset, (last as usize).min(trace.len())));
            trace = Series::new(trace.time(first), trace.step, trace.values.split_off(first));
        }
        trace
    }

    /// Bridge a run where the record is bridged; `filtered` is the run as features see it, by which the two are aligned.
    ///
    /// - `within`: where between two samples of the record a gap begins, −½ to ½
    pub(super) fn bridge(&self, trace: &mut Series, filtered: &Series, within: f64) {
        if let Reduction::Fingerprint(fingerprint) = &self.reduction
            && let Ok(at) = fingerprint.landmark_time(filtered)
        {
            let at = at + within * self.sampling;
            bridge(trace, &self.masked.iter().map(|gap| gap.later(at)).collect::<Vec<_>>());
        }
    }

    /// How long a run must be that crosses the onset threshold at `onset`, s; `None` where onsets mean nothing.
    #[must_use]
    pub(crate) fn end_of_run(&self, onset: f64, drive: &Drive) -> Option<f64> {
        let Reduction::Fingerprint(fingerprint) = &self.reduction else { return None };
        Some(onset + (fingerprint.cycles_needed() as f64 + AFTER_ONSET) / drive.frequency)
    }

    /// Features z of a conditioned trace (m/s or Pa), or why there are none.
    ///
    /// # Errors
    /// What the fingerprint or the printed features say.
    pub fn reduce(&self, trace: &Series) -> Result<Vec<f64>, String> {
        match &self.reduction {
            Reduction::Fingerprint(fingerprint) => fingerprint.measure(trace).map_err(|error| error.to_string()),
            Reduction::Printed(printed) => printed.measure(trace).map_err(|error| error.to_string()),
        }
    }

    /// The same with other weights for the features named.
    ///
    /// # Errors
    /// An unknown name, or a weight that is negative or not finite.
    pub fn weighted(mut self, weights: &BTreeMap<String, f64>) -> Result<Self, WeightError> {
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
