//! A run of the chain between its samples too: quintic splines through a finely sampled response.

use granchain::{
    model::chain::{ChainModel, InitialState},
    response::EnergyBalance,
    scene::Scene,
    signal::{
        Series,
        spline::{Ends, Spline},
    },
};

/// Displacement (m) and velocity (m/s) of every bead, counted from 0 at the piston, at any instant (s).
pub(crate) struct Continuous {
    displacement: Vec<Spline>,
    velocity: Vec<Spline>,
    step: f64,
    pub(crate) energy: EnergyBalance,
}

impl Continuous {
    /// Run a scene from rest positions with these velocities (m/s), sampled every `step` (s).
    pub(crate) fn run(scene: &Scene, velocities: Vec<f64>, step: f64) -> Self {
        let scene = Scene { output_step: step, ..scene.clone() };
        let initial = InitialState { displacements: vec![0.0; velocities.len()], velocities };
        let response = ChainModel.run_from(&scene, &initial, &mut |_| true).unwrap();
        let splines = |all: &[Series]| all.iter().map(|series| Spline::new(series, Ends::Natural)).collect();
        let (displacement, velocity) = (splines(&response.bead_displacement), splines(&response.bead_velocity));
        Self { displacement, velocity, step, energy: response.energy }
    }

    pub(crate) fn displacement(&self, bead: usize, time: f64) -> f64 {
        self.displacement[bead].at(time).0
    }

    pub(crate) fn velocity(&self, bead: usize, time: f64) -> f64 {
        self.velocity[bead].at(time).0
    }

    /// Instant and value of the largest velocity of a bead up to `end`, or with `sign` −1 of the smallest: the largest sample, then a
    /// golden section around it.
    pub(crate) fn extreme_velocity(&self, bead: usize, sign: f64, end: f64) -> (f64, f64) {
        let value = |time: f64| sign * self.velocity(bead, time);
        let samples = (0..=(end / self.step).round() as usize).map(|sample| sample as f64 * self.step);
        let largest = samples.max_by(|a, b| value(*a).total_cmp(&value(*b))).unwrap();
        let (mut low, mut high) = (largest - self.step, largest + self.step);
        let golden = 0.5 * (5f64.sqrt() - 1.0);
        for _ in 0..60 {
            let (left, right) = (high - golden * (high - low), low + golden * (high - low));
            (low, high) = if value(left) > value(right) { (low, right) } else { (left, high) };
        }
        (0.5 * (low + high), self.velocity(bead, 0.5 * (low + high)))
    }

    /// Frequency (Hz) of a nearly sinusoidal motion of that shape, from the first and the last upward zero crossing of its velocity up to
    /// `duration` (s); it starts as a cosine near the frequency `guess`.
    pub(crate) fn frequency(&self, shape: &[f64], guess: f64, duration: f64) -> f64 {
        let modal = |time: f64| shape.iter().enumerate().map(|(i, shape)| shape * self.velocity(i, time)).sum::<f64>();
        let crossing = |near: f64| {
            let (mut low, mut high) = (near - 0.2 / guess, near + 0.2 / guess);
            assert!(modal(low) < 0.0 && modal(high) > 0.0);
            for _ in 0..60 {
                let middle = 0.5 * (low + high);
                if modal(middle) < 0.0 { low = middle } else { high = middle }
            }
            0.5 * (low + high)
        };
        // Upward crossings at (n − 1/4) periods.
        let periods = (duration * guess - 0.5).floor();
        (periods - 1.0) / (crossing((periods - 0.25) / guess) - crossing(0.75 / guess))
    }
}
