//! The tables of a calibration, for people and as CSV.

use std::collections::{BTreeMap, BTreeSet};

use super::{
    CalibrationReport, LawReport, RecordReport,
    shown::{Estimate, Law, estimates, law_name},
};
use crate::{
    number::{short, significant, to_uncertainty, unit, with_interval},
    page::{Column, Files, ReportError, Table, csv_bytes},
    sweep::{capitalised, shown_unit},
};
use granchain_calibration::{
    outcome::{NamedNumber, OutcomeFeature},
    waveform::Origin,
};
use granchain_signal::feature::Measurand;

const NOTHING: &str = "–";

/// As [`shown_unit`]; a pressure here is sound.
fn sound_unit(unit: &str) -> (f64, &str) {
    if unit == "Pa" { (1e-3, "kPa") } else { shown_unit(unit) }
}

/// The numbers named first, as they are printed: record, simulation ± standard deviation, difference, and their unit.
pub fn named_number(number: &NamedNumber) -> [String; 4] {
    let (factor, unit) = sound_unit(number.unit);
    let [measured, simulated, deviation] =
        [number.measured, number.simulated, number.deviation].map(|value| factor * value);
    let least = deviation.max(1e-3 * simulated.abs());
    [
        to_uncertainty(measured, least),
        format!("{} ± {}", to_uncertainty(simulated, least), significant(deviation, 2)),
        format!("{:+.1} %", 100.0 * number.difference()).replace('-', "−"),
        if unit == "1" { String::new() } else { unit.to_owned() },
    ]
}

/// Peaks and ratios of record and simulation.
pub(super) fn named_numbers(report: &CalibrationReport) -> Option<Table> {
    let rows: Vec<Vec<String>> = report
        .outcome
        .named_numbers()
        .iter()
        .map(|number| {
            let [measured, simulated, difference, unit] = named_number(number);
            vec![capitalised(number.name), measured, simulated, difference, unit]
        })
        .collect();
    (!rows.is_empty()).then(|| Table {
        caption: "Peaks over the whole response after the onset; lines at 1/3 and 2/3 of the drive frequency over the line at the drive frequency, in \
                  the analysis window. ±: standard deviation between runs."
            .into(),
        columns: vec![
            Column::words("Velocity of the last bead"),
            Column::numbers(report.lead().record_label.clone()),
            Column::numbers("simulated"),
            Column::numbers("difference"),
            Column::words("unit"),
        ],
        rows,
    })
}

/// Least share of a variance that is listed, and from which it is called the largest part.
const LISTED: f64 = 0.005;
const LARGEST: f64 = 0.3;

/// Where the width of each interval comes from, as bars, and what would narrow it; nothing without a fit by the waveform.
pub(super) fn widths(law: &Law<'_>) -> Option<(Table, Vec<String>)> {
    let from = &law.fit.waveform.as_ref()?.width_from;
    let of = |key: &String| from.get(key).cloned().unwrap_or_default();
    let shares: Vec<BTreeMap<Origin, f64>> = law.drawn.parameters.iter().map(of).collect();
    let origins: BTreeSet<Origin> = shares.iter().flat_map(BTreeMap::keys).copied().collect();
    let bar = |share: f64| format!("{} {:.0} %", "█".repeat((20.0 * share).round() as usize), 100.0 * share);
    let listed = origins.iter().filter(|origin| shares.iter().any(|of| of.get(origin).is_some_and(|it| *it > LISTED)));
    let rows: Vec<Vec<String>> = listed
        .map(|origin| {
            let share = |of: &BTreeMap<Origin, f64>| bar(of.get(origin).copied().unwrap_or(0.0));
            let bars = shares.iter().map(share);
            [capitalised(origin.words())].into_iter().chain(bars).chain([origin.remedy().to_owned()]).collect()
        })
        .collect();
    let sentence = |(parameter, of): (&Estimate, &BTreeMap<Origin, f64>)| {
        let (origin, share) = of.iter().max_by(|a, b| a.1.total_cmp(b.1)).filter(|(_, share)| **share > LARGEST)?;
        let half = 50.0 * (parameter.high? / parameter.low?).ln();
        let without = half * (1.0 - share).max(0.0).sqrt();
        Some(format!(
            "{} is known to ± {} %; without what comes from {} it would be ± {} %. What narrows it: {}.",
            parameter.symbol,
            significant(half, 2),
            origin.words(),
            significant(without, 2),
            origin.remedy()
        ))
    };
    let sentences = law.parameters.iter().zip(&shares).filter_map(sentence).collect();
    let columns = [Column::words("Where the width comes from")].into_iter();
    let columns = columns.chain(law.parameters.iter().map(|it| Column::words(it.symbol)));
    let table = Table {
        caption: "Shares of the variance of each fitted value.".into(),
        columns: columns.chain([Column::words("what narrows it")]).collect(),
        rows,
    };
    (!table.rows.is_empty()).then_some((table, sentences))
}

/// The features that the fit compared, of record `number`: recorded, expected by the model at the answer, and what decided.
pub(super) fn fitted(law: &Law<'_>, report: &CalibrationReport, number: usize) -> Option<Table> {
    let record = &report.records[number];
    let compared = law.compared(std::slice::from_ref(record)).into_iter();
    let rows: Vec<Vec<String>> = compared
        .filter_map(|(name, feature)| {
            let (factor, shown) = sound_unit(&feature.unit);
            let (measured, expected) = (factor * feature.measured?, factor * feature.expected?);
            let scatter = feature.scatter.unwrap_or(0.0).max(1e-4) * expected.abs();
            let value = |value: f64| to_uncertainty(value, scatter);
            let range = feature.range().map(|ends| ends.map(|end| factor * end));
            Some(vec![
                name,
                value(measured),
                range.map_or_else(
                    || value(expected),
                    |[low, high]| format!("{} ({} to {})", value(expected), value(low), value(high)),
                ),
                feature.deviation.map_or(NOTHING.into(), |pull| format!("{pull:+.1}")),
                if shown == "1" { NOTHING.to_owned() } else { shown.to_owned() },
            ])
        })
        .collect();
    if rows.is_empty() {
        return None;
    }
    let columns = vec![
        Column::words("Fitted feature"),
        Column::numbers(record.record_label.clone()),
        Column::words("model (−1 SD to +1 SD)"),
        Column::numbers("deviation"),
        Column::words("unit"),
    ];
    Some(Table {
        caption: "Features compared by the fit, as magnitudes. Peaks: over the whole response after the onset. Bands and means: in its late part. Early: \
                  the given periods after the onset. Deviation: ln(model/record) in SD, after fitting; the SD is that of the logarithm and includes the run-to-run spread and the \
                  model's own error. The p of the features is calculated from these deviations."
            .into(),
        columns,
        rows,
    })
}

/// Recorded, simulated, scatter, sensitivity, of record `number`.
pub(super) fn features(report: &CalibrationReport, number: usize) -> Option<Table> {
    let record = &report.records[number];
    let watched = report.features(number);
    let rows: Vec<Vec<String>> = watched
        .iter()
        .map(|row| {
            let (factor, shown) = sound_unit(&row.feature.unit);
            let scatter = row.feature.scatter.filter(|scatter| *scatter > 0.0).map(|scatter| scatter * factor);
            // Digits down to the scatter, but never more than four figures.
            let value = |value: Option<f64>| match (value.map(|value| value * factor), scatter) {
                (Some(value), Some(scatter)) => to_uncertainty(value, scatter.max(1e-4 * value.abs())),
                (Some(value), None) => significant(value, 3),
                (None, _) => NOTHING.to_owned(),
            };
            let small = |value: Option<f64>| value.map_or(NOTHING.to_owned(), |value| significant(value * factor, 2));
            let mut cells = vec![if row.fitted { format!("{} *", row.name) } else { row.name.clone() }];
            cells.extend([
                value(row.feature.measured),
                value(row.feature.simulated),
                small(row.feature.scatter),
                small(row.feature.sensitivity),
            ]);
            cells.push(if shown == "1" { NOTHING.to_owned() } else { shown.to_owned() });
            cells
        })
        .collect();
    if rows.is_empty() {
        return None;
    }
    let mut columns = vec![Column::words("Feature"), Column::numbers(record.record_label.clone())];
    columns.extend(["simulated", "SD between runs", "for +1 % drive"].map(Column::numbers));
    columns.push(Column::words("unit"));
    Some(Table {
        caption: format!(
            "Features over the analysis window{}{}. SD between runs: standard deviation of posterior predictive runs; smaller \
             differences are not significant. Last column: its change when the drive is increased by 1 %.",
            record.window.map_or_else(String::new, |window| format!(
                ", {} to {} µs",
                significant(window.from * 1e6, 4),
                significant(window.to * 1e6, 4)
            )),
            if watched.iter().any(|row| row.fitted) { " (* used by the fit)" } else { "" }
        ),
        columns,
        rows,
    })
}

/// Every law with its parameters.
pub(super) fn laws(laws: &[Law<'_>]) -> Table {
    let mounts = laws.iter().any(|law| law.fit.mount.is_some());
    let best = laws.iter().map(|law| law.fit.log_evidence).fold(f64::NEG_INFINITY, f64::max);
    let rows = laws
        .iter()
        .flat_map(|law| {
            let fit = law.fit;
            let answering = fit.fidelities.iter().rev().find(|fidelity| fidelity.verdict.is_some());
            let runs = answering.map_or_else(String::new, |fidelity| {
                format!("{} with the model `{}` ({} not usable)", fidelity.runs, fidelity.model, fidelity.failed_runs)
            });
            law.parameters.iter().enumerate().map(move |(index, parameter)| {
                let once = |text: String| if index == 0 { text } else { String::new() };
                let unit = unit(&parameter.unit);
                let unit = if unit == "1" { String::new() } else { format!(" {unit}") };
                let interval = parameter.low.zip(parameter.high);
                let note = if parameter.at_bound { ", at a bound" } else { "" };
                let mut cells = vec![once(law_name(&fit.damping_kind).into())];
                cells.extend(mounts.then(|| once(fit.mount.clone().unwrap_or_default())));
                cells.extend([
                    format!("{} {}", parameter.name, parameter.symbol),
                    format!("{}{unit}{note}", with_interval(parameter.value, interval)),
                    format!("{} to {}{unit}", short(parameter.bounds.0), short(parameter.bounds.1)),
                    once(significant(fit.misfit, 2)),
                    once(fit.verdict.to_string()),
                    once(significant(fit.log_evidence - best, 2)),
                    once(runs.clone()),
                ]);
                cells
            })
        })
        .collect();
    let mut columns = vec![Column::words("Damping")];
    columns.extend(mounts.then(|| Column::words("Disc")));
    columns.extend([
        Column::words("Parameter"),
        Column::words("Value (90 % interval)"),
        Column::words("Range"),
        Column::numbers("Misfit").unit("1"),
        Column::words("Verdict"),
        Column::numbers("Δ ln evidence"),
        Column::words("Runs"),
    ]);
    Table {
        caption: "Fitted parameters with 90 % intervals, where they may be quoted. Misfit: mean squared deviation per feature, in squared standard deviations of a run. It is for information; the verdict depends on p only.".into(),
        columns,
        rows,
    }
}

/// What every model found by itself.
pub(super) fn cost(law: &Law<'_>) -> Table {
    let rows = law.fit.fidelities.iter().enumerate().map(|(level, fidelity)| {
        let own = estimates(&fidelity.parameters, &law.drawn.parameters, &law.fit.damping_kind);
        let values = own.into_iter().map(|own| match fidelity.verdict {
            Some(_) => with_interval(own.value, own.low.zip(own.high)),
            None => format!("{} (run there)", short(own.value)),
        });
        let runs = format!("{} ({} not usable)", fidelity.runs, fidelity.failed_runs);
        let seconds = law.drawn.took.get(level).map_or(NOTHING.to_owned(), |seconds| significant(*seconds, 2));
        let verdict = fidelity.verdict.map_or(NOTHING.to_owned(), |verdict| verdict.to_string());
        [fidelity.model.clone()].into_iter().chain(values).chain([runs, seconds, verdict]).collect()
    });
    let parameters = law.parameters.iter().map(Estimate::column);
    let further = [Column::words("Runs"), Column::numbers("Time").unit("s"), Column::words("Verdict")];
    let columns = [Column::words("Model")].into_iter().chain(parameters).chain(further);
    Table {
        caption: format!(
            "Result of each model alone (90 % intervals, if quoted) and the time of its part of the fit, {}. Times differ from run to run; all else is \
             the same.",
            law.name()
        ),
        columns: columns.collect(),
        rows: rows.collect(),
    }
}

/// The fitted features as every model expects them at the answer.
pub(super) fn fidelity_features(law: &Law<'_>, record: &RecordReport) -> Option<Table> {
    let (fit, fidelities) = (law.fit, &law.fit.fidelities);
    let compared = record.compared.iter().filter_map(|name| Some((name, fit.fidelity_differences.get(name)?)));
    let rows: Vec<Vec<String>> = compared
        .map(|(name, [difference, standard_error])| {
            let expected: Vec<_> = fidelities.iter().map(|fidelity| fidelity.features.get(name)).collect();
            let unit = expected.iter().flatten().next().map_or("1", |feature| feature.unit.as_str());
            let (factor, shown) = sound_unit(unit);
            let recorded = fit.fitted_features.get(name).and_then(|feature| feature.measured);
            let mut cells =
                vec![name.replace('_', " "), recorded.map_or(NOTHING.into(), |v| significant(v * factor, 3))];
            cells.extend(expected.iter().map(|feature| match feature.map(|it| (it.value, it.scatter)) {
                Some((value, Some(scatter))) => {
                    format!("{} ± {} %", significant(value * factor, 3), significant(100.0 * scatter, 2))
                }
                Some((value, None)) => significant(value * factor, 3),
                None => NOTHING.into(),
            }));
            cells.push(format!("{:+.1} ± {:.1}", 100.0 * difference, 100.0 * standard_error));
            cells.push(if shown == "1" { NOTHING.into() } else { shown.to_owned() });
            cells
        })
        .collect();
    if rows.is_empty() {
        return None;
    }
    let mut columns = vec![Column::words("Feature"), Column::numbers(record.record_label.clone())];
    columns.extend(fidelities.iter().map(|fidelity| Column::numbers(fidelity.model.clone())));
    columns.push(Column::numbers("difference").unit("%"));
    columns.push(Column::words("unit"));
    Some(Table {
        caption: format!(
            "Fitted features at the fitted values, of every model, {}: expected value and run-to-run standard deviation, without model error. Difference: model that \
             gives the values minus the next simpler one, of the logarithms; mean ± standard error over pairs of runs with the same random gaps and \
             noise.",
            law.name()
        ),
        columns,
        rows,
    })
}

/// Connected parts of the 90 % region.
pub(super) fn lobes(law: &Law<'_>) -> Option<Table> {
    if law.fit.lobes.len() < 2 {
        return None;
    }
    let mut columns = vec![Column::numbers("Part"), Column::numbers("Probability").unit("%")];
    columns.extend(law.parameters.iter().map(Estimate::column));
    let rows = law
        .fit
        .lobes
        .iter()
        .enumerate()
        .map(|(index, lobe)| {
            let mut row = vec![(index + 1).to_string(), significant(100.0 * lobe.mass, 2)];
            row.extend(law.drawn.parameters.iter().zip(&law.parameters).map(|(key, parameter)| {
                let [low, high] = lobe.extent.get(key).map_or([0.0; 2], |ends| ends.map(|end| parameter.factor * end));
                let half = 0.5 * (high - low);
                format!("{} to {}", to_uncertainty(low, half), to_uncertainty(high, half))
            }));
            row
        })
        .collect();
    let caption = format!(
        "The 90 % region of {} has {} separate parts; the true values may lie in any of them.",
        law.name(),
        law.fit.lobes.len()
    );
    Some(Table { caption, columns, rows })
}

/// Files read, with their digests.
pub(super) fn inputs(report: &CalibrationReport) -> Table {
    let what = |role: &str| match (role.starts_with("drive"), report.outcome.quantity) {
        (true, _) => "horn-tip record",
        (_, Measurand::Velocity) => "vibrometer record",
        (_, Measurand::Pressure) => "hydrophone record",
    };
    let inputs = report.outcome.inputs.iter();
    Table {
        caption: "Files read.".into(),
        columns: vec![Column::words("What"), Column::words("File"), Column::words("SHA-256")],
        rows: inputs.map(|(role, it)| vec![what(role).into(), it.path.clone(), it.sha256.clone()]).collect(),
    }
}

/// `features.csv`, `runs.csv` and the traces as CSV, SI, the unit in the head or beside the value.
pub(super) fn csv_files(report: &CalibrationReport) -> Result<Files, ReportError> {
    let mut files: Files = Vec::new();
    let cell = |value: Option<f64>| value.map(|value| value.to_string()).unwrap_or_default();
    let mut features = csv::Writer::from_writer(Vec::new());
    features.write_record([
        "feature",
        "unit",
        "recorded",
        "simulated",
        "scatter",
        "sensitivity_per_percent_drive",
        "fitted",
    ])?;
    for row in report.features(0) {
        let OutcomeFeature { measured, simulated, scatter, sensitivity, unit, .. } = row.feature;
        let numbers = [*measured, *simulated, *scatter, *sensitivity];
        let words = [row.name.clone(), unit.clone()].into_iter();
        features.write_record(words.chain(numbers.map(cell)).chain([row.fitted.to_string()]))?;
    }
    files.push(("features.csv".into(), csv_bytes(features)?));
    for law in report.laws() {
        files.push((format!("runs-{}.csv", law.key()).into(), runs(law.drawn, &law.parameters)?));
        for (model, below, parameters) in law.below() {
            files.push((format!("runs-{}-{model}.csv", law.key()).into(), runs(below, &parameters)?));
        }
    }
    let quantity = report.outcome.quantity.name();
    let unit = match report.outcome.quantity {
        Measurand::Velocity => "m_per_s",
        Measurand::Pressure => "pa",
    };
    let lead = report.lead();
    for (name, series) in [("recorded", Some(&lead.recorded)), ("simulated", lead.simulated.as_ref())] {
        let Some(series) = series else { continue };
        let mut table = csv::Writer::from_writer(Vec::new());
        table.write_record(["time_s", &format!("{quantity}_{unit}")])?;
        for (index, value) in series.values.iter().enumerate() {
            table.write_record([format!("{:.9e}", series.time(index)), value.to_string()])?;
        }
        files.push((format!("{name}_{quantity}.csv").into(), csv_bytes(table)?));
    }
    Ok(files)
}

/// Every run of a fit: number, parameters in the units they are shown in, misfit.
fn runs(drawn: &LawReport, parameters: &[Estimate]) -> Result<Vec<u8>, ReportError> {
    let mut table = csv::Writer::from_writer(Vec::new());
    let heads = parameters.iter().map(|parameter| format!("{} [{}]", parameter.name, parameter.unit));
    table.write_record(["run".to_owned()].into_iter().chain(heads).chain(["misfit".to_owned()]))?;
    for (index, run) in drawn.runs.iter().enumerate() {
        let shown = run.parameters.iter().zip(parameters).map(|(value, it)| (it.factor * value).to_string());
        let misfit = run.misfit.map(|misfit| misfit.to_string()).unwrap_or_default();
        table.write_record([(index + 1).to_string()].into_iter().chain(shown).chain([misfit]))?;
    }
    csv_bytes(table)
}
