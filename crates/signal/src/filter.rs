use std::{
    collections::BTreeMap,
    fmt,
    sync::{Arc, Mutex, PoisonError},
};

use realfft::{ComplexToReal, RealFftPlanner, RealToComplex};

use super::Series;
use super::kernel::{continued, half_length, windowed_sinc};

/// Full width of the transition band, as a fraction of the cutoff: from 0.85 to 1.15 of it.
const TRANSITION: f64 = 0.3;

/// A planned zero-phase low-pass for series of one step and length: a symmetric Kaiser-windowed sinc, applied by FFT.
///
/// - gain 1 within 1e-5 up to 0.85 of the cutoff, ½ at the cutoff, below 1e-5 from 1.15 of it; exactly 1 at zero frequency;
/// - no delay and no phase: the kernel is symmetric; it reaches 10.7 periods of the cutoff to either side, and is
///   shortened (wider transition) when the series itself is shorter than that;
/// - beyond its ends the series is continued by reflection through its end points, so that a straight line passes
///   unchanged and the first and the last sample of any series stay what they were;
/// - a cutoff at or above half the sample rate leaves the series as it is.
///
/// ```
/// # use granchain_signal::LowPass;
/// let low_pass = LowPass::new(1e-7, 8000, 1.25e6);
/// let line: Vec<f64> = (0..8000).map(f64::from).collect();
/// assert!((low_pass.apply(&line)[17] - 17.0).abs() < 1e-9);
/// ```
#[derive(Clone)]
pub struct LowPass {
    len: usize,
    plan: Option<Plan>,
}

#[derive(Clone)]
struct Plan {
    half: usize,
    gain: Vec<f64>,
    forward: Arc<dyn RealToComplex<f64>>,
    inverse: Arc<dyn ComplexToReal<f64>>,
}

/// Largest transform size whose plan is kept; with the limit on the number of sizes at most about 60 MB.
const LARGEST_KEPT: usize = 1 << 16;
const SIZES_KEPT: usize = 32;

type Kept<T> = Mutex<BTreeMap<usize, T>>;

/// Plan of one size, kept. Planning takes five times as long as applying a filter. Each has its own planner, so that it does not depend on plans made
/// before.
fn kept<T: Clone>(kept: &Kept<T>, size: usize, plan: impl FnOnce(&mut RealFftPlanner<f64>) -> T) -> T {
    let plan = || plan(&mut RealFftPlanner::new());
    if size > LARGEST_KEPT {
        return plan();
    }
    let mut kept = kept.lock().unwrap_or_else(PoisonError::into_inner);
    if kept.len() == SIZES_KEPT && !kept.contains_key(&size) {
        kept.clear();
    }
    kept.entry(size).or_insert_with(plan).clone()
}

/// Transform of so many samples.
pub fn forward_transform(size: usize) -> Arc<dyn RealToComplex<f64>> {
    static KEPT: Kept<Arc<dyn RealToComplex<f64>>> = Mutex::new(BTreeMap::new());
    kept(&KEPT, size, |planner| planner.plan_fft_forward(size))
}

/// Its inverse.
pub fn inverse_transform(size: usize) -> Arc<dyn ComplexToReal<f64>> {
    static KEPT: Kept<Arc<dyn ComplexToReal<f64>>> = Mutex::new(BTreeMap::new());
    kept(&KEPT, size, |planner| planner.plan_fft_inverse(size))
}

impl fmt::Debug for LowPass {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.debug_struct("LowPass").field("len", &self.len).field("half", &self.plan.as_ref().map(|p| p.half)).finish()
    }
}

impl LowPass {
    /// Plan for series of `len` samples every `step` seconds and a −6 dB point at `cutoff` (Hz, positive).
    pub fn new(step: f64, len: usize, cutoff: f64) -> Self {
        Self::falling(step, len, cutoff, 1.0)
    }

    /// A blend of `steepness` parts of [`LowPass::new`] and, for the rest, of the slow roll-off of a Bessel filter or an analogue vibrometer: gain
    /// exp(−ln 2 (f/cutoff)²), 0.84 at half the cutoff, ½ at the cutoff.
    pub fn falling(step: f64, len: usize, cutoff: f64, steepness: f64) -> Self {
        let longest = len.saturating_sub(1);
        let cycles = cutoff * step;
        // σ of the Gaussian kernel, samples: its transform exp(−2 (π σ f)²) is ½ at the cutoff.
        let sigma = (0.5 * std::f64::consts::LN_2).sqrt() / (std::f64::consts::PI * cycles);
        let steep = (steepness > 0.0 && cycles < 0.5).then(|| {
            let exact = half_length(TRANSITION * cycles).min(longest as f64);
            Kernel::new(exact, longest, |x| windowed_sinc(x, cycles, exact))
        });
        let slow = (steepness < 1.0 && sigma >= 0.2)
            .then(|| Kernel::new((6.0 * sigma).min(longest as f64), longest, |x| (-0.5 * (x / sigma).powi(2)).exp()));
        if len < 2 || steep.is_none() && slow.is_none() {
            return Self { len, plan: None };
        }
        let scaled = |kernel: Option<Kernel>, share: f64| {
            let Kernel { right, sum } = kernel.unwrap_or_else(|| Kernel { right: vec![1.0], sum: 1.0 });
            right.into_iter().map(move |weight| share * weight / sum)
        };
        match (steep, slow) {
            (Some(pure), _) if steepness >= 1.0 => Self::planned(len, &pure),
            (_, Some(pure)) if steepness <= 0.0 => Self::planned(len, &pure),
            (steep, slow) => {
                let mut right: Vec<f64> = scaled(steep, steepness).collect();
                let slow: Vec<f64> = scaled(slow, 1.0 - steepness).collect();
                right.resize(usize::max(right.len(), slow.len()), 0.0);
                right.iter_mut().zip(slow).for_each(|(weight, slow)| *weight += slow);
                Self::planned(len, &Kernel { right, sum: 1.0 })
            }
        }
    }

    /// Gain of that slow roll-off at a frequency, Hz.
    pub fn gaussian_gain(frequency: f64, cutoff: f64) -> f64 {
        (-std::f64::consts::LN_2 * (frequency / cutoff).powi(2)).exp()
    }

    fn planned(len: usize, Kernel { right, sum }: &Kernel) -> Self {
        let half = right.len() - 1;
        let size = fast_size(len + 2 * half);
        let mut kernel = vec![0.0; size];
        for (i, &weight) in right.iter().enumerate() {
            kernel[i] = weight;
            kernel[(size - i) % size] = weight;
        }
        let (forward, inverse) = (forward_transform(size), inverse_transform(size));
        let mut spectrum = forward.make_output_vec();
        transform(forward.as_ref(), &mut kernel, &mut spectrum);
        let scale = 1.0 / (sum * size as f64);
        // Symmetric kernel: the spectrum is real.
        let gain = spectrum.iter().map(|bin| bin.re * scale).collect();
        Self { len, plan: Some(Plan { half, gain, forward, inverse }) }
    }

    /// The filtered samples.
    ///
    /// # Panics
    /// If `values` has another length than planned.
    pub fn apply(&self, values: &[f64]) -> Vec<f64> {
        assert_eq!(values.len(), self.len, "LowPass planned for another length");
        let Some(Plan { half, gain, forward, inverse }) = &self.plan else { return values.to_vec() };
        let (half, len) = (*half, values.len());
        let mut work = forward.make_input_vec();
        for i in 0..half {
            work[i] = continued(values, i as isize - half as isize);
            work[half + len + i] = continued(values, (len + i) as isize);
        }
        work[half..half + len].copy_from_slice(values);
        let mut spectrum = forward.make_output_vec();
        transform(forward.as_ref(), &mut work, &mut spectrum);
        for (bin, gain) in spectrum.iter_mut().zip(gain) {
            *bin *= gain;
        }
        // A real series has real first and last bins; rounding must not make the inverse refuse them.
        if let Some(bin) = spectrum.first_mut() {
            bin.im = 0.0;
        }
        if let Some(bin) = spectrum.last_mut() {
            bin.im = 0.0;
        }
        let outcome = inverse.process(&mut spectrum, &mut work);
        debug_assert!(outcome.is_ok(), "sizes come from the plan");
        work.copy_within(half..half + len, 0);
        work.truncate(len);
        work
    }
}

struct Kernel {
    /// Weight at the centre and those to its right.
    right: Vec<f64>,
    sum: f64,
}

impl Kernel {
    /// A kernel that needs `exact` samples on either side, where the series has `longest`.
    fn new(exact: f64, longest: usize, at: impl Fn(f64) -> f64) -> Self {
        let half = (exact.ceil() as usize).min(longest);
        let right: Vec<f64> = (0..=half).map(|i| at(i as f64)).collect();
        let sum =
            right.iter().enumerate().fold(0.0, |sum, (i, weight)| sum + if i == 0 { *weight } else { 2.0 * weight });
        Self { right, sum }
    }
}

fn transform(plan: &dyn RealToComplex<f64>, input: &mut [f64], output: &mut [realfft::num_complex::Complex<f64>]) {
    let outcome = plan.process(input, output);
    debug_assert!(outcome.is_ok(), "sizes come from the plan");
}

/// The smallest even 2ᵃ3ᵇ5ᶜ that is at least `least`.
fn fast_size(least: usize) -> usize {
    let is_fast = |mut n: usize| {
        for factor in [2, 3, 5] {
            while n.is_multiple_of(factor) {
                n /= factor;
            }
        }
        n == 1
    };
    (least.div_ceil(2)..).find(|&n| is_fast(n)).map_or(2 * least, |n| 2 * n)
}

/// `series` with content above `cutoff` (Hz) removed, zero phase; [`LowPass`] states gain, transition and edge
/// handling.
pub fn low_pass(series: &Series, cutoff: f64) -> Series {
    let filter = LowPass::new(series.step, series.len(), cutoff);
    Series::new(series.start, series.step, filter.apply(&series.values))
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::f64::consts::PI;

    const STEP: f64 = 1e-7;

    fn tone(frequency: f64, phase: f64) -> Series {
        Series::new(0.0, STEP, (0..8000).map(|i| (2.0 * PI * frequency * STEP * i as f64 + phase).sin()).collect())
    }

    /// Largest difference away from the ends, where continuation has no effect.
    fn inner_difference(a: &Series, b: &Series) -> f64 {
        a.values.iter().zip(&b.values).skip(200).take(7600).fold(0.0, |worst, (a, b)| f64::max(worst, (a - b).abs()))
    }

    #[test]
    fn a_gaussian_falls_as_it_says_and_delays_nothing() {
        let (step, cutoff) = (1e-7, 0.8e6);
        let filter = LowPass::falling(step, 4000, cutoff, 0.0);
        for frequency in [0.1e6, 0.4e6, 0.8e6, 1.2e6] {
            let tone: Vec<f64> =
                (0..4000).map(|i| libm::sin(std::f64::consts::TAU * frequency * step * f64::from(i))).collect();
            let gain = (-std::f64::consts::LN_2 * (frequency / cutoff).powi(2)).exp();
            let seen = filter.apply(&tone);
            for i in 1000..3000 {
                assert!((seen[i] - gain * tone[i]).abs() < 1e-6, "{frequency}: {} {}", seen[i], gain * tone[i]);
            }
        }
    }

    #[test]
    fn between_steep_and_gaussian_it_is_the_mixture_of_both() {
        let series = tone(0.9e6, 0.4);
        let pass = |steepness| LowPass::falling(STEP, 8000, 1.25e6, steepness).apply(&series.values);
        let (slow, mixed, steep) = (pass(0.0), pass(0.3), pass(1.0));
        assert_eq!(steep, low_pass(&series, 1.25e6).values);
        for i in 0..8000 {
            assert!((mixed[i] - (0.3 * steep[i] + 0.7 * slow[i])).abs() < 1e-13, "{i}");
        }
        // A cutoff beyond half the sample rate: all of the steep part passes.
        let wide = |steepness| LowPass::falling(STEP, 8000, 6e6, steepness).apply(&series.values)[4000];
        assert!((wide(0.5) - 0.5 * (series.values[4000] + wide(0.0))).abs() < 1e-13);
    }

    #[test]
    fn of_two_tones_the_low_one_stays_and_the_high_one_goes() {
        let (low, high) = (tone(1.05e6, 0.3), tone(1.45e6, 1.1));
        let both = Series::new(0.0, STEP, low.values.iter().zip(&high.values).map(|(a, b)| a + b).collect());
        // 0.84 and 1.16 of the cutoff: ripple and leakage by design 1e-5 each.
        let error = inner_difference(&low_pass(&both, 1.25e6), &low);
        assert!(error < 2e-5, "{error:e}");
    }

    #[test]
    fn the_cutoff_tone_is_halved_without_delay() {
        let tone = tone(1.25e6, 0.7);
        let error = inner_difference(&low_pass(&tone, 1.25e6), &tone.map(|x| 0.5 * x));
        // The window is symmetric about the cutoff but for the mirror lobe at negative frequencies, 1e-5.
        assert!(error < 2e-5, "{error:e}");
    }

    #[test]
    fn an_impulse_comes_out_symmetric() {
        let mut values = vec![0.0; 1001];
        values[500] = 1.0;
        let out = low_pass(&Series::new(0.0, STEP, values), 1e6).values;
        for i in 0..500 {
            assert!((out[500 - i] - out[500 + i]).abs() < 1e-15);
        }
        assert!((out.iter().sum::<f64>() - 1.0).abs() < 1e-12);
    }

    #[test]
    fn a_straight_line_passes_unchanged_up_to_its_ends() {
        let line = Series::new(0.0, STEP, (0..900).map(|i| 2.0 - 0.01 * f64::from(i)).collect());
        let out = low_pass(&line, 3e5);
        for (a, b) in line.values.iter().zip(&out.values) {
            assert!((a - b).abs() < 1e-12);
        }
    }

    #[test]
    fn short_series_and_high_cutoffs_are_no_trouble() {
        for len in 0..5 {
            let series = Series::new(0.0, STEP, vec![1.0; len]);
            for cutoff in [1e3, 1e6, 5e6, 9e9] {
                let out = low_pass(&series, cutoff);
                assert_eq!(out.len(), len);
                assert!(out.values.iter().all(|x| (x - 1.0).abs() < 1e-12));
            }
        }
    }
}
