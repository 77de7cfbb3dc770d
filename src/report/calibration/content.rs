//! What the report says, in the order a reader wants it.

use super::{CalibrationReport, LawReport, Verdict, figures, joint, table};
use crate::feature::Measurand;
use crate::report::{
    number::{engineering, significant, unit, with_interval},
    page::{Block, Page, Plate, Tone},
    sweep::{capitalised, sweep_figure},
};

pub(super) fn page(report: &CalibrationReport) -> Page {
    let mut blocks = Vec::new();
    if let Some(law) = report.laws.first() {
        blocks.push(headline(report, law));
    }
    if !report.record_notes.is_empty() {
        blocks.push(Block::Notice(report.record_notes.clone()));
    }
    if !report.warnings.is_empty() {
        blocks.push(Block::Notice(report.warnings.clone()));
    }
    if !report.diagnosis.is_empty() {
        blocks.push(Block::Heading("What would explain the record".into()));
        blocks.push(Block::List(report.diagnosis.clone()));
    }
    if let Some(law) = report.laws.first() {
        section(&mut blocks, "What decided", Some(decided(law)), figures::pulls(law));
    }
    blocks.extend(report.preference.clone().map(Block::Paragraph));
    blocks.push(Block::Table(table::laws(report)));
    if !report.excluded.is_empty() {
        let said = report.excluded.iter().map(|(name, reason)| format!("{name}: no fit. {}", capitalised(reason)));
        blocks.push(Block::List(said.collect()));
    }
    blocks.push(Block::Facts(facts(report)));
    if !report.separation.is_empty() {
        blocks.push(Block::Heading("What the data cannot separate".into()));
        blocks.push(Block::List(report.separation.clone()));
    }
    // Where mounts compete, the regions of those that explain nothing mean nothing.
    let told = |law: &&LawReport| law.mount.is_none() || law.verdict.explains();
    blocks.extend(report.laws.iter().filter(told).filter_map(table::lobes).map(Block::Table));
    joint::shares(report, &mut blocks);

    section(&mut blocks, "Drive", Some(format!("The piston follows {}.", report.drive_origin)), figures::drive(report));
    let alignment = (!report.alignment.is_empty()).then(|| format!("Alignment: {}.", report.alignment));
    section(&mut blocks, recorded_quantity(report), alignment, figures::traces(report));
    section(&mut blocks, "Spectra", None, figures::spectra(report));
    if !report.features.is_empty() {
        blocks.push(Block::Heading("Features".into()));
        blocks.push(Block::Table(table::features(report)));
    }
    joint::companions(report, &mut blocks);
    rungs(report, &mut blocks);
    blocks.push(Block::Heading("Search".into()));
    for law in &report.laws {
        blocks.push(Block::Paragraph(search_words(law)));
        blocks.push(Block::Plates(figures::objective(law)));
    }
    if let Some(sweep) = report.alpha_sweep.as_ref().filter(|sweep| sweep.curves.iter().any(|c| !c.points.is_empty())) {
        let mut plate = Plate::new("sweep", sweep_figure(sweep));
        plate.caption = format!(
            "Peaks and lines against {}; bars are one standard deviation of the scatter, dotted lines: {}.",
            sweep.name, sweep.reference_name
        );
        section(&mut blocks, "Sweep of the drive level", None, vec![plate]);
    }
    if let Some(energy) = table::energy(report) {
        blocks.push(Block::Heading("Energy".into()));
        blocks.push(Block::Table(energy));
    }
    if !report.assumptions.is_empty() {
        blocks.push(Block::Heading("Assumed on reading".into()));
        blocks.push(Block::List(report.assumptions.clone()));
    }
    provenance(report, &mut blocks);
    Page {
        title: joint::title(report),
        subtitle: format!("Scene {}: {}", report.scene, report.scene_description),
        blocks,
    }
}

/// Where the record stands, and by what.
fn decided(law: &LawReport) -> String {
    let p = law.p_value.map_or_else(String::new, |p| {
        format!(
            "Of records that the model makes itself {} are as far from it as this one (p; below 5 % it is doubtful, below 1 % outside its scatter). ",
            share(p)
        )
    });
    format!(
        "{p}Each feature below is what the fit compared; deviations are those left once the parameters have taken up what they can."
    )
}

/// A probability in per cent.
fn share(p: f64) -> String {
    if p < 1e-3 { "fewer than 0.1 %".into() } else { format!("{} %", significant(100.0 * p, 2)) }
}

/// The rungs of the ladder side by side.
fn rungs(report: &CalibrationReport, blocks: &mut Vec<Block>) {
    let laws = || report.laws.iter().filter_map(|law| Some((law, law.rungs.as_ref()?)));
    if laws().next().is_none() {
        return;
    }
    blocks.push(Block::Heading("How far the rungs differ".into()));
    for (law, rungs) in laws() {
        let upper = rungs.rungs.get(1).map_or("the rung above", |rung| rung.model.as_str());
        blocks.push(Block::Paragraph(format!(
            "{}: the search ran on the chain; the values quoted come from the runs of the model `{upper}` alone, made where the \
             chain's answer, corrected round by round, led them. Where the two regions part, the chain leaves out what the record shows.",
            capitalised(&law.name())
        )));
        blocks.push(Block::Table(table::rungs(law, rungs)));
        blocks.push(Block::Plates(figures::rungs(law, rungs).into_iter().collect()));
        blocks.extend(table::rung_features(law, rungs, &report.record_label).map(Block::Table));
    }
}

/// Drive, record and uncalibrated response, before any fit.
pub(super) fn preview(report: &CalibrationReport) -> Page {
    let mut blocks =
        vec![Block::Notice(vec!["Nothing has been fitted: the response shown is the scene as given.".into()])];
    if !report.record_notes.is_empty() {
        blocks.push(Block::Notice(report.record_notes.clone()));
    }
    section(&mut blocks, "Drive", Some(format!("The piston follows {}.", report.drive_origin)), figures::drive(report));
    let alignment = (!report.alignment.is_empty()).then(|| format!("Alignment: {}.", report.alignment));
    section(&mut blocks, recorded_quantity(report), alignment, figures::traces(report));
    section(&mut blocks, "Spectra", None, figures::spectra(report));
    if !report.assumptions.is_empty() {
        blocks.push(Block::Heading("Assumed on reading".into()));
        blocks.push(Block::List(report.assumptions.clone()));
    }
    provenance(report, &mut blocks);
    Page {
        title: format!("Before the calibration against {}", report.title),
        subtitle: format!("Scene {}: {}", report.scene, report.scene_description),
        blocks,
    }
}

/// What the traces are, as a heading.
pub(super) fn recorded_quantity(report: &CalibrationReport) -> &'static str {
    match report.measurand {
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
fn values(law: &LawReport, intervals: bool) -> String {
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

fn headline(report: &CalibrationReport, law: &LawReport) -> Block {
    let leaning: Vec<&str> = law
        .parameters
        .iter()
        .filter(|parameter| parameter.at_bound)
        .map(|parameter| parameter.symbol.as_str())
        .collect();
    let bound = if leaning.is_empty() {
        String::new()
    } else {
        format!(" {} leans on an end of its search range: widen it before believing the interval.", leaning.join(", "))
    };
    let (damping, model) = (law.name(), &report.model);
    let quantity = report.measurand.name();
    let record = match report.record_label.as_str() {
        _ if report.recorded.is_none() => "the published features".to_owned(),
        _ if !report.companions.is_empty() => {
            format!("the {} {quantity} records together", report.companions.len() + 1)
        }
        "recorded" => format!("the recorded {quantity}"),
        label => format!("the {quantity} record ({label})"),
    };
    let p = law.p_value.map_or_else(
        || "unknown".into(),
        |p| if p < 1e-3 { "below 0.001".into() } else { format!("= {}", significant(p, 2)) },
    );
    let explains = if law.verdict == Verdict::Doubtful { "hardly explains" } else { "explains" };
    let (tone, text) = match law.verdict {
        Verdict::WithinScatter | Verdict::Doubtful => (
            if law.verdict == Verdict::Doubtful || !leaning.is_empty() { Tone::Careful } else { Tone::Good },
            format!(
                "With {damping} the {model} model {explains} {record} within its own scatter at {}. Intervals are 90 %; p {p}.{bound}",
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
    Block::Headline { tone, verdict: law.verdict.to_string(), text }
}

fn facts(report: &CalibrationReport) -> Vec<(String, String)> {
    let mut facts = vec![
        ("model".to_owned(), report.model.clone()),
        ("drive frequency".to_owned(), engineering(report.drive_frequency, "Hz", 5)),
        ("drive".to_owned(), report.drive_origin.clone()),
    ];
    if let Some(window) = report.window {
        let microseconds = |time: f64| significant(time * 1e6, 4);
        facts.push((
            "analysis window".to_owned(),
            format!("{} to {} µs", microseconds(window.from), microseconds(window.to)),
        ));
    }
    for law in &report.laws {
        if let Some(correlation) = law.correlation {
            let name = match &law.mount {
                Some(mount) => format!("correlation ({}, {mount})", law.damping_kind),
                None => format!("correlation ({})", law.damping_kind),
            };
            facts.push((name, significant(correlation, 2)));
        }
    }
    facts
}

fn search_words(law: &LawReport) -> String {
    let failed = match law.failed_runs {
        0 => "none of which failed".to_owned(),
        failed => format!(
            "{failed} of which failed and rank{} behind every finished run ({})",
            if failed == 1 { "s" } else { "" },
            law.failures.join("; ")
        ),
    };
    let rung = law.rungs.as_ref().and_then(|rungs| rungs.rungs.get(1));
    let on = rung.map_or_else(String::new, |rung| format!(" of the model `{}`", rung.model));
    format!("{}: {} runs{on}, {failed}.", capitalised(&law.name()), law.evaluations)
}

fn provenance(report: &CalibrationReport, blocks: &mut Vec<Block>) {
    let provenance = &report.provenance;
    blocks.push(Block::Heading("Provenance".into()));
    blocks.push(Block::Table(table::inputs(report)));
    let mut facts =
        vec![("version".to_owned(), provenance.version.clone()), ("seed".to_owned(), provenance.seed.to_string())];
    facts.extend(provenance.settings.iter().cloned());
    blocks.push(Block::Facts(facts));
    blocks.push(Block::Code(provenance.command_line.clone()));
}
