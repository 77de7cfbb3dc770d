//! What the report says, in the order a reader wants it.

use super::{
    CalibrationReport, Verdict, figures, joint,
    shown::{Law, law_name},
    table,
};
use crate::{
    number::{engineering, significant, unit, with_interval},
    page::{Block, Page, Plate, Tone},
    replay::energy_table,
    sweep::capitalised,
};
use granchain_calibration::{
    agreement::DOUBTFUL,
    outcome::{UNDECIDED, WaveformOutcome},
};
use granchain_signal::feature::Measurand;

const NO_CAUSE: &str = "Likely causes (sign, unit, number of beads, gap, material and others) were tried; none of them explains the record better.";

pub(super) fn page(report: &CalibrationReport) -> Page {
    let (outcome, laws, lead) = (&report.outcome, report.laws(), report.lead());
    let mut blocks = Vec::new();
    blocks.extend(undecided(report, &laws).or_else(|| laws.first().map(|law| headline(report, law))));
    blocks.extend(Block::noticed(&lead.record_notes));
    blocks.extend(table::named_numbers(report).map(Block::Table));
    // What a reader wants to see first stands first, and once.
    let mut traces = figures::traces(report, lead).into_iter();
    blocks.push(Block::Plates(traces.by_ref().take(1).collect()));
    blocks.extend(Block::noticed(&outcome.warnings));
    if !outcome.diagnosis.is_empty() {
        let explained = outcome.diagnosis.iter().any(|finding| finding.p_value.is_none_or(|p| p >= DOUBTFUL));
        let heading =
            if explained { "What would explain the record" } else { "What comes nearest to explaining the record" };
        blocks.extend(Block::listed(heading, outcome.diagnosis.iter().map(|it| capitalised(&it.text)).collect()));
    } else if laws.first().is_some_and(|law| law.fit.verdict == Verdict::OutsideScatter) {
        blocks.push(Block::Paragraph(NO_CAUSE.into()));
    }
    if let Some((widths, sentences)) = laws.first().and_then(table::widths) {
        blocks.push(Block::Heading("Where the width of the intervals comes from".into()));
        blocks.push(Block::List(sentences));
        blocks.push(Block::Table(widths));
    }
    if let Some(law) = laws.first() {
        section(&mut blocks, "What decided", Some(decided(law)), figures::pulls(law, &report.records));
    }
    blocks.extend(preference(report).map(Block::Paragraph));
    blocks.push(Block::Table(table::laws(&laws)));
    if !outcome.excluded.is_empty() {
        let sentences =
            outcome.excluded.iter().map(|(name, reason)| format!("{name}: no fit. {}", capitalised(reason)));
        blocks.push(Block::List(sentences.collect()));
    }
    blocks.push(Block::Facts(facts(report, &laws)));
    blocks.extend(Block::listed("What the data cannot separate", outcome.statements.clone()));
    // Where mounts compete, the regions of those that explain nothing mean nothing.
    let meaningful = |law: &&Law<'_>| law.fit.mount.is_none() || law.fit.verdict.explains();
    // Nor do those of a model that is rejected.
    let regions = laws.iter().filter(meaningful).filter(|law| law.fit.verdict != Verdict::OutsideScatter);
    blocks.extend(regions.filter_map(table::lobes).map(Block::Table));
    joint::shares(&laws, &mut blocks);

    blocks.extend(report.bench.blocks());
    measured(report, traces.collect(), &mut blocks);
    blocks.push(Block::Heading("Features".into()));
    blocks.extend(laws.first().and_then(|law| table::fitted(law, report, 0)).map(Block::Table));
    blocks.extend(table::features(report, 0).map(Block::Table));
    joint::companions(report, &mut blocks);
    blocks.push(Block::Heading("What accuracy cost".into()));
    blocks.extend(laws.iter().map(|law| Block::Timed(table::cost(law))));
    fidelities(report, &laws, &mut blocks);
    blocks.push(Block::Heading("Search".into()));
    for law in &laws {
        blocks.push(Block::Paragraph(search_words(law)));
        blocks.push(Block::Plates(figures::objective(law)));
    }
    blocks.extend(report.energy.iter().flat_map(|balance| Block::Table(energy_table(balance)).under("Energy")));
    provenance(report, &mut blocks);
    Page {
        title: joint::title(report),
        subtitle: format!("Scene {}: {}", report.scene, report.scene_description),
        blocks,
    }
}

/// Where the record stands, and by what.
fn decided(law: &Law<'_>) -> String {
    let waveform = law.fit.waveform.as_ref();
    format!(
        "{} Below 5 % the model is doubtful, below 1 % it is rejected (outside scatter). The figure shows the features that were compared, with \
         their residuals after the fit.{}",
        match waveform {
            Some(waveform) if !waveform.decided => format!(
                "p is {}: the smaller of the share of simulated records whose features fit as badly as these or worse, and ten times the share whose first \
                 cycles do ({}).",
                share(law.fit.p_value),
                share(waveform.p_value)
            ),
            Some(waveform) if waveform.left_out == 0 => format!(
                "p is {}: 2 × the smaller of two shares of simulated records that fit as badly as this one or worse, by the waveform ({}) and by the \
                 features, at most 100 %.",
                share(law.fit.p_value),
                share(waveform.p_value)
            ),
            _ => format!(
                "p, the share of simulated records that fit as badly as this one or worse, is {}.",
                share(law.fit.p_value)
            ),
        },
        match waveform {
            Some(waveform) if waveform.decided =>
                " The parameters were fitted to the waveform; the features only enter p.",
            Some(waveform) if waveform.contradicts() => " The first cycles of the waveform do not fit.",
            _ => "",
        }
    )
}

/// Which law and which mount the record prefers, where several were fitted.
fn preference(report: &CalibrationReport) -> Option<String> {
    let (subject, undecided, decided) = match report.records.len() {
        1 => ("The record", "does", "prefers"),
        _ => ("The records", "do", "prefer"),
    };
    let sentence = |preferred: &Option<String>, between: &str, named: &dyn Fn(&str) -> String| {
        preferred.as_ref().map(|preferred| match preferred.as_str() {
            UNDECIDED => format!("{subject} {undecided} not decide between {between}."),
            name => format!("{subject} {decided} {}.", named(name)),
        })
    };
    let outcome = &report.outcome;
    let law = sentence(&outcome.preferred_law, "the damping laws", &|law| format!("{} damping", law_name(law)));
    let mount = sentence(&outcome.preferred_mount, "the mounts of the disc", &|mount| format!("the {mount} disc"));
    let sentences: Vec<String> = law.into_iter().chain(mount).collect();
    (!sentences.is_empty()).then(|| sentences.join(" "))
}

/// A probability in per cent.
fn share(p: f64) -> String {
    if p < 1e-3 { "below 0.1 %".into() } else { format!("{} %", significant(100.0 * p, 2)) }
}

/// The fidelity levels side by side.
fn fidelities(report: &CalibrationReport, laws: &[Law<'_>], blocks: &mut Vec<Block>) {
    let laddered = || laws.iter().filter(|law| law.drawn.below.is_some());
    if laddered().next().is_none() {
        return;
    }
    blocks.push(Block::Heading("How far the models differ".into()));
    for law in laddered() {
        let (upper, below) = (&report.outcome.model, law.below());
        let of_below = match below.as_slice() {
            [_, (model, ..)] => format!("result of the {model} model, which started from the chain's"),
            _ => "chain's result".to_owned(),
        };
        blocks.push(Block::Paragraph(format!(
            "{}: the search used the chain. The quoted values rest on runs of the model `{upper}` near the {of_below}; each round of runs was \
             re-centred. If the regions differ, the simpler model lacks an effect that is visible in the record.",
            capitalised(&law.name())
        )));
        blocks.push(Block::Plates(figures::fidelities(law).into_iter().collect()));
        blocks.extend(table::fidelity_features(law, report.lead()).map(Block::Table));
    }
}

/// Drive, record and uncalibrated response, before any fit.
pub(super) fn preview(report: &CalibrationReport) -> Page {
    let mut blocks =
        vec![Block::Notice(vec!["Nothing has been fitted: the response shown is the scene as given.".into()])];
    let lead = report.lead();
    blocks.extend(Block::noticed(&lead.record_notes));
    blocks.extend(report.bench.blocks());
    measured(report, figures::traces(report, lead), &mut blocks);
    provenance(report, &mut blocks);
    Page {
        title: format!("Before the calibration against {}", lead.title),
        subtitle: format!("Scene {}: {}", report.scene, report.scene_description),
        blocks,
    }
}

/// Drive, traces and spectra of the first record.
fn measured(report: &CalibrationReport, traces: Vec<Plate>, blocks: &mut Vec<Block>) {
    let lead = report.lead();
    section(blocks, "Drive", Some(format!("The piston follows {}.", lead.drive_origin)), figures::drive(report, lead));
    let alignment = (!lead.alignment.is_empty()).then(|| format!("Alignment: {}.", lead.alignment));
    section(blocks, recorded_quantity(report), alignment, traces);
    section(blocks, "Spectra", None, figures::spectra(report, lead));
}

/// What the traces are, as a heading.
pub(super) fn recorded_quantity(report: &CalibrationReport) -> &'static str {
    match report.outcome.quantity {
        Measurand::Velocity => "Velocity of the last bead",
        Measurand::Pressure => "Pressure in the water",
    }
}

pub(super) fn section(blocks: &mut Vec<Block>, heading: &str, words: Option<String>, plates: Vec<Plate>) {
    if plates.is_empty() {
        return;
    }
    blocks.push(Block::Heading(heading.to_owned()));
    blocks.extend(words.map(Block::Paragraph));
    blocks.push(Block::Plates(plates));
}

/// `α = 0.503 (0.488 to 0.519) and c = 0.304 N·s/m (0.27 to 0.34)`.
fn values(law: &Law<'_>, intervals: bool) -> String {
    let values: Vec<String> = law
        .parameters
        .iter()
        .map(|parameter| {
            let interval = parameter.low.zip(parameter.high).filter(|_| intervals);
            let number = with_interval(parameter.value, interval);
            let unit = unit(&parameter.unit);
            match (unit.as_str(), number.split_once(' ')) {
                ("1", _) => format!("{} = {number}", parameter.symbol),
                (_, Some((value, interval))) => format!("{} = {value} {unit} {interval}", parameter.symbol),
                (_, None) => format!("{} = {number} {unit}", parameter.symbol),
            }
        })
        .collect();
    values.join(" and ")
}

/// The headline where the record does not decide between damping laws: the values of each.
fn undecided(report: &CalibrationReport, laws: &[Law<'_>]) -> Option<Block> {
    let open = report.outcome.undecided_laws();
    let drawn = open.iter().filter_map(|open| laws.iter().find(|law| law.fit == *open));
    let texts: Vec<String> = drawn
        .map(|law| {
            format!(
                "with {} {} ({}, p = {})",
                law.name(),
                values(law, true),
                law.fit.verdict,
                significant(law.fit.p_value, 2)
            )
        })
        .collect();
    (!texts.is_empty()).then(|| Block::Headline {
        tone: Tone::Careful,
        verdict: report.outcome.best.verdict.to_string(),
        text: format!(
            "The record does not decide between {} damping laws: {}. Intervals are 90 %.",
            texts.len(),
            texts.join("; ")
        ),
    })
}

fn headline(report: &CalibrationReport, law: &Law<'_>) -> Block {
    let leaning: Vec<&str> =
        law.parameters.iter().filter(|parameter| parameter.at_bound).map(|parameter| parameter.symbol).collect();
    let bound = if leaning.is_empty() {
        String::new()
    } else {
        format!(" {} leans on an end of its search range: widen it before believing the interval.", leaning.join(", "))
    };
    let (damping, model) = (law.name(), &report.outcome.model);
    let (quantity, lead, verdict) = (report.outcome.quantity.name(), report.lead(), law.fit.verdict);
    let record = match lead.record_label.as_str() {
        _ if report.records.len() > 1 => format!("the {} {quantity} records together", report.records.len()),
        "recorded" => format!("the recorded {quantity}"),
        label => format!("the {quantity} record ({label})"),
    };
    let p = law.fit.p_value;
    let p = if p < 1e-3 { "below 0.001".into() } else { format!("= {}", significant(p, 2)) };
    let (explains, deviates) = match verdict {
        Verdict::Doubtful if law.fit.waveform.as_ref().is_some_and(WaveformOutcome::contradicts) => {
            ("hardly explains", "the first cycles of the waveform do not agree")
        }
        Verdict::Doubtful => ("hardly explains", "the record deviates more than most runs of the model do"),
        _ => ("explains", "the deviations are no larger than between runs of the model"),
    };
    let (tone, text) = match verdict {
        Verdict::WithinScatter | Verdict::Doubtful => (
            if verdict == Verdict::Doubtful || !leaning.is_empty() { Tone::Careful } else { Tone::Good },
            format!(
                "With {damping} the {model} model {explains} {record} at {}: {deviates}. Intervals are 90 %; p {p}.{bound}",
                values(law, true)
            ),
        ),
        Verdict::OutsideScatter => (
            Tone::Bad,
            format!(
                "With {damping} the {model} model does not explain {record}: near {}, where it comes closest, p {p}. No interval is quoted, because none would mean anything.{bound}",
                values(law, false)
            ),
        ),
        Verdict::NotConverged => (
            Tone::Bad,
            format!(
                "The search stopped before it could tell. Best so far, {damping}: {} (p {p}).{bound}",
                values(law, false)
            ),
        ),
    };
    Block::Headline { tone, verdict: verdict.to_string(), text }
}

fn facts(report: &CalibrationReport, laws: &[Law<'_>]) -> Vec<(String, String)> {
    let mut facts = vec![
        ("model".to_owned(), report.outcome.model.clone()),
        ("drive frequency".to_owned(), engineering(report.drive_frequency, "Hz", 5)),
        ("drive".to_owned(), report.lead().drive_origin.clone()),
    ];
    if let Some(window) = report.lead().window {
        let microseconds = |time: f64| significant(time * 1e6, 4);
        facts.push((
            "analysis window".to_owned(),
            format!("{} to {} µs", microseconds(window.from), microseconds(window.to)),
        ));
    }
    for law in laws {
        if let Some(correlation) = law.correlation() {
            let kind = law_name(&law.fit.damping_kind);
            let name = match &law.fit.mount {
                Some(mount) => format!("correlation ({kind}, {mount})"),
                None => format!("correlation ({kind})"),
            };
            facts.push((name, significant(correlation, 2)));
        }
    }
    facts
}

fn search_words(law: &Law<'_>) -> String {
    let Some(answering) = law.fit.fidelities.iter().rev().find(|fidelity| fidelity.verdict.is_some()) else {
        return String::new();
    };
    // The numbers were left out of the reasons, so that alike ones meet.
    let given = |reason: &str| {
        let short =
            reason.replace("has … drive periods after its onset, expected at least …", "was too short after its onset");
        let words = short.split(" (").next().unwrap_or_default().split(" of …").next().unwrap_or_default();
        words.replace("stays below", "stayed below").replace(" …", "")
    };
    let failures: Vec<_> =
        law.fit.failures.iter().map(|(reason, count)| format!("in {count} {}", given(reason))).collect();
    let failed = match answering.failed_runs {
        0 => "none failed".to_owned(),
        failed => format!("{failed} failed and are ranked last: {}", failures.join(", ")),
    };
    let on = if law.drawn.below.is_some() { format!(" of the model `{}`", answering.model) } else { String::new() };
    format!("{}: {} runs{on}, {failed}.", capitalised(&law.name()), answering.runs)
}

fn provenance(report: &CalibrationReport, blocks: &mut Vec<Block>) {
    let outcome = &report.outcome;
    blocks.extend(Block::listed("Assumed on reading", outcome.assumptions.clone()));
    blocks.extend(Block::Table(table::inputs(report)).under("Provenance"));
    let version = outcome.program.rsplit(' ').next().unwrap_or_default();
    let cite =
        format!("The granchain authors, granchain, version {version}, and the paper of the model (see CITATION.cff).");
    let facts = [("version", version.to_owned()), ("seed", outcome.seed.to_string()), ("how to cite", cite)];
    let facts = facts.map(|(name, value)| (name.to_owned(), value)).into_iter();
    blocks.push(Block::Facts(facts.chain(report.settings.iter().cloned()).collect()));
    blocks.push(Block::Code(report.command_line.clone()));
}
