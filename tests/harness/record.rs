//! Records of a known truth, as a vibrometer stores them.

use granchain::{
    calibration::{forward::Uncertainty, parameter::Parameter, synthetic::vibrometer_csv},
    model,
    scene::Scene,
    signal::Conditioning,
};
use rand::{Rng, SeedableRng};
use rand_chacha::ChaCha8Rng;
use rand_distr::{Distribution, StandardNormal};

/// Inner part of the box, in each coordinate, from which truths are drawn: at the edge, intervals would be cut off.
const INNER: (f64, f64) = (0.12, 0.88);

/// Range of drive levels of the truths: far below it nothing moves but by the gaps.
const DRIVEN: (f64, f64) = (0.2, 2.0);

const SAMPLE_RATES: [f64; 5] = [1.25e6, 2.5e6, 4e6, 5e6, 10e6];

/// Recorded time before the drive starts, s.
const PRE_TRIGGER: f64 = 30e-6;

/// File number `index` of a scene, and the drawn values of its parameters: gaps are drawn, and up to 3 % of noise, a sample rate, a trigger within 10 µs
/// and an offset up to 5 % of the peak.
pub fn record(scene: &Scene, parameters: &[Parameter], index: u64, seed: u64) -> Result<(Vec<u8>, Vec<f64>), String> {
    let value = |(d, parameter): (usize, &Parameter)| {
        let u = f64::from(sobol_burley::sample(index as u32, d as u32, seed as u32));
        let alpha = *parameter == Parameter::alpha();
        let range = if alpha { parameter.clone().between(DRIVEN.0, DRIVEN.1) } else { parameter.clone() };
        range.value(INNER.0 + (INNER.1 - INNER.0) * u)
    };
    let values: Vec<f64> = parameters.iter().enumerate().map(value).collect();
    let mut random = ChaCha8Rng::seed_from_u64(seed);
    random.set_stream(index + 1);
    let mut truth = scene.clone();
    parameters.iter().zip(&values).for_each(|(parameter, value)| parameter.set(&mut truth, *value));
    for gap in &mut truth.chain.gaps {
        let normal: f64 = StandardNormal.sample(&mut random);
        *gap += Uncertainty::default().gap * normal.abs();
    }
    let response = model::run(&truth, &mut |_| true).map_err(|error| error.to_string())?;
    let made = response.observed_velocity();
    let peak = made.peak();
    let noise = random.random_range(0.0..0.03);
    let rate = SAMPLE_RATES[random.random_range(0..SAMPLE_RATES.len())];
    let delay: f64 = random.random_range(-10e-6..10e-6);
    let offset = peak * random.random_range(-0.05..0.05);
    let conditioning = Conditioning {
        bandwidth: Some(0.45 * rate),
        delay,
        invert: false,
        start: -PRE_TRIGGER,
        step: 1.0 / rate,
        count: ((PRE_TRIGGER + made.end() - delay.abs()) * rate) as usize,
    };
    let mut signal = conditioning.apply(made);
    for value in &mut signal.values {
        let normal: f64 = StandardNormal.sample(&mut random);
        *value += offset + noise * peak * normal;
    }
    Ok((vibrometer_csv(&signal, &[]), values))
}
