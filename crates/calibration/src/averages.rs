//! Runs as an averaging instrument stores them: the mean of several shots, each with its own gaps and trigger instant.

use rand::Rng;
use rand_chacha::ChaCha8Rng;
use rand_distr::{Distribution, StandardNormal};

use super::{
    engine::Engine,
    forward::{DrawnRun, Forward, LANES},
};
use granchain_model::ModelError;
use granchain_signal::Series;

/// Most shots simulated for an average: more make little difference.
const MOST_SHOTS: usize = 16;

/// Largest standard deviation of the trigger from shot to shot, s.
const JITTER: f64 = 0.3e-6;

impl Forward {
    /// The trace of one run.
    pub(super) fn mean_of_shots(
        &self,
        engine: &Engine,
        drawn: &DrawnRun,
        random: &mut ChaCha8Rng,
    ) -> Result<Series, ModelError> {
        let jitter = JITTER * random.random::<f64>();
        let mut shots = vec![drawn.variation.clone()];
        shots.resize_with(self.comparison.averages.min(MOST_SHOTS), || {
            let mut shot = drawn.variation.clone();
            for (offset, known) in shot.gap_offsets.iter_mut().zip(&drawn.gaps) {
                let draw: f64 = StandardNormal.sample(random);
                *offset += drawn.roughness * (draw.abs() - known);
            }
            shot
        });
        let mut mean: Option<Series> = None;
        for trace in shots.chunks(LANES).flat_map(|shots| engine.run(shots)) {
            let trace = trace?;
            let draw: f64 = StandardNormal.sample(random);
            let late = jitter * draw / trace.step;
            match &mut mean {
                None => mean = Some(trace),
                Some(mean) => {
                    mean.values.iter_mut().enumerate().for_each(|(i, value)| *value += shifted(&trace, i, late));
                }
            }
        }
        let count = shots.len() as f64;
        Ok(mean.map_or_else(|| Series::new(0.0, 1.0, vec![]), |mean| mean.map(|value| value / count)))
    }
}

/// Sample `index` of a trace delayed by `late` samples, by linear interpolation.
fn shifted(trace: &Series, index: usize, late: f64) -> f64 {
    let place = (index as f64 - late).clamp(0.0, (trace.len() - 1) as f64);
    let (whole, part) = (place.floor() as usize, place.fract());
    let next = trace.values[(whole + 1).min(trace.len() - 1)];
    (1.0 - part) * trace.values[whole] + part * next
}
