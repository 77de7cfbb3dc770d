//! Horn-tip record → piston motion: recorded motion with rest before it and separable noise removed.
//!
//! ```text
//! recorded quantity ─ first and last motion ─ continued at both ends ─ low-pass ─ less drift ─ Wiener's gain, [∫dt] ─ from rest to rest
//! ```
//!
//! No window is applied to recorded samples: only what was predicted beyond them fades.
//!
//! - Onset: the first sample beyond 4.5 σ and 1e-4 of the peak, followed by more within a period; back to its change of sign; back by half periods as long as
//!   the part of sin ωt in them exceeds 3.5 of its own σ; then the zero of the lines fitted to three periods after it. A slope of the quiet samples is removed.
//! - A first sample that moves (beyond 3 σ and 1 % of the peak) belongs to a burst that begins with the record if the fitted lines pass zero less than one
//!   sample before it. Else the record begins inside the burst and is continued backwards for 20 cycles, of which the first 8 rise.
//! - An end is continued by the fitted lines (half as many periods where they miss the samples), growth levelling off as L tanh(u/L), the remainder reflected
//!   over two periods, for at least four periods and as far as the filters reach; then it fades over twelve.

use std::f64::consts::PI;

use super::{
    continuation::Continuation,
    estimate::{Noisy, Remainder},
    onset::{FITTED_PERIODS, Onset, Search},
};
use granchain_signal::{
    LowPass, NoiseSpectrum, Resampler, Series,
    spline::{Ends, Spline},
};

/// Periods by which a burst is continued beyond either end before it fades.
const CONTINUED: f64 = 4.0;
/// Periods over which the continuation fades.
const FADED: f64 = 12.0;
/// Periods by which a burst is continued before a record that begins inside it, so that the chain reaches its steady
/// state.
const LED_IN: f64 = 12.0;
/// Periods over which this continuation rises.
const RISEN: f64 = 8.0;
/// Fraction of the fitted periods that is used if the lines change too fast: if the misfit exceeds the noise by the
/// factor below.
const SHORTER: f64 = 0.5;
const MISSED: f64 = 1.5;
/// Periods over which the residual of the fitted lines is reflected at an end.
const REFLECTED: f64 = 2.0;
/// Fewest samples a drive period in the drive, for an accurate spline.
const FINEST: f64 = 20.0;
/// Fewest periods from first to last motion.
const SHORTEST: f64 = 1.5;
/// Periods of rest after the burst that mark its end.
const RESTED: f64 = 0.25;
/// Motion at the end of a record, as a fraction of the peak, from which the comparison is shortened.
const CUT: f64 = 0.5;
/// Range of the running mean that counts as drift, as a fraction of the peak and in σ.
const WANDER: (f64, f64) = (2e-3, 6.0);
/// A start within this many periods of t = 0 is set to t = 0, if the motion in between is negligible against noise or
/// peak.
const NEAR_ZERO: f64 = 0.02;
/// Periods after t = 0 from which the rest before the motion is not simulated.
const LATE: f64 = 20.0;
/// Negligible motion, as a fraction of the peak.
const UNSEEN: f64 = 0.005;

/// Fewest quiet samples for the estimate of a slope, and least slope in its σ.
const FEWEST_INCLINED: usize = 16;
const INCLINED: f64 = 5.0;

#[derive(Debug, Clone, Copy, PartialEq, serde::Serialize)]
#[serde(rename_all = "kebab-case", tag = "kind")]
pub enum Beginning {
    /// From rest, recorded before the burst.
    Rest,
    /// At the first sample, or less than one sample before it.
    WithBurst,
    /// Before the record: the first cycles are missing.
    Inside {
        /// Their number, estimated from a growing envelope; `None` if the envelope is steady.
        missing_cycles: Option<f64>,
    },
}

#[derive(Debug, Clone, Copy, PartialEq, Eq, serde::Serialize)]
#[serde(rename_all = "kebab-case", tag = "kind")]
pub enum Ending {
    /// At rest, recorded after the burst.
    Rest,
    /// After the record: the continuation is predicted.
    Inside,
}

/// Piston motion from a horn-tip record.
#[derive(Debug, Clone, PartialEq)]
pub struct HornDrive {
    /// Displacement of the piston on the model's clock (m), at rest before its first instant and after its last; the
    /// first value is zero.
    pub displacement: Series,
    /// Instant of the record's own axis (t = 0 at the trigger) at the model's time 0, s.
    pub origin: f64,
    /// First motion, model's clock, s; of a record that begins inside the burst its first sample.
    pub begins_at: f64,
    /// Last instant of recorded motion, model's clock, s; later motion is rest or predicted.
    pub recorded_until: f64,
    pub begins: Beginning,
    pub ends: Ending,
    /// Residual noise; `None` if unknown.
    pub remainder: Option<Remainder>,
    /// Noise of the record, unit of the recorded quantity, rms; 0 if unknown.
    pub noise_rms: f64,
    /// Step of the converter, unit of the recorded quantity, if visible.
    pub quantisation_step: Option<f64>,
    /// Range of the drift that was removed, m; 0 if none.
    pub drift: f64,
    /// −6 dB point of the low-pass, Hz.
    pub cutoff: f64,
    pub drive_frequency: f64,
    /// Motion over the last period recorded, as a fraction of the peak.
    left_at_end: f64,
}

/// Recorded samples and their noise.
#[derive(Debug)]
pub(super) struct Recorded {
    /// Displacement or velocity about its rest, positive towards the chain, on the record's own axis.
    pub series: Series,
    pub integrated: bool,
    /// Quiet samples at the start.
    pub quiet: usize,
    pub sigma: f64,
    pub noise_band: f64,
    pub quantisation_step: Option<f64>,
    pub drive_frequency: f64,
    pub cutoff: f64,
}

/// One end of the burst, seen inwards.
#[derive(Debug, Clone, Copy)]
struct End {
    /// Position, samples from the record's first.
    place: f64,
    /// Whether the motion is zero there.
    rests: bool,
}

impl Recorded {
    /// The drive; `None` where nothing moves.
    pub(crate) fn drive(mut self) -> Option<HornDrive> {
        let trend = self.trend();
        let Self { integrated, sigma, drive_frequency, cutoff, .. } = self;
        let (step, count) = (self.series.step, self.series.len());
        let period = 1.0 / (drive_frequency * step);
        let level: Vec<f64> = match trend {
            Some(trend) => {
                let until = self.quiet + period.ceil() as usize;
                self.series
                    .values
                    .iter()
                    .enumerate()
                    .map(|(i, x)| x - trend.0 - trend.1 * i.min(until) as f64)
                    .collect()
            }
            None => self.series.values.clone(),
        };
        let search = Search { values: &level, sigma, period, jumps: integrated };
        let onset = search.onset()?;
        let (begins, first) = match onset {
            Onset::Rest(place) => (Beginning::Rest, End { place, rests: true }),
            Onset::AtFirst(place) => (Beginning::WithBurst, End { place, rests: true }),
            Onset::Before => {
                (Beginning::Inside { missing_cycles: self.missing_cycles(period) }, End { place: 0.0, rests: false })
            }
        };
        let mut reversed = level.clone();
        reversed.reverse();
        let farthest = (count - 1) as f64;
        let (ends, last) = match (Search { values: &reversed, ..search }).onset()? {
            Onset::Rest(place) if place >= f64::max(RESTED * period, 2.0) => {
                (Ending::Rest, End { place: farthest - place, rests: true })
            }
            _ => (Ending::Inside, End { place: farthest, rests: false }),
        };
        drop(reversed);
        let (from, to) = (first.place.ceil().max(0.0) as usize, (last.place.floor() as usize).min(count - 1));
        if to < from + (SHORTEST * period) as usize {
            return None;
        }
        let burst = &self.series.values[from..=to];
        // As far as low-pass and resampling reach, where the record is that long.
        let kernel = f64::min(11.0 / (cutoff * step), count as f64) + 48.0;
        let margin = |periods: f64, fade: f64| {
            let flat = (f64::max(periods * period, kernel)).ceil() as usize;
            let fade = (fade * period).ceil() as usize;
            (flat, fade)
        };
        let before = if first.rests { margin(CONTINUED, FADED) } else { margin(LED_IN, RISEN) };
        let after = margin(CONTINUED, FADED);
        let lead = before.0 + before.1;
        // Of a velocity the longer fit counts: what it is continued by must not drift.
        let tolerated = if integrated { f64::INFINITY } else { sigma };
        let mut values = continued(burst, (from as f64 - first.place, first.rests), period, before, true, tolerated);
        values.extend_from_slice(burst);
        values.extend(continued(burst, (last.place - to as f64, last.rests), period, after, false, tolerated));
        let values = LowPass::new(step, values.len(), cutoff).apply(&values);
        let mut extended = Series::new(-(lead as f64), 1.0, values);
        let drift = if integrated { 0.0 } else { take_drift(&mut extended, lead..lead + burst.len(), period, sigma) };
        let noisy = Noisy {
            values: &extended.values,
            step,
            recorded: burst.len(),
            sigma,
            band: self.noise_band,
            spectrum: self.spectrum(),
            drive_frequency,
            integrated,
        };
        let (values, remainder) = noisy.estimate();
        // Places on `extended` count samples from `from`.
        let extended = Series::new(extended.start, 1.0, values);
        let (mut begin, mut end) = (first.place - from as f64, last.place - from as f64);
        if integrated {
            // A displacement is zero where it begins, its velocity need not be.
            let spline = Spline::new(&extended, Ends::Zero);
            if first.rests {
                begin = nearest_zero(&spline, begin, 0.75 + 0.02 * period).unwrap_or(begin);
            }
            if last.rests {
                end = nearest_zero(&spline, end, 0.75 + 0.02 * period).unwrap_or(end);
            }
        }
        Some(self.between_rests(&extended, (from, begin, end), (begins, ends), remainder, drift))
    }

    /// Onto the model's clock, from the zero at which motion begins to the zero at which it ends.
    fn between_rests(
        &self,
        extended: &Series,
        (from, mut begin, end): (usize, f64, f64),
        (begins, ends): (Beginning, Ending),
        remainder: Option<Remainder>,
        drift: f64,
    ) -> HornDrive {
        let drive_frequency = self.drive_frequency;
        let (start, step) = (self.series.start + from as f64 * self.series.step, self.series.step);
        let period = 1.0 / (drive_frequency * step);
        let rests = !matches!(begins, Beginning::Inside { .. });
        // Of t = 0 within what noise hides of the beginning, that is when it begins.
        let zero = -start / step;
        let moved = |place: f64| {
            let index = (place - extended.start).max(0.0);
            let part = index.fract();
            match extended.values.get(index as usize..index as usize + 2) {
                Some([before, after]) => ((1.0 - part) * before + part * after).abs(),
                _ => 0.0,
            }
        };
        let peak = extended.peak();
        if rests
            && (zero - begin).abs() <= NEAR_ZERO * period
            && moved(zero) <= f64::max(3.0 * self.displacement_noise(), UNSEEN * peak)
        {
            begin = zero;
        }
        let parts = (FINEST / period).ceil().max(1.0);
        let mut spacing = 1.0 / parts;
        let (first, last) =
            (if rests { begin } else { extended.start }, if ends == Ending::Rest { end } else { extended.end() });
        let mut count = ((last - first) / spacing).floor() as usize + 1;
        if ends == Ending::Rest {
            // The last sample lies where the motion ends.
            spacing = (last - first) / count as f64;
            count += 1;
        }
        let mut values = Resampler::interpolating(extended.start, 1.0, extended.len(), first, spacing, count)
            .apply(&extended.values);
        let reach = ((0.25 * period / spacing).ceil() as usize).clamp(1, count);
        let settle = |u: usize| {
            let left = 1.0 - u as f64 / reach as f64;
            left * left * (3.0 - 2.0 * left)
        };
        // What noise leaves of the zero that a motion begins and ends with.
        let (at_first, at_last) = (values[0], values[count - 1]);
        for u in 0..reach {
            values[u] -= at_first * settle(u);
            values[count - 1 - u] -= at_last * settle(u);
        }
        (values[0], values[count - 1]) = (0.0, 0.0);
        let on_record = |place: f64| start + place * step;
        let begins_on_record = on_record(first);
        // On another clock a period of rest precedes the motion.
        let on_time = (-1e-9 * step..=LATE / drive_frequency).contains(&begins_on_record);
        let origin = if on_time { 0.0 } else { begins_on_record - 1.0 / drive_frequency };
        let start_of_motion = if begins_on_record.abs() <= 1e-9 * step { 0.0 } else { begins_on_record - origin };
        let last_period = (period.ceil() as usize).min(extended.len());
        let end_index = (end - extended.start).floor() as usize + 1;
        let left_at_end = extended.values[end_index.saturating_sub(last_period)..end_index.min(extended.len())]
            .iter()
            .fold(0.0, |most, x| f64::max(most, x.abs()))
            / peak.max(f64::MIN_POSITIVE);
        HornDrive {
            displacement: Series::new(start_of_motion, spacing * step, values),
            origin,
            begins_at: on_record(if rests { begin } else { 0.0 }) - origin,
            recorded_until: on_record(end) - origin,
            begins,
            ends,
            remainder,
            noise_rms: self.sigma,
            quantisation_step: self.quantisation_step,
            drift,
            cutoff: self.cutoff,
            drive_frequency,
            left_at_end,
        }
    }

    /// Level and slope (per sample) of the quiet samples, if the slope exceeds their noise because of hum or drift; σ
    /// is then taken about that line.
    fn trend(&mut self) -> Option<(f64, f64)> {
        let quiet = self.series.values.get(..self.quiet).filter(|quiet| quiet.len() >= FEWEST_INCLINED)?;
        let n = quiet.len() as f64;
        let middle = 0.5 * (n - 1.0);
        let mean = quiet.iter().sum::<f64>() / n;
        let spread = n * (n * n - 1.0) / 12.0;
        let slope = quiet.iter().enumerate().map(|(i, x)| (i as f64 - middle) * (x - mean)).sum::<f64>() / spread;
        let left = quiet.iter().enumerate().map(|(i, x)| (x - mean - slope * (i as f64 - middle)).powi(2)).sum::<f64>();
        let least = self.quantisation_step.map_or(0.0, |step| step / 12f64.sqrt());
        let sigma = (left / n).sqrt().max(least);
        if slope.abs() <= INCLINED * sigma / spread.sqrt() || slope == 0.0 {
            return None;
        }
        self.sigma = sigma;
        Some((mean - slope * middle, slope))
    }

    /// Noise spectrum of a displacement, if its quiet samples show a 1/f part.
    fn spectrum(&self) -> Option<NoiseSpectrum> {
        let quiet = self.series.values.get(..self.quiet).filter(|_| !self.integrated)?;
        NoiseSpectrum::of(quiet, self.series.step).filter(|spectrum| spectrum.flicker > 0.0)
    }

    /// Noise expressed as a displacement, rms, m.
    fn displacement_noise(&self) -> f64 {
        if self.integrated { self.sigma / (2.0 * PI * self.drive_frequency) } else { self.sigma }
    }

    /// Cycles before the first sample, from the amplitudes of the first six periods if they grow beyond their noise:
    /// by A(1 − e^(−t/τ)), or by a line if the growth does not slow down.
    fn missing_cycles(&self, period: f64) -> Option<f64> {
        let whole = period.round() as usize;
        let amplitude = |k: usize| {
            let from = (k as f64 * period).round() as usize;
            let part = self.series.values.get(from..from + whole)?;
            let sum = |phase: f64| {
                let wave = |i: usize| libm::cos(2.0 * PI * (from + i) as f64 / period + phase);
                part.iter().enumerate().map(|(i, x)| x * wave(i)).sum::<f64>()
            };
            Some(2.0 / whole as f64 * libm::hypot(sum(0.0), sum(0.5 * PI)))
        };
        let [early, middle, late] = [amplitude(0)?, amplitude(2)?, amplitude(4)?];
        let error = self.sigma * (2.0 / whole as f64).sqrt();
        let (first, second) = (middle - early, late - middle);
        if first + second < f64::max(5.0 * error, 0.02 * late) || first <= 0.0 {
            return None;
        }
        let ratio = second / first;
        // The first amplitude is that of the middle of its period.
        let cycles = if ratio < 0.97 && ratio > 0.0 {
            let most = early + first / (1.0 - ratio);
            2.0 * (1.0 - early / most).ln() / ratio.ln()
        } else {
            4.0 * early / (first + second)
        };
        (cycles.is_finite() && cycles > 0.5).then_some(cycles - 0.5)
    }
}

impl HornDrive {
    /// Description of how the record was processed.
    #[must_use]
    pub fn statement(&self) -> String {
        let begins = match self.begins {
            Beginning::Rest => "set to rest before the burst".to_owned(),
            Beginning::WithBurst => "set to rest before its first sample, with which the burst begins".to_owned(),
            Beginning::Inside { .. } => {
                format!("extended backwards by {:.0} cycles, because it begins inside the burst", LED_IN + RISEN)
            }
        };
        let ends = match self.ends {
            Ending::Rest => "set to rest after it",
            Ending::Inside => "extended after its last sample by a prediction from its last cycles",
        };
        let clock = if self.origin == 0.0 {
            "the simulation uses the time axis of the record".to_owned()
        } else {
            format!(
                "the time of the simulation is that of the record {} {:.3} µs",
                if self.origin < 0.0 { '+' } else { '−' },
                1e6 * self.origin.abs()
            )
        };
        let left = match &self.remainder {
            Some(remainder) => format!("; remaining noise: {:.3} nm rms", 1e9 * remainder.rms()),
            None => String::new(),
        };
        let drift = if self.drift > 0.0 {
            format!("; a drift of {:.2} nm was removed", 1e9 * self.drift)
        } else {
            String::new()
        };
        format!(
            "the horn's record was low-passed (zero phase, {:.0} kHz), {begins}, and {ends}; {clock}{left}{drift}",
            1e-3 * self.cutoff
        )
    }

    /// Warnings about missing parts of the record and their consequences; empty if nothing is missing.
    #[must_use]
    pub fn warnings(&self) -> Vec<String> {
        let mut warnings = Vec::new();
        if let Beginning::Inside { missing_cycles } = self.begins {
            let missing = match missing_cycles {
                Some(cycles) => format!("some {cycles:.1} cycles of it are"),
                None => "at least a part of a cycle of it is".to_owned(),
            };
            warnings.push(format!(
                "the horn's record begins inside the burst, and {missing} missing: what the chain does first cannot be compared; \
                 record from before the burst on"
            ));
        }
        if self.ends == Ending::Inside && self.left_at_end > CUT {
            warnings.push(format!(
                "the horn's record ends inside the burst, {:.1} cycles after it begins, at {:.0} % of its peak: nothing later is compared, \
                 however long the other record; record the horn to the end of the burst",
                (self.recorded_until - self.begins_at) * self.drive_frequency,
                100.0 * self.left_at_end
            ));
        }
        warnings
    }
}

/// Samples beyond one end of `burst` in the order of time: `flat` samples of continuation, then `fade` samples that
/// fade. The edge lies `offset` samples beyond the outermost sample.
fn continued(
    burst: &[f64],
    (offset, rests): (f64, bool),
    period: f64,
    (flat, fade): (usize, usize),
    before: bool,
    tolerated: f64,
) -> Vec<f64> {
    let inwards = |i: usize| if before { burst[i] } else { burst[burst.len() - 1 - i] };
    let fitted = |periods: f64| {
        let reach = ((periods * period).ceil() as usize).min(burst.len());
        Continuation::fit(inwards, reach, offset, period)
    };
    // A burst that rises within a few periods is no line over three of them.
    let missed = |lines: &Continuation| {
        let near = (period.ceil() as usize).min(burst.len());
        let sum: f64 = (0..near).map(|i| (inwards(i) - lines.at(i as f64 + offset)).powi(2)).sum();
        (sum / near as f64).sqrt()
    };
    let long = fitted(FITTED_PERIODS);
    let lines = match fitted(SHORTER * FITTED_PERIODS) {
        Some(short) if long.as_ref().is_none_or(|long| missed(long) > MISSED * f64::max(missed(&short), tolerated)) => {
            Some(short)
        }
        _ => long,
    };
    let lines = lines.map(|lines| if rests { lines } else { lines.going_on() });
    let reflected = (REFLECTED * period).min((burst.len() - 1) as f64);
    let value = |beyond: usize| {
        // u of the sample that is `beyond` samples outside the outermost one.
        let left = |i: usize| inwards(i) - lines.as_ref().map_or(0.0, |lines| lines.at(i as f64 + offset));
        let share = 0.5 + 0.5 * libm::cos(PI * (beyond as f64 / reflected.max(1.0)).min(1.0));
        let rest = if share > 0.0 { share * left(beyond.min(burst.len() - 1)) } else { 0.0 };
        let fading =
            if beyond > flat { 0.5 + 0.5 * libm::cos(PI * (beyond - flat) as f64 / (fade + 1) as f64) } else { 1.0 };
        fading * (rest + lines.as_ref().map_or(0.0, |lines| lines.at(offset - beyond as f64)))
    };
    let mut values: Vec<f64> = (1..=flat + fade).map(value).collect();
    if before {
        values.reverse();
    }
    values
}

/// Removes drift, the running mean over eight periods, if it is significant, and returns its range. The overall mean
/// stays, since the baseline was chosen for it.
fn take_drift(extended: &mut Series, burst: std::ops::Range<usize>, period: f64, sigma: f64) -> f64 {
    let less = super::baseline::without_drift(extended, 1.0 / period);
    let peak = extended.peak();
    let loud = |x: &f64| x.abs() > CUT * peak;
    let Some(last) = extended.values[burst.clone()].iter().rposition(loud) else { return 0.0 };
    // Windows that reach behind the burst see its end, which is no whole number of periods.
    let half = (4.0 * period).ceil() as usize;
    let (from, past) = (burst.start + half, (burst.start + last).saturating_sub(half));
    let slope_over = (2.0 * period).ceil() as usize;
    if past <= from + slope_over {
        return 0.0;
    }
    let mean = |i: usize| extended.values[i] - less.values[i];
    let inside = || (from..past).map(mean);
    let (low, high, sum) = inside().fold((f64::INFINITY, f64::NEG_INFINITY, 0.0), |(low, high, sum), x| {
        (f64::min(low, x), f64::max(high, x), sum + x)
    });
    let level = sum / (past - from) as f64;
    let scatter = sigma * (1.5 / (8.0 * period)).sqrt();
    if high - low <= f64::max(WANDER.0 * peak, WANDER.1 * scatter) {
        return 0.0;
    }
    // Onwards along a line for half a window, then level.
    let early = (mean(from + slope_over) - mean(from)) / slope_over as f64;
    let late = (mean(past - 1) - mean(past - 1 - slope_over)) / slope_over as f64;
    let wander: Vec<f64> = (0..extended.len())
        .map(|i| {
            let (before, behind) = (from.saturating_sub(i).min(half), (i + 1).saturating_sub(past).min(half));
            mean(i.clamp(from, past - 1)) - early * before as f64 + late * behind as f64 - level
        })
        .collect();
    extended.values.iter_mut().zip(&wander).for_each(|(value, wander)| *value -= wander);
    high - low
}

/// The zero crossing of a spline nearest to a place, within `slack` of it.
fn nearest_zero(spline: &Spline, place: f64, slack: f64) -> Option<f64> {
    const PARTS: usize = 64;
    let at = |x: f64| spline.at(x).0;
    let grid = |part: usize| place - slack + 2.0 * slack * part as f64 / PARTS as f64;
    let crossing = |part: usize| {
        let (mut low, mut high) = (grid(part), grid(part + 1));
        let sign = at(low);
        if sign * at(high) > 0.0 {
            return None;
        }
        for _ in 0..50 {
            let middle = 0.5 * (low + high);
            if at(middle) * sign > 0.0 { low = middle } else { high = middle }
        }
        Some(0.5 * (low + high))
    };
    (0..PARTS).filter_map(crossing).min_by(|a, b| (a - place).abs().total_cmp(&(b - place).abs()))
}
