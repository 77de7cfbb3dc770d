//! argmin's own solvers on the plain misfit, for comparison with the search of [`super::search`].
//!
//! The misfit of a single run is mean over features of min(|z − z₀|/0.2, 5)². In chaotic regimes it is itself a noisy
//! draw, so the minimum found is the luckiest run, not the truest: the answer is read from a regression over all runs in
//! any case. Every batch is a fresh start: one Nelder–Mead from a Sobol point, or one small swarm over the whole box.

use std::sync::{Mutex, PoisonError};

use argmin::{
    core::{CostFunction, Error, Executor},
    solver::{neldermead::NelderMead, particleswarm::ParticleSwarm},
};
use rand::SeedableRng;
use rand_chacha::ChaCha8Rng;

use super::{forward::Run, joint::Joint, parameter::reflect, search::Strategy};

/// Deviation of a feature, in ln, that counts as one.
const YARDSTICK: f64 = 0.2;

/// Cost of a failed run: finite, because argmin's Nelder–Mead breaks on NaN and its particle swarm on infinity.
const FAILED: f64 = 1000.0;

/// Particles of a swarm.
const PARTICLES: usize = 12;

/// Side of the first simplex, unit coordinates.
const SIMPLEX: f64 = 0.08;

/// The misfit, remembering every run made for it.
struct Misfit<'a> {
    joint: &'a Joint,
    observed: &'a [f64],
    first: u64,
    count: usize,
    runs: &'a Mutex<Vec<Run>>,
}

impl CostFunction for Misfit<'_> {
    type Param = Vec<f64>;
    type Output = f64;

    fn cost(&self, position: &Vec<f64>) -> Result<f64, Error> {
        let inside: Vec<f64> = position.iter().map(|u| reflect(*u)).collect();
        let mut runs = self.runs.lock().unwrap_or_else(PoisonError::into_inner);
        if runs.len() >= self.count {
            return Ok(FAILED);
        }
        let mut made = self.joint.run(self.first + runs.len() as u64, &[inside]);
        let cost = made.first().and_then(Run::features).map_or(FAILED, |features| {
            let each = features.iter().zip(self.observed);
            let sum: f64 = each.map(|(z, z0)| ((z - z0).abs() / YARDSTICK).min(5.0).powi(2)).sum();
            sum / self.observed.len() as f64
        });
        runs.append(&mut made);
        Ok(cost)
    }
}

/// Exactly `count` runs, the first of which is run number `first` of the search.
///
/// # Errors
/// When argmin refuses the set-up.
pub fn runs(joint: &Joint, strategy: Strategy, first: u64, count: usize, seed: u64) -> Result<Vec<Run>, Error> {
    let dimension = joint.parameters().len();
    let observed: Vec<f64> = joint.records().iter().flat_map(|record| record.comparison.features.clone()).collect();
    let made = Mutex::new(Vec::with_capacity(count));
    let mut start = 0;
    while made.lock().unwrap_or_else(PoisonError::into_inner).len() < count {
        let misfit = Misfit { joint, observed: &observed, first, count, runs: &made };
        match strategy {
            Strategy::ParticleSwarm => {
                let random = ChaCha8Rng::seed_from_u64(seed.wrapping_add(start));
                let bounds = (vec![0.0; dimension], vec![1.0; dimension]);
                let solver: ParticleSwarm<Vec<f64>, f64, _> =
                    ParticleSwarm::new(bounds, PARTICLES).with_rng_generator(random);
                let iterations = (count / PARTICLES) as u64;
                Executor::new(misfit, solver).configure(|state| state.max_iters(iterations)).ctrlc(false).run()?;
            }
            Strategy::NelderMead | Strategy::Likelihood => {
                let index = (first + start) as u32;
                let corner: Vec<f64> =
                    (0..dimension).map(|d| f64::from(sobol_burley::sample(index, d as u32, seed as u32))).collect();
                let mut simplex = vec![corner.clone()];
                simplex.extend((0..dimension).map(|d| {
                    let mut other = corner.clone();
                    other[d] += SIMPLEX;
                    other
                }));
                let solver = NelderMead::new(simplex).with_sd_tolerance(0.02)?;
                Executor::new(misfit, solver).configure(|state| state.max_iters(40)).ctrlc(false).run()?;
            }
        }
        start += 1;
    }
    Ok(made.into_inner().unwrap_or_else(PoisonError::into_inner))
}
