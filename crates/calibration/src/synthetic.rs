//! Synthetic records with known parameters, to test the coverage of the stated intervals.
//!
//! Each record is simulated by the accurate integrator with drawn parameters and gaps. It passes through a drawn
//! instrument: sample rate, trigger offset, baseline, white noise. It is then fitted as any record.

use std::fmt::Write;

use rand::{Rng, SeedableRng};
use rand_chacha::ChaCha8Rng;
use rand_distr::{Distribution, StandardNormal};
use serde::{Deserialize, Serialize};
use thiserror::Error;

use super::{
    engine::trace,
    forward::Uncertainty,
    observation::Recording,
    parameter::{Parameter, Target},
};
use granchain_model::{
    ModelError,
    response::Response,
    scene::{DampingCoefficients, DampingKind, DampingTerm, FlatContact, Scene, Support},
};
use granchain_record::{MeasurementError, ReadOptions, RecordKind, read_record_bytes};
use granchain_signal::{Conditioning, Series, feature::Measurand};

/// True parameters and instrument of a synthetic record.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Truth {
    pub index: u64,
    /// `rigid`, `annulus` or the mount of a disc, such as `clamped`.
    pub support: String,
    pub damping_kind: String,
    /// Values of the parameters, SI.
    pub values: Vec<f64>,
    /// σ of the noise relative to the peak, 1.
    pub noise: f64,
    pub sample_rate_hz: f64,
    /// Delay of the record's time zero after the start of the drive, s.
    pub trigger_offset_s: f64,
    /// Offset of the record of a velocity, m/s.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub baseline_m_per_s: Option<f64>,
    /// Offset of the record of a pressure, Pa.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub baseline_pa: Option<f64>,
}

/// Why a synthetic record cannot be made.
#[derive(Debug, Error)]
#[non_exhaustive]
pub enum SyntheticError {
    #[error("the truth cannot be simulated")]
    Model(#[from] ModelError),
    #[error("the synthetic record cannot be read")]
    Record(#[from] MeasurementError),
}

/// A synthetic record with known truth, in the form of a laboratory file.
#[derive(Debug, Clone)]
pub struct Synthetic {
    /// Its true parameters and instrument.
    pub truth: Truth,
    /// The record as a CSV file.
    pub csv: Vec<u8>,
    /// The record as read back from that file.
    pub recording: Recording,
}

/// Range of drive levels of the truths.
const DRIVEN: (f64, f64) = (0.2, 2.0);

/// Inner part of the box, in each coordinate, from which truths are drawn: at the edge, intervals would be cut off.
const INNER: (f64, f64) = (0.12, 0.88);

/// Sample rates of the lab's vibrometer, Hz.
const SAMPLE_RATES: [f64; 5] = [1.25e6, 2.5e6, 4e6, 5e6, 10e6];

/// Sample rates of its hydrophone, Hz.
const HYDROPHONE_RATES: [f64; 5] = [2.5e6, 4e6, 5e6, 10e6, 20e6];

/// Sensitivity of the hydrophone, as stated in a header, and in V/Pa.
const HYDROPHONE: (&str, f64) = ("250 nV/Pa", 250e-9);

/// Largest noise relative to the peak.
const NOISE: f64 = 0.03;

/// Largest trigger offset, s.
const TRIGGER: f64 = 10e-6;

/// Largest offset relative to the peak.
const BASELINE: f64 = 0.05;

/// Recorded time before the drive starts, s.
const PRE_TRIGGER: f64 = 30e-6;

/// Difference between the true scene and the fitted model.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Flaw {
    None,
    /// The annulus is 30 % softer.
    SofterSupport,
    /// The other of the two damping laws, its coefficient `EQUIVALENT`.
    OtherLaw,
    MissingBead,
}

/// γ/c of two dampers of comparable loss: the paper's 3660 N·s·m^(-3/2) against 0.3 N·s/m.
const EQUIVALENT: f64 = 12_200.0;

/// The scene of synthetic record `index` (without its truth): the supports alternate, the laws alternate half as
/// often.
pub fn scene_of(base: &Scene, index: u64) -> Scene {
    let linear = (index / 2).is_multiple_of(2);
    let mut scene = with_law(base, if linear { DampingKind::Linear } else { DampingKind::KuwabaraKono });
    scene.support =
        if index.is_multiple_of(2) { Support::resin_annulus(1.0) } else { Support::Flat(FlatContact::Rigid) };
    scene
}

/// The same scene with the other of the two damping laws, no coefficient set.
pub fn with_other_law(scene: &Scene) -> Scene {
    let linear = scene.damping.kind == DampingKind::Linear;
    with_law(scene, if linear { DampingKind::KuwabaraKono } else { DampingKind::Linear })
}

/// The scene with a damping law, no coefficient set.
pub fn with_law(scene: &Scene, kind: DampingKind) -> Scene {
    let mut scene = scene.clone();
    scene.damping.kind = kind;
    scene.damping.coefficients = DampingCoefficients::default();
    scene
}

/// The scene with a flaw that the fitted model does not have.
fn flawed(scene: &Scene, flaw: Flaw) -> Scene {
    let mut flawed = scene.clone();
    match flaw {
        Flaw::None => {}
        Flaw::SofterSupport => flawed.support = Support::resin_annulus(0.7),
        Flaw::OtherLaw => {
            flawed = with_other_law(scene);
            let (own, other) = (&scene.damping.coefficients, &mut flawed.damping.coefficients);
            other[DampingTerm::Linear] = own[DampingTerm::KuwabaraKono] / EQUIVALENT;
            other[DampingTerm::KuwabaraKono] = own[DampingTerm::Linear] * EQUIVALENT;
        }
        Flaw::MissingBead => {
            flawed.chain.beads.pop();
            flawed.chain.gaps.pop();
        }
    }
    flawed
}

/// Draws truth and instrument of synthetic record `index`, simulates by `run`, writes the record and reads it back: a
/// hydrophone record at the first field point for a scene with water, otherwise a vibrometer record.
pub fn synthetic(
    scene: &Scene,
    parameters: &[Parameter],
    uncertainty: &Uncertainty,
    flaw: Flaw,
    index: u64,
    seed: u64,
    run: &dyn Fn(&Scene) -> Result<Response, ModelError>,
) -> Result<Synthetic, SyntheticError> {
    let values = drawn_truth(parameters, index, seed);
    made(scene, parameters, values, uncertainty, (index, seed), &|scene| run(&flawed(scene, flaw)))
}

/// The truth of synthetic record `index`: a point of the box's inner part.
fn drawn_truth(parameters: &[Parameter], index: u64, seed: u64) -> Vec<f64> {
    let value = |(d, parameter): (usize, &Parameter)| {
        let u = f64::from(sobol_burley::sample(index as u32, d as u32, seed as u32));
        let range = match parameter.target {
            // What a horn makes; far below it nothing moves but by the gaps.
            Target::Alpha if *parameter == Parameter::alpha() => parameter.clone().between(DRIVEN.0, DRIVEN.1),
            _ => parameter.clone(),
        };
        range.value(INNER.0 + (INNER.1 - INNER.0) * u)
    };
    parameters.iter().enumerate().map(value).collect()
}

/// Record `number` of synthetic set `index` at `level` times the scene's drive amplitude: the same truth in the whole
/// set, gaps and instrument of its own. Record 0 at level 1 is that of [`synthetic`].
pub fn synthetic_at_level(
    scene: &Scene,
    parameters: &[Parameter],
    uncertainty: &Uncertainty,
    level: f64,
    (index, number): (u64, u64),
    seed: u64,
    run: &dyn Fn(&Scene) -> Result<Response, ModelError>,
) -> Result<Synthetic, SyntheticError> {
    let (scene, values) = (at_level(scene, level), drawn_truth(parameters, index, seed));
    // Shots draw from streams of their own, as synthetic records do.
    let drawn_by = index + (number << 32);
    let mut made = made(&scene, parameters, values, uncertainty, (drawn_by, seed), run)?;
    made.truth.index = index;
    Ok(made)
}

/// The scene with `level` times its drive amplitude.
pub fn at_level(scene: &Scene, level: f64) -> Scene {
    let mut scene = scene.clone();
    scene.drive.amplitude *= level;
    scene
}

/// Synthetic record `index` of a seed with given truth, drawn gaps and a typical instrument: up to 3 % of noise, a common sample rate, a trigger within
/// 10 µs, an offset up to 5 %.
fn made(
    scene: &Scene,
    parameters: &[Parameter],
    values: Vec<f64>,
    uncertainty: &Uncertainty,
    (index, seed): (u64, u64),
    run: &dyn Fn(&Scene) -> Result<Response, ModelError>,
) -> Result<Synthetic, SyntheticError> {
    let mut random = ChaCha8Rng::seed_from_u64(seed);
    random.set_stream(index + 1);
    let mut truth_scene = scene.clone();
    parameters.iter().zip(&values).for_each(|(parameter, value)| parameter.set(&mut truth_scene, *value));
    draw_nuisances(&mut truth_scene, parameters, uncertainty, &mut random);
    let measurand = if scene.water.is_some() { Measurand::Pressure } else { Measurand::Velocity };
    let made = trace(run(&truth_scene)?, measurand)?;
    let peak = made.peak();
    let rates = if measurand == Measurand::Pressure { HYDROPHONE_RATES } else { SAMPLE_RATES };
    let noise = random.random_range(0.0..NOISE);
    let sample_rate = rates[random.random_range(0..rates.len())];
    let trigger_offset: f64 = random.random_range(-TRIGGER..TRIGGER);
    let baseline = peak * random.random_range(-BASELINE..BASELINE);
    let seen = parameters.iter().zip(&values).find(|(parameter, _)| parameter.target == Target::Bandwidth);
    let bandwidth = seen.map_or(f64::INFINITY, |(_, bandwidth)| *bandwidth);
    let span = PRE_TRIGGER + made.end() - trigger_offset.abs();
    let conditioning = Conditioning {
        bandwidth: Some(f64::min(bandwidth, 0.45 * sample_rate)),
        delay: trigger_offset,
        invert: false,
        start: -PRE_TRIGGER,
        step: 1.0 / sample_rate,
        count: (span * sample_rate) as usize,
    };
    let mut signal = conditioning.apply(&made);
    for value in &mut signal.values {
        let draw: f64 = StandardNormal.sample(&mut random);
        *value += baseline + noise * peak * draw;
    }
    let truth = Truth {
        index,
        support: match &scene.support {
            Support::Annulus { .. } => "annulus".into(),
            Support::Disc { shape, .. } => shape.rim.name().into(),
            _ => "rigid".into(),
        },
        damping_kind: scene.damping.kind.name().into(),
        values,
        noise,
        sample_rate_hz: sample_rate,
        trigger_offset_s: trigger_offset,
        baseline_m_per_s: (measurand == Measurand::Velocity).then_some(baseline),
        baseline_pa: (measurand == Measurand::Pressure).then_some(baseline),
    };
    let (csv, kind) = match measurand {
        Measurand::Velocity => (vibrometer_csv(&signal, &[]), RecordKind::Vibrometer),
        Measurand::Pressure => (hydrophone_csv(&signal, &[]), RecordKind::Hydrophone),
    };
    let name = std::path::PathBuf::from(format!("twin-{index}.csv"));
    let options = ReadOptions { drive_frequency: Some(scene.drive.frequency), ..ReadOptions::default() };
    let record = read_record_bytes(&name, &csv, Some(kind), &options)?;
    Ok(Synthetic { truth, csv, recording: Recording::of(&record, false) })
}

/// Applies one draw of the bench's uncertainty to a scene; fitted parameters are not drawn.
fn draw_nuisances(scene: &mut Scene, parameters: &[Parameter], uncertainty: &Uncertainty, random: &mut ChaCha8Rng) {
    let mut normal = || -> f64 { StandardNormal.sample(random) };
    let open = |target| parameters.iter().all(|parameter| parameter.target != target);
    let Uncertainty { gap: roughness, baseline, precompression, support_stiffness: sigma, .. } = *uncertainty;
    for gap in &mut scene.chain.gaps {
        // A bead cannot overlap its neighbour before anything moves.
        *gap += roughness * normal().abs();
    }
    if baseline > 0.0 && open(Target::Gap) {
        scene.chain.gaps[0] = (scene.chain.gaps[0] + baseline * normal()).max(0.0);
    }
    if precompression > 0.0 && open(Target::Precompression) {
        scene.chain.precompression = (scene.chain.precompression + precompression * normal()).abs();
    }
    if sigma > 0.0
        && open(Target::SupportStiffness)
        && let Some(own) = scene.support.stiffness_mut()
    {
        *own *= (sigma * normal()).exp();
    }
    if scene.chain.precompression > 0.0 {
        scene.chain.gaps.fill(0.0);
    }
}

/// A horn-tip file as a laboratory stores it: µs and nm, resolution 0.01 nm, after `comments`.
pub fn horn_tip_csv(displacement: &Series, comments: &[String]) -> Vec<u8> {
    file(displacement, comments, "time_us,displacement_nm", [1, 2], |value| value * 1e9)
}

/// A vibrometer file as a laboratory stores it: µs and mm/s, resolution 1 µm/s, after `comments`.
pub fn vibrometer_csv(velocity: &Series, comments: &[String]) -> Vec<u8> {
    file(velocity, comments, "time_us,velocity_mm_per_s", [4, 3], |value| value * 1e3)
}

/// A hydrophone file as a laboratory stores it: µs and mV of an instrument of 250 nV/Pa, resolution 0.1 µV (0.4 Pa),
/// after `comments`.
pub fn hydrophone_csv(pressure: &Series, comments: &[String]) -> Vec<u8> {
    let head = format!("# sensitivity: {}\ntime_us,hydrophone_mV", HYDROPHONE.0);
    file(pressure, comments, &head, [4, 4], |value| value * HYDROPHONE.1 * 1e3)
}

/// A file of instants (µs) and values with so many decimals each.
fn file(series: &Series, comments: &[String], head: &str, decimals: [usize; 2], shown: fn(f64) -> f64) -> Vec<u8> {
    let mut text: String = comments.iter().map(|comment| format!("# {comment}\n")).collect();
    let _ = writeln!(text, "{head}");
    for (index, value) in series.values.iter().enumerate() {
        let _ = writeln!(text, "{:.*},{:.*}", decimals[0], series.time(index) * 1e6, decimals[1], shown(*value));
    }
    text.into_bytes()
}
