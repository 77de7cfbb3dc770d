//! Repetition of impulse trains and similarity of traces.

use granchain::{
    feature::{Window, repetition, similarity},
    signal::Series,
};
use rand::SeedableRng;
use rand_chacha::ChaCha8Rng;
use rand_distr::{Distribution, StandardNormal};

const F0: f64 = 73e3;
const PERIOD: f64 = 1.0 / F0;

/// Impulses 4 µs wide at the instants (in drive periods) with the heights, on a small hum at f0.
fn train(start: f64, step: f64, duration: f64, impulses: &[(f64, f64)]) -> Series {
    let value = |t: f64| {
        let hum = 0.02 * (std::f64::consts::TAU * F0 * t).sin();
        hum + impulses.iter().map(|(at, h)| h * (1.763 * (t - at * PERIOD) / 4e-6).cosh().powi(-2)).sum::<f64>()
    };
    Series::new(start, step, (0..(duration / step) as usize).map(|i| value(start + i as f64 * step)).collect())
}

/// One of a period-3 state's copies: 0.3, 0.08, 0.11 over and over, begun `copy` periods late.
fn period_three(copy: usize, start: f64, step: f64) -> Series {
    let heights = [0.3, 0.08, 0.11];
    let impulses: Vec<(f64, f64)> = (0..48).map(|k| (k as f64 + 0.4, heights[(k + copy) % 3])).collect();
    train(start, step, 48.0 * PERIOD - start, &impulses)
}

#[test]
fn a_train_of_period_three_repeats_every_three_periods() {
    for step in [1e-7, 1.0 / (40.0 * F0), 1.0 / (15.3 * F0)] {
        let impulses: Vec<(f64, f64)> = (0..12).map(|k| (3.0 * k as f64 + 1.4, 0.29)).collect();
        let record = train(0.0, step, 40.0 * PERIOD, &impulses);
        let found = repetition(&record, Window::whole(&record), F0, 0.29).unwrap().unwrap();
        assert_eq!(found.impulses, 12);
        // The centroid of a few samples above half height: a hundredth of an impulse's width.
        assert!((found.mean_interval_periods - 3.0).abs() < 2e-3, "{found:?}");
        assert!(found.irregularity < 5e-3, "{found:?}");
    }
}

#[test]
fn small_impulses_between_and_three_per_cent_of_noise_do_not_count() {
    let clean = period_three(0, 0.0, 1e-7);
    let mut random = ChaCha8Rng::seed_from_u64(8);
    let record = clean.map(|value| {
        let draw: f64 = StandardNormal.sample(&mut random);
        value + 0.009 * draw
    });
    let found = repetition(&record, Window::whole(&record), F0, 0.31).unwrap().unwrap();
    assert_eq!(found.impulses, 16);
    assert!((found.mean_interval_periods - 3.0).abs() < 5e-3, "{found:?}");
}

#[test]
fn alternating_intervals_are_irregular_and_one_impulse_is_no_train() {
    let impulses: Vec<(f64, f64)> =
        (0..10).map(|k| (3.0 * k as f64 + if k % 2 == 0 { 1.0 } else { 0.0 } + 1.0, 0.29)).collect();
    let record = train(0.0, 1e-7, 40.0 * PERIOD, &impulses);
    let found = repetition(&record, Window::whole(&record), F0, 0.29).unwrap().unwrap();
    // Intervals 2, 4, 2, 4 … 2: mean 26/9, deviation ±1.
    assert!((found.mean_interval_periods - 26.0 / 9.0).abs() < 2e-3, "{found:?}");
    assert!((found.irregularity - 0.344).abs() < 3e-3, "{found:?}");
    let single = train(0.0, 1e-7, 10.0 * PERIOD, &[(5.0, 0.29)]);
    assert_eq!(repetition(&single, Window::whole(&single), F0, 0.29).unwrap(), None);
}

#[test]
fn a_shifted_copy_sampled_elsewhere_is_similar_to_one() {
    let window = Window::new(5.0 * PERIOD, 42.0 * PERIOD);
    let reference = period_three(0, 0.0, 1e-7);
    for (start, step) in [(0.0, 1e-7), (-3.21e-6, 1e-7), (1.7e-6, 1.0 / 2.5e6)] {
        // Clock 2.345 µs late: the copy's values at t + 2.345 µs are the reference's at t.
        let late = 2.345e-6;
        let mut copy = period_three(0, start - late, step);
        copy.start += late;
        let found = similarity(&reference, &copy, window, F0).unwrap();
        assert!(found.correlation > 1.0 - 1e-6, "{found:?}");
        // The parabola through samples 0.1 µs apart.
        assert!((found.lag_s - late).abs() < 2e-9, "{found:?}");
        assert!(found.relative_rms_difference < 2e-3, "{found:?}");
        assert_eq!((found.shift_periods, found.state_period), (0, 1));
    }
}

#[test]
fn another_copy_of_a_period_three_state_is_found_by_its_shift() {
    let window = Window::new(5.0 * PERIOD, 42.0 * PERIOD);
    let reference = period_three(0, 0.0, 1e-7);
    for copy in [1, 2] {
        let found = similarity(&reference, &period_three(copy, 0.0, 1e-7), window, F0).unwrap();
        assert!(found.correlation > 1.0 - 1e-6, "{found:?}");
        assert!(found.unshifted_correlation < 0.8, "{found:?}");
        assert!(found.state_period <= 3 && found.shift_periods.rem_euclid(3) == 3 - copy as i32, "{found:?}");
    }
}

#[test]
fn similarity_ignores_scale_and_offset_and_turns_with_the_sign() {
    let window = Window::new(5.0 * PERIOD, 42.0 * PERIOD);
    let (reference, other) = (period_three(0, 0.0, 1e-7), train(0.0, 1e-7, 48.0 * PERIOD, &[(7.0, 0.3), (19.3, 0.2)]));
    let found = similarity(&reference, &other, window, F0).unwrap();
    let scaled = similarity(&reference.map(|v| 3.0 * v - 1.0), &other.map(|v| 0.1 * v + 2.0), window, F0).unwrap();
    // Rounding.
    assert!((found.correlation - scaled.correlation).abs() < 1e-9, "{found:?} {scaled:?}");
    assert!(found.correlation < 0.9);
    let same = similarity(&reference, &reference, window, F0).unwrap();
    // The ends of the window make the correlation's top a little lopsided: a fraction of a sample of 1e-7 s.
    assert!((same.correlation - 1.0).abs() < 1e-8 && same.lag_s.abs() < 1e-9, "{same:?}");
}

#[test]
fn the_rms_difference_of_a_known_change_is_that_change() {
    let window = Window::new(5.0 * PERIOD, 42.0 * PERIOD);
    let reference = period_three(0, 0.0, 1e-7);
    let mut random = ChaCha8Rng::seed_from_u64(1);
    let noisy = reference.map(|value| {
        let draw: f64 = StandardNormal.sample(&mut random);
        value + 0.01 * draw
    });
    let found = similarity(&reference, &noisy, window, F0).unwrap();
    // 5000 samples: the rms of the noise is known to 1 %.
    assert!((found.rms_difference / 0.01 - 1.0).abs() < 0.03, "{found:?}");
}

#[test]
fn traces_of_a_million_samples_are_compared_in_seconds() {
    let fine = |series: &Series| {
        let step = series.step / 150.0;
        let values = (0..series.len() * 150).map(|i| series.values[i / 150]).collect();
        Series::new(series.start, step, values)
    };
    let (reference, other) = (fine(&period_three(0, 0.0, 1e-7)), fine(&period_three(1, 0.0, 1e-7)));
    assert!(reference.len() > 900_000);
    let begin = std::time::Instant::now();
    let found = similarity(&reference, &other, Window::new(5.0 * PERIOD, 42.0 * PERIOD), F0).unwrap();
    let took = begin.elapsed().as_secs_f64();
    // The sum of each of 160,000 lags by itself would take minutes.
    assert!(took < 15.0, "{took} s");
    assert!(found.correlation > 1.0 - 1e-5 && found.shift_periods.rem_euclid(3) == 2, "{found:?}");
}
