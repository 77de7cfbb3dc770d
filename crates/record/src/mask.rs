//! Samples that show no motion: signal drop-outs of a vibrometer, spikes, and trigger spikes before the motion.
//!
//! Motion of a driven chain has almost no content above twelve times the drive frequency, whereas a failing instrument
//! jumps from one sample to the next. So the content above that band is compared with its typical value at the
//! record's own impulses. An excess is masked if a short stretch explains all of it: a few samples (a spike), or
//! neighbouring samples at one level (a drop-out). Impulses are not masked: they repeat, and no stretch that short
//! explains them.

mod search;

use std::{ops::Range, str::FromStr};

use serde::Serialize;

use granchain_signal::{Dimension, Gap, Quantity, QuantityError, Series, bridge};

use self::search::find;
use super::RecordKind;

#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Serialize)]
#[serde(rename_all = "kebab-case")]
pub enum MaskReason {
    /// Drop-out: the signal stays at one level, with a jump at either end.
    SignalLost,
    /// A few samples that no motion can reach.
    Spike,
    /// A spike before the motion, caused by the trigger.
    TriggerSpike,
    Stated,
}

impl MaskReason {
    /// Singular and plural in messages.
    #[must_use]
    pub fn words(self) -> [&'static str; 2] {
        match self {
            Self::SignalLost => ["drop-out", "drop-outs"],
            Self::Spike => ["spike", "spikes"],
            Self::TriggerSpike => ["spike before the motion begins", "spikes before the motion begins"],
            Self::Stated => ["stretch as stated", "stretches as stated"],
        }
    }
}

#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct Masked {
    /// Position on the clock of the record's series.
    #[serde(flatten)]
    pub gap: Gap,
    pub samples: usize,
    pub reason: MaskReason,
}

#[derive(Debug, Clone, PartialEq, Default, Serialize)]
#[serde(rename_all = "kebab-case")]
pub enum Masking {
    #[default]
    Auto,
    None,
    /// Exactly these stretches, s on the file's own time axis.
    Stretches(Vec<[f64; 2]>),
}

/// Why a mask cannot be used.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum MaskError {
    #[error(
        "expected `auto`, `none` or stretches of the file\'s time axis such as `12.1us:13.4us,50us:51us`, found `{found}`"
    )]
    Form { found: String },
    #[error(transparent)]
    Time(#[from] QuantityError),
}

impl FromStr for Masking {
    type Err = MaskError;

    fn from_str(text: &str) -> Result<Self, MaskError> {
        let form = || MaskError::Form { found: text.into() };
        let stretch = |part: &str| {
            let (from, to) = part.split_once(':').ok_or_else(form)?;
            let [from, to] = [from, to].map(|instant| Quantity::parse_as(instant.trim(), Dimension::TIME));
            let [from, to] = [from?, to?];
            if from < to { Ok([from, to]) } else { Err(form()) }
        };
        match text.trim() {
            "auto" => Ok(Self::Auto),
            "none" => Ok(Self::None),
            text => Ok(Self::Stretches(text.split(',').map(stretch).collect::<Result<_, _>>()?)),
        }
    }
}

/// Most stretches listed with their instants.
const LISTED: usize = 12;

/// Description of the masked samples: number of each kind, and where.
#[must_use]
pub(super) fn in_words(masked: &[Masked]) -> String {
    let mut kinds: Vec<MaskReason> = masked.iter().map(|masked| masked.reason).collect();
    kinds.sort_unstable();
    kinds.dedup();
    let counted = |kind: &MaskReason| {
        let count = masked.iter().filter(|masked| masked.reason == *kind).count();
        format!("{count} {}", kind.words()[usize::from(count > 1)])
    };
    let kinds: Vec<String> = kinds.iter().map(counted).collect();
    let instant = |t: f64| if t.is_finite() { format!("{:.2}", 1e6 * t) } else { "the end".into() };
    let place = |Masked { gap, .. }: &Masked| match (gap.from.is_finite(), gap.to.is_finite()) {
        (false, _) => format!("up to {}", instant(gap.to)),
        _ => format!("{}–{}", instant(gap.from), instant(gap.to)),
    };
    let mut places: Vec<String> = masked.iter().take(LISTED).map(place).collect();
    if masked.len() > LISTED {
        places.push("…".into());
    }
    format!("{} at {} µs", kinds.join(" and "), places.join(", "))
}

/// Largest share of the samples that may be masked.
pub(super) const MOST: f64 = 0.1;

/// Stretches that the user states.
pub(super) fn stated(series: &Series, stretches: &[[f64; 2]]) -> Vec<(Range<usize>, MaskReason)> {
    let inside = |[from, to]: &[f64; 2]| {
        let index = |t: f64| (((t - series.start) / series.step).max(0.0)) as usize;
        let (first, past) = ((index(*from - 1e-6 * series.step) + 1).min(series.len()), index(*to).min(series.len()));
        let first = if *from <= series.start { 0 } else { first };
        let past = if *to >= series.end() { series.len() } else { past + 1 };
        (first < past).then_some((first..past.min(series.len()), MaskReason::Stated))
    };
    stretches.iter().filter_map(inside).collect()
}

/// The gap around some samples of a series.
fn gap_of(series: &Series, samples: &Range<usize>) -> Gap {
    let length = samples.len() as f64 * series.step;
    Gap {
        from: if samples.start == 0 { f64::NEG_INFINITY } else { series.time(samples.start - 1) },
        to: if samples.end >= series.len() { f64::INFINITY } else { series.time(samples.end) },
        support: f64::max(series.step, 0.25 * length),
    }
}

/// Stretches of a record of that kind to be masked; `line` is its drive frequency or strongest line, Hz.
pub(super) fn found(
    masking: &Masking,
    (series, kind): (&Series, RecordKind),
    line: impl FnOnce() -> Option<f64>,
) -> Vec<(Range<usize>, MaskReason)> {
    match masking {
        Masking::Auto if kind != RecordKind::Hydrophone => {
            line().map_or_else(Vec::new, |frequency| find(series, frequency, kind == RecordKind::HornTip))
        }
        Masking::Stretches(stretches) => stated(series, stretches),
        _ => Vec::new(),
    }
}

/// The same on the clock of the series.
pub(super) fn placed(series: &Series, found: &[(Range<usize>, MaskReason)]) -> Vec<Masked> {
    let place = |(samples, reason): &(Range<usize>, MaskReason)| Masked {
        gap: gap_of(series, samples),
        samples: samples.len(),
        reason: *reason,
    };
    found.iter().map(place).collect()
}

/// Bridge the samples that are masked.
pub(super) fn apply(series: &mut Series, found: &[(Range<usize>, MaskReason)]) -> Vec<Masked> {
    let masked = placed(series, found);
    bridge(series, &masked.iter().map(|masked| masked.gap).collect::<Vec<_>>());
    masked
}

#[cfg(test)]
mod tests;
