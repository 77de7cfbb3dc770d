//! Start of the motion in a record: the first departure from rest, traced back to its zero crossing.

use std::f64::consts::PI;

use super::continuation::Continuation;

/// Departure from rest, in σ of the noise.
const DEPARTED: f64 = 4.5;
/// Smallest departure, as a fraction of the peak: larger than the rounding of decimals.
const SMALLEST: f64 = 1e-4;
/// A first sample beyond this many σ, and beyond [`MOVING`] of the peak, moves.
const SIGMAS: f64 = 3.0;
const MOVING: f64 = 0.01;
/// A velocity starts with a jump if its first departure exceeds this fraction of the maximum within a period.
const JUMP: f64 = 0.3;
/// Half periods count as motion beyond this many of their own σ.
const HALF_PERIOD: f64 = 3.5;
/// Periods fitted at an edge.
pub(super) const FITTED_PERIODS: f64 = 3.0;

/// Start of the motion; positions in samples, possibly fractional.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) enum Onset {
    Rest(f64),
    /// At the first sample, or less than one sample before it.
    AtFirst(f64),
    Before,
}

#[derive(Debug, Clone, Copy)]
pub(super) struct Search<'a> {
    /// Recorded quantity about its rest.
    pub values: &'a [f64],
    pub sigma: f64,
    /// Drive period, samples.
    pub period: f64,
    /// Whether motion may begin with a jump: of a velocity.
    pub jumps: bool,
}

impl Search<'_> {
    /// Where motion begins.
    ///
    /// 1. departure: the first sample beyond 4.5 σ and 1e-4 of the peak, followed by more of the kind within a period (no spike);
    /// 2. back to the change of sign before it;
    /// 3. back by half periods as long as the part of sin ωt in them exceeds 3.5 of its own σ (of white noise, or as the samples long before
    ///    scatter, which counts hum in): a slow envelope begins in the noise;
    /// 4. the crossing of the lines fitted to three periods from there, within an eighth of a period.
    pub(crate) fn onset(&self) -> Option<Onset> {
        let Self { values, sigma, period, jumps } = *self;
        let peak = values.iter().fold(0.0, |peak, x| f64::max(peak, x.abs()));
        let threshold = f64::max(DEPARTED * sigma, SMALLEST * peak);
        let beyond = |x: &f64| x.abs() > threshold;
        let within = period.ceil() as usize;
        let company = ((period / 8.0) as usize).max(2);
        let departure = (0..values.len()).find(|&i| {
            beyond(&values[i])
                && values[i..values.len().min(i + within)].iter().filter(|x| beyond(x)).count() >= company
        })?;
        let sign = values[departure].signum();
        let farthest = departure.saturating_sub((0.6 * period).ceil() as usize);
        let mut inside = departure;
        let soon =
            values[departure..values.len().min(departure + within)].iter().fold(0.0, |most, x| f64::max(most, x.abs()));
        let jumped = jumps && values[departure].abs() > JUMP * soon;
        while !jumped && inside > farthest && values[inside - 1] * sign > sigma {
            inside -= 1;
        }
        let moving = f64::max(SIGMAS * sigma, MOVING * peak);
        if inside == 0 {
            return Some(self.at_first(moving, peak));
        }
        let (out, first) = (values[inside - 1] * sign, values[inside] * sign);
        let found = match () {
            // A jump lies anywhere between two samples.
            () if jumped => inside as f64 - 0.5,
            () if out <= sigma => inside as f64 - (first / (first - out)).min(1.0),
            () => departure as f64 - (0.25 * period).min(departure as f64),
        };
        let mut place = self.back_by_half_periods(found, peak);
        if !jumps {
            // The sample before may still be at rest, and no part of the lines.
            let first = place.floor() as usize + 1;
            let offset = first as f64 - place;
            let slack = period / 8.0;
            let lines = self.lines(first, offset);
            place += lines.and_then(|lines| lines.zero((offset - 1.05).min(-slack), offset.max(slack))).unwrap_or(0.0);
        }
        Some(if place < 0.5 { Onset::AtFirst(place.max(-1.0)) } else { Onset::Rest(place) })
    }

    /// Motion at the first sample: less than a sample old, or older than the record. A velocity may have jumped there.
    fn at_first(&self, moving: f64, peak: f64) -> Onset {
        let lines = self.lines(0, 0.0);
        let amplitude = lines.as_ref().map_or(peak, Continuation::amplitude).max(moving);
        // By noise the crossing of lines fitted to some periods is off by σ over the slope, less by averaging.
        let slack =
            0.05 + SIGMAS * self.sigma / amplitude * self.period / (2.0 * PI) / (0.25 * self.period).max(1.0).sqrt();
        match lines.and_then(|lines| lines.zero(-1.0 - slack, slack)) {
            Some(place) if !self.jumps => Onset::AtFirst(place),
            _ if self.values[0].abs() <= moving => Onset::AtFirst(0.0),
            // A velocity begins at a crest, as a displacement begins at zero.
            _ if self.jumps && self.begins_at_a_crest() => Onset::AtFirst(-0.5),
            _ => Onset::Before,
        }
    }

    fn begins_at_a_crest(&self) -> bool {
        let slack = 1.0 + 0.02 * self.period;
        self.lines(0, 0.0).is_some_and(|lines| {
            let quarter = 0.25 * self.period;
            lines.zero(quarter - slack, quarter + 0.5 * slack).is_some()
        })
    }

    /// Lines fitted to the periods from sample `first`, which lies `offset` samples inside the edge.
    pub fn lines(&self, first: usize, offset: f64) -> Option<Continuation> {
        let reach = ((FITTED_PERIODS * self.period).ceil() as usize).min(self.values.len().saturating_sub(first));
        Continuation::fit(|i| self.values[first + i], reach, offset, self.period)
    }

    fn back_by_half_periods(&self, mut place: f64, peak: f64) -> f64 {
        let half = 0.5 * self.period;
        if half < 4.0 {
            return place;
        }
        let part = |to: f64| {
            let (from, past) = ((to - half).ceil() as usize, (to.ceil() as usize).min(self.values.len()));
            let sine = |i: usize| libm::sin(2.0 * PI * (i as f64 - to) / self.period);
            let norm: f64 = (from..past).map(|i| sine(i).powi(2)).sum();
            (from..past).map(|i| sine(i) * self.values[i]).sum::<f64>() / norm.max(f64::MIN_POSITIVE)
        };
        let long_before = (0..).map(|k| half * f64::from(k + 1)).take_while(|to| *to < place - 5.0 * half);
        let (sum, count) = long_before.fold((0.0, 0.0), |(sum, count), to| (sum + part(to).powi(2), count + 1.0));
        let seen = if count >= 4.0 { f64::sqrt(sum / count) } else { 0.0 };
        let least = f64::max(HALF_PERIOD * f64::max(self.sigma / (0.5 * half).sqrt(), seen), 2.0 * SMALLEST * peak);
        while place >= half && part(place).abs() > least {
            place -= half;
        }
        place
    }
}
