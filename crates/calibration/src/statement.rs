//! Statements about a fit: which parameters the record cannot separate, and which further record would.

use super::{
    agreement,
    comparison::Comparison,
    fingerprints::CandidateRuns,
    fit::{Estimate, Fit, Verdict},
    forward::Run,
    likelihood::neighbours,
    multi_record::Share,
    outcome::FitOutcome,
    parameter::Parameter,
    waveform::WaveformFit,
};
use granchain_model::scene::Scene;
use granchain_signal::number::engineering;

/// |correlation| from which two parameters are called strongly correlated.
const RIDGE: f64 = 0.7;

/// Width in ln from which a parameter is called poorly determined.
const WIDE: f64 = 0.5;

/// Difference of ln evidence from which a damping law is preferred.
const DECISIVE: f64 = 5.0;

/// Statements that a reader needs before using the values.
pub(crate) fn statements(fit: &Fit) -> Vec<String> {
    let mut sentences: Vec<String> = fit.waveform.iter().map(waveform).collect();
    match fit.verdict {
        Verdict::OutsideScatter => sentences.push(format!(
            "The model does not explain the data: {} The values are those of the most similar response, no interval is quoted.",
            standing(fit)
        )),
        Verdict::NotConverged if fit.waveform.as_ref().is_some_and(WaveformFit::decides) => {
            sentences.push("The values fitted to the waveform were still changing after the last round of runs: another --seed may settle it.".into());
        }
        Verdict::NotConverged => sentences.push(format!(
            "The estimates were still changing: the last batch of runs shifted a median by {:.1} half-widths of its interval. Raise \
             --evaluations.",
            fit.drift
        )),
        Verdict::Doubtful => {
            if fit.agreement.p < agreement::DOUBTFUL {
                sentences.push(format!("The result is doubtful: {}", standing(fit)));
            }
            let unusual = fit.estimates.iter().zip(&fit.parameters).filter(|(it, parameter)| parameter.is_unusual(it.value));
            sentences.extend(unusual.map(|(estimate, _)| {
                format!(
                    "{} = {} lies far outside what such benches have: check unit and sensitivity of both records (α of a recorded horn is 1 where both \
                     are right).",
                    estimate.name,
                    short(estimate.value)
                )
            }));
        }
        Verdict::WithinScatter => {}
    }
    sentences.extend(lost(fit));
    if fit.verdict == Verdict::OutsideScatter {
        return sentences;
    }
    let names: Vec<&str> = fit.parameters.iter().map(|parameter| parameter.name.as_str()).collect();
    if fit.lobes.len() > 1 {
        let shares: Vec<String> = fit.lobes.iter().map(|lobe| format!("{:.0} %", 100.0 * lobe.mass)).collect();
        sentences.push(format!(
            "{} separate regions explain the data (with {} of the probability): the most probable one need not contain the true values. A \
             record at another drive level decides between them.",
            fit.lobes.len(),
            shares.join(", ")
        ));
    }
    let on_ridge = names.len() > 1 && fit.correlation.abs() >= RIDGE;
    if on_ridge {
        let widths: Vec<String> = fit.estimates.iter().map(|e| percent(e.low, e.high)).collect();
        sentences.push(format!(
            "{} and {} trade off along a ridge (correlation {:+.2}): these data hold their combination better than either of \
             them ({} and {} wide). {}, or a second chain length, would separate them.",
            names[0],
            names[1],
            fit.correlation,
            widths[0],
            widths[1],
            if fit.shares.is_empty() { "Several drive levels fitted together" } else { "A further, lower drive level" }
        ));
    }
    sentences.extend(further_ridges(fit));
    let unidentified: Vec<(&Estimate, &Parameter)> =
        fit.estimates.iter().zip(&fit.parameters).filter(|(estimate, _)| estimate.unidentified).collect();
    if unidentified.len() > 1 && unidentified.len() == fit.parameters.len() {
        sentences.push(
            "These data hold none of the parameters that were to be fitted: fewer of them, or more records together."
                .into(),
        );
    }
    for (estimate, parameter) in &unidentified {
        sentences.push(format!(
            "{} is unidentified: its interval ({} to {}{}) is hardly narrower than the range that was searched. {}",
            estimate.name,
            short(estimate.low),
            short(estimate.high),
            if estimate.unit == "1" { String::new() } else { format!(" {}", estimate.unit) },
            parameter.remedy()
        ));
    }
    for estimate in fit.estimates.iter().filter(|estimate| !estimate.unidentified) {
        if estimate.at_bound {
            sentences.push(format!(
                "{} touches a bound of its search: its interval is cut off there. Widen it with --bounds {}=LOW:HIGH.",
                estimate.name, estimate.name
            ));
        } else if !on_ridge && (estimate.high / estimate.low).ln() > WIDE {
            sentences.push(format!(
                "{} is poorly determined ({} wide): in a chaotic regime a single record says little. A record at a lower drive \
                 level, where the response is regular, would narrow it.",
                estimate.name,
                percent(estimate.low, estimate.high)
            ));
        }
    }
    if sentences.len() == usize::from(fit.waveform.is_some()) && names.len() > 1 {
        sentences.push(format!(
            "{} and {} are separated by these data (correlation {:+.2}).",
            names[0], names[1], fit.correlation
        ));
    }
    sentences
}

/// Statements on what leaks of the drive into the records (`labels`).
pub(crate) fn crosstalk(fit: &Fit, labels: &[String]) -> Vec<String> {
    let found = |number| fit.waveform.as_ref()?.crosstalk(number);
    let each = labels.iter().enumerate().filter_map(|(number, label)| Some((found(number)?, label)));
    each.map(|(found, label)| {
        let [share, deviation] = found.map(|share| 100.0 * share);
        format!(
            "Of the drive {share:.1} ± {deviation:.1} % of the peak leaks into the signal of {label}, from the beginning of the drive on. The fit takes it into account; separate the cables."
        )
    })
    .collect()
}

/// Statements on records (`labels`) whose clock is not the horn's.
pub(crate) fn other_clock(fit: &Fit, labels: &[String]) -> Vec<String> {
    let seen = |number| fit.waveform.as_ref()?.other_clock(number);
    let each = labels.iter().enumerate().filter_map(|(number, label)| Some((seen(number)?, label)));
    each.map(|(seen, label)| {
        format!(
            "The clock of {label} seems {:.3} ± {:.3} % {} against the horn's, more than two instruments differ by: check the sample rates and time \
             columns of both files. The values may be off by more than their intervals.",
            100.0 * seen.late.abs(),
            100.0 * seen.deviation,
            seen.direction()
        )
    })
    .collect()
}

/// A p-value as text.
pub(crate) fn p_value(p: f64) -> String {
    match p {
        p if p < 1e-3 => "below 0.001".into(),
        p if p < 1e-2 => format!("{p:.3}"),
        p => format!("{p:.2}"),
    }
}

/// Statement on the waveform comparison, and whether it decided.
fn waveform(waveform: &WaveformFit) -> String {
    let WaveformFit { cycles, reduced, p, .. } = waveform;
    let p = p_value(*p);
    if !waveform.decides() {
        let part = match periods(*cycles) {
            none if *cycles < 0.5 => format!("Not even the first {none} after the onset can be predicted; there"),
            part => format!("Only the first {part} after the onset can be predicted; after that"),
        };
        return format!(
            "{part}, runs with slightly different gaps and noise diverge. Therefore the features were fitted, not the waveform. The p of the waveform in \
             this part is {p}. The p of the verdict is the smaller of ten times this and the p of the features."
        );
    }
    let times = if *reduced < 10.0 { format!("{reduced:.2}") } else { format!("{reduced:.0}") };
    let how_far = if waveform.whole {
        "to its end".into()
    } else {
        format!("over {} after the onset; after that the runs diverge", periods(*cycles))
    };
    let verdict = match waveform.left_out {
        0 => "The p of the verdict is 2 × the smaller of this p and the p of the features, at most 1.".into(),
        samples => format!(
            "It is the p of the verdict: {samples} samples in and around drop-outs are left out, and the features include interpolated samples there."
        ),
    };
    format!(
        "The waveform was fitted, sample by sample, {how_far}. The mean square residual is {times} times the value expected from noise and unknown \
         gaps. The p of the waveform is {p}. {verdict}"
    )
}

fn periods(cycles: f64) -> String {
    if cycles < 1.5 { "drive period".into() } else { format!("{cycles:.0} drive periods") }
}

fn standing(fit: &Fit) -> String {
    let p = fit.agreement.p;
    let share = if p < 1e-3 { "below 0.1 %".into() } else { format!("{:.1} %", 100.0 * p) };
    format!(
        "p, the share of simulated records that fit as badly as this one or worse, is {share} (below 5 % doubtful, below 1 % rejected)."
    )
}

/// Meaning of α with a recorded drive.
pub(crate) fn recorded_drive(fit: &Fit) -> Option<String> {
    let alpha = fit.estimates.iter().find(|estimate| estimate.name == "alpha");
    let alpha = alpha.filter(|_| fit.verdict != Verdict::OutsideScatter)?;
    let meaning = "alpha is the drive at the first bead divided by the true motion of the horn: 1 if the sensitivities of both records are right and the horn's \
                   face moves as its recorded point. The record gives alpha × horn scale; the interval includes the uncertainty of the horn scale.";
    let checks = " Since alpha is not 1, three checks tell why: point the vibrometer at the horn's face beside the first bead (a motion that differs from the recorded \
                  point's is alpha itself); glue a bead to the horn and record it (what is left are the sensitivities); fit a second drive level (a coupling that \
                  gives way changes alpha with the level, a sensitivity does not).";
    Some([meaning, if (alpha.low..=alpha.high).contains(&1.0) { "" } else { checks }].concat())
}

/// Meaning of α without a horn record.
pub(crate) fn assumed_drive(fit: &Fit, scene: &Scene) -> Option<String> {
    let fitted = fit.parameters.iter().any(|it| it.name == "alpha");
    fitted.then(|| {
        format!(
            "No horn record: alpha is relative to the scene's own drive of {} at {}, which may not be that of the experiment. Name the horn's record \
             with --drive.",
            engineering(scene.drive.amplitude, "m", 3),
            engineering(scene.drive.frequency, "Hz", 4)
        )
    })
}

/// Statement on a search of a wider range and its result.
pub(crate) fn widened(fit: &Fit, runs: &CandidateRuns) -> Option<String> {
    let bounds =
        |parameter: &Parameter| format!("{} {} to {}", parameter.name, short(parameter.low), short(parameter.high));
    let bounds = || fit.parameters.iter().map(bounds).collect::<Vec<_>>().join(", ");
    if !runs.wide.is_empty() {
        return Some("A search range four times wider on every side that you did not set was tried too; no better fit was found.".into());
    }
    (!runs.narrow.is_empty())
        .then(|| format!("The best fit lay outside the first search range, so a wider one was searched: {}.", bounds()))
}

/// Strong correlations of pairs other than the first two.
fn further_ridges(fit: &Fit) -> Vec<String> {
    let count = fit.parameters.len();
    let pairs = (0..count).flat_map(|a| (a + 1..count).map(move |b| (a, b))).filter(|pair| *pair != (0, 1));
    let on_ridge = pairs.map(|(a, b)| (a, b, fit.posterior.correlation(a, b))).filter(|(.., it)| it.abs() >= RIDGE);
    on_ridge
        .map(|(a, b, correlation)| {
            format!(
                "{} and {} trade off along a ridge (correlation {correlation:+.2}). {}",
                fit.parameters[a].name,
                fit.parameters[b].name,
                fit.parameters[b].remedy()
            )
        })
        .collect()
}

/// Further statements on several records fitted together: which of them is not explained, and how much narrower the
/// joint intervals are. `labels` are the labels of the records.
pub(crate) fn together(fit: &Fit, labels: &[String]) -> Vec<String> {
    let shares = || labels.iter().zip(&fit.shares);
    if fit.verdict == Verdict::OutsideScatter {
        let outside = |share: &Share| share.p < agreement::OUTSIDE;
        let (missed, held): (Vec<_>, Vec<_>) = shares().partition(|(_, share)| outside(share));
        if missed.is_empty() || held.is_empty() {
            return vec![];
        }
        let names = |records: Vec<(&String, &Share)>| {
            records.into_iter().map(|(label, _)| label.as_str()).collect::<Vec<_>>().join(", ")
        };
        return vec![format!(
            "At the values fitted to all records {} would be explained, {} not: look at what differs between them on the bench, or fit them by themselves.",
            names(held),
            names(missed)
        )];
    }
    let width = |estimate: &Estimate| (estimate.high / estimate.low).ln();
    let narrowed = |(d, together): (usize, &Estimate)| {
        let alone = |(label, share): (&String, &Share)| Some((width(share.estimates.get(d)?), label.clone()));
        let mut alone: Vec<(f64, String)> = shares().filter_map(alone).collect();
        alone.sort_by(|a, b| a.0.total_cmp(&b.0));
        let (best, label) = alone.first()?;
        let all: Vec<String> = alone.iter().map(|(_, label)| label.clone()).collect();
        Some(format!(
            "{}: 90 % interval {} wide from all records together; from {label} alone, the narrowest of {}, {}.",
            together.name,
            percent_of_width(width(together)),
            all.len(),
            percent_of_width(*best)
        ))
    };
    let mut sentences: Vec<String> =
        if fit.shares.is_empty() { vec![] } else { fit.estimates.iter().enumerate().filter_map(narrowed).collect() };
    let ridges: Vec<String> = shares()
        .filter(|(_, share)| share.correlation.abs() >= RIDGE)
        .map(|(label, share)| format!("{label} ({:+.2})", share.correlation))
        .collect();
    if let [first, second, ..] = fit.parameters.as_slice()
        && !ridges.is_empty()
        && fit.correlation.abs() < RIDGE
    {
        sentences.push(format!(
            "By itself {} leaves {} and {} on a ridge; together the records break it (correlation {:+.2}).",
            ridges.join(", "),
            first.name,
            second.name,
            fit.correlation
        ));
    }
    sentences
}

/// Standard deviations from which a drift over shots, or a single shot, is named.
const APART: f64 = 4.0;

/// Least drift over all shots that is named, ln.
const DRIFT: f64 = 2e-3;

/// Statements on shots of one experiment (`labels`), whose features are compared with `comparisons`: how much they differ, and whether they drift.
pub(crate) fn repeated(fit: &Fit, comparisons: &[&Comparison], labels: &[String]) -> Vec<String> {
    let (count, features) = (comparisons.len() as f64, comparisons[0].features.len());
    let compared = |f: &usize| comparisons.iter().all(|recorded_run| recorded_run.weights[*f] > 0.0);
    let ratio = |f: usize| {
        let values = || comparisons.iter().map(|recorded_run| recorded_run.features[f]);
        let middle = values().sum::<f64>() / count;
        let variance = values().map(|z| (z - middle).powi(2)).sum::<f64>() / (count - 1.0);
        let scatter: f64 = fit.scatter.iter().skip(f).step_by(features).map(|scatter| scatter * scatter).sum();
        (variance / (scatter / count)).sqrt()
    };
    let mut ratios: Vec<f64> = (0..features).filter(compared).map(ratio).filter(|ratio| ratio.is_finite()).collect();
    ratios.sort_by(f64::total_cmp);
    let middle = ratios.get(ratios.len() / 2).map(|ratio| {
        format!(
            "From shot to shot features vary {ratio:.1} times as much as from run to run of the model (median of {}); runs also differ in what shots share.",
            ratios.len()
        )
    });
    let residuals = fit.waveform.iter().flat_map(|waveform| &waveform.residuals);
    let levels: Vec<[f64; 2]> = residuals.filter_map(|of| of.level).collect();
    middle.into_iter().chain(drift(&levels, labels)).collect()
}

/// Statements on the levels of shots, ln, each with its standard deviation.
fn drift(levels: &[[f64; 2]], labels: &[String]) -> Vec<String> {
    let weighted = |of: &dyn Fn(usize) -> f64| -> f64 { (0..levels.len()).map(|i| of(i) / levels[i][1].powi(2)).sum() };
    let middle = weighted(&|i| i as f64) / weighted(&|_| 1.0);
    let squares = weighted(&|i| (i as f64 - middle).powi(2));
    let slope = weighted(&|i| (i as f64 - middle) * levels[i][0]) / squares;
    let span = slope * (levels.len() as f64 - 1.0);
    if levels.len() > 2 && slope.abs() * squares.sqrt() > APART && span.abs() > DRIFT {
        return vec![format!(
            "The level of the drive drifts by {:+.2} % from the first shot to the last: fit them apart, or let the bench come to rest.",
            100.0 * span.exp_m1()
        )];
    }
    let apart =
        levels.iter().zip(labels).filter(|([level, deviation], _)| level.abs() > f64::max(APART * deviation, DRIFT));
    apart
        .map(|([level, _], label)| {
            format!("{label} stands apart: its level is {:+.2} % from that of all shots.", 100.0 * level.exp_m1())
        })
        .collect()
}

fn percent(low: f64, high: f64) -> String {
    format!("{:.1} %", 100.0 * ((high / low).sqrt() - (low / high).sqrt()))
}

/// A number to two significant figures.
fn short(value: f64) -> String {
    if (0.01..1e5).contains(&value) { format!("{value:.2}") } else { format!("{value:.1e}") }
}

/// The same of a width ln(high/low).
fn percent_of_width(width: f64) -> String {
    percent(1.0, width.exp())
}

/// Share of runs without features near the answer from which it is stated.
const LOST: f64 = 0.25;

/// How many of the runs nearest to the answer have no features, if these are more than a quarter.
fn lost(fit: &Fit) -> Option<String> {
    let distance = |run: &Run| run.position.iter().zip(&fit.most_likely).map(|(a, b)| (a - b).powi(2)).sum::<f64>();
    let mut near: Vec<&Run> = fit.runs.iter().collect();
    near.sort_by(|a, b| distance(a).total_cmp(&distance(b)));
    near.truncate(neighbours(fit.parameters.len()));
    let lost = near.iter().filter(|run| run.outcome.is_err()).count();
    (lost as f64 > LOST * near.len() as f64).then(|| {
        format!(
            "Of the {} runs nearest to the fitted values {lost} have no features: their motion stays below the record's threshold or begins too late. The \
             record has features, so such values count as less likely by the share of these runs.",
            near.len()
        )
    })
}

/// Why the record does not decide between these damping laws, the leading one first; `None` for fewer than two.
pub(crate) fn undecided(laws: &[&FitOutcome]) -> Option<String> {
    let [best, others @ ..] = laws else { return None };
    let one = |law: &&FitOutcome| match best.log_evidence - law.log_evidence {
        lead if best.verdict.explains() && !law.verdict.explains() => format!(
            "`{}` is outside scatter (its p is {}), although the ln evidence of its features is higher by {:.1}",
            law.damping_kind,
            p_value(law.p_value),
            -lead
        ),
        lead => {
            format!("the ln evidence of `{}` is lower by only {lead:.1} ({DECISIVE:.0} would decide)", law.damping_kind)
        }
    };
    let texts: Vec<String> = others.iter().map(one).collect();
    (!others.is_empty()).then(|| {
        format!(
            "The record does not decide between the damping laws: beside `{}`, {}. Quote the values of each. A record at another drive level may \
             decide, since the laws depend differently on amplitude.",
            best.damping_kind,
            texts.join("; ")
        )
    })
}

/// Whether a fit of another choice (law, mount) may be right where `best` leads; both by verdict and ln evidence. A
/// choice that is rejected while the best one explains the record may not, unless its evidence is the higher one: then
/// evidence and verdict contradict each other, and neither decides.
pub(crate) fn is_open(best: (Verdict, f64), other: (Verdict, f64)) -> bool {
    let lead = best.1 - other.1;
    if best.0.explains() && !other.0.explains() { lead < 0.0 } else { lead < DECISIVE }
}

/// The value of a choice (law, mount) that the record prefers; values in `excluded` have no comparable run. `None` if
/// undecided. The best fit is the one of the highest evidence among those that explain the record.
pub fn preferred_of(fits: &[(String, &Fit)], excluded: &[String]) -> Option<String> {
    let rank = |fit: &Fit| (fit.verdict, fit.log_evidence);
    let (best, fit) = fits.iter().max_by(|(_, a), (_, b)| a.by_standing(b))?;
    let mut others = fits.iter().filter(|(name, _)| name != best).peekable();
    match others.peek() {
        Some(_) => (!others.any(|(_, other)| is_open(rank(fit), rank(other)))).then(|| best.clone()),
        None => excluded.iter().any(|name| name != best).then(|| best.clone()),
    }
}

#[cfg(test)]
mod tests {
    use super::{Verdict::*, *};

    #[test]
    fn a_choice_is_open_unless_evidence_or_verdict_excludes_it() {
        for (best, other, expected) in [
            ((WithinScatter, 0.0), (WithinScatter, -4.9), true),
            ((WithinScatter, 0.0), (Doubtful, -5.0), false),
            // Rejected, with the lower evidence: excluded. With the higher one they contradict each other.
            ((WithinScatter, 0.0), (OutsideScatter, -0.1), false),
            ((Doubtful, 0.0), (OutsideScatter, 0.1), true),
            // None explains the record: evidence alone.
            ((OutsideScatter, 0.0), (OutsideScatter, -1.0), true),
            ((OutsideScatter, 0.0), (OutsideScatter, -6.0), false),
        ] {
            assert_eq!(is_open(best, other), expected, "{best:?} {other:?}");
        }
    }
}
