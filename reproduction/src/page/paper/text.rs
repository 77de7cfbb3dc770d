//! Sentences of the study of the paper: what was found, never what was hoped for.

use super::{PaperReport, millimetres, tables};
use crate::paper::statements::Claim;
use crate::paper::{
    Change, Judgement, LAWS, PaperOutcome, PaperPlan, ReadingOutcome, Verdict, chose_the_readings, largest,
};
use crate::portrait::Trait;
use granchain_report::{
    number::{fixed, significant},
    page::{Block, Tone},
};
use granchain_signal::feature::Ratio;

fn count(judgements: &[Judgement], verdict: Verdict) -> usize {
    judgements.iter().filter(|judgement| judgement.verdict == verdict).count()
}

/// How many statements are met.
pub(super) fn headline(judgements: &[Judgement]) -> Block {
    let (agrees, differs) = (count(judgements, Verdict::Agrees), count(judgements, Verdict::Differs));
    let tested = agrees + differs;
    let off: Vec<String> = judgements
        .iter()
        .filter(|judgement| judgement.verdict == Verdict::Differs)
        .map(|judgement| format!("{} ({})", judgement.statement.said, tables::subject(judgement.statement.subject)))
        .collect();
    let tone = if differs == 0 {
        Tone::Good
    } else if 2 * agrees > tested {
        Tone::Careful
    } else {
        Tone::Bad
    };
    let rest = if off.is_empty() { String::new() } else { format!(" Not met: {}.", off.join("; ")) };
    let agreeing = judgements.iter().filter(|judgement| judgement.verdict == Verdict::Agrees);
    let chosen = agreeing.filter(|judgement| chose_the_readings(&judgement.statement)).count();
    Block::Headline {
        tone,
        verdict: format!("{agrees} of {tested} tested statements agree, {} of them blind.", agrees - chosen),
        text: format!(
            "The other {chosen} are peaks by which the default readings were chosen.{rest} {} more could not be tested here.",
            count(judgements, Verdict::NotTested)
        ),
    }
}

pub(super) fn introduction(outcome: &PaperOutcome) -> Block {
    let plan = &outcome.plan;
    Block::Paragraph(format!(
        "Six 1 mm steel beads between a piston (73 kHz, 1 µm times α) and a resin annulus, run on model {} with the paper’s two damping laws: \
         linear dashpots of 0.3 N·s/m at α = 0.5 and Kuwabara–Kono dashpots of 3660 N·s·m⁻³ᐟ² at α = 1.5. The motion is chaotic or close to it, \
         so a single run means little: each law was run {} times with gaps jittered by 0.3 nm, the drive by 1 in 10⁴ and noise of {} mm/s rms \
         on the velocity (which passes a vibrometer filter of {} MHz), and as often at 1 % more and 1 % less drive.",
        outcome.model,
        plan.replicates,
        significant(1e3 * plan.noise_rms_m_per_s, 2),
        significant(1e-6 * plan.bandwidth_hz, 2)
    ))
}

/// What each law meets, what it misses and by how much, and which single reading would bring both its peaks to the printed ones.
pub(super) fn agreement(outcome: &PaperOutcome, judgements: &[Judgement]) -> Vec<String> {
    let of = |prefix: &str, verdict: Verdict, with_found: bool| {
        let chosen = judgements
            .iter()
            .filter(|judgement| judgement.statement.key.starts_with(prefix) && judgement.verdict == verdict);
        let said = chosen.map(|judgement| {
            if with_found {
                format!("{} ({})", judgement.statement.said, judgement.found)
            } else {
                judgement.statement.said.into()
            }
        });
        said.collect::<Vec<String>>().join("; ")
    };
    let mut said = Vec::new();
    for (law, readings) in outcome.laws.iter().zip(&outcome.readings) {
        let prefix = format!("{}.", law.law.kind);
        let name = tables::capitalised(law.law.name);
        let (met, missed) = (of(&prefix, Verdict::Agrees, false), of(&prefix, Verdict::Differs, true));
        if !met.is_empty() {
            said.push(format!("{name} dampers agree with the paper’s own runs in: {met}."));
        }
        if !missed.is_empty() {
            said.push(format!("{name} dampers do not agree in: {missed}."));
        }
        let meeting = readings_that_meet(judgements, &prefix, readings);
        if !missed.is_empty() && missed.contains("peak") {
            said.push(match meeting.as_slice() {
                [] => format!("No single reading of those varied below brings both peaks with {} dampers to the printed ones.", law.law.name),
                names => format!(
                    "With {} dampers both printed peaks are met under one other reading alone: {}. What the paper does not print decides \
                     about as much as what it does.",
                    law.law.name,
                    names.join(", ")
                ),
            });
        }
    }
    let missed = of("measured.", Verdict::Differs, true);
    said.push(match missed.as_str() {
        "" => "All that is printed of the measurement and can be tested is met by linear dampers at α = 0.5.".into(),
        missed => format!("Of the measurement linear dampers at α = 0.5 do not meet: {missed}."),
    });
    said
}

/// Readings under which both printed peaks of a law lie within two scatters, the change for 1 % of drive and half a digit.
fn readings_that_meet(judgements: &[Judgement], prefix: &str, readings: &[ReadingOutcome]) -> Vec<&'static str> {
    let printed = |name: &str| {
        let judgement = judgements.iter().find(|judgement| judgement.statement.key == format!("{prefix}{name}"))?;
        let (Claim::PositivePeak(value) | Claim::NegativePeak(value)) = judgement.statement.claim else { return None };
        let ours = judgement.ours?;
        // What the law itself is allowed beyond its own scatter.
        Some((value, judgement.allowance? - 2.0 * ours.scatter))
    };
    let (Some(up), Some(down)) = (printed("positive-peak"), printed("negative-peak")) else { return Vec::new() };
    let met = |change: &Change, (value, more): (f64, f64)| (change.mean - value).abs() <= 2.0 * change.scatter + more;
    readings
        .iter()
        .filter(|reading| reading.changes.as_ref().is_some_and(|[p, n, _]| met(p, up) && met(n, down)))
        .map(|reading| reading.reading.name)
        .collect()
}

pub(super) fn sweep(outcome: &PaperOutcome) -> String {
    let mut said = Vec::new();
    for (law, sweep) in LAWS.iter().zip(&outcome.sweeps) {
        for line in [Ratio::new(1, 3), Ratio::new(1, 2)] {
            if let Some((alpha, value, scatter)) = largest(sweep, Trait::Level(line)) {
                said.push(format!(
                    "With {} dampers A({line}·f0)/A(f0) is largest at α = {alpha} ({} ± {}).",
                    law.name,
                    fixed(value, 2),
                    fixed(scatter, 2)
                ));
            }
        }
        let with = |line: Ratio| {
            let present: Vec<String> = sweep
                .iter()
                .filter(|point| point.moments.has_line(line))
                .map(|point| point.alpha.to_string())
                .collect();
            if present.is_empty() { "at none".to_owned() } else { format!("at α = {}", present.join(", ")) }
        };
        said.push(format!(
            "Lines at thirds (1/3) are present {}; at one half {}.",
            with(Ratio::new(1, 3)),
            with(Ratio::new(1, 2))
        ));
    }
    said.join(" ")
}

/// How to read the ranking, and what leads it.
pub(super) fn readings(outcome: &PaperOutcome) -> String {
    let lead = |readings: &[ReadingOutcome]| {
        let names: Vec<String> = readings
            .iter()
            .filter(|reading| reading.changes.is_some())
            .take(3)
            .map(|reading| format!("{} ({} %)", reading.reading.name, significant(100.0 * reading.shift, 2)))
            .collect();
        names.join(", ")
    };
    let leads: Vec<String> = LAWS
        .iter()
        .zip(&outcome.readings)
        .map(|(law, readings)| format!("with {} dampers {}", law.name, lead(readings)))
        .collect();
    format!(
        "Each reading of what the paper does not say is varied alone on model {}, {} perturbed runs each. Largest shifts: {}. By comparison 1 % of drive \
         moves the positive peak by {}.",
        outcome.readings_model,
        outcome.plan.reading_replicates,
        leads.join("; "),
        outcome
            .laws
            .iter()
            .filter_map(|law| {
                let spread = law.spread(Trait::PositivePeak)?;
                Some(format!(
                    "{} % ({})",
                    significant(100.0 * (spread.sensitivity / spread.mean).abs(), 2),
                    law.law.name
                ))
            })
            .collect::<Vec<_>>()
            .join(" and ")
    )
}

pub(super) fn rigid(outcome: &PaperOutcome) -> String {
    let runs = &outcome.rigid.runs;
    let Some(finest) = runs.first() else { return "No model ran the rigid scene.".into() };
    let said: Vec<String> = runs
        .iter()
        .skip(1)
        .map(|run| {
            let parts: Vec<String> = outcome
                .rigid
                .windows_s
                .iter()
                .zip(&run.differences)
                .map(|((from, to), d)| {
                    format!("{} % in {:.0}–{:.0} µs", significant(100.0 * d, 2), 1e6 * from, 1e6 * to)
                })
                .collect();
            format!("model {} differs by {}", run.model, parts.join(", "))
        })
        .collect();
    let peaks =
        format!("{} and {} mm/s", millimetres(finest.positive_peak_m_per_s), millimetres(finest.negative_peak_m_per_s));
    if said.is_empty() {
        return format!(
            "Only model {} ran; its peaks within 70 µs are {peaks}. The paper prints no number of this scene.",
            finest.model
        );
    }
    format!(
        "The paper finds good agreement of its finite elements with the discrete chain and prints no number. Ours: from model {} (peaks {peaks} \
         within 70 µs) {}.",
        finest.model,
        said.join("; ")
    )
}

/// Unknowns outside the authors’ laboratory.
pub(super) fn unknown(plan: &PaperPlan) -> Vec<String> {
    vec![
        "The horn-tip record is not published. Its stand-in is a 40-cycle sine that rings up with τ = 100 µs; length and shape of the burst are \
         ours. What they change stands above."
            .into(),
        "The vibrometer record is not published either. What is drawn beside our runs is a reconstruction from the printed numbers; no verdict \
         rests on it."
            .into(),
        "Whether piston and support have dampers, whether a damper may pull, and how stiff the ends are is not said; ours: dampers at every \
         contact, no pulling, rigid piston. Precompression and gaps are said to be none; a micrometer screw cannot tell 1 mN from none."
            .into(),
        "The printed damping unit of Kuwabara and Kono’s law lacks the second; read as N·s·m⁻³ᐟ². The printed diameters of the annulus fit \
         together only as radii."
            .into(),
        format!(
            "The vibrometer’s noise of {} mm/s rms and its bandwidth of {} MHz are those of the reconstruction, invented; jitters of 0.3 nm and 10⁻⁴ lie far below what a \
             laboratory controls, so the scatter is a lower bound.",
            significant(1e3 * plan.noise_rms_m_per_s, 2),
            significant(1e-6 * plan.bandwidth_hz, 2)
        ),
        "The thresholds by which lines are called present and a response impulsive are ours: the paper says what is seen in its figures.".into(),
    ]
}

pub(super) fn provenance(report: &PaperReport) -> Vec<(String, String)> {
    let outcome = &report.outcome;
    let plan = &outcome.plan;
    let failed: usize = outcome.laws.iter().map(|law| law.failures.len()).sum();
    let balance = outcome.laws.iter().map(|law| law.energy_balance).fold(0.0, f64::max);
    vec![
        ("version".into(), report.program.clone()),
        ("model".into(), format!("{}; readings on {}", outcome.model, outcome.readings_model)),
        (
            "runs".into(),
            format!(
                "{} of the annulus scene: {} a law at its α, {} at each of {} α, {} a reading",
                plan.runs().0 + plan.runs().1,
                3 * plan.replicates,
                plan.sweep_replicates,
                plan.alphas.len(),
                plan.reading_replicates
            ),
        ),
        ("failed runs".into(), failed.to_string()),
        (
            "energy residual".into(),
            format!("{} of the largest energy at most, unperturbed runs", significant(balance, 2)),
        ),
        ("seed".into(), plan.seed.to_string()),
    ]
}
