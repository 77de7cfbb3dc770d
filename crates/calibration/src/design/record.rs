//! From a truth on the user's bench to files as its laboratory stores them: sampling, trigger, noise, converter, filter and gaps of the measured record.
//!
//! ```text
//! motion ─ filter ─ anti-alias filter ─ the record's own samples ─ noise, converter, clipping, offset ─ file, and how it is read
//! ```

use std::fmt::Write;

use rand::Rng;
use rand_chacha::ChaCha8Rng;
use rand_distr::{Distribution, StandardNormal};

use crate::observation::{Fall, Passband, clip};
use granchain_model::{ModelError, scene::Scene};
use granchain_record::{Masking, ReadOptions, Record, RecordedQuantity};
use granchain_signal::{
    FlickerSource, LowPass, NoiseSpectrum, Series,
    spline::{Ends, Spline},
};

/// Samples a drive period of the truth: a whole number, so that periods are compared sample by sample.
pub const FINE: usize = 256;

/// Simulated beyond both ends of a record, s: room for filters and triggers.
pub const MARGIN: f64 = 30e-6;

/// Cutoff of an oscilloscope's anti-alias filter over the sample rate.
pub const ANTI_ALIAS: f64 = 0.45;

/// What the bead does in one shot, or in the mean of several, each with gaps (half-normal, of this scale in m) of its own and this jitter (s).
pub fn shots(
    truth: &Scene,
    (averages, scale): (Option<(usize, f64)>, f64),
    random: &mut ChaCha8Rng,
    run: &dyn Fn(&Scene) -> Result<Series, ModelError>,
) -> Result<Series, ModelError> {
    let mut mean = run(truth)?;
    let Some((count, jitter)) = averages else { return Ok(mean) };
    for _ in 1..count {
        let mut scene = truth.clone();
        scene.chain.gaps.iter_mut().for_each(|gap| {
            let normal: f64 = StandardNormal.sample(random);
            *gap = scale * normal.abs();
        });
        let late: f64 = StandardNormal.sample(random);
        let shot = Spline::new(&run(&scene)?, Ends::Natural);
        let (start, step, end) = (mean.start, mean.step, mean.end());
        for (index, value) in mean.values.iter_mut().enumerate() {
            *value += shot.at((start + index as f64 * step - jitter * late).clamp(start, end)).0;
        }
    }
    Ok(mean.map(|value| value / count as f64))
}

/// A file in µs and `unit`: six digits below its peak.
pub fn csv(series: &Series, later: f64, (factor, column): (f64, &str), head: &[String]) -> Vec<u8> {
    let peak = (factor * series.peak()).max(f64::MIN_POSITIVE);
    let digits = (6 - peak.log10().floor() as i32).clamp(2, 12) as usize;
    let mut text: String = head.iter().map(|line| format!("# {line}\n")).collect();
    let _ = writeln!(text, "time_us,{column}");
    for (index, value) in series.values.iter().enumerate() {
        let _ = writeln!(text, "{:.4},{:.digits$}", 1e6 * (series.time(index) + later), factor * value);
    }
    text.into_bytes()
}

/// The instrument of one measured record.
#[derive(Debug)]
pub(super) struct Instrument {
    pub record: Record,
    /// σ of the white noise of a sample, and 1/f part: density times frequency; units of the recorded quantity.
    white: f64,
    flicker: f64,
}

impl Instrument {
    /// Of a record; `density`: one-sided density of its noise, unit² per Hz, where that is known better than from its rms.
    pub fn of(record: Record, density: Option<f64>) -> Self {
        let (step, half) = (record.raw.step, 0.5 / record.raw.step);
        let quiet = &record.raw.values[..record.pretrigger.min(record.raw.len())];
        let spectrum = NoiseSpectrum::of(quiet, step).filter(|spectrum| spectrum.flicker > 0.0);
        let own = density.map_or(record.recorded_noise_rms.powi(2), |density| density * half);
        let white = spectrum.map_or(own, |spectrum| spectrum.white * half);
        let rounding = record.quantisation_step.map_or(0.0, |step| step * step / 12.0);
        let (white, flicker) = ((white - rounding).max(0.0).sqrt(), spectrum.map_or(0.0, |spectrum| spectrum.flicker));
        Self { record, white, flicker }
    }

    /// Whether it recorded a velocity.
    pub fn sees_velocity(&self) -> bool {
        self.record.recorded == RecordedQuantity::Velocity
    }

    /// A motion from the model's t = 0 on, which lies `later` (s) on the record's clock, behind rest from before the record begins.
    pub fn at_rest_before(&self, motion: &Series, later: f64) -> Series {
        let rest = (((later - self.record.series.start).max(0.0) + MARGIN) / motion.step).ceil();
        let values = std::iter::repeat_n(0.0, rest as usize).chain(motion.values.iter().copied()).collect();
        Series::new(-rest * motion.step, motion.step, values)
    }

    /// What its filter makes of a motion; of a filter of which only the bandwidth is stated, one that has it. `fitted`: bandwidth of a digital filter
    /// that is a parameter of the fit, Hz.
    pub fn filtered(
        &self,
        motion: &Series,
        (frequency, fitted): (f64, Option<f64>),
        random: &mut ChaCha8Rng,
    ) -> Series {
        let (response, bandwidth) = (self.record.response.as_ref(), self.record.bandwidth);
        let digital = |bandwidth| Passband { bandwidth, fall: Fall::Steepness(1.0) };
        let stated_response = || response.and_then(|response| Passband::of(response, bandwidth, frequency));
        let known = fitted.map(digital).or_else(stated_response);
        let stated = || bandwidth.map(|bandwidth| Passband::stated(bandwidth, random.random()));
        known.or_else(stated).map_or_else(|| motion.clone(), |passband| passband.pass(motion))
    }

    /// The file of a motion (recorded quantity, SI) that lies `later` (s) on the record's clock, and the options that read it.
    pub fn file(&self, motion: &Series, later: f64, random: &mut ChaCha8Rng) -> (Vec<u8>, ReadOptions) {
        let Self { record, white, flicker } = self;
        let own = &record.series;
        let smooth = LowPass::new(motion.step, motion.len(), ANTI_ALIAS / own.step).apply(&motion.values);
        let spline = Spline::new(&Series::new(motion.start + later, motion.step, smooth), Ends::Natural);
        let (first, last) = (motion.start + later, motion.end() + later);
        let mut normal = || -> f64 { StandardNormal.sample(random) };
        let mut slow = FlickerSource::new(*flicker, own.step, 0.5 / (own.step * own.len() as f64), &mut normal);
        let sample = |index: usize| {
            let signal = spline.at(own.time(index).clamp(first, last)).0;
            signal + white * normal() + slow.next(&mut normal)
        };
        let mut values: Vec<f64> = (0..own.len()).map(sample).collect();
        clip(&mut values, record.clipped);
        let step = record.quantisation_step.filter(|step| *step > 0.0);
        values.iter_mut().for_each(|value| {
            *value += record.baseline;
            *value = step.map_or(*value, |step| (*value / step).round() * step);
        });
        let column = match record.recorded {
            RecordedQuantity::Displacement => (1e9, "displacement_nm"),
            RecordedQuantity::Velocity => (1e3, "velocity_mm_per_s"),
            RecordedQuantity::Pressure => (1.0, "pressure_pa"),
        };
        (csv(&Series::new(own.start, own.step, values), record.delay, column, &[]), self.options())
    }

    /// How its files are read: everything that the record's own header or options stated of it.
    fn options(&self) -> ReadOptions {
        let record = &self.record;
        let stretch = |gap: granchain_signal::Gap| {
            let inside = 0.5 * record.series.step;
            let [from, to] = [gap.from.max(record.series.start) + inside, gap.to.min(record.series.end()) - inside];
            [from + record.delay, to + record.delay]
        };
        let mask = match &record.masked[..] {
            [] if record.options.mask == Masking::None => Masking::None,
            [] => Masking::Auto,
            masked => Masking::Stretches(masked.iter().map(|masked| stretch(masked.gap)).collect()),
        };
        ReadOptions {
            baseline: record.options.baseline,
            bandwidth: record.bandwidth,
            response: record.response.clone(),
            delay: Some(record.delay),
            drive_frequency: record.stated_drive_frequency,
            force_frequency: record.options.force_frequency,
            averages: (record.averages > 1).then_some(record.averages),
            mask,
            ..ReadOptions::default()
        }
    }
}
