//! The offset of a record: which samples are quiet, and the mean over the plateau of a burst.

use std::f64::consts::PI;

use realfft::num_complex::Complex;

use granchain_signal::{Series, mean_and_rms};

/// Fewest quiet samples whose mean is a baseline.
pub(super) const FEWEST_QUIET: usize = 8;
/// Fewest drive periods of a plateau.
pub(super) const FEWEST_PERIODS: usize = 4;

/// Largest rms of quiet samples, as a fraction of the record's peak.
const QUIET_RMS: f64 = 0.05;
/// Share of the variance of quiet samples that lines of the drive may explain. In 35 samples of white noise, 13
/// unknowns explain a third.
const MOVED_SHARE: f64 = 0.6;
/// Chance that a window of noise alone counts as motion.
const BY_CHANCE: f64 = 1e-3;
/// The same in standard deviations.
const SIGMAS: f64 = 3.1;
/// Samples of noise as correlated as behind a vibrometer's filter that count as one.
const CORRELATED: f64 = 4.0;
/// Windows after one that moves within which another must: of a subharmonic every third may.
const AGAIN: usize = 3;
/// Windows left out before the first that moves.
const MARGIN: f64 = 1.5;
/// Windows of a record whose drive frequency is unknown.
const WINDOWS: usize = 64;

/// Fewest samples that can be recognised as white noise.
const FEWEST_LOUD: usize = 64;
/// Least roughness of white noise; its expected value is 2.
const WHITE: f64 = 1.2;
/// Largest share of the variance that lines of the drive may explain in noise.
const LINELESS: f64 = 0.2;

/// Roughness below which samples are motion. Noise low-passed at a tenth of the sample rate has 0.13.
const SMOOTH: f64 = 0.1;

/// Median; the upper of the two middle values of an even number; 0 for no values.
pub(super) fn median(values: &[f64]) -> f64 {
    let mut values = values.to_vec();
    let middle = values.len() / 2;
    if values.is_empty() { 0.0 } else { *values.select_nth_unstable_by(middle, f64::total_cmp).1 }
}

/// Number of quiet samples at the start of a record: those before the trigger if motion begins there or somewhat later.
///
/// Samples are quiet until their scatter or their line of the drive grows ([`first_motion`]). Their rms about their mean
/// is below 5 % of the record's peak, or they are white noise. Without a trigger they must also be no motion from the
/// first sample on: no line of the drive explains them; if the drive's frequency is unknown, they cross their mean at
/// least four times or differ only by the resolution. The start of a finely sampled cycle does neither.
pub(super) fn quiet_lead(values: &[f64], before_trigger: usize, period: Option<f64>) -> usize {
    let median = median(values);
    let peak = values.iter().fold(0.0, |peak, x| f64::max(peak, (x - median).abs()));
    let smallest_step = values
        .windows(2)
        .map(|pair| (pair[1] - pair[0]).abs())
        .filter(|step| *step > 0.0)
        .fold(f64::INFINITY, f64::min)
        .min(peak);
    let (still, moving) = first_motion(values, period, smallest_step);
    let is_quiet = |count: usize| {
        let lead = &values[..count];
        let (mean, rms) = mean_and_rms(lead);
        if rms > QUIET_RMS * peak || count < FEWEST_QUIET {
            return count >= FEWEST_LOUD && is_loud_noise(lead, period);
        }
        // The first cycles of a slow envelope are small, and motion.
        count == before_trigger
            || period.map_or_else(
                || {
                    let crossings = lead.windows(2).filter(|pair| (pair[0] > mean) != (pair[1] > mean)).count();
                    rms <= smallest_step || crossings >= 4 && roughness(lead).is_some_and(|(rough, _)| rough > SMOOTH)
                },
                |period| {
                    count as f64 >= 0.5 * period
                        && line_share(lead, period) < MOVED_SHARE
                        && !stirs(lead, period, smallest_step)
                },
            )
    };
    let begins = (still / 3..=moving).contains(&before_trigger);
    let candidates = [if begins { before_trigger } else { still }, before_trigger.min(moving)];
    candidates.into_iter().find(|count| is_quiet(*count)).unwrap_or(0)
}

/// Number of samples clearly before the first motion, and to the end of the window in which it begins. Of each window of one drive period the scatter about a straight line and
/// the line of the drive are compared with those of the windows before it. Motion is where two of four windows exceed them
/// by more than noise does. Toggling between two steps of a converter is no motion. (0, all) if no window
/// exceeds those before it: what is steady from the first sample on may be motion.
fn first_motion(values: &[f64], period: Option<f64>, step: f64) -> (usize, usize) {
    let window = period.map_or(values.len() / WINDOWS, |period| period.round() as usize).max(FEWEST_QUIET);
    let samples = window as f64;
    let turn = 2.0 * PI / period.unwrap_or(samples);
    let (mut quiet, mut scatter, mut line, mut moved) = (0.0, 0.0, 0.0, None::<usize>);
    for (k, part) in values.chunks_exact(window).enumerate() {
        let variance = roughness(part).map_or(0.0, |(_, rms)| rms * rms);
        let mean = part.iter().sum::<f64>() / samples;
        let sum = |phase: f64| {
            let wave = |i: usize| libm::cos(turn * i as f64 + phase);
            part.iter().enumerate().map(|(i, x)| (x - mean) * wave(i)).sum::<f64>()
        };
        let squared = (4.0 / (samples * samples)) * (sum(0.0).powi(2) + sum(0.5 * PI).powi(2));
        let scattered = f64::max(scatter / quiet, 0.25 * step * step);
        let lined = f64::max(line / quiet, 4.0 / samples * f64::max(scatter / quiet, step * step / 12.0));
        let growth = (SIGMAS * (2.0 * CORRELATED / samples * (1.0 + 1.0 / quiet)).sqrt()).exp();
        let is_motion = variance > growth * scattered || squared > quiet * (BY_CHANCE.powf(-1.0 / quiet) - 1.0) * lined;
        if !is_motion || quiet == 0.0 {
            (quiet, scatter, line) = (quiet + 1.0, scatter + variance, line + squared);
        } else if let Some(first) = moved.filter(|first| k - first <= AGAIN) {
            let before = first as f64;
            return ((f64::max(before - MARGIN, 0.5 * before) * samples) as usize, (first + 1) * window);
        } else {
            moved = Some(k);
        }
    }
    (0, values.len())
}

/// Whether samples are white noise of any level: rough, without a line of the drive.
fn is_loud_noise(values: &[f64], period: Option<f64>) -> bool {
    let rough = roughness(values).is_some_and(|(rough, _)| rough > WHITE);
    rough && period.is_some_and(|period| line_share(values, period) < LINELESS)
}

/// Roughness, and rms about a straight line. Roughness is the mean square of the first differences over the variance
/// about that line: 2 for white noise, (2π f Δt)² for a finely sampled motion at frequency f. `None` for samples on a
/// line.
fn roughness(values: &[f64]) -> Option<(f64, f64)> {
    let n = values.len() as f64;
    let middle = 0.5 * (n - 1.0);
    let (mean, _) = mean_and_rms(values);
    let slope = values.iter().enumerate().map(|(i, x)| (i as f64 - middle) * (x - mean)).sum::<f64>() * 12.0
        / (n * (n * n - 1.0));
    let left =
        values.iter().enumerate().map(|(i, x)| (x - mean - slope * (i as f64 - middle)).powi(2)).sum::<f64>() / n;
    let differences = values.windows(2).map(|pair| (pair[1] - pair[0] - slope).powi(2)).sum::<f64>() / (n - 1.0);
    (left > 0.0).then(|| (differences / left, left.sqrt()))
}

/// Whether there is smooth motion under white noise, larger than `step`. The noise is estimated from third
/// differences, which are almost zero for motion. Motion is measured about a straight line in every three drive
/// periods, which excludes hum.
fn stirs(values: &[f64], period: f64, step: f64) -> bool {
    let window = usize::min((3.0 * period).round() as usize, values.len());
    if window < FEWEST_QUIET {
        return false;
    }
    let (mut windows, mut differences, mut left, mut white) = (0.0, 0.0, 0.0, 0.0);
    for part in values.chunks_exact(window) {
        let Some((rough, rms)) = roughness(part) else { continue };
        let third = part.windows(4).map(|x| (x[3] - 3.0 * (x[2] - x[1]) - x[0]).powi(2)).sum::<f64>();
        windows += 1.0;
        differences += rough * rms * rms;
        left += rms * rms;
        white += third / (20.0 * (window - 3) as f64);
    }
    let unsure = 2.0 * white * (2.0 / (windows * window as f64)).sqrt();
    let beyond = left - white;
    beyond > white && left > windows * step * step && differences - 2.0 * white < SMOOTH * beyond + unsure
}

/// Share of the variance of `values` about their mean that lines of `period` (samples) explain, mean and lines fitted together.
fn line_share(values: &[f64], period: f64) -> f64 {
    let (mean, rms) = mean_and_rms(values);
    let reach = values.len();
    let lines = super::continuation::Continuation::fit(|i| values[i] - mean, reach, 0.0, period);
    let rounding = 16.0 * f64::EPSILON * mean.abs();
    let Some(lines) = lines.filter(|_| rms > rounding) else { return 0.0 };
    let left = values.iter().enumerate().map(|(i, x)| (x - mean - lines.at(i as f64)).powi(2)).sum::<f64>();
    1.0 - left / (reach as f64 * rms * rms)
}

/// Hann-weighted mean of `series` over the largest whole number of drive periods in its plateau; if there are too few,
/// their number. The plateau is the longest run of periods whose swing (maximum − minimum) exceeds 0.8 of the largest.
/// Over m ≥ 2 whole periods the weights 1 − cos(2πt/(m T)) have no response at f0 and its harmonics, so the motion
/// does not affect the mean.
pub(super) fn plateau_mean(series: &Series, drive_frequency: f64) -> Result<(f64, usize), usize> {
    let period = 1.0 / drive_frequency;
    let periods = ((series.end() - series.start) / period).floor() as usize;
    let swing = |k: usize| {
        let from = (k as f64 * period / series.step).ceil() as usize;
        let past = ((((k + 1) as f64) * period / series.step).floor() as usize + 1).min(series.len());
        let (low, high) = series.values[from.min(past)..past]
            .iter()
            .fold((f64::INFINITY, f64::NEG_INFINITY), |(low, high), &x| (low.min(x), high.max(x)));
        if high >= low { high - low } else { 0.0 }
    };
    let swings: Vec<f64> = (0..periods).map(swing).collect();
    let level = 0.8 * swings.iter().copied().fold(0.0, f64::max);
    let (mut best, mut run) = ((0, 0), 0);
    for (k, &swing) in swings.iter().enumerate() {
        run = if swing > level { run + 1 } else { 0 };
        if run > best.1 {
            best = (k + 1 - run, run);
        }
    }
    let (first, count) = best;
    if count < FEWEST_PERIODS {
        return Err(count);
    }
    let (from, span) = (series.start + first as f64 * period, count as f64 * period);
    let (mut sum, mut weights) = (0.0, 0.0);
    for (i, value) in series.values.iter().enumerate() {
        let u = (series.time(i) - from) / span;
        if (0.0..=1.0).contains(&u) {
            let weight = 1.0 - libm::cos(2.0 * PI * u);
            sum += weight * value;
            weights += weight;
        }
    }
    Ok((sum / weights, count))
}

/// `series` without its slow drift, the running Hann-weighted mean over eight drive periods, which has no response at
/// f0 and its harmonics. Near the ends the series is continued by reflection through its end points. If the horn still
/// rings at the end of the record, the last four periods are uncertain by a tenth of that motion.
pub(super) fn without_drift(series: &Series, drive_frequency: f64) -> Series {
    let half = (4.0 / (drive_frequency * series.step)).round().max(1.0) as usize;
    let n = series.len();
    let half = half.min(n.saturating_sub(1));
    if half == 0 {
        return series.clone();
    }
    let span = 4.0 / (drive_frequency * series.step);
    let angle = PI / span;
    // 1 + cos(angle k) at k = −half … half.
    let total = (1..=half).fold(2.0, |sum, k| sum + 2.0 * (1.0 + libm::cos(angle * k as f64)));
    let x = &series.values;
    let at = |i: isize| -> f64 {
        let last = n as isize - 1;
        if i < 0 {
            2.0 * x[0] - x[i.unsigned_abs()]
        } else if i > last {
            2.0 * x[n - 1] - x[(2 * last - i) as usize]
        } else {
            x[i as usize]
        }
    };
    // Of the window around i: A = Σ x_j and Z = Σ x_j exp(i angle (j − i)), so Σ (1 + cos) x_j = A + Re Z. From one window to the next a
    // sample leaves, one enters and Z turns; every `half` windows both are summed again, so that rounding does not add up.
    let cis = |k: isize| Complex::<f64>::new(libm::cos(angle * k as f64), libm::sin(angle * k as f64));
    let reach = half as isize;
    let (edge, turn) = (cis(reach), cis(-1));
    let (mut sum, mut swing) = (0.0, Complex::<f64>::default());
    let values = (0..n as isize)
        .map(|i| {
            if i % reach == 0 {
                (sum, swing) = (i - reach..=i + reach)
                    .fold((0.0, Complex::default()), |(sum, swing), j| (sum + at(j), swing + cis(j - i) * at(j)));
            } else {
                let (leaving, entering) = (at(i - 1 - reach), at(i + reach));
                sum += entering - leaving;
                swing = (swing - edge.conj() * leaving) * turn + edge * entering;
            }
            x[i as usize] - (sum + swing.re) / total
        })
        .collect();
    Series::new(series.start, series.step, values)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn burst(offset: f64) -> Series {
        let (step, f0, tau) = (2e-7, 73e3, 100e-6);
        let values = (0..4000)
            .map(|i| {
                let t = f64::from(i) * step - 50e-6;
                let envelope = if t < 0.0 {
                    0.0
                } else if t < 548e-6 {
                    1.0 - (-t / tau).exp()
                } else {
                    (-(t - 548e-6) / tau).exp()
                };
                offset + 1e-6 * envelope * (2.0 * PI * f0 * t).sin()
            })
            .collect();
        Series::new(-50e-6, step, values)
    }

    #[test]
    fn plateau_mean_finds_an_offset_under_a_growing_burst() {
        let (mean, periods) = plateau_mean(&burst(3e-9), 73e3).unwrap();
        assert!(periods >= 20, "{periods}");
        // The sampled window and the growth of the burst leave less than 1e-4 of the amplitude.
        assert!((mean - 3e-9).abs() < 1e-10, "{mean:e}");
    }

    #[test]
    fn drift_goes_and_the_burst_stays() {
        let burst = burst(0.0);
        let mut drifting = burst.clone();
        for i in 0..drifting.len() {
            let t = drifting.time(i);
            drifting.values[i] += 2e-8 + 5e-5 * t + 0.08 * t * t;
        }
        let out = without_drift(&drifting, 73e3);
        // The last four periods, where the burst still rings, are left out.
        let pairs = out.values.iter().zip(&burst.values).take(4000 - 274);
        let worst = pairs.fold(0.0, |worst, (a, b)| f64::max(worst, (a - b).abs()));
        // Onset and end of the burst are no whole periods: a few 1e-3 of the amplitude remain there.
        assert!(worst < 8e-9, "{worst:e}");
    }

    #[test]
    fn the_running_mean_is_the_sum_over_every_window() {
        let x: Vec<f64> = (0..700).map(|i| (f64::from(i * i) * 0.37).sin() + 1e-3 * f64::from(i)).collect();
        let last = x.len() as isize - 1;
        let at = |i: isize| match i {
            i if i < 0 => 2.0 * x[0] - x[-i as usize],
            i if i > last => 2.0 * x[last as usize] - x[(2 * last - i) as usize],
            i => x[i as usize],
        };
        // Half windows of 1, 40 and 699 samples, the last the longest there is.
        for frequency in [4.0, 0.1, 4.0 / 699.2] {
            let out = without_drift(&Series::new(0.0, 1.0, x.clone()), frequency);
            let (span, half) = (4.0 / frequency, (4.0 / frequency).round() as isize);
            let weight = |k: isize| 1.0 + (PI * k as f64 / span).cos();
            let total: f64 = (-half..=half).map(weight).sum();
            for i in 0..=last {
                let mean = (-half..=half).map(|k| weight(k) * at(i + k)).sum::<f64>() / total;
                let error = (out.values[i as usize] - (at(i) - mean)).abs();
                assert!(error < 1e-13, "{frequency} {i}: {error:e}");
            }
        }
    }

    #[test]
    fn a_ring_up_is_not_quiet_and_a_pretrigger_is() {
        let values = burst(0.0).values;
        assert_eq!(quiet_lead(&values, 250, None), 250);
        // The trigger lies inside the burst, which begins at sample 250: the samples before that are quiet all the same.
        assert_eq!(quiet_lead(&values, 900, None), quiet_lead(&values, 0, None));
        let detected = quiet_lead(&values, 0, None);
        assert!((60..=300).contains(&detected), "{detected}");
        let tone: Vec<f64> = (0..1000).map(|i| (0.1 * f64::from(i)).sin()).collect();
        assert_eq!(quiet_lead(&tone, 0, None), 0);
        // A hum of a fifth of the peak before the trigger gives no baseline.
        let hum: Vec<f64> = (0..2000).map(|i| (0.3 * f64::from(i)).sin() * if i < 300 { 0.2 } else { 1.0 }).collect();
        assert_eq!(quiet_lead(&hum, 300, None), 0);
        let fine: Vec<f64> = (0..10_000).map(|i| (1e-3 * f64::from(i)).sin()).collect();
        assert_eq!(quiet_lead(&fine, 0, None), 0);
    }

    /// Approximately Gaussian: the sum of four uniform draws, of rms 1.
    fn noise(seed: &mut u64) -> f64 {
        let mut even = || {
            *seed = seed.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
            (*seed >> 11) as f64 / (1u64 << 53) as f64 - 0.5
        };
        (0..4).map(|_| even()).sum::<f64>() * 3f64.sqrt()
    }

    #[test]
    fn noise_of_a_tenth_of_the_peak_is_quiet_and_a_burst_as_loud_is_not() {
        let period = 1.0 / (73e3 * 2e-7);
        for seed in 0..20 {
            let mut random = seed;
            let loud: Vec<f64> = (0..4000)
                .map(|i| {
                    let tone = if i < 1000 { 0.0 } else { libm::sin(2.0 * PI * f64::from(i) / period) };
                    tone + 0.1 * noise(&mut random)
                })
                .collect();
            assert_eq!(quiet_lead(&loud, 1000, Some(period)), 1000, "{seed}");
            // Triggered a thousand samples into the burst.
            assert_eq!(quiet_lead(&loud[1000..], 1000, Some(period)), 0, "{seed}");
        }
    }

    /// Quiet samples of a burst that begins at sample 600, or as much later as noise hides it, in steps of a converter.
    #[test]
    fn quiet_samples_end_with_the_motion_wherever_time_begins() {
        let period = 1.0 / (73e3 * 2e-7);
        for (bits, rise) in [(8, 100.0), (8, 1500.0), (12, 100.0), (12, 1500.0)] {
            for seed in 0..20 {
                let mut random = seed;
                let step = 2.4 / f64::from(1 << bits);
                let values: Vec<f64> = (0..4000)
                    .map(|i| {
                        let since = f64::from(i - 600).max(0.0);
                        let motion = (1.0 - libm::exp(-since / rise)) * libm::sin(2.0 * PI * since / period);
                        ((motion + 0.003 * noise(&mut random)) / step).round() * step
                    })
                    .collect();
                let rms = |count: usize| mean_and_rms(&values[..count]).1;
                // With a trigger inside the quiet samples, at their end, and without one.
                for trigger in [0, 400, 600] {
                    let count = quiet_lead(&values, trigger, Some(period));
                    assert!((250..=700).contains(&count), "{bits} {rise} {seed} {trigger}: {count}");
                    let grown = rms(count) / rms(600).max(step / 12f64.sqrt());
                    assert!(grown < 1.25, "{bits} {rise} {seed} {trigger}: {count}, {grown}");
                }
            }
        }
    }

    #[test]
    fn what_swells_before_the_first_arrival_is_no_noise() {
        let mut random = 3;
        // 25 µs of noise of 1e-3, then a wave that grows with the square of time to its peak at 600 µs.
        let period = 1.0 / (73e3 * 2e-7);
        let values: Vec<f64> = (0..4000)
            .map(|i| {
                let grown = (f64::from(i - 125).max(0.0) / 3000.0).powi(2).min(1.0);
                grown * libm::sin(2.0 * PI * f64::from(i) / period) + 1e-3 * noise(&mut random)
            })
            .collect();
        let quiet = quiet_lead(&values, 0, Some(period));
        assert!(quiet >= 80, "{quiet}");
        let rms = mean_and_rms(&values[..quiet]).1;
        assert!((0.8e-3..1.2e-3).contains(&rms), "{quiet}: {rms:e}");
    }

    #[test]
    fn a_small_motion_under_noise_stirs_and_a_hum_or_a_vibrometer_filter_does_not() {
        let period = 1.0 / (73e3 * 2e-7);
        let samples = |seed: u64, made: &dyn Fn(f64) -> f64| -> Vec<f64> {
            let mut random = seed;
            (0..206).map(|i| made(f64::from(i)) + noise(&mut random)).collect()
        };
        let tone = |height: f64, periods: f64| move |i: f64| height * libm::sin(2.0 * PI * i / (periods * period));
        for seed in 0..50 {
            assert!(stirs(&samples(seed, &tone(4.0, 1.0)), period, 0.0), "{seed}");
            assert!(!stirs(&samples(seed, &|_| 0.0), period, 0.0), "{seed}");
            // A hundred times as slow as the drive; and a step of the converter that is greater than the motion.
            assert!(!stirs(&samples(seed, &tone(4.0, 100.0)), period, 0.0), "{seed}");
            assert!(!stirs(&samples(seed, &tone(4.0, 1.0)), period, 8.0), "{seed}");
            let loud = samples(seed, &|_| 0.0);
            let through = granchain_signal::LowPass::new(2e-7, loud.len(), 0.6e6).apply(&loud);
            assert!(!stirs(&through, period, 0.0), "{seed}");
        }
    }
}
