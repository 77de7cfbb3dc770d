//! From a truth on the user's bench to files as its laboratory stores them: sampling, trigger, noise, converter, filter and gaps of the measured record.
//!
//! ```text
//! motion ─ filter ─ anti-alias filter ─ the record's own samples ─ noise, converter, clipping, offset ─ file, and how it is read
//! ```

use rand::Rng;
use rand_chacha::ChaCha8Rng;
use rand_distr::{Distribution, StandardNormal};

use crate::laboratory::record::{ANTI_ALIAS, MARGIN, csv};
use granchain_calibration::observation::{Fall, Passband, clip};
use granchain_record::{Masking, ReadOptions, Record, RecordedQuantity};
use granchain_signal::{
    FlickerSource, LowPass, NoiseSpectrum, Series,
    spline::{Ends, Spline},
};

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
        let column = if self.sees_velocity() { (1e3, "velocity_mm_per_s") } else { (1e9, "displacement_nm") };
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
