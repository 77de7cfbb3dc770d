//! From a truth to two files: the bench is simulated under its analytic drive, and what it does passes through the laboratory.
//!
//! ```text
//! drive, bench ─ mean of shots ─ drop-outs ─ vibrometer ─ crosstalk ─ AC coupling ─ anti-alias filter ─ samples at the channel's clock ─ gain, offset, hum, drift, noise ─ clipping ─ bits ─ file
//! ```

use rand::Rng;
use rand_chacha::ChaCha8Rng;
use rand_distr::{Distribution, StandardNormal};
use serde::{Deserialize, Serialize};

use super::{
    condition::{GAP, Setting},
    instrument::{CausalFilter, Laboratory},
};
use granchain_calibration::design::record::{ANTI_ALIAS, FINE, MARGIN, csv, shots};
use granchain_model::{
    ModelError,
    response::Response,
    scene::{Drive, DriveKind, ModelKind, Scene},
};
use granchain_signal::{
    LowPass, Series,
    spline::{Ends, Spline},
};

/// Periods of the drive over which a motion is asked for its own period.
const LATE: usize = 12;

/// What may differ between one period and the next, relative to its rms: the burst still grows by a few per cent.
const ALIKE: f64 = 0.15;

/// How a truth moves once the drive has been on for a while.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Regime {
    /// Every period of the drive is as the one before.
    Period1,
    Period2,
    Period3,
    /// None of these: longer periods, and chaos.
    Chaotic,
}

impl Regime {
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
    pub horn: Vec<u8>,
    pub vibrometer: Vec<u8>,
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
    driven(scene, &setting.laboratory)
}

/// The scene under what a horn does to its drive: harmonics, modulation, a second burst. Sampled finely, as no formula of a scene has them.
fn driven(scene: Scene, lab: &Laboratory) -> Scene {
    if lab.harmonics == [0.0; 2] && lab.modulation == [0.0; 2] && lab.second_burst.is_none() {
        return scene;
    }
    let (frequency, end) = (scene.drive.frequency, scene.drive.burst().1);
    let harmonic = |(index, share): (usize, &f64)| {
        let multiple = 2.0 + index as f64;
        let mut drive = scene.drive.clone();
        if let DriveKind::ToneBurst { cycles, .. } = &mut drive.kind {
            *cycles *= multiple;
        }
        Drive { frequency: multiple * frequency, amplitude: share * drive.amplitude, ..drive }.motion(1.0)
    };
    let harmonics: Vec<_> = lab.harmonics.iter().enumerate().map(harmonic).collect();
    let (fundamental, [modulation, drift]) = (scene.drive.motion(1.0), lab.modulation);
    let once = |t: f64| {
        let swing = 1.0 + modulation * (2.0 * std::f64::consts::TAU * t / end).sin();
        let warped = t + 0.5 * drift * t * t / end;
        let others: f64 = harmonics.iter().map(|motion| motion.at(t).0).sum();
        if t < 0.0 { 0.0 } else { swing * fundamental.at(warped).0 + others }
    };
    let second = lab.second_burst.map(|rest| end + rest / frequency);
    let step = scene.output_step;
    let count = (scene.duration / step).round() as usize + 1;
    let values = (0..count).map(|i| i as f64 * step).map(|t| once(t) + second.map_or(0.0, |at| once(t - at)));
    let displacement = Series::new(0.0, step, values.collect());
    let until = displacement.end();
    scene.with_continued_record(displacement, until, vec![], frequency, None)
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
    let velocity = shots(truth, (lab.averages, GAP), random, &|scene| Ok(run(scene)?.observed_velocity().clone()))?;
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
        lab.horn_gain * if lab.horn_velocity { velocity } else { displacement }
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
    if let Some((shape, bandwidth)) = lab.causal {
        velocity = causal(&velocity, shape, bandwidth);
        head = vec![format!("bandwidth: {:.4} MHz", 1e-6 * bandwidth)];
    }
    head.extend(lab.averages.map(|(count, _)| format!("averages: {count}")));
    if let Some([share, phase, _]) = lab.crosstalk {
        // The drive's voltage: the horn's motion some part of a period before, over its peak.
        let drive = Spline::new(&horn, Ends::Natural);
        let ahead = phase / std::f64::consts::TAU / frequency;
        let [of_horn, of_bead] = peaks;
        for index in 0..velocity.len() {
            let t = (velocity.time(index) + ahead).min(horn.end());
            velocity.values[index] += share * of_bead * drive.at(t).0 / of_horn;
        }
    }
    if let Some(cutoff) = lab.coupling_hz {
        (horn, velocity) = (coupled(&horn, cutoff), coupled(&velocity, cutoff));
    }
    let clock = Clock::of(lab, frequency, random);
    let horn = clock.channel(&horn, [None, lab.horn_end], 1.0);
    let mut velocity = clock.channel(&velocity, [lab.vibrometer_lost, lab.vibrometer_end], 1.0 + 1e-6 * lab.clock_ppm);
    let clean = velocity.clone();
    let mut horn = disturbed(
        &horn,
        &Channel {
            peak: peaks[0],
            gain: 1.0,
            offset: lab.horn_offset,
            hum: lab.horn_hum,
            drift: lab.horn_drift,
            noise: lab.horn_noise,
            clip: None,
            recovery: 0.0,
            bits: lab.bits,
        },
        clock.end,
        random,
    );
    if let Some(speckle) = lab.speckle {
        speckled(&mut velocity, speckle, peaks[1], random);
    }
    let mut velocity = disturbed(
        &velocity,
        &Channel {
            peak: peaks[1],
            gain: lab.gain,
            offset: lab.offset,
            hum: lab.hum,
            drift: lab.drift,
            // Of shots of their own noise.
            noise: lab.noise / lab.averages.map_or(1.0, |(count, _)| (count as f64).sqrt()),
            clip: lab.clip,
            recovery: lab.recovery_s,
            bits: lab.bits,
        },
        clock.end,
        random,
    );
    if let Some([_, _, spike]) = lab.crosstalk {
        let first = velocity.values.iter_mut().take((0.4e-6 / clean.step).ceil() as usize);
        first.for_each(|value| *value += spike * peaks[1]);
    }
    for (series, share, peak) in [(&mut horn, lab.pink[0], peaks[0]), (&mut velocity, lab.pink[1], peaks[1])] {
        if share > 0.0 {
            let noise = pink(series.len(), random);
            series.values.iter_mut().zip(noise).for_each(|(value, noise)| *value += share * peak * noise);
        }
    }
    drop_out(&mut velocity, lab, frequency, (peaks[1], lab.offset * peaks[1]), random);
    // Where the burst begins in each file.
    let zero = lab.lost.map_or(-lab.start_s, |_| horn.start);
    let (unit, column) = if lab.horn_velocity { (1e3, "velocity_mm_per_s") } else { (1e9, "displacement_nm") };
    let mut files = [
        csv(&horn, -zero, (unit, column), if lab.causal.is_some() { &[] } else { &head }),
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
    /// Time in which an overload fades by a factor of e, s.
    recovery: f64,
    bits: Option<(u32, f64)>,
}

/// Length of a stretch of speckle noise, s, and their number.
const STRETCH: f64 = 5e-6;
const STRETCHES: usize = 4;

/// Noise in proportion to the velocity of the instant everywhere, and to the peak in a few stretches of the motion.
fn speckled(series: &mut Series, [share, loud]: [f64; 2], peak: f64, random: &mut ChaCha8Rng) {
    let length = (STRETCH / series.step).ceil() as usize;
    let begins: Vec<usize> =
        (0..STRETCHES).map(|_| random.random_range(series.len() / 3..series.len() - length)).collect();
    for (index, value) in series.values.iter_mut().enumerate() {
        let noise: f64 = StandardNormal.sample(random);
        let is_loud = begins.iter().any(|begin| (*begin..begin + length).contains(&index));
        *value += noise * if is_loud { loud * peak } else { share * value.abs() };
    }
}

fn disturbed(series: &Series, channel: &Channel, end: f64, random: &mut ChaCha8Rng) -> Series {
    let peak = channel.peak * channel.gain.abs();
    let mut disturbed = series.clone();
    // What an overload leaves in the amplifier, which fades.
    let mut charge = 0.0_f64;
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
            let [low, high] = [channel.offset - level, channel.offset + level].map(|limit| limit * peak);
            let beyond = *value - value.clamp(low, high);
            if beyond.abs() > charge.abs() {
                charge = beyond;
            }
            *value = (*value + if beyond == 0.0 { charge } else { 0.0 }).clamp(low, high);
            charge *= if channel.recovery > 0.0 { libm::exp(-series.step / channel.recovery) } else { 0.0 };
        }
        if let Some((bits, full)) = channel.bits {
            let most = 2f64.powi(bits as i32 - 1);
            let step = full * peak / most;
            *value = (*value / step).round().clamp(-most, most - 1.0) * step;
        }
    }
    disturbed
}

/// Lose the signal here and there within the burst: for 0.5 to 2 µs it stays at its offset, and as often a single sample leaps.
fn drop_out(
    series: &mut Series,
    lab: &Laboratory,
    frequency: f64,
    (peak, offset): (f64, f64),
    random: &mut ChaCha8Rng,
) {
    let burst = |random: &mut ChaCha8Rng| {
        let t = random.random_range(5.0..lab.end - 8.0) / frequency;
        (((t - series.start) / series.step).max(0.0) as usize).min(series.len() - 1)
    };
    let places: Vec<[usize; 2]> = (0..lab.drop_outs).map(|_| [burst(random), burst(random)]).collect();
    for [lost, leap] in places {
        let length = (random.random_range(0.5e-6..2e-6) / series.step).ceil() as usize;
        let until = (lost + length).min(series.len());
        for value in &mut series.values[lost..until] {
            let noise: f64 = StandardNormal.sample(random);
            *value = offset + lab.noise * peak * noise;
        }
        let sign = if random.random() { 1.0 } else { -1.0 };
        series.values[leap] += sign * peak * random.random_range(0.5..2.0);
    }
}

/// 1/f noise of rms 1: white noise through Kellet's filter, a sum of six first-order sections.
fn pink(count: usize, random: &mut ChaCha8Rng) -> Vec<f64> {
    const SECTIONS: [(f64, f64); 6] = [
        (0.99886, 0.055_517_9),
        (0.99332, 0.075_075_9),
        (0.96900, 0.153_852_0),
        (0.86650, 0.310_485_6),
        (0.55000, 0.532_952_2),
        (-0.7616, -0.016_898_0),
    ];
    let mut sections = [0.0; 6];
    let settle = 4096;
    let mut values: Vec<f64> = (0..count + settle)
        .map(|_| {
            let white: f64 = StandardNormal.sample(random);
            for (section, (kept, taken)) in sections.iter_mut().zip(SECTIONS) {
                *section = kept * *section + taken * white;
            }
            sections.iter().sum::<f64>() + 0.5362 * white
        })
        .skip(settle)
        .collect();
    let rms = (values.iter().map(|value| value * value).sum::<f64>() / count as f64).sqrt();
    values.iter_mut().for_each(|value| *value /= rms);
    values
}

/// A causal low-pass, −6 dB at `bandwidth` of a Bessel filter, −3 dB of a Butterworth one; its delay at zero frequency is removed, as vibrometers do.
fn causal(series: &Series, shape: CausalFilter, bandwidth: f64) -> Series {
    let CausalFilter::Butterworth(order) = shape else {
        let mut passed = decoded(series, bandwidth, 0.0);
        passed.start -= bessel_delay(bandwidth);
        return passed;
    };
    let omega = std::f64::consts::TAU * bandwidth;
    let mut values = series.values.clone();
    let mut delay = 0.0;
    // Poles in pairs on a circle; of an odd order one more on the real axis.
    for pair in 0..order.div_ceil(2) {
        let angle = std::f64::consts::PI * (f64::from(2 * pair + 1) / f64::from(2 * order) + 0.5);
        let k = 2.0 / series.step;
        let real = order % 2 == 1 && pair == order / 2;
        // ω²/(s² − 2 ω cos φ s + ω²), or ω/(s + ω), by the bilinear transform.
        let (b, d) = if real {
            (omega, [0.0, k + omega, omega - k])
        } else {
            let a = -2.0 * omega * angle.cos();
            delay += a / (omega * omega);
            let b = omega * omega;
            (b, [k * k + a * k + b, 2.0 * (b - k * k), k * k - a * k + b])
        };
        delay += if real { 1.0 / omega } else { 0.0 };
        let (mut before, mut out) = ([0.0; 2], [0.0; 2]);
        for value in &mut values {
            let new = if real {
                (b * (*value + before[0]) - d[2] * out[0]) / d[1]
            } else {
                (b * (*value + 2.0 * before[0] + before[1]) - d[1] * out[0] - d[2] * out[1]) / d[0]
            };
            (before, out) = ([*value, before[0]], [new, out[0]]);
            *value = new;
        }
    }
    Series::new(series.start - delay, series.step, values)
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

/// Delay at low frequency of the vibrometer's filter, s.
fn bessel_delay(bandwidth: f64) -> f64 {
    bessel_half() / (std::f64::consts::TAU * bandwidth)
}

/// What a vibrometer shows: a causal Bessel filter of fourth order, −6 dB at `bandwidth` (Hz), `delay` (s) later.
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
    fn a_vibrometer_filter_halves_at_its_bandwidth_and_delays_as_stated() {
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
    fn a_causal_filter_halves_the_power_at_its_bandwidth_and_keeps_slow_motion_in_place() {
        let step = 1.0 / (73e3 * FINE as f64);
        for shape in [1, 2, 3, 4].map(CausalFilter::Butterworth) {
            for (frequency, expected, tolerance) in [(10e3, 1.0, 1e-3), (0.4e6, 0.5f64.sqrt(), 0.01)] {
                let omega = std::f64::consts::TAU * frequency;
                let tone = Series::new(0.0, step, (0..40_000).map(|i| (omega * step * f64::from(i)).sin()).collect());
                let seen = causal(&tone, shape, 0.4e6);
                let late = Series { values: seen.values[20_000..].to_vec(), ..seen.clone() };
                assert!((late.peak() - expected).abs() < tolerance, "{shape:?} {frequency}: {}", late.peak());
                if frequency < 20e3 {
                    for (index, value) in seen.values.iter().enumerate().skip(20_000) {
                        assert!((value - (omega * seen.time(index)).sin()).abs() < 2e-3, "{shape:?}");
                    }
                }
            }
        }
    }

    #[test]
    fn pink_noise_falls_by_three_decibels_an_octave() {
        use rand::SeedableRng;
        let noise = pink(1 << 16, &mut ChaCha8Rng::seed_from_u64(3));
        // Variance of means of 2^k samples: of 1/f noise it falls with the logarithm of their length, of white noise with the length.
        let spread = |length: usize| {
            let means: Vec<f64> = noise.chunks(length).map(|part| part.iter().sum::<f64>() / length as f64).collect();
            means.iter().map(|mean| mean * mean).sum::<f64>() / means.len() as f64
        };
        assert!((0.15..0.8).contains(&(spread(64) / spread(4))), "{}", spread(64) / spread(4));
    }

    #[test]
    fn periods_are_found_by_what_returns() {
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
