//! The classifier of regimes on signals whose regime is known.

use granchain::{
    feature::{FeatureError, Window},
    signal::Series,
    study::steady::{BROADBAND, Regime, SteadyMotion},
};
use rand::SeedableRng;
use rand_chacha::ChaCha8Rng;
use rand_distr::{Distribution, StandardNormal};

const F0: f64 = 73e3;

/// 110 drive periods of `value` at a time in drive periods, sampled at 137.3 samples a period; what is found in the last 100 of them.
fn found(value: impl FnMut(f64) -> f64) -> SteadyMotion {
    let count = (110.0 * 137.3) as usize;
    let series = Series::new(0.0, 1.0 / (137.3 * F0), (0..count).map(|i| i as f64 / 137.3).map(value).collect());
    SteadyMotion::of(&series, Window::new(9.5 / F0, 1.0), F0).unwrap()
}

fn tone(t: f64, ratio: f64) -> f64 {
    (std::f64::consts::TAU * ratio * t + ratio).sin()
}

#[test]
fn a_subharmonic_is_the_period_of_its_denominator() {
    assert_eq!(found(|t| tone(t, 1.0) + 0.4 * tone(t, 2.0) + 0.2 * tone(t, 7.0)).regime, Regime::Period(1));
    for (over, under) in [(1, 2), (1, 3), (2, 3), (1, 4), (3, 5), (5, 7), (1, 12), (5, 12)] {
        let ratio = f64::from(over) / f64::from(under);
        let motion = found(|t| tone(t, 1.0) + 0.3 * tone(t, 2.0) + 0.5 * tone(t, ratio));
        assert_eq!(motion.regime, Regime::Period(under), "{over}/{under}");
        assert!(motion.broadband_share < 0.1 * BROADBAND, "{over}/{under}: {}", motion.broadband_share);
    }
    // Two of them repeat together.
    assert_eq!(found(|t| tone(t, 1.0) + 0.2 * tone(t, 0.5) + 0.2 * tone(t, 1.0 / 3.0)).regime, Regime::Period(6));
    assert_eq!(found(|t| tone(t, 1.0) + 0.02 * tone(t, 0.5)).regime, Regime::Period(1));
}

#[test]
fn incommensurate_lines_are_quasi_periodic() {
    let golden = 0.5 * (5_f64.sqrt() - 1.0);
    for ratio in [golden, 0.41, 1.0 / std::f64::consts::PI, 1.732] {
        let motion = found(|t| tone(t, 1.0) * (1.0 + 0.3 * tone(t, ratio)) + 0.2 * tone(t, 2.0 * ratio).powi(3));
        assert_eq!(motion.regime, Regime::QuasiPeriodic, "{ratio}: {}", motion.broadband_share);
    }
}

#[test]
fn noise_is_broadband_by_its_power() {
    let mut random = ChaCha8Rng::seed_from_u64(5);
    let mut noise = || -> f64 { StandardNormal.sample(&mut random) };
    // Its power stays where 137.3 samples a period are read at 40.
    let motion = found(|t| tone(t, 1.0) + 0.17 * noise());
    assert_eq!(motion.regime, Regime::Chaotic);
    let expected = 0.03 / (0.5 + 0.03);
    assert!((0.5..1.5).contains(&(motion.broadband_share / expected)), "{}", motion.broadband_share);
}

/// Pulses whose heights follow the logistic map, at the parameters of its known regimes.
#[test]
fn pulses_of_the_logistic_map_have_its_periods() {
    for (r, expected) in [
        (2.8, Regime::Period(1)),
        (3.2, Regime::Period(2)),
        (3.5, Regime::Period(4)),
        (3.83, Regime::Period(3)),
        (3.7, Regime::Chaotic),
        (3.99, Regime::Chaotic),
    ] {
        let mut heights = vec![0.3];
        (0..2000).for_each(|k| heights.push(r * heights[k] * (1.0 - heights[k])));
        let motion = found(|t| heights[1800 + t as usize] * (std::f64::consts::PI * t.fract()).sin().powi(4));
        assert_eq!(motion.regime, expected, "{r}: {}", motion.broadband_share);
    }
}

#[test]
fn what_is_too_short_or_still_has_no_regime() {
    let series = |count: usize, size: f64| {
        Series::new(0.0, 1e-7, (0..count).map(|i| size * tone(1e-7 * F0 * i as f64, 1.0)).collect())
    };
    let of = |series: &Series| SteadyMotion::of(series, Window::whole(series), F0);
    assert!(matches!(of(&series(5_000, 1.0)), Err(FeatureError::TooFewSamples { needed: 6_576, found: 5_000 })));
    assert!(matches!(of(&series(20_000, 0.0)), Err(FeatureError::Constant { .. })));
    assert!(of(&series(20_000, 1.0)).is_ok());
}
