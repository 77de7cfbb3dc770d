//! Every printed statement held against the runs.
//!
//! A printed velocity **agrees** where it lies within two scatters, the change for 1 % of drive and half its last digit of our mean:
//!
//! ```text
//! |x̄ − x_printed| ≤ 2 s + |S| + ½ digit
//! ```
//!
//! s is the standard deviation of a single run, since the printed number is that of a single run too. A line is present or absent as in
//! [`portrait`](crate::portrait). An extreme over α agrees where it falls on the printed α or one of the paper's
//! steps beside it.

use serde::Serialize;

use super::{
    LAWS, LawOutcome, PaperOutcome, SweepPoint, moment,
    statements::{Claim, PEAK_HALF_DIGIT, STATEMENTS, SWEPT_ALPHAS, Statement, Subject},
};
use crate::{
    portrait::{IMPULSIVE_CREST, Trait},
    published::{KUWABARA_KONO, MEASURED},
};
use granchain_calibration::predict::ensemble::Spread;
use granchain_signal::feature::Ratio;

/// What came of a statement.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize)]
#[serde(rename_all = "kebab-case")]
pub enum Verdict {
    Agrees,
    Differs,
    /// It was not held against anything.
    NotTested,
}

/// Whether a statement chose the default readings, and is therefore met without proving anything.
#[must_use]
pub fn chose_the_readings(statement: &Statement) -> bool {
    let is_peak = matches!(statement.claim, Claim::PositivePeak(_) | Claim::NegativePeak(_));
    is_peak && matches!(statement.subject, Subject::Linear | Subject::KuwabaraKono)
}

#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Judgement {
    pub statement: Statement,
    /// Of our runs, where the statement is a number.
    pub ours: Option<Spread>,
    /// What was found, in words with units; why, where it was not tested.
    pub found: String,
    /// How far ours may be off to agree, same unit as the number.
    pub allowance: Option<f64>,
    pub verdict: Verdict,
}

/// All of [`STATEMENTS`] in their order.
#[must_use]
pub fn judge(outcome: &PaperOutcome) -> Vec<Judgement> {
    STATEMENTS.iter().map(|statement| one(statement, outcome)).collect()
}

/// Which of our laws stands for a subject: the measurement is compared with the law the paper finds closer to it.
fn law_of(subject: Subject) -> usize {
    usize::from(subject == Subject::KuwabaraKono)
}

fn one(statement: &Statement, outcome: &PaperOutcome) -> Judgement {
    let index = law_of(statement.subject);
    let Some((law, sweep)) = outcome.laws.get(index).zip(outcome.sweeps.get(index)) else {
        return judged(statement, "no run of this law", Verdict::NotTested);
    };
    match statement.claim {
        Claim::PositivePeak(value) => number(statement, law.spread(Trait::PositivePeak), value),
        Claim::NegativePeak(value) => number(statement, law.spread(Trait::NegativePeak), value),
        Claim::Present(lines) => {
            let agrees = lines.iter().all(|line| *line == Ratio::ONE || law.moments.has_line(*line));
            judged(statement, levels(law, lines), Verdict::of(agrees))
        }
        Claim::Absent(lines) => {
            let agrees = !lines.iter().any(|line| law.moments.has_line(*line));
            judged(statement, levels(law, lines), Verdict::of(agrees))
        }
        Claim::Impulses => {
            let crest = moment(&law.moments, Trait::Crest);
            let found = format!(
                "crest factor {:.2} ± {:.2}, at least {IMPULSIVE_CREST:.2} asked for",
                crest.mean, crest.deviation
            );
            judged(statement, found, Verdict::of(law.moments.is_impulsive()))
        }
        Claim::ContentUpTo(frequency) => {
            let band = moment(&law.moments, Trait::Bandwidth);
            let found = format!(
                "{:.0} ± {:.0} kHz at −20 dB; the printed level is unknown",
                1e-3 * band.mean,
                1e-3 * band.deviation
            );
            judged(statement, found, Verdict::of(band.mean >= frequency))
        }
        Claim::RatioLargestAt(line, alpha) => extreme(statement, sweep, alpha, "ratio", |point| {
            point.moments.get(Trait::Level(line)).map(|own| (own.mean, own.deviation))
        }),
        Claim::PeakClosestAt(alpha) => extreme(statement, sweep, alpha, "distance", |point| {
            let peak = point.moments.get(Trait::PositivePeak)?;
            Some((-1e3 * (peak.mean - MEASURED.positive_m_per_s).abs(), 1e3 * peak.deviation))
        }),
        Claim::LessSymmetricThanMeasured => {
            let (up, down) = (moment(&law.moments, Trait::PositivePeak), moment(&law.moments, Trait::NegativePeak));
            let share = -down.mean / up.mean;
            let [measured, printed] =
                [MEASURED, KUWABARA_KONO].map(|peaks| -peaks.negative_m_per_s / peaks.positive_m_per_s);
            let found = format!("share {share:.2}; printed {printed:.2}, measured {measured:.2}");
            // Much smaller: closer to what the paper's own run has than to the measurement.
            judged(statement, found, Verdict::of((share - printed).abs() < (share - measured).abs()))
        }
        Claim::CloserThanOtherLaw => {
            let distance = |index: usize| {
                let law = outcome.laws.get(index)?;
                let (up, down) = (law.spread(Trait::PositivePeak)?, law.spread(Trait::NegativePeak)?);
                Some((up.mean - MEASURED.positive_m_per_s).hypot(down.mean - MEASURED.negative_m_per_s))
            };
            let (Some(own), Some(other)) = (distance(index), distance(1 - index)) else {
                return judged(statement, "no peaks of both laws", Verdict::NotTested);
            };
            let found = format!(
                "both peaks off by {:.0} mm/s (root of squares) with {} dampers, by {:.0} mm/s with {} dampers",
                1e3 * own,
                LAWS[index].name,
                1e3 * other,
                LAWS[1 - index].name
            );
            judged(statement, found, Verdict::of(own < other))
        }
        Claim::NotTested(why) => judged(statement, why, Verdict::NotTested),
    }
}

impl Verdict {
    fn of(agrees: bool) -> Self {
        if agrees { Self::Agrees } else { Self::Differs }
    }
}

fn judged(statement: &Statement, found: impl Into<String>, verdict: Verdict) -> Judgement {
    Judgement { statement: *statement, ours: None, found: found.into(), allowance: None, verdict }
}

fn number(statement: &Statement, ours: Option<Spread>, printed: f64) -> Judgement {
    let Some(spread) = ours else { return judged(statement, "could not be measured in every run", Verdict::NotTested) };
    let allowance = allowance(&spread);
    let difference = spread.mean - printed;
    Judgement {
        statement: *statement,
        ours: Some(spread),
        found: format!("{} mm/s off, {:.0} mm/s allowed", signed(1e3 * difference, 0), 1e3 * allowance),
        allowance: Some(allowance),
        verdict: Verdict::of(difference.abs() <= allowance),
    }
}

/// How far a printed velocity may lie from our mean and agree, m/s.
#[must_use]
pub fn allowance(spread: &Spread) -> f64 {
    2.0 * spread.scatter + spread.sensitivity.abs() + PEAK_HALF_DIGIT
}

/// With its sign, a true minus.
fn signed(value: f64, digits: usize) -> String {
    format!("{value:+.digits$}").replace('-', "−")
}

/// Level and prominence of lines, for people.
fn levels(law: &LawOutcome, lines: &[Ratio]) -> String {
    let said = lines.iter().map(|line| {
        if *line == Ratio::ONE {
            let sensitivity = law.spread(Trait::DriveLine).map_or(0.0, |spread| spread.sensitivity);
            let drive = moment(&law.moments, Trait::DriveLine);
            let (mean, scatter) = (1e3 * drive.mean, 1e3 * drive.deviation);
            return format!("{mean:.1} ± {scatter:.1} mm/s, {} per +1 % drive", signed(1e3 * sensitivity, 1));
        }
        let sensitivity = law.spread(Trait::Level(*line)).map_or(0.0, |spread| spread.sensitivity);
        let level = moment(&law.moments, Trait::Level(*line));
        let prominence = moment(&law.moments, Trait::Prominence(*line)).mean;
        format!(
            "{line}: {:.3} ± {:.3} of f0, {} per +1 % drive, {prominence:.1} × floor",
            level.mean,
            level.deviation,
            signed(sensitivity, 3)
        )
    });
    said.collect::<Vec<_>>().join("; ")
}

/// Where over α `of` (value, scatter) is largest, against the printed α.
fn extreme(
    statement: &Statement,
    sweep: &[SweepPoint],
    alpha: f64,
    name: &str,
    of: impl Fn(&SweepPoint) -> Option<(f64, f64)>,
) -> Judgement {
    let points: Vec<(f64, f64, f64)> =
        sweep.iter().filter_map(|point| of(point).map(|(value, scatter)| (point.alpha, value, scatter))).collect();
    let best = points.iter().copied().max_by(|a, b| a.1.total_cmp(&b.1));
    let nearest = points.iter().copied().min_by(|a, b| (a.0 - alpha).abs().total_cmp(&(b.0 - alpha).abs()));
    let (Some(best), Some(own)) = (best, nearest) else {
        return judged(statement, "the sweep has no such number", Verdict::NotTested);
    };
    let (_, _, step) = SWEPT_ALPHAS;
    let rank = 1 + points.iter().filter(|point| point.1 > own.1).count();
    let said = |(_, value, scatter): (f64, f64, f64)| match name {
        "ratio" => format!("{value:.2} ± {scatter:.2}"),
        _ => format!("{:.0} ± {scatter:.0} mm/s", -value),
    };
    let found = if best.0 == own.0 {
        format!("best at α = {} of {} ({name} {})", best.0, points.len(), said(best))
    } else {
        format!(
            "best at α = {} ({name} {}); at α = {} {}, rank {rank} of {}",
            best.0,
            said(best),
            own.0,
            said(own),
            points.len()
        )
    };
    judged(statement, found, Verdict::of((best.0 - alpha).abs() <= step * (1.0 + 1e-9)))
}
