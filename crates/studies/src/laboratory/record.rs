//! From a truth to two files: the bench is simulated under its analytic drive, and what it does passes through the laboratory.
//!
//! ```text
//! bench ─ decoder ─ AC coupling ─ anti-alias filter ─ samples at the channel's clock ─ gain, offset, hum, drift, noise ─ clipping ─ bits ─ file
//! ```

use std::fmt::Write;

use rand_chacha::ChaCha8Rng;
use rand_distr::{Distribution, StandardNormal};
use serde::{Deserialize, Serialize};

use super::condition::{Laboratory, Setting};
use granchain_model::{
    ModelError,
    response::Response,
    scene::{ModelKind, Scene},
};
use granchain_signal::{
    LowPass, Series,
    spline::{Ends, Spline},
};

/// Samples a drive period of the truth: a whole number, so that periods are compared sample by sample.
const FINE: usize = 256;

/// Simulated beyond both ends of a record, s: room for filters and triggers.
const MARGIN: f64 = 30e-6;

/// Periods of the drive over which a motion is asked for its own period.
const LATE: usize = 12;

/// What may differ between one period and the next, relative to its rms: the burst still grows by a few per cent.
const ALIKE: f64 = 0.15;

/// Cutoff of an oscilloscope's anti-alias filter over the sample rate.
const ANTI_ALIAS: f64 = 0.45;

/// How a truth moves once the drive has been on for a while.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Regime {
    /// Every period of the drive is as the one before.
    Period1,
    /// Every second.
    Period2,
    /// Every third.
    Period3,
    /// None of these: longer periods, and chaos.
    Chaotic,
}

impl Regime {
    /// In words.
    #[must_use]
    pub fn name(self) -> &'static str {
        match self {
            Self::Period1 => "period 1",
            Self::Period2 => "period 2",
            Self::Period3 => "period 3",
            Self::Chaotic => "chaotic or longer",
        }
    }

    /// Of a motion with [`FINE`] samples a period, by the last [`LATE`] periods up to sample `end`: the least of 1, 2 and 3 periods after which
    /// it is what it was, rms of the difference at most [`ALIKE`] of its own.
    ///
    /// It says what the late motion is, not what a feature could see of it: noise-free, and a transient that decays slowly counts as chaotic.
    fn of(motion: &[f64], end: usize) -> Self {
        let end = end.min(motion.len());
        let late = &motion[end.saturating_sub(LATE * FINE)..end];
        let rms = |values: &mut dyn Iterator<Item = f64>| {
            let (mut sum, mut count) = (0.0, 0_u32);
            for value in values {
                (sum, count) = (sum + value * value, count + 1);
            }
            (sum / f64::from(count.max(1))).sqrt()
        };
        let own = rms(&mut late.iter().copied());
        let returns = |periods: usize| {
            let later = late.iter().skip(periods * FINE);
            rms(&mut later.zip(late).map(|(later, before)| later - before)) <= ALIKE * own
        };
        let regimes = [(1, Self::Period1), (2, Self::Period2), (3, Self::Period3)];
        regimes.into_iter().find(|(periods, _)| returns(*periods)).map_or(Self::Chaotic, |(_, regime)| regime)
    }
}

/// Two files as a laboratory stores them.
#[derive(Debug, Clone, PartialEq)]
pub struct Files {
    /// `horn_tip.csv`.
    pub horn: Vec<u8>,
    /// `vib.csv`.
    pub vibrometer: Vec<u8>,
    /// How the truth moves.
    pub regime: Regime,
}

/// The truth as it is simulated: with its own gaps and duration, on a body above the chain by half the output step.
#[must_use]
pub fn truth_scene(mut scene: Scene, setting: &Setting) -> Scene {
    scene.chain.gaps.clone_from(&setting.gaps);
    scene.output_step = 1.0 / (scene.drive.frequency * FINE as f64);
    scene.duration = (setting.laboratory.end / scene.drive.frequency + MARGIN) / scene.output_step;
    scene.duration = scene.duration.ceil() * scene.output_step;
    if scene.model.kind == ModelKind::Reduced {
        scene.model.reduced.step = 0.5 * scene.output_step;
    }
    scene
}

/// Simulate `truth`, of [`truth_scene`], by `run` and record it; noise is drawn from `random`.
///
/// # Errors
/// When the simulation fails.
pub fn files(
    truth: &Scene,
    setting: &Setting,
    random: &mut ChaCha8Rng,
    run: &dyn Fn(&Scene) -> Result<Response, ModelError>,
) -> Result<Files, ModelError> {
    let lab = &setting.laboratory;
    let frequency = truth.drive.frequency;
    let velocity = run(truth)?.observed_velocity().clone();
    // The middle of a Gaussian burst, else its end; of a record that was cut, the cut.
    let (_, end) = truth.drive.burst();
    let end = if setting.drive == "gaussian-burst" { 0.5 * end + LATE as f64 / 2.0 / frequency } else { end };
    let late = (end.min(lab.end / frequency) / velocity.step) as usize;
    let regime = Regime::of(&velocity.values, late);
    // The bench at rest before the burst, on the grid of the run.
    let lead = ((lab.before / frequency + MARGIN) / velocity.step).round() as usize;
    let start = -(lead as f64) * velocity.step;
    let mut values = vec![0.0; lead];
    values.extend(&velocity.values);
    let velocity = Series::new(start, velocity.step, values);
    let motion = truth.drive.motion(1.0);
    let horn = (0..velocity.len()).map(|index| {
        let (displacement, velocity) = motion.at(velocity.time(index));
        if lab.horn_velocity { velocity } else { displacement }
    });
    let horn = Series::new(start, velocity.step, horn.collect());
    let peaks = [&horn, &velocity].map(|series| series.window(0.0, lab.end / frequency).peak());
    let (mut horn, mut velocity) = (horn, velocity);
    if lab.silent {
        velocity = velocity.map(|_| 0.0);
    }
    let mut head = Vec::new();
    if let Some([bandwidth, delay]) = lab.decoder {
        (horn, velocity) = (decoded(&horn, bandwidth, delay), decoded(&velocity, bandwidth, delay));
        let stated = delay + bessel_delay(bandwidth);
        head = vec![format!("bandwidth: {:.4} MHz", 1e-6 * bandwidth), format!("delay: {:.4} us", 1e6 * stated)];
    }
    if let Some(cutoff) = lab.coupling_hz {
        (horn, velocity) = (coupled(&horn, cutoff), coupled(&velocity, cutoff));
    }
    let clock = Clock::of(lab, frequency, random);
    let horn = clock.channel(&horn, [None, lab.horn_end], 1.0);
    let velocity = clock.channel(&velocity, [lab.vibrometer_lost, lab.vibrometer_end], 1.0 + 1e-6 * lab.clock_ppm);
    let horn = disturbed(
        &horn,
        &Channel {
            peak: peaks[0],
            gain: 1.0,
            offset: lab.horn_offset,
            hum: lab.horn_hum,
            drift: lab.horn_drift,
            noise: lab.horn_noise,
            clip: None,
            bits: lab.bits,
        },
        clock.end,
        random,
    );
    let velocity = disturbed(
        &velocity,
        &Channel {
            peak: peaks[1],
            gain: lab.gain,
            offset: lab.offset,
            hum: lab.hum,
            drift: lab.drift,
            noise: lab.noise,
            clip: lab.clip,
            bits: lab.bits,
        },
        clock.end,
        random,
    );
    // Where the burst begins in each file.
    let zero = lab.lost.map_or(-lab.start_s, |_| horn.start);
    let (unit, column) = if lab.horn_velocity { (1e3, "velocity_mm_per_s") } else { (1e9, "displacement_nm") };
    let mut files = [
        csv(&horn, -zero, (unit, column), &head),
        csv(&velocity, lab.shift_s - zero, (1e3, "velocity_mm_per_s"), &head),
    ];
    if lab.swapped {
        files.reverse();
    }
    let [horn, vibrometer] = files;
    Ok(Files { horn, vibrometer, regime })
}

/// When a record's samples are taken, on the bench's time.
struct Clock {
    first: f64,
    end: f64,
    step: f64,
    frequency: f64,
}

impl Clock {
    fn of(lab: &Laboratory, frequency: f64, random: &mut ChaCha8Rng) -> Self {
        use rand::Rng;
        let step = 1.0 / lab.sample_rate_hz;
        let within_a_step: f64 = random.random_range(0.0..step);
        // A record that begins with the burst begins at its first sample.
        let exact = lab.before == 0.0 && lab.lost.is_none();
        let first = lab.lost.map_or(-lab.before, |lost| lost) / frequency + if exact { 0.0 } else { within_a_step };
        Self { first, end: lab.end / frequency, step, frequency }
    }

    /// A channel whose clock runs `ratio` as fast, from and up to so many cycles of the burst where it does not go with the other.
    fn channel(&self, series: &Series, [from, to]: [Option<f64>; 2], ratio: f64) -> Series {
        let filtered = LowPass::new(series.step, series.len(), ANTI_ALIAS / self.step).apply(&series.values);
        let spline = Spline::new(&Series::new(series.start, series.step, filtered), Ends::Natural);
        let [first, end] = [(from, self.first), (to, self.end)]
            .map(|(own, shared)| own.map_or(shared, |cycles| cycles / self.frequency));
        let count = ((end - first) / self.step) as usize;
        let at = |index: usize| spline.at(first + index as f64 * self.step / ratio).0;
        Series::new(first, self.step, (0..count).map(at).collect())
    }
}

/// What happens to the samples of one channel; amplitudes over its peak.
struct Channel {
    peak: f64,
    gain: f64,
    offset: f64,
    hum: Option<[f64; 3]>,
    drift: f64,
    noise: f64,
    clip: Option<f64>,
    bits: Option<(u32, f64)>,
}

fn disturbed(series: &Series, channel: &Channel, end: f64, random: &mut ChaCha8Rng) -> Series {
    let peak = channel.peak * channel.gain.abs();
    let mut disturbed = series.clone();
    for (index, value) in disturbed.values.iter_mut().enumerate() {
        let time = series.time(index);
        let passed = (time - series.start) / (end - series.start);
        let hum = channel.hum.map_or(0.0, |[frequency, amplitude, phase]| {
            amplitude * (std::f64::consts::TAU * frequency * time + phase).sin()
        });
        let noise: f64 = StandardNormal.sample(random);
        let aside = channel.offset + hum + channel.drift * passed.powf(1.5) + channel.noise * noise;
        *value = channel.gain * *value + peak * aside;
        if let Some(level) = channel.clip {
            *value = value.clamp((channel.offset - level) * peak, (channel.offset + level) * peak);
        }
        if let Some((bits, full)) = channel.bits {
            let most = 2f64.powi(bits as i32 - 1);
            let step = full * peak / most;
            *value = (*value / step).round().clamp(-most, most - 1.0) * step;
        }
    }
    disturbed
}

/// A file in µs and `unit`: six digits below its peak.
fn csv(series: &Series, later: f64, (factor, column): (f64, &str), head: &[String]) -> Vec<u8> {
    let peak = (factor * series.peak()).max(f64::MIN_POSITIVE);
    let digits = (6 - peak.log10().floor() as i32).clamp(2, 12) as usize;
    let mut text: String = head.iter().map(|line| format!("# {line}\n")).collect();
    let _ = writeln!(text, "time_us,{column}");
    for (index, value) in series.values.iter().enumerate() {
        let _ = writeln!(text, "{:.4},{:.digits$}", 1e6 * (series.time(index) + later), factor * value);
    }
    text.into_bytes()
}

/// An AC coupling: a high-pass of first order, at rest where the series begins.
fn coupled(series: &Series, cutoff: f64) -> Series {
    let kept = (-std::f64::consts::TAU * cutoff * series.step).exp();
    let (mut last, mut out) = (0.0, 0.0);
    series.map(|value| {
        out = kept * out + 0.5 * (1.0 + kept) * (value - last);
        last = value;
        out
    })
}

/// Poles of the Bessel filter of fourth order whose delay at low frequency is 1: the roots of s⁴ + 10 s³ + 45 s² + 105 s + 105.
const BESSEL: [[f64; 2]; 2] = [[-2.896_210_603, 0.867_234_129], [-2.103_789_397, 2.657_418_042]];

/// Angular frequency at which that filter is down to a half.
fn bessel_half() -> f64 {
    let gain = |w: f64| 105.0 / (w.powi(4) - 45.0 * w * w + 105.0).hypot(105.0 * w - 10.0 * w.powi(3));
    let (mut low, mut high) = (1.0, 6.0);
    for _ in 0..60 {
        let middle = 0.5 * (low + high);
        if gain(middle) > 0.5 { low = middle } else { high = middle }
    }
    0.5 * (low + high)
}

/// Delay at low frequency of the decoder's filter, s.
fn bessel_delay(bandwidth: f64) -> f64 {
    bessel_half() / (std::f64::consts::TAU * bandwidth)
}

/// What a decoder shows: a causal Bessel filter of fourth order, −6 dB at `bandwidth` (Hz), `delay` (s) later.
fn decoded(series: &Series, bandwidth: f64, delay: f64) -> Series {
    let scale = 1.0 / bessel_delay(bandwidth);
    let mut values = series.values.clone();
    for [re, im] in BESSEL {
        // (p p̄)/(s² − 2 Re p s + p p̄) by the bilinear transform, s = (2/h)(z − 1)/(z + 1).
        let (a, b) = (-2.0 * re * scale, (re * re + im * im) * scale * scale);
        let k = 2.0 / series.step;
        let (d0, d1, d2) = (k * k + a * k + b, 2.0 * (b - k * k), k * k - a * k + b);
        let (mut before, mut out) = ([0.0; 2], [0.0; 2]);
        for value in &mut values {
            let new = (b * (*value + 2.0 * before[0] + before[1]) - d1 * out[0] - d2 * out[1]) / d0;
            (before, out) = ([*value, before[0]], [new, out[0]]);
            *value = new;
        }
    }
    Series::new(series.start + delay, series.step, values)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_decoder_halves_its_bandwidth_and_delays_as_it_says() {
        let step = 1.0 / (73e3 * FINE as f64);
        for (frequency, expected) in [(20e3, 1.0), (0.8e6, 0.5)] {
            let omega = std::f64::consts::TAU * frequency;
            let tone = Series::new(0.0, step, (0..20_000).map(|i| (omega * step * f64::from(i)).sin()).collect());
            let seen = decoded(&tone, 0.8e6, 1e-6);
            let late = Series { values: seen.values[10_000..].to_vec(), ..seen.clone() };
            // 1 %: the warp of the bilinear transform at 0.8 of 18.7 MHz, and the filter's droop at 20 kHz.
            assert!((late.peak() - expected).abs() < 0.01, "{frequency}: {}", late.peak());
        }
        let omega = std::f64::consts::TAU * 20e3;
        let tone = Series::new(0.0, step, (0..20_000).map(|i| (omega * step * f64::from(i)).sin()).collect());
        let (seen, stated) = (decoded(&tone, 0.8e6, 1e-6), 1e-6 + bessel_delay(0.8e6));
        for (index, value) in seen.values.iter().enumerate().skip(5000) {
            assert!((value - (omega * (seen.time(index) - stated)).sin()).abs() < 2e-3);
        }
    }

    #[test]
    fn periods_are_told_by_what_returns() {
        let motion = |subharmonic: f64, share: f64| -> Vec<f64> {
            let phase = |index: usize| std::f64::consts::TAU * index as f64 / FINE as f64;
            (0..40 * FINE).map(|i| phase(i).sin() + share * (subharmonic * phase(i)).sin()).collect()
        };
        assert_eq!(Regime::of(&motion(0.5, 0.01), 40 * FINE), Regime::Period1);
        assert_eq!(Regime::of(&motion(0.5, 0.5), 40 * FINE), Regime::Period2);
        assert_eq!(Regime::of(&motion(1.0 / 3.0, 0.5), 40 * FINE), Regime::Period3);
        assert_eq!(Regime::of(&motion(0.41, 0.5), 40 * FINE), Regime::Chaotic);
    }
}
