//! The proof of the intervals of impact records: hits made with known modulus and loss, written as files, read and fitted as any.
//!
//! Truths run at a hundredth of the fit's tolerance and four times its sampling. Their sensor weighs its two contacts unequally, and a low-pass
//! follows it, which no run of the fit has; noise, gain and offset are a laboratory's.

use std::path::Path;

use rand::{Rng as _, SeedableRng as _};
use rand_chacha::ChaCha8Rng;
use rand_distr::{Distribution as _, StandardNormal};
use serde::{Deserialize, Serialize};

use granchain_calibration::fit::Verdict;
use granchain_model::scene::{self, DriveKind, Integrator, Scene};
use granchain_record::{ReadOptions, SensorRecord, read_sensor_bytes};
use granchain_signal::CausalShape;

use crate::{Experiment, Parameter, SET_UP, Unknown, force, high_passed, run::sampled};

/// Hits of one synthetic experiment.
pub const HITS: usize = 5;

/// Sampling rate of the records, Hz.
const RATE: f64 = 51_200.0;

/// Modulus, Pa, and time constant of the loss, s: uniform in the logarithm.
pub const TRUTHS: [(&str, [f64; 2]); 2] = [("support_modulus", [20e6, 500e6]), ("support_loss", [1e-5, 1e-4])];

/// Largest factor between the true modulus and the one that the scene of the fit states.
const MISTAKEN: f64 = 2.0;

/// Result of one synthetic experiment.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct ImpactSynthetic {
    /// Modulus and loss, SI.
    pub truth: [f64; 2],
    /// Ends of their intervals, SI.
    pub intervals: [[f64; 2]; 2],
    pub medians: [f64; 2],
    pub verdict: Verdict,
    pub p_value: f64,
}

/// Count over synthetic experiments.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct ImpactCount {
    pub count: usize,
    /// Intervals that hold the truth, whatever the verdict.
    pub held: [usize; 2],
    /// Median ln(high/low).
    pub widths: [f64; 2],
    /// Median |ln(median/truth)|.
    pub errors: [f64; 2],
    /// Right models called inconsistent.
    pub outside: usize,
    pub below_five_percent: usize,
}

impl ImpactCount {
    #[must_use]
    pub fn of(synthetics: &[ImpactSynthetic]) -> Self {
        let holds = |synthetic: &&ImpactSynthetic, d: usize| {
            (synthetic.intervals[d][0]..=synthetic.intervals[d][1]).contains(&synthetic.truth[d])
        };
        let median = |of: &dyn Fn(&ImpactSynthetic) -> f64| {
            let mut values: Vec<f64> = synthetics.iter().map(of).collect();
            values.sort_unstable_by(f64::total_cmp);
            values.get(values.len() / 2).copied().unwrap_or(f64::NAN)
        };
        Self {
            count: synthetics.len(),
            held: [0, 1].map(|d| synthetics.iter().filter(|synthetic| holds(synthetic, d)).count()),
            widths: [0, 1].map(|d| median(&|synthetic| (synthetic.intervals[d][1] / synthetic.intervals[d][0]).ln())),
            errors: [0, 1].map(|d| median(&|synthetic| (synthetic.medians[d] / synthetic.truth[d]).ln().abs())),
            outside: synthetics.iter().filter(|synthetic| synthetic.verdict == Verdict::OutsideScatter).count(),
            below_five_percent: synthetics.iter().filter(|synthetic| synthetic.p_value < 0.05).count(),
        }
    }
}

/// Makes and fits `count` synthetic experiments; the same of a seed for any number of threads.
///
/// # Errors
/// A record or fit that fails, in words: every one is expected to be fitted.
pub fn synthetics(count: u64, seed: u64) -> Result<Vec<ImpactSynthetic>, String> {
    (0..count).map(|number| synthetic(number, seed).map_err(|reason| format!("record {number}: {reason}"))).collect()
}

fn synthetic(number: u64, seed: u64) -> Result<ImpactSynthetic, String> {
    let mut random = ChaCha8Rng::seed_from_u64(seed);
    random.set_stream(number);
    let truth = TRUTHS.map(|(_, [low, high])| low * (high / low).powf(random.random::<f64>()));
    let records = records(truth, &mut random)?;
    let stated = truth[0] * MISTAKEN.powf(random.random_range(-1.0..1.0));
    let scene = column(&[format!("support.youngs_modulus={stated}")])?;
    let parameter = |(name, _): (&str, _)| Parameter::named(name, &scene).map(|mut named| named.remove(0));
    let parameters = TRUTHS.into_iter().map(parameter).collect::<Result<_, _>>().map_err(|error| error.to_string())?;
    let experiment = Experiment::of(records, scene, parameters);
    let fit = experiment.and_then(|experiment| experiment.fit()).map_err(|error| error.to_string())?;
    let of = |d: usize| &fit.estimates[d];
    Ok(ImpactSynthetic {
        truth,
        intervals: [0, 1].map(|d| [of(d).low, of(d).high]),
        medians: [0, 1].map(|d| of(d).median),
        verdict: fit.verdict,
        p_value: fit.p_value,
    })
}

fn column(set: &[String]) -> Result<Scene, String> {
    scene::load("impact", set).map_err(|error| error.to_string())
}

/// The hits of one column, as files that are read.
fn records(truth: [f64; 2], random: &mut ChaCha8Rng) -> Result<Vec<(SensorRecord, Option<String>)>, String> {
    let mut normal = |deviation: f64| -> f64 {
        let draw: f64 = StandardNormal.sample(random);
        deviation * draw
    };
    let unknown = Unknown::default();
    let (velocity, modulus) = (normal(unknown.velocity), normal(unknown.modulus));
    // What the set-up does to the return time: a clock of its own.
    let clock = normal(SET_UP[0]).exp();
    let set = [
        format!("support.youngs_modulus={}", truth[0]),
        format!("support.loss_time={}", truth[1]),
        "output_step=0.25us".into(),
    ];
    let mut scene = column(&set)?;
    scene.model.integrator = Integrator::DormandPrince853 { tolerance: 1e-12 };
    scene.chain.beads.iter_mut().for_each(|bead| bead.material.youngs_modulus *= modulus.exp());
    let corner = 250.0 * 10f64.powf(random.random::<f64>());
    let cutoff = 8e3 * 4f64.powf(random.random::<f64>());
    let share = random.random_range(-0.2..0.2);
    (0..HITS)
        .map(|hit| {
            let own: f64 = StandardNormal.sample(random);
            let DriveKind::Striker { velocity: speed, .. } = &mut scene.drive.kind else {
                return Err("the scene has no striker".into());
            };
            let usual = *speed;
            *speed *= (velocity + 0.03 * own).exp();
            let read = force(&scene, share).map_err(|error| error.to_string());
            if let DriveKind::Striker { velocity, .. } = &mut scene.drive.kind {
                *velocity = usual;
            }
            let read = read?;
            let seen = CausalShape::Butterworth(2).apply(&high_passed(&read, corner), cutoff, 0.5f64.sqrt());
            let seen = sampled(&seen, clock / RATE, random.random());
            let (gain, noise) = (1e-3, 0.005 * seen.peak());
            let rows = seen.values.iter().enumerate().map(|(index, force)| {
                let draw: f64 = StandardNormal.sample(random);
                format!("{:.9},{:.9e}\n", index as f64 / RATE, 2e-4 + gain * (force + noise * draw))
            });
            let text = "time_s,sensor_V\n".to_owned() + &rows.collect::<String>();
            let name = format!("hit{hit}.csv");
            let records = read_sensor_bytes(Path::new(&name), text.as_bytes(), &ReadOptions::default());
            Ok(records.map_err(|error| error.to_string())?.into_iter().map(|record| (record, None)).collect::<Vec<_>>())
        })
        .collect::<Result<Vec<_>, _>>()
        .map(|records| records.concat())
}
