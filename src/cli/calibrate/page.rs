//! From a finished fit to the report, the dry run's figure and the text on the terminal.

use std::{fmt::Write, path::Path, time::Duration};

use super::{Job, bench, manifest};
use crate::{
    calibration::{
        Fitted, Problem,
        drive::displacement,
        fit::Fit,
        forward::Run,
        outcome::{CalibrationOutcome, FitOutcome, FittedFeature},
        parameter::Parameter,
        posterior::Posterior,
        recorded_run::RecordedRun,
    },
    cli::{
        Outcome,
        arguments::Session,
        output::{OutputFolder, page_results},
        summary,
    },
    feature::{Features, Measurand, Peaks, Window, fingerprint::Fingerprint},
    measurement::Record,
    report::{
        calibration::{
            CalibrationReport, DensityMap, LawReport, PairMap, RecordReport, RunPoint, law_name, named_number,
        },
        number::significant,
    },
    scene::{ModelKind, Scene},
    signal::Series,
    study::{
        Bodies, EnsemblePlan,
        predicted::{Predictions, predict_measured},
        prediction::PredictiveRun,
        replicates::Unwatched,
    },
};

/// The report of a calibration, plain and in SI.
pub fn report(job: &Job, fitted: &Fitted, predicted: &Predictions, outcome: &CalibrationOutcome) -> CalibrationReport {
    let (problem, best) = (&job.problem, fitted.best());
    let prediction = predicted.predictions[0].as_ref();
    let scene = best.scene(0);
    let recorded_runs = problem.recorded_runs.iter().zip(&predicted.predictions).enumerate();
    let records = recorded_runs.map(|(number, (recorded_run, prediction))| RecordReport {
        residual: residual(&best.fit, number),
        instrument: instrument(&best.fit, number, recorded_run),
        ..record(problem, (number, recorded_run), &best.scene(number), prediction.as_ref())
    });
    CalibrationReport {
        outcome: outcome.clone(),
        records: records.collect(),
        laws: fitted
            .ranked()
            .into_iter()
            .map(|law| LawReport {
                took: law.took.iter().map(Duration::as_secs_f64).collect(),
                ..law_report(&law.fit, problem)
            })
            .collect(),
        energy: prediction.map(|prediction| prediction.response.energy),
        ..frame(job, &scene)
    }
}

/// What a report says whatever came of the fit.
fn frame(job: &Job, scene: &Scene) -> CalibrationReport {
    let (problem, comparison) = (&job.problem, &job.problem.lead().comparison);
    let mut settings = vec![
        ("runs of the chain per damping law".into(), problem.evaluations.to_string()),
        ("cutoff of data and runs".into(), format!("{:.0} kHz", comparison.cutoff * 1e-3)),
    ];
    let fingerprint = &comparison.fingerprint;
    let threshold = match fingerprint.measurand() {
        Measurand::Velocity => format!("{:.1} mm/s", fingerprint.threshold() * 1e3),
        Measurand::Pressure => format!("{:.3} kPa", fingerprint.threshold() * 1e-3),
    };
    let name = if fingerprint.falls() { "rms below which the response falls" } else { "onset threshold" };
    settings.push((name.into(), threshold));
    CalibrationReport {
        outcome: CalibrationOutcome { program: job.program.clone(), ..problem.outcome() },
        scene: scene.name.clone(),
        scene_description: summary::in_words(scene),
        drive_frequency: scene.drive.frequency,
        bench: bench::bench(job, scene),
        records: Vec::new(),
        laws: Vec::new(),
        energy: None,
        settings,
        command_line: manifest::command_line(&job.arguments),
    }
}

/// A record, its number with it, and the response held against it, where that could be run.
fn record(
    problem: &Problem,
    (number, recorded_run): (usize, &RecordedRun),
    scene: &Scene,
    prediction: Option<&PredictiveRun>,
) -> RecordReport {
    let record = &recorded_run.measured.record;
    let label = record_label(record);
    let names = recorded_run.comparison.names().into_iter().zip(&recorded_run.comparison.weights);
    RecordReport {
        label: if problem.recorded_runs.len() == 1 { String::new() } else { problem.labels().swap_remove(number) },
        title: recorded_run.measured.path().display().to_string(),
        record_label: label.into(),
        record_notes: if label == "recorded" { Vec::new() } else { record.comments.clone() },
        drive: displacement(scene),
        drive_origin: drive_origin(recorded_run),
        recorded: record.series.clone(),
        simulated: prediction.map(simulated_span),
        residual: Vec::new(),
        instrument: Vec::new(),
        alignment: prediction.map_or_else(String::new, |found| alignment(found, &recorded_run.comparison.fingerprint)),
        masked: masked(record),
        observed: prediction.map_or_else(Default::default, |prediction| prediction.response.observed),
        window: prediction.map(|prediction| prediction.window),
        compared: names.filter(|(_, weight)| **weight > 0.0).map(|(name, _)| name.into_owned()).collect(),
    }
}

/// What is left of a record where its waveform decided.
fn residual(fit: &Fit, number: usize) -> Vec<(f64, f64, f64)> {
    let waveform = fit.waveform.as_ref().filter(|waveform| waveform.decides());
    let Some(of) = waveform.and_then(|waveform| waveform.residuals.get(number)) else { return Vec::new() };
    let each = of.times.iter().zip(&of.left).zip(&of.deviations);
    each.map(|((time, left), deviation)| (*time, *left, *deviation)).collect()
}

/// Averages and crosstalk of a record, in sentences.
fn instrument(fit: &Fit, number: usize, recorded_run: &RecordedRun) -> Vec<String> {
    let averages = recorded_run.comparison.averages;
    let mean = (averages > 1).then(|| format!("The record is the mean of {averages} shots."));
    let crosstalk = fit.waveform.as_ref().and_then(|waveform| waveform.crosstalk(number)).map(|found| {
        let [share, deviation] = found.map(|share| 100.0 * share);
        format!("The record holds crosstalk of the drive, {share:.1} ± {deviation:.1} % of the peak.")
    });
    mean.into_iter().chain(crosstalk).collect()
}

/// The stretches of a record that are bridged, up to its ends.
fn masked(record: &Record) -> Vec<(f64, f64)> {
    let (start, end) = (record.series.start, record.series.end());
    record.masked.iter().map(|masked| (masked.gap.from.max(start), masked.gap.to.min(end))).collect()
}

/// Where a drive comes from, for people.
fn drive_origin(recorded_run: &RecordedRun) -> String {
    let drive = recorded_run.bench.drive.as_ref();
    drive.map_or_else(|| "the scene's own drive".into(), |drive| drive.input.path.display().to_string())
}

/// What a record is called: `recorded`, unless its comments own up to be something else.
fn record_label(record: &Record) -> &'static str {
    let says = |words: &str| record.comments.iter().any(|comment| comment.to_lowercase().contains(words));
    match says("not a measurement") {
        false => "recorded",
        true if says("granchain twin") => "synthetic",
        true => "reconstruction",
    }
}

/// The simulated trace where it was simulated: beyond the end of the run there is nothing to draw.
fn simulated_span(prediction: &PredictiveRun) -> Series {
    let simulated = &prediction.simulated;
    simulated.window(simulated.start, prediction.response.observed_velocity().end() + prediction.offset)
}

fn alignment(prediction: &PredictiveRun, fingerprint: &Fingerprint) -> String {
    let similarity = &prediction.recorded.similarity;
    let by = if fingerprint.falls() {
        "its fall at the end of the burst and its similarity"
    } else if fingerprint.lies_somewhere() {
        "its similarity"
    } else {
        "its onset"
    };
    format!(
        "the record is aligned with the model by {by} (record time = model time {:+.2} µs). The normalised cross-correlation is then {:.2}; at the best \
         shift by whole drive periods it is {:.2} (shift {:+})",
        prediction.offset * 1e6,
        similarity.unshifted_correlation,
        similarity.correlation,
        similarity.shift_periods
    )
}

/// What is drawn of one fit of one law, and of the fit on the model below it.
fn law_report(fit: &Fit, problem: &Problem) -> LawReport {
    let run = |(run, misfit): (&Run, Option<f64>)| RunPoint {
        parameters: run.position.iter().zip(&fit.parameters).map(|(u, parameter)| parameter.value(*u)).collect(),
        misfit,
    };
    LawReport {
        parameters: fit.parameters.iter().map(|parameter| parameter.name.clone()).collect(),
        map: density_map(fit, &fit.posterior),
        pairs: pair_maps(fit),
        runs: fit.runs.iter().zip(problem.misfits(fit)).map(run).collect(),
        alone: fit.shares.iter().map(|share| density_map(fit, &share.posterior)).collect(),
        below: fit.below.as_ref().map(|below| Box::new(law_report(&below.fit, problem))),
        took: Vec::new(),
    }
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
fn density_map(fit: &Fit, posterior: &Posterior) -> Option<DensityMap> {
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
                parameters[d].value(u)
            })
            .collect()
    };
    let largest = posterior.mass.iter().copied().fold(0.0, f64::max);
    let density =
        (0..cells * cells).map(|index| posterior.mass[(index % cells) * cells + index / cells] / largest).collect();
    DensityMap { x: along(0), y: along(1), density, accepted_level: posterior.level() / largest }
}

/// What a dry run measured of the uncalibrated response.
const DRY_RUN: &str = "dry-run.json";

/// Drive, record and the uncalibrated response, before any fit.
pub struct Preview {
    pub report: CalibrationReport,
    pub features: Features,
    /// In two lines.
    pub text: String,
}

/// Run the scene as it is given, and hold it against the record.
pub fn preview(job: &Job) -> anyhow::Result<Preview> {
    let problem = &job.problem;
    let plan = EnsemblePlan::new(2, problem.seed);
    let mut scene = problem.candidates[0].scene().clone();
    scene.model.kind = ModelKind::Chain;
    let measured = &problem.lead().measured;
    let prediction = predict_measured(measured, &scene, &Bodies::new(None), (&plan, None), None, &Unwatched)?;
    let lead = record(problem, (0, problem.lead()), &scene, Some(&prediction));
    let mut report = CalibrationReport { records: vec![lead], ..frame(job, &scene) };
    for row in &mut report.bench.rows {
        row.origin = row.origin.replace("fitted", "to be fitted");
    }
    let window: Window = prediction.window;
    let peaks = |features: &Features| {
        let Peaks { positive, negative, .. } = features.peaks;
        match problem.quantity {
            // What is far too small is to be seen as that, not as 0.
            Measurand::Velocity if positive - negative < 0.02 => {
                format!("{:+.2e} and {:+.2e} mm/s", positive * 1e3, negative * 1e3)
            }
            Measurand::Velocity => format!("{:+.0} and {:+.0} mm/s", positive * 1e3, negative * 1e3),
            Measurand::Pressure => format!("{:+.1} and {:+.1} kPa", positive * 1e-3, negative * 1e-3),
        }
    };
    let recorded = &prediction.recorded;
    let compared =
        format!(", record {}, correlation {:.2}", peaks(&recorded.features), recorded.similarity.correlation);
    let text = format!(
        "Nothing was fitted. Uncalibrated response of the chain at α = {}: peaks {}{compared}\nin the window {:.0} … {:.0} µs.",
        significant(scene.amplitude_scale, 3),
        peaks(&prediction.simulated_features),
        window.from * 1e6,
        window.to * 1e6
    );
    Ok(Preview { report, features: prediction.simulated_features, text })
}

/// The same, written into a folder.
pub fn dry_run(job: &Job, target: &Path, force: bool, session: &Session) -> anyhow::Result<Outcome> {
    let Preview { report, features, text } = preview(job)?;
    if target.join("calibration.json").exists() {
        anyhow::bail!(
            "{}: holds a calibration, which a dry run does not replace; name another folder with --out",
            target.display()
        );
    }
    let folder = OutputFolder::stage(target, &page_results(DRY_RUN), force)?;
    folder.write_all(report.preview()?)?;
    folder.write(DRY_RUN, summary::json(&features)?)?;
    let place = folder.finish()?;
    session.result(format!("{text} Figures: {}\n", place.display()), &features)?;
    Ok(Outcome::Done)
}

/// The verdict before causes are looked for.
pub fn verdict(fitted: &Fitted) -> String {
    let fit = &fitted.best().fit;
    format!(
        "{} (p = {}): looking for causes; Ctrl-C ends that and keeps the result",
        fit.verdict,
        significant(fit.agreement.p, 2)
    )
}

/// Summary on the terminal at the end.
pub fn text(outcome: &CalibrationOutcome, measured: &str, place: &Path) -> String {
    let mut text = String::new();
    let mount = outcome.best.mount.as_ref().map_or_else(String::new, |mount| format!(", {mount} disc"));
    let open = outcome.undecided_laws();
    let laws = if open.is_empty() { vec![&outcome.best] } else { open };
    let names: Vec<&str> = laws.iter().map(|law| law_name(&law.damping_kind)).collect();
    let undecided = if laws.len() > 1 { " (undecided)" } else { "" };
    let _ = writeln!(
        text,
        "{}: {} with {} damping{undecided}{mount}",
        outcome.best.verdict,
        outcome.scene,
        names.join(" or ")
    );
    let _ = writeln!(text, "  model    {}", answered_by(outcome));
    for law in &laws {
        if laws.len() > 1 {
            let (name, p) = (law_name(&law.damping_kind), significant(law.p_value, 2));
            let _ = writeln!(text, "  {name} damping: {}, p = {p}", law.verdict);
        }
        values(&mut text, law);
    }
    for warning in &outcome.warnings {
        let _ = writeln!(text, "  warning: {warning}");
    }
    for (number, finding) in outcome.diagnosis.iter().enumerate() {
        let lead = if number == 0 { "  look at: " } else { "       or: " };
        let _ = writeln!(text, "{lead}{}", finding.text);
    }
    let named = outcome.named_numbers();
    for number in &named {
        let [of_record, simulated, difference, unit] = named_number(number);
        let unit = if unit.is_empty() { unit } else { format!(" {unit}") };
        let _ = writeln!(
            text,
            "  {:<14} {measured} {of_record}{unit}, simulated {simulated}{unit} ({difference})",
            number.name
        );
    }
    for (key, feature) in leading(outcome).filter(|_| named.is_empty()) {
        let _ = writeln!(text, "  {key:<14} {}", feature_text(key, feature, measured));
    }
    let _ = writeln!(text, "  farthest off   {}; p = {}", farthest(outcome), significant(outcome.best.p_value, 2));
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
    let (runs, failed, page) = (outcome.best.evaluations, outcome.best.failed_runs, place.join("report.html"));
    let _ = writeln!(text, "{runs} runs, {failed} not usable. Report: {}", page.display());
    text
}

/// The fitted values of one law, a line each.
fn values(text: &mut String, law: &FitOutcome) {
    let widest = law.parameters.keys().map(String::len).max().unwrap_or(0).max(8);
    for (name, parameter) in &law.parameters {
        let interval = match (parameter.low, parameter.high) {
            (Some(low), Some(high)) => {
                format!("   90 % interval {} … {}", significant(low, 4), significant(high, 4))
            }
            _ => "   no interval is quoted".into(),
        };
        let unit = if parameter.unit == "1" { "" } else { &parameter.unit };
        let bound = if parameter.at_bound { "   at a bound of the search" } else { "" };
        let unstated = if parameter.unidentified { "   unidentified" } else { "" };
        let _ =
            writeln!(text, "  {name:<widest$} {} {unit}{interval}{bound}{unstated}", significant(parameter.value, 4));
    }
}

/// The model that answers, and the one that searched.
fn answered_by(outcome: &CalibrationOutcome) -> String {
    match outcome.best.fidelities.first().filter(|fidelity| fidelity.model != outcome.model) {
        Some(below) => {
            let between = &outcome.best.fidelities[1..];
            let above = between.iter().take_while(|fidelity| fidelity.model != outcome.model);
            let above: String = above.map(|fidelity| format!(", above the {} model", fidelity.model)).collect();
            format!("{}{above}, searched on the {}", outcome.model, below.model)
        }
        None => outcome.model.clone(),
    }
}

/// `+0.4` or `−0.4`.
fn signed(value: f64) -> String {
    format!("{value:+.1}").replace('-', "−")
}

/// The three fitted features that are farthest off, and up to five that no run has.
fn farthest(outcome: &CalibrationOutcome) -> String {
    let mut off: Vec<(&String, f64, bool)> = outcome
        .best
        .fitted_features
        .iter()
        .filter_map(|(name, feature)| Some((name, feature.deviation?, feature.widened.is_some())))
        .collect();
    off.sort_by(|a, b| b.1.abs().total_cmp(&a.1.abs()));
    let shown = off.iter().filter(|(.., widened)| *widened).count().clamp(3, 5);
    let texts = off.iter().take(shown).map(|(name, deviation, widened)| {
        format!("{name} {}{}", signed(*deviation), if *widened { " (down-weighted)" } else { "" })
    });
    format!("{} SD of a run", texts.collect::<Vec<_>>().join(", "))
}

/// The fitted features that say most: the peaks, and the lines of a third or of the drive.
fn leading(outcome: &CalibrationOutcome) -> impl Iterator<Item = (&str, &FittedFeature)> {
    let names = [
        "positive_peak",
        "negative_peak",
        "band_1/3",
        "band_2/3",
        "ratio_1/3",
        "ratio_2/3",
        "amplitude_1/3",
        "amplitude_2/3",
        "band_1",
        "thd",
    ];
    let fitted = &outcome.best.fitted_features;
    names.into_iter().filter_map(|name| Some((name, fitted.get(name).filter(|it| it.measured.is_some())?))).take(4)
}

fn feature_text(key: &str, feature: &FittedFeature, measured: &str) -> String {
    let (factor, unit) = match feature.unit.as_str() {
        "m/s" => (1e3, " mm/s"),
        "Pa" => (1e-3, " kPa"),
        _ => (1.0, ""),
    };
    let factor = if key == "negative_peak" { -factor } else { factor };
    let shown = |value: Option<f64>| value.map_or_else(|| "–".into(), |value| significant(value * factor, 3));
    let range = feature.range().map(|ends| format!("{} to {}", shown(Some(ends[0])), shown(Some(ends[1]))));
    let deviation = feature.deviation.map(|pull| format!("{} SD", signed(pull)));
    let about: Vec<String> = range.into_iter().chain(deviation).collect();
    format!(
        "{measured} {}{unit}, model {}{unit} ({})",
        shown(feature.measured),
        shown(feature.expected),
        about.join("; ")
    )
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_printed_numbers_of_a_feature_give_its_deviation() {
        let (measured, expected, scatter) = (0.0507_f64, 0.0178_f64, 0.478);
        let feature = FittedFeature {
            measured: Some(measured),
            deviation: Some((expected / measured).ln() / scatter),
            expected: Some(expected),
            scatter: Some(scatter),
            widened: None,
            model_error: None,
            unit: "m/s".into(),
        };
        let text = feature_text("band_1/3", &feature, "record");
        assert_eq!(text, "record 50.7 mm/s, model 17.8 mm/s (11.0 to 28.7; −2.2 SD)");
        // By hand, from what is printed.
        let by_hand = (17.8_f64 / 50.7).ln() / (28.7_f64 / 17.8).ln();
        assert!((by_hand - -2.2).abs() < 0.05, "{by_hand}");
    }
}
