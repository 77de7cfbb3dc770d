//! Twins: records made with known parameters, to prove that the stated intervals hold.
//!
//! Each twin is simulated by the accurate integrator at its truth, with its own draw of gaps, and passes through a lab
//! of its own: sample rate, trigger offset, baseline, white noise. It is then fitted as any record.

use rand::{Rng, SeedableRng};
use rand_chacha::ChaCha8Rng;
use rand_distr::{Distribution, StandardNormal};
use serde::{Deserialize, Serialize};

use super::{forward::Uncertainty, observation::Recording, parameter::Parameter};
use crate::{
    model::{ModelError, Progress},
    response::Response,
    scene::{DampingKind, FlatContact, Scene, Support},
    signal::{Conditioning, Series},
};

/// What a twin was made with.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Truth {
    /// Number of the twin.
    pub index: u64,
    /// `rigid` or `annulus`.
    pub support: String,
    /// Damping law.
    pub damping_kind: String,
    /// Values of the parameters, SI.
    pub values: Vec<f64>,
    /// σ of the noise relative to the peak.
    pub noise: f64,
    /// Sample rate, Hz.
    pub sample_rate_hz: f64,
    /// Time from the drive's start to the record's time zero, s.
    pub trigger_offset_s: f64,
    /// Offset of the record, m/s.
    pub baseline_m_per_s: f64,
}

/// Share of the box, in each coordinate, from which truths are drawn: intervals at its edge are cut off.
const INNER: (f64, f64) = (0.12, 0.88);

/// Sample rates of the lab, Hz.
const SAMPLE_RATES: [f64; 5] = [1.25e6, 2.5e6, 4e6, 5e6, 10e6];

/// Recorded time before the drive starts, s.
const PRE_TRIGGER: f64 = 30e-6;

/// The scene of twin `index` (without its truth): the supports alternate, the laws alternate half as fast.
#[must_use]
pub fn scene_of(base: &Scene, index: u64) -> Scene {
    let mut scene = base.clone();
    scene.support = if index.is_multiple_of(2) {
        Support::Annulus { stiffness_factor: 1.0 }
    } else {
        Support::Flat(FlatContact::Rigid)
    };
    scene.damping.kind = if (index / 2).is_multiple_of(2) { DampingKind::Linear } else { DampingKind::KuwabaraKono };
    scene.damping.linear = 0.0;
    scene.damping.kuwabara_kono = 0.0;
    scene
}

/// Draw the truth of twin `index` and simulate what the lab would have recorded.
///
/// `simulate` runs a scene accurately.
///
/// # Errors
/// When the simulation fails.
pub fn twin(
    scene: &Scene,
    parameters: &[Parameter],
    uncertainty: &Uncertainty,
    index: u64,
    seed: u64,
    simulate: &dyn Fn(&Scene, Progress<'_>) -> Result<Response, ModelError>,
) -> Result<(Truth, Recording), ModelError> {
    let mut random = ChaCha8Rng::seed_from_u64(seed ^ 0x7714);
    random.set_stream(index + 1);
    let mut truth_scene = scene.clone();
    let values: Vec<f64> = parameters
        .iter()
        .enumerate()
        .map(|(d, parameter)| {
            let u = f64::from(sobol_burley::sample(index as u32, d as u32, seed as u32));
            let value = parameter.value(INNER.0 + (INNER.1 - INNER.0) * u);
            parameter.set(&mut truth_scene, value);
            value
        })
        .collect();
    for gap in &mut truth_scene.chain.gaps {
        let draw: f64 = StandardNormal.sample(&mut random);
        *gap += uncertainty.gap * draw.abs();
    }
    let response = simulate(&truth_scene, &mut |_| true)?;
    let noise = random.random_range(0.0..0.03);
    let sample_rate = SAMPLE_RATES[random.random_range(0..SAMPLE_RATES.len())];
    let trigger_offset: f64 = random.random_range(-10e-6..10e-6);
    let peak = response.pole_velocity.peak();
    let baseline = peak * random.random_range(-0.05..0.05);
    let span = PRE_TRIGGER + response.pole_velocity.end() - trigger_offset.abs();
    let conditioning = Conditioning {
        bandwidth: Some(0.45 * sample_rate),
        delay: trigger_offset,
        invert: false,
        start: -PRE_TRIGGER,
        step: 1.0 / sample_rate,
        count: (span * sample_rate) as usize,
    };
    let mut velocity = conditioning.apply(&response.pole_velocity);
    for value in &mut velocity.values {
        let draw: f64 = StandardNormal.sample(&mut random);
        *value += baseline + noise * peak * draw;
    }
    let truth = Truth {
        index,
        support: if matches!(scene.support, Support::Annulus { .. }) { "annulus".into() } else { "rigid".into() },
        damping_kind: format!("{:?}", scene.damping.kind),
        values,
        noise,
        sample_rate_hz: sample_rate,
        trigger_offset_s: trigger_offset,
        baseline_m_per_s: baseline,
    };
    Ok((truth, without_baseline(velocity)))
}

fn without_baseline(velocity: Series) -> Recording {
    let quiet = ((PRE_TRIGGER - 12e-6) / velocity.step) as usize;
    let before = &velocity.values[..quiet];
    let mean = before.iter().sum::<f64>() / quiet as f64;
    let variance = before.iter().map(|v| (v - mean).powi(2)).sum::<f64>() / (quiet as f64 - 1.0);
    Recording { velocity: velocity.map(|v| v - mean), noise_rms: variance.sqrt(), bandwidth: None }
}
