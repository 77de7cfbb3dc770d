//! The paper's scene on the annulus along one varied quantity: portraits and spectra of perturbed runs at each value.

use std::{marker::PhantomData, ops::Range};

use serde::{Deserialize, Serialize};

use crate::{
    decoder::Decoder,
    portrait::{Portrait, PortraitMoments},
};
use crate::{
    divided::Divided,
    failure::{StudyError, enough},
    paper::{LAWS, Law},
};
use granchain_calibration::predict::{
    Bodies,
    ensemble::{EnsemblePlan, STEPS_PER_PERIOD},
    observation,
    replicates::{self, Watch, perturbations},
};
use granchain_model::scene::Scene;
use granchain_signal::{
    Series,
    feature::{FeatureError, FeatureSettings, Measurand, Window, amplitude_spectrum},
};

/// Highest frequency of the spectra, in drive frequencies.
pub const SPECTRUM_SPAN: f64 = 3.25;
pub const SPECTRUM_POINTS: usize = 260;

/// How much is run at each value.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct TrendPlan {
    /// Perturbed runs, ≥ 2.
    #[serde(rename = "members")]
    pub replicates: usize,
    pub seed: u64,
}

/// A value of the varied quantity.
#[derive(Debug, Clone, PartialEq)]
pub struct Setting {
    pub value: f64,
    /// The overrides that set it.
    pub overrides: Vec<String>,
}

/// What came of a value.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct TrendPoint {
    pub value: f64,
    /// Mean and scatter over the perturbed runs.
    pub moments: PortraitMoments,
    pub failed: usize,
    /// Mean over the runs of the largest amplitude in each of [`SPECTRUM_POINTS`] equal bands up to [`SPECTRUM_SPAN`] f0, m/s.
    pub spectrum_m_per_s: Vec<f64>,
}

/// What is varied along the chain under both laws, and what came of one law.
pub trait Varied: Sized {
    /// The values, in the order in which they are shown.
    fn settings() -> Vec<Setting>;

    /// The overrides of every scene, where `given` are the caller's, which win.
    ///
    /// # Errors
    /// [`StudyError`] for overrides that make no scene.
    fn overrides(given: &[String]) -> Result<Vec<String>, StudyError> {
        Ok(given.to_vec())
    }

    /// What a law's points, one a setting, say together.
    fn of(law: Law, points: Vec<TrendPoint>) -> Self;
}

/// Both laws at the paper's α along what `V` varies: a point is a law at a value.
#[derive(Debug)]
pub struct Study<V> {
    plan: TrendPlan,
    overrides: Vec<String>,
    scene: Scene,
    settings: Vec<Setting>,
    bodies: Bodies,
    varied: PhantomData<fn() -> V>,
}

impl<V: Varied> Study<V> {
    /// Check plan and scene; `given` overrides apply to all runs, before a setting's own.
    ///
    /// # Errors
    /// [`StudyError::TooFew`], [`StudyError::Scene`].
    pub fn new(plan: TrendPlan, given: &[String], bodies: Bodies) -> Result<Self, StudyError> {
        if plan.replicates < 2 {
            return Err(StudyError::TooFew { what: "members", least: 2, found: plan.replicates });
        }
        let overrides = V::overrides(given)?;
        let scene = LAWS[0].scene(&overrides)?;
        Ok(Self { plan, overrides, scene, settings: V::settings(), bodies, varied: PhantomData })
    }

    #[must_use]
    pub fn plan(&self) -> &TrendPlan {
        &self.plan
    }

    #[must_use]
    pub fn bodies(&self) -> &Bodies {
        &self.bodies
    }

    #[must_use]
    pub fn scene(&self) -> &Scene {
        &self.scene
    }
}

/// Single failed runs are counted.
impl<V: Varied> Divided for Study<V> {
    type Point = TrendPoint;
    type Outcome = Vec<V>;

    fn points(&self) -> usize {
        LAWS.len() * self.settings.len()
    }

    fn runs_of(&self, _point: usize) -> usize {
        self.plan.replicates
    }

    fn part(&self, part: Range<usize>, watch: &dyn Watch) -> Result<Vec<TrendPoint>, StudyError> {
        let settings = self.settings.len();
        part.map(|number| self.point(&LAWS[number / settings], &self.settings[number % settings], watch)).collect()
    }

    fn outcome(&self, points: Vec<TrendPoint>) -> Result<Vec<V>, StudyError> {
        Ok(LAWS.iter().zip(points.chunks(self.settings.len())).map(|(law, own)| V::of(*law, own.to_vec())).collect())
    }
}

impl<V: Varied> Study<V> {
    fn point(&self, law: &Law, setting: &Setting, watch: &dyn Watch) -> Result<TrendPoint, StudyError> {
        let Self { plan, overrides, bodies, .. } = self;
        let what = || format!("{} dampers with {}", law.name, setting.overrides.join(", "));
        let all: Vec<String> = overrides.iter().chain(&setting.overrides).cloned().collect();
        let scene = law.scene(&all)?;
        let clean = observation::settings(&scene).map_err(|source| StudyError::Feature { what: what(), source })?;
        let decoder = Decoder::of_reconstruction(plan.seed);
        let noisy = decoder.settings(&clean);
        let variations = perturbations(&scene, &EnsemblePlan::new(plan.replicates, plan.seed));
        let see = |index, velocity: &Series| {
            let velocity = decoder.sees(velocity, index);
            Ok((Portrait::of(&velocity, &noisy)?, bands(&velocity, &noisy)?))
        };
        let outcomes = replicates::run(bodies, &scene, &variations, STEPS_PER_PERIOD, Measurand::Velocity, watch, see)
            .map_err(|source| StudyError::Run { what: what(), source })?;
        if watch.stop() {
            return Err(StudyError::Stopped);
        }
        let (portraits, spectra): (Vec<_>, Vec<_>) = outcomes.into_iter().map(Result::unzip_pair).unzip();
        let moments = PortraitMoments::over(&portraits.iter().flatten().collect::<Vec<_>>());
        let moments = enough(moments, &portraits, what)?;
        let spectra: Vec<&Vec<f64>> = spectra.iter().flatten().collect();
        let mean = |band: usize| spectra.iter().map(|bands| bands[band]).sum::<f64>() / spectra.len().max(1) as f64;
        let failed = portraits.iter().filter(|portrait| portrait.is_err()).count();
        Ok(TrendPoint {
            value: setting.value,
            moments,
            failed,
            spectrum_m_per_s: (0..SPECTRUM_POINTS).map(mean).collect(),
        })
    }
}

/// A pair of results out of the result of a pair.
trait UnzipPair<A, B> {
    fn unzip_pair(self) -> (Result<A, String>, Option<B>);
}

impl<A, B> UnzipPair<A, B> for Result<(A, B), String> {
    fn unzip_pair(self) -> (Result<A, String>, Option<B>) {
        match self {
            Ok((a, b)) => (Ok(a), Some(b)),
            Err(reason) => (Err(reason), None),
        }
    }
}

/// Largest amplitude in each band, m/s.
fn bands(velocity: &Series, settings: &FeatureSettings) -> Result<Vec<f64>, FeatureError> {
    let window = settings.window.unwrap_or_else(|| Window::whole(velocity));
    let spectrum = amplitude_spectrum(velocity, window)?;
    let width = SPECTRUM_SPAN * settings.drive_frequency / SPECTRUM_POINTS as f64;
    let mut largest = vec![0.0; SPECTRUM_POINTS];
    for (index, amplitude) in spectrum.amplitudes.iter().enumerate() {
        let band = (spectrum.frequency(index) / width) as usize;
        match largest.get_mut(band) {
            Some(value) => *value = f64::max(*value, *amplitude),
            None => break,
        }
    }
    Ok(largest)
}

/// Spearman's rank correlation of two lists of one length, −1…1; 0 where either has no spread. Ties share their mean rank.
#[must_use]
pub(crate) fn rank_correlation(x: &[f64], y: &[f64]) -> f64 {
    let (x, y) = (ranks(x), ranks(y));
    let middle = 0.5 * (x.len() as f64 + 1.0);
    let product = |a: &[f64], b: &[f64]| a.iter().zip(b).map(|(a, b)| (a - middle) * (b - middle)).sum::<f64>();
    let scale = (product(&x, &x) * product(&y, &y)).sqrt();
    if scale > 0.0 { product(&x, &y) / scale } else { 0.0 }
}

fn ranks(values: &[f64]) -> Vec<f64> {
    let rank = |value: f64| {
        let below = values.iter().filter(|other| **other < value).count();
        let same = values.iter().filter(|other| **other == value).count();
        below as f64 + 0.5 * (same as f64 + 1.0)
    };
    values.iter().map(|value| rank(*value)).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn rank_correlation_is_that_of_the_textbook() {
        // Spearman (1904): 1 − 6 Σ d²/(n (n² − 1)) without ties.
        let (x, y) = ([1.0, 2.0, 3.0, 4.0, 5.0], [5.0, 6.0, 7.0, 8.0, 7.5]);
        assert!((rank_correlation(&x, &y) - 0.9).abs() < 1e-12);
        assert!((rank_correlation(&x, &[3.0, 1.0, -2.0, -8.0, -9.0]) + 1.0).abs() < 1e-12);
        assert_eq!(rank_correlation(&x, &[1.0; 5]), 0.0);
    }
}
