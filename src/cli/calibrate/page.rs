//! From a finished fit to the report, the dry run's figure and the text on the terminal.

use std::{fmt::Write, path::Path};

use super::{Job, alpha_sweep::alpha_sweep, manifest, records_page, rungs_page};
use crate::{
    calibration::{
        Fitted, FittedCandidate, Problem,
        comparison::Reduction,
        drive::{Input, displacement},
        fit::{self, Fit},
        measured::Measured,
        outcome::CalibrationOutcome,
        parameter::{Parameter, Target},
        posterior::Posterior,
        shot::Shot,
    },
    cli::{Outcome, arguments::Session, interrupt, output::OutputFolder},
    feature::{Features, Measurand, Peaks, Window},
    measurement::{PublishedFeature, PublishedFeatures, Record, Statement},
    report::{
        calibration::{
            CalibrationReport, DensityMap, Estimate, FeatureRow, InputFile, LawReport, Lobe, PairMap, Provenance, Pull,
            RunPoint,
        },
        number::significant,
        sweep::capitalised,
    },
    scene::{DampingKind, ModelKind, Scene},
    signal::Series,
    study::{
        Bodies, EnsemblePlan,
        confirmation::Confirmation,
        confirmed::{Confirmed, confirm_measured},
        published::published,
    },
};

/// The report of a calibration, plain and in SI.
///
/// # Errors
/// When Ctrl-C was pressed on the way.
pub fn report(
    job: &Job,
    fitted: &Fitted,
    confirmed: &Confirmed,
    outcome: &CalibrationOutcome,
    fea: Option<&[f64]>,
) -> anyhow::Result<CalibrationReport> {
    let (problem, law) = (&job.problem, fitted.best());
    let (lead, confirmation) = (problem.lead(), confirmed.confirmations[0].as_ref());
    let companions = records_page::records(problem, law, &confirmed.confirmations);
    let scene = law.scene(0);
    let reference = if lead.measured.record().is_some() { "of the record" } else { "as published" };
    let alpha_sweep = alpha_sweep(&scene, outcome, reference);
    interrupt::check()?;
    let order = std::iter::once(law).chain(fitted.candidates.iter().filter(|other| !std::ptr::eq(*other, law)));
    let laws = order
        .map(|other| {
            let fea = fea.filter(|_| std::ptr::eq(other, law));
            let shares = records_page::shares(other, problem);
            LawReport {
                rungs: rungs_page::rungs(problem, other, fea),
                shares,
                ..law_report(other, &other.fit, problem)
            }
        })
        .collect();
    let (subject, undecided, decided) = match &lead.measured {
        Measured::Record(_) if problem.shots.len() > 1 => ("The records", "do", "prefer"),
        Measured::Record(_) => ("The record", "does", "prefers"),
        Measured::Published(_) => ("The published features", "do", "prefer"),
    };
    let law = outcome.preferred_law.as_ref().map(|preferred| match preferred.as_str() {
        "undecided" => format!("{subject} {undecided} not decide between the damping laws."),
        law => format!("{subject} {decided} {} damping.", law_name(law)),
    });
    let mount = outcome.preferred_mount.as_ref().map(|preferred| match preferred.as_str() {
        "undecided" => format!("{subject} {undecided} not decide between the mounts of the disc."),
        mount => format!("{subject} {decided} the {mount} disc."),
    });
    let said: Vec<String> = law.into_iter().chain(mount).collect();
    let preference = (!said.is_empty()).then(|| said.join(" "));
    Ok(CalibrationReport {
        laws,
        excluded: outcome.excluded.clone().into_iter().collect(),
        preference,
        separation: outcome.statements.clone(),
        diagnosis: outcome.diagnosis.iter().map(|finding| capitalised(&finding.text)).collect(),
        simulated: confirmation.map(simulated_span),
        alignment: confirmation.map_or_else(String::new, alignment),
        window: confirmation.map(|confirmation| confirmation.window),
        features: confirmation
            .map_or_else(Vec::new, |confirmation| feature_rows(lead, problem.quantity, &scene, confirmation)),
        companions,
        alpha_sweep,
        energy: confirmation.map(|confirmation| confirmation.response.energy),
        ..frame(job, &scene)
    })
}

/// What a report says whatever came of the fit.
fn frame(job: &Job, scene: &Scene) -> CalibrationReport {
    let (problem, lead) = (&job.problem, job.problem.lead());
    let (measured, comparison) = (&lead.measured, &lead.comparison);
    let record = measured.record();
    let label = record.map_or("recorded", record_label);
    let record_notes = match measured {
        Measured::Published(measured) => published_notes(&measured.published),
        Measured::Record(_) if label == "recorded" => Vec::new(),
        Measured::Record(_) => record.map_or_else(Vec::new, |record| record.comments.clone()),
    };
    let mut settings = vec![
        ("runs a damping law".into(), problem.evaluations.to_string()),
        ("cutoff of data and runs".into(), format!("{:.0} kHz", comparison.cutoff * 1e-3)),
    ];
    if let Reduction::Fingerprint(fingerprint) = &comparison.reduction {
        let threshold = match fingerprint.measurand() {
            Measurand::Velocity => format!("{:.1} mm/s", fingerprint.threshold() * 1e3),
            Measurand::Pressure => format!("{:.3} kPa", fingerprint.threshold() * 1e-3),
        };
        settings.push(("onset threshold".into(), threshold));
    }
    CalibrationReport {
        title: measured.path().display().to_string(),
        measurand: problem.quantity,
        record_label: label.into(),
        record_notes,
        warnings: problem.warnings(),
        diagnosis: Vec::new(),
        scene: scene.name.clone(),
        scene_description: scene.description.clone(),
        model: problem.model().into(),
        drive_frequency: scene.drive.frequency,
        laws: Vec::new(),
        excluded: Vec::new(),
        preference: None,
        separation: Vec::new(),
        drive: displacement(scene),
        drive_origin: drive_origin(lead),
        recorded: record.map(|record| record.series.clone()),
        simulated: None,
        alignment: String::new(),
        window: None,
        features: Vec::new(),
        alpha_sweep: None,
        energy: None,
        assumptions: problem.assumptions.clone(),
        label: if problem.shots.len() == 1 { String::new() } else { problem.labels().swap_remove(0) },
        companions: Vec::new(),
        provenance: Provenance {
            version: job.program.rsplit(' ').next().unwrap_or_default().into(),
            command_line: manifest::command_line(&job.arguments),
            seed: problem.seed,
            inputs: problem.shots.iter().flat_map(inputs).collect(),
            settings,
        },
    }
}

/// The files of a record.
fn inputs(shot: &Shot) -> Vec<InputFile> {
    let kind = |record: &Record| format!("{} record", record.kind.name());
    let record = InputFile {
        role: shot.measured.record().map_or_else(|| "published features".into(), kind),
        path: shot.measured.path().display().to_string(),
        sha256: shot.measured.sha256().into(),
    };
    let drive = shot.bench.drive.as_ref().map(|drive| &drive.input);
    let horn_tip = |Input { path, sha256 }: &Input| InputFile {
        role: "horn-tip record".into(),
        path: path.display().to_string(),
        sha256: sha256.clone(),
    };
    std::iter::once(record).chain(drive.map(horn_tip)).collect()
}

/// Where a drive comes from, for people.
pub(super) fn drive_origin(shot: &Shot) -> String {
    let drive = shot.bench.drive.as_ref();
    drive.map_or_else(|| "the scene's own drive".into(), |drive| drive.input.path.display().to_string())
}

/// What a record is called: `recorded`, unless its comments own up to be something else.
pub(super) fn record_label(record: &Record) -> &'static str {
    let says = |words: &str| record.comments.iter().any(|comment| comment.to_lowercase().contains(words));
    match says("not a measurement") {
        false => "recorded",
        true if says("granchain twin") => "twin",
        true => "reconstruction",
    }
}

/// Where published numbers come from, for the head of a report.
fn published_notes(published: &PublishedFeatures) -> Vec<String> {
    let mut notes = vec!["Published numbers only: there is no waveform to compare with.".to_owned()];
    let told = [&published.title, &published.source].map(|text| text.trim().to_owned());
    notes.extend(told.into_iter().filter(|text| !text.is_empty()));
    notes
}

/// The simulated trace where it was simulated: beyond the end of the run there is nothing to draw.
pub(super) fn simulated_span(confirmation: &Confirmation) -> Series {
    let simulated = &confirmation.simulated;
    simulated.window(simulated.start, confirmation.response.observed_velocity().end() + confirmation.offset)
}

pub(super) fn alignment(confirmation: &Confirmation) -> String {
    let Some(similarity) = confirmation.recorded.as_ref().map(|recorded| &recorded.similarity) else {
        return "none; times are the model's own".into();
    };
    format!(
        "aligned by the first crossing of the onset threshold (record time = model time {:+.2} µs); normalised \
         cross-correlation {:.2}, {:.2} at the best of the equally valid drive-period shifts ({:+})",
        confirmation.offset * 1e6,
        similarity.unshifted_correlation,
        similarity.correlation,
        similarity.shift_periods
    )
}

/// Name of a damping law for people.
fn law_name(kind: &str) -> &str {
    match kind {
        "kuwabara-kono" => "Kuwabara–Kono",
        other => other,
    }
}

/// Unit that a parameter is shown in, and what its SI value is multiplied by.
fn shown_unit(parameter: &Parameter) -> (f64, &str) {
    match parameter.target {
        Target::Gap => (1e9, "nm"),
        Target::Precompression => (1e3, "mN"),
        Target::Bandwidth => (1e-3, "kHz"),
        Target::Damping | Target::LinearDamping | Target::KuwabaraKonoDamping if parameter.unit == "N s/m" => {
            (1.0, "N·s/m")
        }
        Target::Damping | Target::LinearDamping | Target::KuwabaraKonoDamping => (1.0, "N·s·m^(-3/2)"),
        Target::Alpha | Target::SupportStiffness => (1.0, &parameter.unit),
    }
}

/// Value of a parameter at a coordinate, in the unit it is shown in.
fn shown_value(parameter: &Parameter, u: f64) -> f64 {
    parameter.value(u) * shown_unit(parameter).0
}

/// One estimate for people.
pub(super) fn shown_estimate(estimate: &fit::Estimate, parameter: &Parameter, kind: DampingKind) -> Estimate {
    let (name, symbol) = match parameter.target {
        Target::Alpha => ("amplitude scale", "α"),
        Target::Damping if kind == DampingKind::KuwabaraKono => ("damping coefficient", "γ"),
        Target::Damping => ("damping coefficient", "c"),
        Target::LinearDamping => ("linear damping coefficient", "c"),
        Target::KuwabaraKonoDamping => ("Kuwabara–Kono damping coefficient", "γ"),
        Target::Precompression => ("precompression", "F₀"),
        Target::SupportStiffness if parameter.unit == "1" => ("stiffness factor of the annulus", "κ"),
        Target::SupportStiffness => ("stiffness of the spring", "k"),
        Target::Gap => ("gap before the first bead", "g"),
        Target::Bandwidth => ("bandwidth of the instrument", "B"),
    };
    let (factor, unit) = shown_unit(parameter);
    Estimate {
        name: name.into(),
        symbol: symbol.into(),
        unit: unit.into(),
        value: factor * estimate.value,
        low: Some(factor * estimate.low),
        high: Some(factor * estimate.high),
        bounds: (factor * parameter.low, factor * parameter.high),
        at_bound: estimate.at_bound,
    }
}

/// One fit of one law, on whatever rung; the rungs side by side are added by the caller.
pub fn law_report(law: &FittedCandidate, fit: &Fit, problem: &Problem) -> LawReport {
    let quoted = |bound: f64| fit.verdict.explains().then_some(bound);
    let parameters = fit.estimates.iter().zip(&fit.parameters).map(|(estimate, parameter)| {
        let shown = shown_estimate(estimate, parameter, law.candidate.scene().damping.kind);
        Estimate { low: shown.low.and_then(quoted), high: shown.high.and_then(quoted), ..shown }
    });
    let extent = |lobe: &crate::calibration::posterior::Lobe| {
        let ends = fit.parameters.iter().enumerate();
        ends.map(|(d, parameter)| (shown_value(parameter, lobe.low[d]), shown_value(parameter, lobe.high[d]))).collect()
    };
    let misfits = problem.misfits(fit);
    let failures = crate::calibration::outcome::failures(fit);
    LawReport {
        damping_kind: law_name(&law.candidate.law).into(),
        mount: law.mount(),
        rungs: None,
        shares: Vec::new(),
        verdict: fit.verdict,
        p_value: Some(fit.agreement.p),
        pulls: pulls(fit, problem),
        misfit: fit.misfit,
        parameters: parameters.collect(),
        correlation: (fit.parameters.len() > 1).then_some(fit.correlation),
        lobes: fit.lobes.iter().map(|lobe| Lobe { mass: lobe.mass, extent: extent(lobe) }).collect(),
        log_evidence: Some(fit.log_evidence),
        map: density_map(fit, &fit.posterior),
        pairs: pair_maps(fit),
        runs: fit
            .runs
            .iter()
            .zip(misfits)
            .map(|(run, misfit)| RunPoint {
                parameters: run.position.iter().zip(&fit.parameters).map(|(u, p)| shown_value(p, *u)).collect(),
                misfit,
            })
            .collect(),
        history: fit.history.clone(),
        evaluations: fit.runs.len() as u64,
        failed_runs: fit.failed() as u64,
        failures: failures.into_iter().map(|(reason, count)| format!("{count} × {reason}")).collect(),
    }
}

/// What is left of every feature of every record at the answer; of further records with their number.
fn pulls(fit: &Fit, problem: &Problem) -> Vec<Pull> {
    let comparisons = problem.shots.iter().map(|shot| &shot.comparison);
    let several = problem.shots.len() > 1;
    let names = comparisons.zip(problem.labels()).flat_map(|(comparison, label)| {
        let name = move |name: std::borrow::Cow<'static, str>| {
            if several { format!("{label} {name}") } else { name.into_owned() }
        };
        comparison.names().into_iter().map(name).zip(comparison.weights.clone()).collect::<Vec<_>>()
    });
    let each = names.zip(&fit.agreement.pulls).zip(&fit.inflation);
    let counted = each.filter(|(((_, weight), _), _)| *weight > 0.0);
    counted.map(|(((name, _), pull), more)| Pull { name, pull: *pull, widened: (1.0 + more).sqrt() }).collect()
}

/// Every pair of more than two parameters.
fn pair_maps(fit: &Fit) -> Vec<PairMap> {
    let count = if fit.parameters.len() > 2 { fit.parameters.len() } else { 0 };
    let pairs = (0..count).flat_map(|first| (first + 1..count).map(move |second| (first, second)));
    let map = |(first, second)| PairMap {
        first,
        second,
        map: pair_map([&fit.parameters[first], &fit.parameters[second]], &fit.posterior.marginal(first, second)),
    };
    pairs.map(map).collect()
}

/// The posterior over both of two parameters, relative to its largest value.
pub(super) fn density_map(fit: &Fit, posterior: &Posterior) -> Option<DensityMap> {
    let [first, second] = fit.parameters.as_slice() else { return None };
    Some(match posterior.frame {
        Some(_) => pair_map([first, second], &posterior.marginal(0, 1)),
        None => pair_map([first, second], posterior),
    })
}

fn pair_map(parameters: [&Parameter; 2], posterior: &Posterior) -> DensityMap {
    let cells = posterior.cells;
    let along = |d: usize| {
        (0..cells)
            .map(|i| {
                let u = posterior.low[d] + (posterior.high[d] - posterior.low[d]) * (i as f64 + 0.5) / cells as f64;
                shown_value(parameters[d], u)
            })
            .collect()
    };
    let largest = posterior.mass.iter().copied().fold(0.0, f64::max);
    let density =
        (0..cells * cells).map(|index| posterior.mass[(index % cells) * cells + index / cells] / largest).collect();
    DensityMap { x: along(0), y: along(1), density, accepted_level: posterior.level() / largest }
}

pub(super) fn feature_rows(
    Shot { measured, comparison, .. }: &Shot,
    quantity: Measurand,
    scene: &Scene,
    confirmation: &Confirmation,
) -> Vec<FeatureRow> {
    let printed = match measured {
        Measured::Record(measured) => {
            PublishedFeatures::read(&measured.record.path.with_file_name(manifest::PUBLISHED)).ok()
        }
        Measured::Published(measured) => Some(measured.published.clone()),
    };
    let in_code = published(scene).filter(|_| measured.record().is_some());
    let rows = confirmation.features.iter().map(|feature| {
        let simulated = feature.simulated.as_ref();
        let statement = printed.as_ref().and_then(|printed| statement_on(printed, &feature.key));
        let (value, uncertainty) = match statement.map(|feature| &feature.statement) {
            Some(Statement::Value { value, uncertainty, .. }) => (Some(*value), *uncertainty),
            _ => (
                in_code.and_then(|published| match feature.key.as_str() {
                    "positive_peak" => Some(published.measured.positive_m_per_s),
                    "negative_peak" => Some(published.measured.negative_m_per_s),
                    _ => None,
                }),
                None,
            ),
        };
        let fitted = match measured {
            // Of a pressure a harmonic's line is compared by the band around it.
            Measured::Record(_) => {
                let band = feature.key.replace("line_", "band_");
                let same = |name: &str| name == feature.key || (quantity == Measurand::Pressure && name == band);
                comparison.names().iter().any(|name| same(name))
            }
            Measured::Published(published) => published.printed.value(&feature.key).is_some(),
        };
        FeatureRow {
            name: feature.key.replace('_', " "),
            unit: feature.unit.clone(),
            recorded: feature.measured.filter(|_| measured.record().is_some()),
            simulated: simulated.map(|spread| spread.mean),
            scatter: simulated.map(|spread| spread.scatter),
            sensitivity: simulated.map(|spread| spread.sensitivity),
            published: value,
            published_uncertainty: uncertainty,
            fitted,
        }
    });
    rows.filter(|row| row.recorded.is_some() || row.simulated.is_some()).collect()
}

/// The printed statement on a watched number: the amplitude of a line is `line_P/Q` there and `amplitude_P/Q` in print.
fn statement_on<'a>(printed: &'a PublishedFeatures, key: &str) -> Option<&'a PublishedFeature> {
    match key.strip_prefix("line_") {
        Some(ratio) => printed.feature(&format!("amplitude_{ratio}")),
        None => printed.feature(key),
    }
}

/// Draw drive, record and the uncalibrated response, before any fit.
///
/// # Errors
/// When the run fails or the folder cannot be written.
pub fn dry_run(job: &Job, target: &Path, force: bool, session: &Session) -> anyhow::Result<Outcome> {
    let problem = &job.problem;
    let plan = EnsemblePlan::new(2, problem.seed);
    let mut scene = problem.candidates[0].scene().clone();
    scene.model.kind = ModelKind::Chain;
    let measured = &problem.lead().measured;
    let confirmation = confirm_measured(measured, &scene, &Bodies::new(None), (&plan, None), None)?;
    let report = CalibrationReport {
        simulated: Some(simulated_span(&confirmation)),
        alignment: alignment(&confirmation),
        window: Some(confirmation.window),
        ..frame(job, &scene)
    };
    let name =
        target.file_name().map_or_else(|| "dry-run".into(), |name| format!("{}-dry-run", name.to_string_lossy()));
    let folder = OutputFolder::stage(&target.with_file_name(name), &[], force)?;
    for (name, bytes) in report.preview()? {
        folder.write(name, bytes)?;
    }
    let place = folder.finish()?;
    let window: Window = confirmation.window;
    let peaks = |features: &Features| {
        let Peaks { positive, negative, .. } = features.peaks;
        match problem.quantity {
            Measurand::Velocity => format!("{:+.0} and {:+.0} mm/s", positive * 1e3, negative * 1e3),
            Measurand::Pressure => format!("{:+.1} and {:+.1} kPa", positive * 1e-3, negative * 1e-3),
        }
    };
    let compared = confirmation.recorded.as_ref().map_or_else(
        || " (published features are compared only after a fit)".to_owned(),
        |recorded| {
            format!(", record {}, correlation {:.2}", peaks(&recorded.features), recorded.similarity.correlation)
        },
    );
    let text = format!(
        "Nothing was fitted. Uncalibrated response at α = {}: peaks {}{compared}\nin the window {:.0} … {:.0} µs. Figures: {}\n",
        significant(scene.amplitude_scale, 3),
        peaks(&confirmation.simulated_features),
        window.from * 1e6,
        window.to * 1e6,
        place.display()
    );
    session.result(text, &confirmation.simulated_features)?;
    Ok(Outcome::Done)
}

/// What is said on the terminal at the end.
pub fn text(outcome: &CalibrationOutcome, measured: &str, place: &Path) -> String {
    let mut text = String::new();
    let mount = outcome.mount.as_ref().map_or_else(String::new, |mount| format!(", {mount} disc"));
    let law = law_name(&outcome.damping_kind);
    let _ = writeln!(text, "{}: {} with {law} damping{mount}", outcome.verdict, outcome.scene);
    let widest = outcome.parameters.keys().map(String::len).max().unwrap_or(0).max(8);
    for (name, parameter) in &outcome.parameters {
        let interval = match (parameter.low, parameter.high) {
            (Some(low), Some(high)) => {
                format!("   90 % interval {} … {}", significant(low, 4), significant(high, 4))
            }
            _ => "   no interval is quoted".into(),
        };
        let unit = if parameter.unit == "1" { "" } else { &parameter.unit };
        let bound = if parameter.at_bound { "   at a bound of the search" } else { "" };
        let untold = if parameter.unidentified { "   unidentified" } else { "" };
        let _ = writeln!(text, "  {name:<widest$} {} {unit}{interval}{bound}{untold}", significant(parameter.value, 4));
    }
    for warning in &outcome.warnings {
        let _ = writeln!(text, "  warning: {warning}");
    }
    for (number, finding) in outcome.diagnosis.iter().enumerate() {
        let lead = if number == 0 { "  look at: " } else { "       or: " };
        let _ = writeln!(text, "{lead}{}", finding.text);
    }
    for key in ["positive_peak", "negative_peak", "ratio_1/3", "ratio_2/3", "thd"] {
        // The distortion says more of a train of pulses than of a bead's motion.
        if key == "thd" && outcome.quantity == Measurand::Velocity {
            continue;
        }
        if let Some(feature) = outcome.features.get(key) {
            let _ = writeln!(text, "  {key:<14} {}", feature_text(feature, measured));
        }
    }
    let _ = writeln!(text, "  farthest off   {}; p = {}", farthest(outcome), significant(outcome.p_value, 2));
    if let Some(preferred) = &outcome.preferred_law {
        let _ = writeln!(text, "  preferred law: {preferred}");
    }
    if let Some(preferred) = &outcome.preferred_mount {
        let _ = writeln!(text, "  preferred mount: {preferred}");
    }
    for (candidate, reason) in &outcome.excluded {
        let _ = writeln!(text, "  {candidate}: no fit; {reason}");
    }
    for statement in &outcome.statements {
        let _ = writeln!(text, "{statement}");
    }
    let _ = writeln!(
        text,
        "{} runs, {} failed. Report: {}",
        outcome.evaluations,
        outcome.failed_runs,
        std::env::current_dir()
            .map_or(place, |here| place.strip_prefix(here).unwrap_or(place))
            .join("report.html")
            .display()
    );
    text
}

/// The three fitted features that are farthest off, and up to five that no run has.
fn farthest(outcome: &CalibrationOutcome) -> String {
    let mut off: Vec<(&String, f64, bool)> = outcome
        .fitted_features
        .iter()
        .filter_map(|(name, feature)| Some((name, feature.deviation?, feature.widened.is_some())))
        .collect();
    off.sort_by(|a, b| b.1.abs().total_cmp(&a.1.abs()));
    let shown = off.iter().filter(|(.., widened)| *widened).count().clamp(3, 5);
    let said = off.iter().take(shown).map(|(name, deviation, widened)| {
        format!("{name} {deviation:+.1}{}", if *widened { " (down-weighted)" } else { "" })
    });
    format!("{} scatters", said.collect::<Vec<_>>().join(", "))
}

fn feature_text(feature: &crate::calibration::outcome::OutcomeFeature, measured: &str) -> String {
    let (factor, unit) = match feature.unit.as_str() {
        "m/s" => (1e3, " mm/s"),
        "Pa" => (1e-3, " kPa"),
        _ => (1.0, ""),
    };
    let shown = |value: Option<f64>| value.map_or_else(|| "–".into(), |value| significant(value * factor, 3));
    format!(
        "{measured} {}{unit}, model {} ± {}{unit}",
        shown(feature.measured),
        shown(feature.simulated),
        shown(feature.scatter)
    )
}
