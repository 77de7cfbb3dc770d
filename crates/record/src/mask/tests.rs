use rand::{Rng, SeedableRng};
use rand_chacha::ChaCha8Rng;
use rand_distr::{Distribution, StandardNormal};

use super::*;

const F0: f64 = 73e3;

/// A train of impulses of 1.2 µs that alternate in height, a tone under them, 1 % of noise, after 40 µs of rest.
fn train(sample_rate: f64, seed: u64) -> Series {
    let mut random = ChaCha8Rng::seed_from_u64(seed);
    let step = 1.0 / sample_rate;
    let value = |t: f64| {
        if t < 40e-6 {
            return 0.0;
        }
        let cycle = ((t - 40e-6) * F0).floor();
        let height = if (cycle as i64) % 2 == 0 { 1.0 } else { 0.6 };
        let distance = (t - 40e-6) - (cycle + 0.5) / F0;
        let grown = ((t - 40e-6) * F0 / 3.0).min(1.0);
        grown * (height * (-0.5 * (distance / 0.5e-6).powi(2)).exp() - 0.25 * (std::f64::consts::TAU * F0 * t).sin())
    };
    let values = (0..(700e-6 * sample_rate) as usize).map(|i| {
        let noise: f64 = StandardNormal.sample(&mut random);
        value(i as f64 * step) + 0.01 * noise
    });
    Series::new(0.0, step, values.collect())
}

#[test]
fn drop_outs_and_spikes_are_found_where_they_are_and_impulses_are_not_masked() {
    for (number, sample_rate) in [2.5e6, 5e6, 12.5e6, 25e6].into_iter().enumerate() {
        let clean = train(sample_rate, number as u64);
        assert_eq!(find(&clean, F0, false), [], "{sample_rate}");
        let mut random = ChaCha8Rng::seed_from_u64(100 + number as u64);
        let mut broken = clean.clone();
        let index = |t: f64| (t * sample_rate) as usize;
        // Lost on the flank of the tone, for 1.6 µs; spikes between the impulses.
        let lost = [150e-6, 260e-6, 391e-6].map(|t| index(t)..index(t + 1.6e-6));
        for samples in lost.clone() {
            broken.values[samples].fill(0.0);
        }
        let spikes = [201e-6, 330e-6, 500e-6].map(index);
        for spike in spikes {
            broken.values[spike] += if random.random() { 0.9 } else { -0.9 };
        }
        let found = find(&broken, F0, false);
        for samples in &lost {
            let jump =
                (clean.values[samples.start] - clean.values[samples.end]).abs().max(clean.values[samples.start].abs());
            let covered = found.iter().any(|(masked, _)| masked.start <= samples.start && masked.end >= samples.end);
            assert!(covered || jump < 0.15, "{sample_rate}: {samples:?} in {found:?}");
        }
        for spike in spikes {
            assert!(found.iter().any(|(masked, _)| masked.contains(&spike)), "{sample_rate}: {spike} in {found:?}");
        }
        // Nothing else, and little beside it but its edges.
        let masked: usize = found.iter().map(|(samples, _)| samples.len()).sum();
        let edges = 12 * usize::max(2, index(0.03 / F0) + 1);
        assert!(masked <= 3 * (index(2.4e-6) + 2) + 3 * (1 + index(0.4e-6)) + edges, "{sample_rate}: {found:?}");
    }
}

#[test]
fn a_spike_on_the_weak_beginning_of_a_motion_and_one_inside_a_drop_out_are_masked() {
    for (number, sample_rate) in [2.5e6, 5e6, 25e6].into_iter().enumerate() {
        let mut series = train(sample_rate, 20 + number as u64);
        let index = |t: f64| (t * sample_rate) as usize;
        // Motion that grows from nothing: 2 % of the peak for five periods before it.
        for i in index(41e-6 - 5.0 / F0)..index(41e-6) {
            series.values[i] += 0.02 * (std::f64::consts::TAU * F0 * i as f64 / sample_rate).sin();
        }
        let early = index(10e-6);
        series.values[early] -= 0.8;
        let lost = index(305.5e-6)..index(308.5e-6);
        series.values[lost.clone()].fill(0.004);
        let inside = index(307e-6);
        series.values[inside] = -1.2;
        let found = find(&series, F0, false);
        let masked = |i: usize| found.iter().any(|(samples, _)| samples.contains(&i));
        assert!(masked(early) && lost.clone().all(masked), "{sample_rate}: {early}, {lost:?} in {found:?}");
        assert!(found.iter().map(|(samples, _)| samples.len()).sum::<usize>() < 2 * lost.len() + 12, "{found:?}");
    }
}

/// A vibrometer output takes some samples to follow a loss of signal, and two losses leave a few good samples between
/// them that cannot carry a bridge.
#[test]
fn the_edges_of_a_drop_out_and_a_few_samples_between_two_are_masked_with_it() {
    for (number, sample_rate) in [2.5e6, 5e6, 12.5e6].into_iter().enumerate() {
        let mut series = train(sample_rate, 40 + number as u64);
        let index = |t: f64| (t * sample_rate) as usize;
        let lost = index(260e-6)..index(262e-6);
        for (from, to) in [(lost.start, lost.start - 1), (lost.end - 1, lost.end)] {
            series.values[to] = 0.5 * (series.values[from] + series.values[to]);
        }
        let second = lost.end + index(1.6e-6)..lost.end + index(3.4e-6);
        series.values[lost.clone()].fill(0.0);
        series.values[second.clone()].fill(0.0);
        let found = find(&series, F0, false);
        let all = lost.start - 1..second.end + 1;
        assert!(
            found.iter().any(|(masked, _)| masked.start <= all.start && masked.end >= all.end),
            "{sample_rate}: {all:?} in {found:?}"
        );
    }
}

/// Motion that rests and then rises as steeply as a collision lets it, a cusp where two slopes meet, and a drive that grows
/// from less than one step of the converter: all of it is motion, whatever the noise, the converter and the sample rate.
#[test]
fn nothing_is_masked_in_clean_records() {
    let mut wrong = Vec::new();
    for number in 0..48_u64 {
        let mut random = ChaCha8Rng::seed_from_u64(200 + number);
        let sample_rate = [2.5e6, 5e6, 10e6, 25e6][number as usize % 4];
        let noise = [0.0, 0.003, 0.01, 0.03][number as usize / 4 % 4];
        let bits = [8, 12, 16][number as usize / 16];
        // A free flight between two collisions in every second or third cycle, the next one late by chance.
        let mut knots = vec![(0.0, 0.0), (60e-6, 0.0)];
        let mut height = 0.02;
        while let Some(&(t, _)) = knots.last().filter(|(t, _)| *t < 600e-6) {
            height = f64::min(1.6 * height, 1.0);
            let rest = random.random_range(0.2..0.5) / F0;
            let (rise, fall) = (random.random_range(1.0e-6..2.2e-6), random.random_range(3e-6..8e-6));
            let top = height * random.random_range(0.3..1.0);
            knots.extend([
                (t + rest, -0.15 * height),
                (t + rest + rise, top),
                (t + rest + rise + fall, -0.15 * height),
            ]);
        }
        let value = |t: f64| {
            let at = knots.partition_point(|(knot, _)| *knot <= t).clamp(1, knots.len() - 1);
            let [(from, low), (to, high)] = [knots[at - 1], knots[at]];
            low + (high - low) * (t - from) / (to - from)
        };
        let step = 2.0 * 1.6 / f64::from(1u32 << bits);
        let values = (0..(650e-6 * sample_rate) as usize).map(|i| {
            let normal: f64 = StandardNormal.sample(&mut random);
            // The mean over half a microsecond: a vibrometer of 1 MHz.
            let seen =
                (0..20).map(|part| value(i as f64 / sample_rate + 0.025e-6 * f64::from(part))).sum::<f64>() / 20.0;
            ((seen + noise * normal) / step).round() * step
        });
        let series = Series::new(0.0, 1.0 / sample_rate, values.collect());
        let found = find(&series, F0, false);
        if !found.is_empty() {
            wrong.push(format!("{number}, {sample_rate} Hz, noise {noise}, {bits} bits: {found:?}"));
        }
    }
    assert!(wrong.is_empty(), "{} of 48: {wrong:#?}", wrong.len());
}

#[test]
fn what_a_trigger_leaves_at_rest_is_masked() {
    let mut series = train(10e6, 7);
    series.values[..4].fill(0.2);
    assert_eq!(find(&series, F0, false), [(0..4, MaskReason::TriggerSpike)]);
}

#[test]
fn a_mask_is_stated_in_stretches_of_the_file_s_axis() {
    let series = Series::new(-1e-6, 1e-6, vec![0.0; 10]);
    let Masking::Stretches(stretches) = "0.5us:2.5us, 7us:9us".parse().unwrap() else { panic!("stretches") };
    let found = stated(&series, &stretches);
    assert_eq!(found, [(2..4, MaskReason::Stated), (8..10, MaskReason::Stated)]);
    assert_eq!("none".parse(), Ok(Masking::None));
    for wrong in ["12us", "2us:1us", "1V:2V", ""] {
        assert!(wrong.parse::<Masking>().is_err(), "{wrong}");
    }
}
