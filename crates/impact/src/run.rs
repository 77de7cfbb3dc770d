//! Simulated hits: the chain's sensor force as a laboratory would have recorded it.

use std::f64::consts::TAU;

use granchain_model::{
    ModelError,
    chain::ChainModel,
    chain::ensemble::Variation,
    scene::{Scene, Sensor},
};
use granchain_signal::Series;
use nalgebra::SVector;
use rand::{Rng as _, SeedableRng as _};
use rand_chacha::ChaCha8Rng;
use rand_distr::{Distribution as _, StandardNormal};
use rayon::prelude::*;

use crate::{
    hit::{Features, observe},
    parameter::{Parameter, Target},
};

/// Quantities that all hits share and that nobody fits: velocity, bead stiffness, corner of the AC coupling, where in its bead the sensor reads.
pub(crate) const SHARED: usize = 4;

pub(crate) type Nuisance = SVector<f64, SHARED>;

/// Corner of the AC coupling, Hz, and the standard deviation of its logarithm: from coupling that leaves an impulse as it is to one that bends its
/// foot below zero by a third.
pub(super) const CORNER: (f64, f64) = (800.0, 0.7);

/// Standard deviation of the share of the contact before the sensor bead: a shift of half a bead's passage would be one half.
const SHARE: f64 = 0.1;

/// Longest run, s, in which an impulse is followed to the last bead.
const LONGEST: f64 = 20e-3;

/// What is not known of a bench with a striker.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Unknown {
    /// Standard deviation of ln of the striker's velocity, shared by all hits, 1.
    pub velocity: f64,
    /// The same of the beads' stiffness over their mass, 1.
    pub modulus: f64,
}

impl Default for Unknown {
    fn default() -> Self {
        Self { velocity: 0.05, modulus: 0.004 }
    }
}

/// Standard deviation of ln of a hit's velocity about that of all hits, 1.
const HIT_VELOCITY: f64 = 0.03;

/// One simulated hit.
#[derive(Debug, Clone, PartialEq)]
pub struct Run {
    /// Where its parameters lie in their bounds, 0 to 1.
    pub at: Vec<f64>,
    /// The shared unknowns, in standard deviations.
    pub nuisance: Nuisance,
    /// What it showed, or why it showed nothing.
    pub features: Result<Features, String>,
}

/// A bench on which hits are simulated.
#[derive(Debug, Clone)]
pub(crate) struct Bench<'a> {
    pub scene: &'a Scene,
    pub parameters: &'a [Parameter],
    pub unknown: Unknown,
    /// Sampling step of the records, s.
    pub step: f64,
    /// Before this after the incident impulse nothing can have returned, s.
    pub earliest: f64,
    pub seed: u64,
}

impl Bench<'_> {
    /// Runs `numbers` of a low-discrepancy design within a part of the box; the same for any number of threads.
    pub(crate) fn runs(&self, numbers: std::ops::Range<u32>, within: &[[f64; 2]]) -> Vec<Run> {
        numbers.into_par_iter().map(|number| self.run(number, within)).collect()
    }

    fn run(&self, number: u32, within: &[[f64; 2]]) -> Run {
        let sample = |d: usize| f64::from(sobol_burley::sample(number, d as u32, self.seed as u32));
        let at: Vec<f64> = within.iter().enumerate().map(|(d, [low, high])| low + (high - low) * sample(d)).collect();
        let mut random = ChaCha8Rng::seed_from_u64(self.seed);
        random.set_stream(u64::from(number));
        let nuisance = Nuisance::from_fn(|_, _| StandardNormal.sample(&mut random));
        let own: f64 = StandardNormal.sample(&mut random);
        let phase: f64 = random.random();
        let mut scene = self.scene.clone();
        self.parameters.iter().zip(&at).for_each(|(parameter, u)| parameter.set(&mut scene, parameter.value(*u)));
        // A fitted velocity is not drawn as well.
        let known = self.parameters.iter().any(|parameter| parameter.target == Target::Alpha);
        let velocity = if known { 0.0 } else { self.unknown.velocity * nuisance[0] };
        let variation = Variation {
            amplitude_scale: scene.amplitude_scale * (velocity + HIT_VELOCITY * own).exp(),
            modulus_factor: (self.unknown.modulus * nuisance[1]).exp(),
            ..Variation::of(&scene)
        };
        scene = variation.written_into(&scene, |gap| gap.max(0.0));
        let corner = CORNER.0 * (CORNER.1 * nuisance[2]).exp();
        let features = force(&scene, SHARE * nuisance[3]).map_err(|error| error.to_string()).and_then(|force| {
            let seen = sampled(&high_passed(&force, corner), self.step, phase);
            let lacking = || "no impulse returns to the sensor within the duration".into();
            observe(&seen, self.earliest).map(|found| found.features()).ok_or_else(lacking)
        });
        Run { at, nuisance, features }
    }
}

/// What the scene's sensor reads, N, and the force of every contact from the striker's to the foot's.
fn forces(scene: &Scene, more: f64) -> Result<(Series, Vec<Series>), ModelError> {
    let lacking =
        || ModelError::Unsupported { model: "chain", reason: "the scene has no sensor; set chain.sensor".into() };
    let sensor = scene.chain.sensor.ok_or_else(lacking)?;
    let forces = ChainModel.run(scene, &mut |_| true)?.contact_force;
    let read = Sensor { share: (sensor.share + more).clamp(0.0, 1.0), ..sensor }.reads(&forces);
    Ok((read, forces))
}

/// What the scene's sensor reads, N, if its share is larger by `more`.
pub fn force(scene: &Scene, more: f64) -> Result<Series, ModelError> {
    forces(scene, more).map(|(read, _)| read)
}

/// The force of the last bead on the ground, N.
pub(crate) fn foot(scene: &Scene) -> Result<Series, ModelError> {
    forces(scene, 0.0).map(|(_, mut forces)| forces.swap_remove(scene.chain.beads.len()))
}

/// When the impulse reaches the sensor, and how long after it nothing can have returned: twice its way from there to the last bead; s. A record of
/// `length` (s) shows it.
pub fn arrival(scene: &Scene, length: f64) -> Result<[f64; 2], ModelError> {
    let mut scene = scene.clone();
    scene.duration = scene.duration.max(length.min(LONGEST));
    let (read, forces) = forces(&scene, 0.0)?;
    let [sensor, last] = [&read, &forces[scene.chain.beads.len() - 1]].map(|force| {
        let half = 0.5 * force.values.iter().copied().fold(0.0, f64::max);
        force.time(force.values.iter().position(|value| *value >= half).unwrap_or(0))
    });
    Ok([sensor, 2.0 * (last - sensor).max(0.0)])
}

/// As an AC coupling passes it: ẏ = ẋ − 2π f y, y = 0 at first, by the trapezoidal rule.
pub fn high_passed(series: &Series, corner: f64) -> Series {
    let half = 0.5 * TAU * corner * series.step;
    let (mut before, mut out) = (series.values.first().copied().unwrap_or_default(), 0.0);
    series.map(|value| {
        out = (out * (1.0 - half) + value - before) / (1.0 + half);
        before = value;
        out
    })
}

/// Every `step` (s), first `phase` of a step after the series begins; on the line between its samples.
pub fn sampled(series: &Series, step: f64, phase: f64) -> Series {
    let (stride, first) = (step / series.step, phase * step / series.step);
    let last = series.len().saturating_sub(1) as f64;
    let count = ((last - first) / stride).floor().max(0.0) as usize + 1;
    let value = |index: usize| {
        let at = (first + index as f64 * stride).min(last);
        let below = at.floor();
        let [a, b] = [below as usize, at.ceil() as usize].map(|i| series.values[i]);
        a + (at - below) * (b - a)
    };
    Series::new(series.start + phase * step, step, (0..count).map(value).collect())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn an_ac_coupling_forgets_a_step_in_its_time_constant() {
        let step = Series::new(0.0, 1e-6, (0..1000).map(|i| if i < 10 { 5.0 } else { 7.0 }).collect());
        let passed = high_passed(&step, 1000.0);
        let decay = (-TAU * 1000.0 * 400e-6_f64).exp();
        assert!((passed.values[410] / passed.values[10] - decay).abs() < 1e-5, "{}", passed.values[410]);
        assert!(passed.values[..10].iter().all(|value| *value == 0.0) && (passed.values[10] - 2.0).abs() < 0.01);
    }

    #[test]
    fn samples_lie_on_the_trace_and_within_it() {
        let line = Series::new(2e-3, 1e-6, (0..1001).map(|i| 3.0 * f64::from(i)).collect());
        let seen = sampled(&line, 19.5e-6, 0.7);
        assert!(seen.end() <= line.end() && line.end() - seen.end() < 19.5e-6);
        for (index, value) in seen.values.iter().enumerate() {
            assert!((value - 3.0 * (seen.time(index) - 2e-3) / 1e-6).abs() < 1e-6);
        }
    }
}
