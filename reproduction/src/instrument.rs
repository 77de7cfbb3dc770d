//! Perturbed runs of one scene at several levels of its drive, as a vibrometer sees them.

use crate::{
    decoder::Decoder,
    failure::StudyError,
    portrait::{Portrait, PortraitMoments, Trait},
};
use granchain_calibration::predict::{
    Bodies,
    ensemble::{EnsemblePlan, STEPS_PER_PERIOD, Spread},
    replicates::{self, Watch, perturbations},
};
use granchain_model::{chain::ensemble::Variation, scene::Scene};
use granchain_signal::{
    Series,
    feature::{FeatureSettings, Measurand},
};

/// What perturbed runs pass through before they are measured.
#[derive(Debug, Clone, Copy)]
pub struct Instrument<'a> {
    pub bodies: &'a Bodies,
    pub decoder: Decoder,
    /// How velocities without noise are measured.
    pub settings: &'a FeatureSettings,
    /// Every so many of the samples behind the vibrometer are measured: measuring all of them costs more than the run.
    pub every: usize,
}

impl Instrument<'_> {
    /// Portraits of the plan's replicates at each factor on the scene's drive, the same perturbations at each; a run that failed leaves its reason.
    ///
    /// # Errors
    /// [`StudyError::Run`] for a scene that no run can be made of, [`StudyError::Stopped`].
    pub fn at(
        &self,
        scene: &Scene,
        factors: &[f64],
        plan: &EnsemblePlan,
        watch: &dyn Watch,
    ) -> Result<Vec<Vec<Result<Portrait, String>>>, StudyError> {
        let perturbed = perturbations(scene, plan);
        let at = |factor: f64| {
            let scaled = move |replicate: &Variation| Variation {
                amplitude_scale: replicate.amplitude_scale * factor,
                ..replicate.clone()
            };
            perturbed.iter().map(scaled)
        };
        let variations: Vec<Variation> = factors.iter().flat_map(|factor| at(*factor)).collect();
        let noisy = self.decoder.settings(self.settings);
        let see =
            |index, velocity: &Series| Portrait::of(&thinned(self.decoder.sees(velocity, index), self.every), &noisy);
        let portraits =
            replicates::run(self.bodies, scene, &variations, STEPS_PER_PERIOD, Measurand::Velocity, watch, see)
                .map_err(|source| StudyError::Run { what: "perturbed runs".into(), source })?;
        if watch.stop() {
            return Err(StudyError::Stopped);
        }
        Ok(portraits.chunks(plan.replicates).map(<[_]>::to_vec).collect())
    }
}

/// Mean, scatter and sensitivity of every number from runs at the drive's [`EnsemblePlan::levels`], in the order of [`Trait::all`].
pub fn spreads(levels: &[Vec<Result<Portrait, String>>]) -> Vec<Option<Spread>> {
    let moments: Vec<PortraitMoments> = levels.iter().map(|replicates| PortraitMoments::of(replicates)).collect();
    let of = |number: Trait| {
        let [own, above, below] = moments.as_slice() else { return None };
        Some(Spread::between(&own.get(number)?, &above.get(number)?, &below.get(number)?))
    };
    Trait::all().into_iter().map(of).collect()
}

fn thinned(series: Series, every: usize) -> Series {
    if every == 1 {
        return series;
    }
    Series::new(series.start, series.step * every as f64, series.values.into_iter().step_by(every).collect())
}

#[cfg(test)]
mod tests {
    use super::*;
    use granchain_calibration::predict::{observation, replicates::Unwatched};
    use granchain_signal::feature::Ratio;

    #[test]
    fn a_fourth_of_the_samples_of_the_chain_has_the_same_peaks_and_thirds() {
        let scene = granchain_model::scene::load("annulus", &["alpha=0.5".to_owned()]).unwrap();
        let settings = observation::settings(&scene).unwrap();
        let bodies = Bodies::default();
        let decoder = Decoder::of_reconstruction(1);
        let [all, fourth] = [1, 4].map(|every| {
            let seen = Instrument { bodies: &bodies, decoder, settings: &settings, every };
            seen.at(&scene, &[1.0], &EnsemblePlan::new(2, 1), &Unwatched).unwrap().concat()
        });
        for (all, fourth) in all.iter().flatten().zip(fourth.iter().flatten()) {
            // The noise at the peaks is 1 mm/s of 300, and every fourth sample has another part of it.
            for what in [Trait::PositivePeak, Trait::NegativePeak, Trait::Level(Ratio::new(1, 3))] {
                let (all, fourth) = (all.get(what).unwrap(), fourth.get(what).unwrap());
                assert!((fourth / all - 1.0).abs() < 3e-3, "{}: {all} {fourth}", what.key());
            }
        }
    }
}
