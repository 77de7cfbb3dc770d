//! Summary over all synthetic records: coverage, false alarms and widths by condition, law, support and regime; wrong records found and named.

use std::collections::BTreeMap;

use serde::{Deserialize, Serialize};

use super::{Condition, LaboratoryFit, LaboratoryRecord, Regime};
use granchain_calibration::{
    agreement::{DOUBTFUL, OUTSIDE},
    diagnosis::{Cause, Finding},
    fit::{Estimate, Verdict},
};
use granchain_signal::median;

const LEVEL: f64 = 0.9;

/// One parameter of a group of synthetic records.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct ParameterCount {
    pub name: String,
    /// Intervals that hold the truth, whatever the verdict: none may hide a miss behind `outside scatter`.
    pub held: usize,
    pub count: usize,
    /// Of the intervals that were given out: those that hold it.
    pub quoted_held: usize,
    /// Intervals that were given out.
    pub quoted: usize,
    /// Binomial standard error of the share held, √(p(1 − p)/n) at p = 0.9.
    pub binomial_error: f64,
    /// Median ln(high/low).
    pub median_width: f64,
    /// Median |ln(median/truth)|.
    pub median_error: f64,
    /// Median ln(median/truth): what does not average out.
    pub median_bias: f64,
}

/// A group of right synthetic records.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Tally {
    /// What they have in common.
    pub group: String,
    #[serde(rename = "twins")]
    pub synthetics: usize,
    pub parameters: Vec<ParameterCount>,
    pub within: usize,
    pub doubtful: usize,
    /// Ended `outside scatter`: false alarms.
    pub outside: usize,
    pub not_converged: usize,
    /// Refused by the reader or the fit.
    pub refused: usize,
    /// Fits with p below 0.01.
    pub below_one_percent: usize,
    /// Fits with p below 0.05.
    pub below_five_percent: usize,
    /// Binomial standard errors of the shares of both, √(p(1 − p)/n) at 0.01 and 0.05.
    pub p_errors: [f64; 2],
}

/// The synthetic records of a wrong condition.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct WrongTally {
    pub group: String,
    #[serde(rename = "twins")]
    pub synthetics: usize,
    /// Those that did not end `within scatter`, refusals among them.
    pub unmasked: usize,
    /// Those whose diagnosis has the cause among its three, or whose refusal names it.
    pub named: usize,
    /// Those with a warning beside the verdict that names it, whatever the verdict.
    pub warned: usize,
    /// Refused by the reader or the fit.
    pub refused: usize,
}

/// Summary over all synthetic records.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct LaboratoryCount {
    pub conditions: Vec<Tally>,
    pub laws: Vec<Tally>,
    pub supports: Vec<Tally>,
    /// By how the truth moves.
    pub regimes: Vec<Tally>,
    pub all: Option<Tally>,
    /// Wrong synthetic records by condition, then all.
    pub wrong: Vec<WrongTally>,
}

impl LaboratoryCount {
    #[must_use]
    pub fn of(synthetics: &[LaboratoryRecord]) -> Self {
        let (wrong, right): (Vec<_>, Vec<_>) =
            synthetics.iter().partition(|synthetic| synthetic.setting.condition.expected().is_some());
        let all: Vec<(String, Vec<&LaboratoryRecord>)> =
            if right.is_empty() { Vec::new() } else { vec![("all".into(), right.clone())] };
        let tallies = |groups: Vec<(String, Vec<&LaboratoryRecord>)>| -> Vec<Tally> {
            groups.into_iter().map(|(group, synthetics)| Tally::of(group, &synthetics)).collect()
        };
        let condition = |synthetic: &LaboratoryRecord| synthetic.setting.condition;
        let named = |groups: Vec<(Condition, Vec<_>)>| {
            groups
                .into_iter()
                .map(|(condition, synthetics)| (condition.name().to_owned(), synthetics))
                .collect::<Vec<_>>()
        };
        let mut of_wrong: Vec<WrongTally> = named(grouped(&wrong, condition))
            .into_iter()
            .map(|(group, synthetics)| WrongTally::of(group, &synthetics))
            .collect();
        if of_wrong.len() > 1 {
            of_wrong.push(WrongTally::of("all".into(), &wrong));
        }
        let regime = |synthetic: &LaboratoryRecord| synthetic.regime.map_or("none", Regime::name).to_owned();
        Self {
            conditions: tallies(named(grouped(&right, condition))),
            laws: tallies(grouped(&right, |synthetic| synthetic.setting.damping_kind.clone())),
            supports: tallies(grouped(&right, |synthetic| synthetic.setting.support.clone())),
            regimes: tallies(grouped(&right, regime)),
            all: tallies(all).pop(),
            wrong: of_wrong,
        }
    }
}

fn grouped<'a, K: Ord>(
    synthetics: &[&'a LaboratoryRecord],
    key: impl Fn(&LaboratoryRecord) -> K,
) -> Vec<(K, Vec<&'a LaboratoryRecord>)> {
    let mut groups: BTreeMap<K, Vec<&LaboratoryRecord>> = BTreeMap::new();
    for synthetic in synthetics {
        groups.entry(key(synthetic)).or_default().push(synthetic);
    }
    groups.into_iter().collect()
}

fn binomial(p: f64, count: usize) -> f64 {
    (p * (1.0 - p) / count.max(1) as f64).sqrt()
}

impl Tally {
    fn of(group: String, synthetics: &[&LaboratoryRecord]) -> Self {
        let fits: Vec<(&LaboratoryRecord, &LaboratoryFit)> =
            synthetics.iter().filter_map(|synthetic| Some((*synthetic, synthetic.fit.as_ref().ok()?))).collect();
        let ended = |verdict| fits.iter().filter(|(_, fit)| fit.verdict == verdict).count();
        let below = |p: f64| fits.iter().filter(|(_, fit)| fit.p_value < p).count();
        let names = fits.first().map_or(0, |(_, fit)| fit.estimates.len());
        let parameter = |d: usize| {
            let of = |(synthetic, fit): &(&LaboratoryRecord, &LaboratoryFit)| {
                Some((*synthetic.setting.values.get(d)?, fit.estimates.get(d)?.clone(), fit.quoted))
            };
            let intervals: Vec<(f64, Estimate, bool)> = fits.iter().filter_map(of).collect();
            let holds = |(truth, estimate, _): &&(f64, Estimate, bool)| (estimate.low..=estimate.high).contains(truth);
            let quoted = || intervals.iter().filter(|(.., quoted)| *quoted);
            let error = |(truth, estimate, _): &(f64, Estimate, bool)| (estimate.median / truth).ln();
            ParameterCount {
                name: intervals.first().map(|(_, estimate, _)| estimate.name.clone()).unwrap_or_default(),
                held: intervals.iter().filter(holds).count(),
                count: intervals.len(),
                quoted_held: quoted().filter(holds).count(),
                quoted: quoted().count(),
                binomial_error: binomial(LEVEL, intervals.len()),
                median_width: median(intervals.iter().map(|(_, estimate, _)| (estimate.high / estimate.low).ln())),
                median_error: median(intervals.iter().map(|it| error(it).abs())),
                median_bias: median(intervals.iter().map(error)),
            }
        };
        Self {
            group,
            synthetics: synthetics.len(),
            parameters: (0..names).map(parameter).collect(),
            within: ended(Verdict::WithinScatter),
            doubtful: ended(Verdict::Doubtful),
            outside: ended(Verdict::OutsideScatter),
            not_converged: ended(Verdict::NotConverged),
            refused: synthetics.len() - fits.len(),
            below_one_percent: below(OUTSIDE),
            below_five_percent: below(DOUBTFUL),
            p_errors: [OUTSIDE, DOUBTFUL].map(|p| binomial(p, fits.len())),
        }
    }
}

impl LaboratoryRecord {
    /// Whether something was amiss to a user: any end but `within scatter`.
    #[must_use]
    pub fn unmasked(&self) -> bool {
        self.fit.as_ref().map_or(true, |fit| fit.verdict != Verdict::WithinScatter)
    }

    /// Whether the diagnosis has the true cause among its three, or the refusal names it.
    #[must_use]
    pub fn named(&self) -> bool {
        let Some(expected) = self.setting.condition.expected() else { return false };
        let holds = |finding: &Finding| match expected.cause {
            Cause::Record => finding.cause == Cause::Record && holds_word(&finding.text, expected.words),
            cause => finding.cause == cause,
        };
        match &self.fit {
            Ok(fit) => fit.diagnosis.iter().any(holds),
            Err(refusal) => holds_word(refusal, expected.words),
        }
    }

    /// Whether a warning beside the verdict names it.
    #[must_use]
    pub fn warned(&self) -> bool {
        let words = self.setting.condition.expected().map_or(&[][..], |expected| expected.words);
        self.fit.as_ref().is_ok_and(|fit| fit.warnings.iter().any(|text| holds_word(text, words)))
    }
}

/// Whether a text holds one of the words; the names of the files are not looked at.
fn holds_word(text: &str, words: &[&str]) -> bool {
    let text = text.to_lowercase().replace("horn_tip.csv", "").replace("vib.csv", "");
    words.iter().any(|word| text.contains(word))
}

impl WrongTally {
    fn of(group: String, synthetics: &[&LaboratoryRecord]) -> Self {
        let count = |is: fn(&LaboratoryRecord) -> bool| synthetics.iter().filter(|synthetic| is(synthetic)).count();
        Self {
            group,
            synthetics: synthetics.len(),
            unmasked: count(LaboratoryRecord::unmasked),
            named: count(LaboratoryRecord::named),
            warned: count(LaboratoryRecord::warned),
            refused: count(|synthetic| synthetic.fit.is_err()),
        }
    }
}
