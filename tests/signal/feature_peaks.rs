//! Peaks of noisy records: bias against the known signal, over noise, sample rates and kinds of pulse train.

use granchain::{
    feature::{PeakSettings, Window, peaks},
    signal::Series,
};
use rand::SeedableRng;
use rand_chacha::ChaCha8Rng;
use rand_distr::{Distribution, StandardNormal};

const F0: f64 = 73e3;
const PERIOD: f64 = 1.0 / F0;

/// A train of sech² impulses (the shape of a solitary wave's velocity, near enough) with known heights.
struct Train {
    heights: Vec<f64>,
    interval: f64,
    width: f64,
}

impl Train {
    fn value(&self, t: f64) -> f64 {
        let sech2 = |x: f64| x.cosh().powi(-2);
        let impulses = self.heights.iter().enumerate();
        impulses.map(|(k, h)| h * sech2(1.763 * (t - (k as f64 + 0.53) * self.interval) / self.width)).sum()
    }

    fn duration(&self) -> f64 {
        self.heights.len() as f64 * self.interval
    }

    fn peak(&self) -> f64 {
        let steps = (self.duration() / 1e-8) as usize;
        (0..steps).map(|i| self.value(i as f64 * 1e-8)).fold(f64::NEG_INFINITY, f64::max)
    }

    fn record(&self, rate: f64, phase: f64) -> Series {
        let start = -phase / rate;
        let count = ((self.duration() - start) * rate) as usize;
        Series::new(start, 1.0 / rate, (0..count).map(|i| self.value(start + i as f64 / rate)).collect())
    }
}

fn trains() -> Vec<(&'static str, Train)> {
    let mut random = ChaCha8Rng::seed_from_u64(5);
    let mut scattered = |spread: f64, count: usize| -> Vec<f64> {
        let draw = |random: &mut ChaCha8Rng| -> f64 { StandardNormal.sample(random) };
        (0..count).map(|_| 0.29 * (1.0 + spread * draw(&mut random))).collect()
    };
    vec![
        ("every period", Train { heights: vec![0.29; 40], interval: PERIOD, width: 4e-6 }),
        ("every third period", Train { heights: vec![0.29; 13], interval: 3.0 * PERIOD, width: 5e-6 }),
        ("chaotic, 20 %", Train { heights: scattered(0.2, 40), interval: PERIOD, width: 4e-6 }),
        ("chaotic, 4 %", Train { heights: scattered(0.04, 40), interval: PERIOD, width: 4e-6 }),
        ("one sharp", Train { heights: vec![0.0, 0.29, 0.0], interval: 2.0 * PERIOD, width: 2e-6 }),
    ]
}

fn noisy(record: &Series, rms: f64, random: &mut ChaCha8Rng) -> Series {
    record.map(|value| {
        let draw: f64 = StandardNormal.sample(random);
        value + rms * draw
    })
}

/// Mean and standard deviation of (found − true)/true, and the mean for the raw extreme.
fn bias(train: &Train, rate: f64, noise: f64, count: u64, down: bool) -> (f64, f64, f64) {
    let truth = train.peak();
    let sigma = noise * truth;
    let (mut sum, mut square, mut raw) = (0.0, 0.0, 0.0);
    for seed in 0..count {
        let mut random = ChaCha8Rng::seed_from_u64(seed);
        let record = train.record(rate, (seed as f64 * 0.618).fract());
        let record = noisy(&record, sigma, &mut random).map(|value| if down { -value } else { value });
        let settings = PeakSettings { noise_rms: sigma, noise_bandwidth: None };
        let found = peaks(&record, Window::whole(&record), &settings).unwrap();
        let (value, largest) =
            if down { (-found.negative, -found.raw_negative) } else { (found.positive, found.raw_positive) };
        let error = value / truth - 1.0;
        sum += error;
        square += error * error;
        raw += largest / truth - 1.0;
    }
    let n = count as f64;
    (sum / n, (square / n - (sum / n).powi(2)).max(0.0).sqrt(), raw / n)
}

#[test]
fn without_noise_the_peak_is_the_extreme_between_samples_to_1e_minus_4() {
    // 2 µs at half height holds 1e-5 of its spectrum beyond 0.42 × 2.92 MHz; the raw sample is off by up to 0.75 %.
    for (name, train) in trains() {
        for rate in [40.0 * F0, 5e6, 10e6] {
            for down in [false, true] {
                let truth = train.peak();
                for phase in [0.0, 0.21, 0.5, 0.83] {
                    let sign = if down { -1.0 } else { 1.0 };
                    let record = train.record(rate, phase).map(|value| sign * value);
                    let found = peaks(&record, Window::whole(&record), &PeakSettings::default()).unwrap();
                    let value = if down { -found.negative } else { found.positive };
                    assert!((value / truth - 1.0).abs() < 1e-4, "{name} {rate:e} {phase}: {value} {truth}");
                }
            }
        }
    }
}

#[test]
fn the_peak_of_a_sine_and_its_instant_are_met_at_four_samples_a_period() {
    let rate = 4.1 * F0;
    let phase = |t: f64| std::f64::consts::TAU * F0 * t;
    let tone = Series::new(0.0, 1.0 / rate, (0..400).map(|i| 0.29 * phase(f64::from(i) / rate).sin()).collect());
    let found = peaks(&tone, Window::new(20.0 * PERIOD, 60.0 * PERIOD), &PeakSettings::default()).unwrap();
    assert!((found.positive / 0.29 - 1.0).abs() < 1e-4, "{}", found.positive);
    assert!((found.negative / -0.29 - 1.0).abs() < 1e-4, "{}", found.negative);
    let periods = found.positive_time_s * F0 - 0.25;
    assert!((periods - periods.round()).abs() < 1e-3, "{periods}");
    assert!((20.0..=60.0).contains(&(found.negative_time_s * F0)));
}

#[test]
fn noise_up_to_three_per_cent_leaves_a_bias_below_one_per_cent() {
    // The mean of 60 records is known to sd/√60: 0.2 % at 3 % noise (0.4 % for the single impulse at 3 MHz), counted in.
    for (name, train) in trains().into_iter().filter(|(name, _)| *name != "chaotic, 4 %") {
        for rate in [1.5e6, 40.0 * F0, 10e6] {
            for noise in [0.003, 0.01, 0.02, 0.03] {
                for down in [false, true] {
                    let (mean, scatter, raw) = bias(&train, rate, noise, 60, down);
                    let allowed = 0.003 + 0.2 * noise + 2.0 * scatter / 60.0_f64.sqrt();
                    assert!(mean.abs() < allowed, "{name} {rate:e} {noise}: bias {mean:.4}, raw {raw:.4}");
                }
            }
        }
    }
}

#[test]
fn heights_scattered_like_the_noise_are_underestimated_by_two_per_cent_at_most() {
    // A spread of 4 % under 3 % noise: which of 40 impulses is truly the highest cannot be known.
    let (_, train) = trains().swap_remove(3);
    for rate in [1.5e6, 40.0 * F0, 10e6] {
        let (mean, ..) = bias(&train, rate, 0.03, 60, false);
        assert!((-0.025..0.01).contains(&mean), "{rate:e}: {mean}");
    }
}

#[test]
fn a_shallow_trough_keeps_five_per_cent_of_bias_where_the_raw_extreme_is_off_by_a_quarter() {
    // 3 % of the positive peak is 9 to 13 % of the troughs between the impulses.
    let noise = 0.0066;
    for (every, width) in [(1, 3e-6), (1, 5e-6), (3, 3e-6), (3, 5e-6)] {
        let train = Train { heights: vec![0.284; 40 / every], interval: every as f64 * PERIOD, width };
        let value = |t: f64| train.value(t) - 0.06 - 0.01 * (std::f64::consts::TAU * F0 * t).cos();
        let truth = (3000..51000).map(|i| -value(f64::from(i) * 1e-8)).fold(f64::NEG_INFINITY, f64::max);
        for rate in [1.5e6, 40.0 * F0, 10e6] {
            let clean =
                Series::new(0.0, 1.0 / rate, (0..(540e-6 * rate) as usize).map(|i| value(i as f64 / rate)).collect());
            let (mut mean, mut raw) = (0.0, 0.0);
            for seed in 0..60 {
                let record = noisy(&clean, noise, &mut ChaCha8Rng::seed_from_u64(seed));
                let settings = PeakSettings { noise_rms: noise, noise_bandwidth: None };
                let found = peaks(&record, Window::new(30e-6, 510e-6), &settings).unwrap();
                mean += (-found.negative / truth - 1.0) / 60.0;
                raw += (-found.raw_negative / truth - 1.0) / 60.0;
            }
            assert!(raw > 0.2, "the case is meant to be hard: {raw}");
            assert!(mean.abs() < 0.06, "{every} {width:e} {rate:e}: {mean}, raw {raw}");
        }
    }
}

#[test]
fn noise_limited_to_a_band_is_corrected_when_its_bandwidth_is_stated() {
    // White noise drawn at 2.5 MHz and interpolated to 10 MHz fills 0 … 1.25 MHz.
    let (_, train) = trains().swap_remove(1);
    let (truth, clean) = (train.peak(), train.record(10e6, 0.0));
    let noise = 0.03 * truth;
    let (mut stated, mut unstated, count) = (0.0, 0.0, 60);
    for seed in 0..count {
        let mut random = ChaCha8Rng::seed_from_u64(seed);
        let coarse: Vec<f64> = (0..clean.len() / 4 + 70).map(|_| StandardNormal.sample(&mut random)).collect();
        let fine = |i: usize| -> f64 {
            let position = 32.0 + 0.25 * i as f64;
            let nearest = position.round() as usize;
            let sinc =
                |x: f64| if x == 0.0 { 1.0 } else { (std::f64::consts::PI * x).sin() / (std::f64::consts::PI * x) };
            (nearest - 32..=nearest + 32).map(|j| coarse[j] * sinc(position - j as f64)).sum()
        };
        let values = clean.values.iter().enumerate().map(|(i, value)| value + noise * fine(i)).collect();
        let record = Series::new(clean.start, clean.step, values);
        let error = |noise_bandwidth: Option<f64>| {
            let settings = PeakSettings { noise_rms: noise, noise_bandwidth };
            peaks(&record, Window::whole(&record), &settings).unwrap().positive / truth - 1.0
        };
        stated += error(Some(1.25e6)) / count as f64;
        unstated += error(None) / count as f64;
    }
    // Scatter of one record 1.3 %, of the mean of 60 0.2 %.
    assert!(stated.abs() < 0.012, "{stated}");
    assert!(stated.abs() < unstated.abs(), "{stated} {unstated}");
}

#[test]
fn peaks_follow_sign_and_scale() {
    let (_, train) = trains().swap_remove(2);
    let record = noisy(&train.record(40.0 * F0, 0.3), 0.006, &mut ChaCha8Rng::seed_from_u64(1));
    let measure = |series: &Series, noise_rms: f64| {
        peaks(series, Window::whole(series), &PeakSettings { noise_rms, noise_bandwidth: None }).unwrap()
    };
    let reference = measure(&record, 0.006);
    let turned = measure(&record.map(|value| -2.0 * value), 0.012);
    assert!((turned.positive + 2.0 * reference.negative).abs() < 1e-12);
    assert!((turned.negative + 2.0 * reference.positive).abs() < 1e-12);
    assert_eq!(turned.positive_time_s, reference.negative_time_s);
}

#[test]
fn a_slow_record_of_half_a_million_samples_is_measured_in_bins() {
    // One smooth rise and fall over the whole record: its kernel would have 60,000 samples, and 3e10 products.
    let mut random = ChaCha8Rng::seed_from_u64(9);
    let (count, rms) = (500_000, 0.02);
    let clean = |i: usize| (std::f64::consts::PI * i as f64 / count as f64).sin() - 0.3;
    let record = Series::new(0.0, 1e-6, (0..count).map(clean).collect());
    let record = noisy(&record, rms, &mut random);
    let settings = PeakSettings { noise_rms: rms, noise_bandwidth: None };
    let found = peaks(&record, Window::whole(&record), &settings).unwrap();
    assert!((found.positive - 0.7).abs() < 2e-3, "{found:?}");
    assert!((found.positive_time_s - 0.25).abs() < 0.02, "{found:?}");
    assert!((found.negative + 0.3).abs() < 0.01, "{found:?}");
    assert!(found.raw_positive > 0.74, "{found:?}");
}
