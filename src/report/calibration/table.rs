//! The tables of a calibration, for people and as CSV.

use std::fmt::Write as _;

use super::{CalibrationReport, LawReport, RungsReport};
use crate::feature::Measurand;
use crate::report::{
    number::{short, significant, to_uncertainty, unit, with_interval},
    page::{Column, Files, Table},
    sweep::shown_unit,
};

const NOTHING: &str = "–";

/// As [`shown_unit`]; a pressure here is sound.
fn heard_unit(unit: &str) -> (f64, &str) {
    if unit == "Pa" { (1e-3, "kPa") } else { shown_unit(unit) }
}

/// Recorded, simulated, scatter, sensitivity, published.
pub(super) fn features(report: &CalibrationReport) -> Table {
    let rows = report
        .features
        .iter()
        .map(|row| {
            let (factor, shown) = heard_unit(&row.unit);
            let scatter = row.scatter.filter(|scatter| *scatter > 0.0).map(|scatter| scatter * factor);
            // Digits down to the scatter, but never more than four figures.
            let value = |value: Option<f64>| match (value.map(|value| value * factor), scatter) {
                (Some(value), Some(scatter)) => to_uncertainty(value, scatter.max(1e-4 * value.abs())),
                (Some(value), None) => significant(value, 3),
                (None, _) => NOTHING.to_owned(),
            };
            let small = |value: Option<f64>| value.map_or(NOTHING.to_owned(), |value| significant(value * factor, 2));
            let published = match (row.published, row.published_uncertainty) {
                (Some(value), Some(error)) => {
                    let (value, error) = (value * factor, error * factor);
                    format!("{} ± {}", to_uncertainty(value, error), significant(error, 2))
                }
                (Some(value), None) => significant(value * factor, 3),
                (None, _) => NOTHING.to_owned(),
            };
            let mut cells = vec![if row.fitted { format!("{} *", row.name) } else { row.name.clone() }];
            cells.extend(report.recorded.is_some().then(|| value(row.recorded)));
            cells.extend([
                value(row.simulated),
                small(row.scatter),
                small(row.sensitivity),
                published,
                if shown == "1" { NOTHING.to_owned() } else { shown.to_owned() },
            ]);
            cells
        })
        .collect();
    let mut columns = vec![Column::words("Feature")];
    // Without a waveform the column would be empty.
    columns.extend(report.recorded.is_some().then(|| Column::numbers(report.record_label.clone())));
    columns.extend(["simulated", "scatter", "sensitivity", "published"].map(Column::numbers));
    columns.push(Column::words("unit"));
    Table {
        caption: "Features over the analysis window (* used by the fit). Scatter: one standard deviation under perturbations the laboratory cannot control; agreement closer than that means nothing. Sensitivity: change for +1 % drive.".into(),
        columns,
        rows,
    }
}

/// Every law with its parameters.
pub(super) fn laws(report: &CalibrationReport) -> Table {
    let mounts = report.laws.iter().any(|law| law.mount.is_some());
    let best = report.laws.iter().filter_map(|law| law.log_evidence).fold(f64::NEG_INFINITY, f64::max);
    let rows = report
        .laws
        .iter()
        .flat_map(|law| {
            law.parameters.iter().enumerate().map(move |(index, parameter)| {
                let once = |text: String| if index == 0 { text } else { String::new() };
                let unit = unit(&parameter.unit);
                let unit = if unit == "1" { String::new() } else { format!(" {unit}") };
                let interval = parameter.low.zip(parameter.high);
                let note = if parameter.at_bound { ", at a bound" } else { "" };
                let mut cells = vec![once(law.damping_kind.clone())];
                cells.extend(mounts.then(|| once(law.mount.clone().unwrap_or_default())));
                cells.extend([
                    format!("{} {}", parameter.name, parameter.symbol),
                    format!("{}{unit}{note}", with_interval(parameter.value, interval)),
                    format!("{} to {}{unit}", short(parameter.bounds.0), short(parameter.bounds.1)),
                    once(significant(law.misfit, 2)),
                    once(law.verdict.to_string()),
                    once(law.log_evidence.map_or(NOTHING.to_owned(), |evidence| significant(evidence - best, 2))),
                    once(format!("{} ({} failed)", law.evaluations, law.failed_runs)),
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
        Column::words("Searched"),
        Column::numbers("Misfit").unit("1"),
        Column::words("Verdict"),
        Column::numbers("Δ ln evidence"),
        Column::words("Runs"),
    ]);
    Table {
        caption: "Fitted parameters with 90 % intervals, where they may be quoted. Misfit: per feature, in units of the local scatter; p decides, not it.".into(),
        columns,
        rows,
    }
}

/// What every rung found by itself.
pub(super) fn rungs(law: &LawReport, rungs: &RungsReport) -> Table {
    let rows = rungs.rungs.iter().map(|rung| {
        let values = law.parameters.iter().enumerate().map(|(index, parameter)| match rung.parameters.get(index) {
            Some(own) => with_interval(own.value, own.low.zip(own.high)),
            None => format!("{} (run there)", short(parameter.value)),
        });
        let runs = format!("{} ({} failed)", rung.runs, rung.failed_runs);
        let verdict = rung.verdict.map_or(NOTHING.to_owned(), |verdict| verdict.to_string());
        [rung.model.clone()].into_iter().chain(values).chain([runs, verdict]).collect()
    });
    let parameters = law.parameters.iter().map(|parameter| {
        let column = Column::words(format!("{} {}", parameter.name, parameter.symbol));
        if unit(&parameter.unit) == "1" { column } else { column.unit(unit(&parameter.unit)) }
    });
    let columns = [Column::words("Rung")]
        .into_iter()
        .chain(parameters)
        .chain([Column::words("Runs"), Column::words("By itself")]);
    Table {
        caption: format!("What each rung says by itself (90 % interval), {}.", law.name()),
        columns: columns.collect(),
        rows: rows.collect(),
    }
}

/// The fitted features as every rung expects them at the answer.
pub(super) fn rung_features(law: &LawReport, rungs: &RungsReport, record: &str) -> Option<Table> {
    if rungs.features.is_empty() {
        return None;
    }
    let rows = rungs.features.iter().map(|row| {
        let (factor, shown) = heard_unit(&row.unit);
        let mut cells = vec![row.name.clone(), row.recorded.map_or(NOTHING.into(), |v| significant(v * factor, 3))];
        cells.extend(row.expected.iter().zip(&row.scatter).map(|(value, scatter)| match (value, scatter) {
            (Some(value), Some(scatter)) => {
                format!("{} ± {} %", significant(value * factor, 3), significant(100.0 * scatter, 2))
            }
            (Some(value), None) => significant(value * factor, 3),
            (None, _) => NOTHING.into(),
        }));
        let percent = |ln: f64| 100.0 * ln;
        cells.push(format!("{:+.1} ± {:.1}", percent(row.difference), percent(row.standard_error)));
        cells.push(if shown == "1" { NOTHING.into() } else { shown.to_owned() });
        cells
    });
    let mut columns = vec![Column::words("Feature"), Column::numbers(record)];
    columns.extend(rungs.rungs.iter().map(|rung| Column::numbers(rung.model.clone())));
    columns.push(Column::numbers("difference").unit("%"));
    columns.push(Column::words("unit"));
    Some(Table {
        caption: format!(
            "Fitted features at the answer on every rung, {}: expected value and scatter of a single run. Difference: rung above the chain \
             less the chain in the logarithm, over pairs under the same nuisances, with its standard error.",
            law.name()
        ),
        columns,
        rows: rows.collect(),
    })
}

/// Connected parts of the 90 % region.
pub(super) fn lobes(law: &LawReport) -> Option<Table> {
    if law.lobes.len() < 2 {
        return None;
    }
    let mut columns = vec![Column::numbers("Lobe"), Column::numbers("Probability").unit("%")];
    columns.extend(law.parameters.iter().map(|parameter| {
        let column = Column::words(format!("{} {}", parameter.name, parameter.symbol));
        if unit(&parameter.unit) == "1" { column } else { column.unit(unit(&parameter.unit)) }
    }));
    let rows = law
        .lobes
        .iter()
        .enumerate()
        .map(|(index, lobe)| {
            let mut row = vec![(index + 1).to_string(), significant(100.0 * lobe.mass, 2)];
            row.extend(lobe.extent.iter().map(|(low, high)| {
                let half = 0.5 * (high - low);
                format!("{} to {}", to_uncertainty(*low, half), to_uncertainty(*high, half))
            }));
            row
        })
        .collect();
    let caption = format!(
        "The 90 % region falls into {} parts, {}: the record does not tell which holds the truth.",
        law.lobes.len(),
        law.name()
    );
    Some(Table { caption, columns, rows })
}

/// Where the piston's work went.
pub(super) fn energy(report: &CalibrationReport) -> Option<Table> {
    let ledger = report.energy.as_ref()?;
    let supplied = (ledger.initial_j + ledger.piston_work_j).abs();
    let rows = [
        ("stored at the start (precompression)", ledger.initial_j),
        ("work of the piston", ledger.piston_work_j),
        ("kinetic energy at the end", ledger.kinetic_j),
        ("stored in the contacts at the end", ledger.stored_j),
        ("lost in the dashpots", ledger.dissipated_j),
        ("residual (error of the integrator)", ledger.residual_j),
        ("largest energy in the chain", ledger.largest_j),
    ]
    .into_iter()
    .map(|(name, value)| {
        let share = if supplied > 0.0 { significant(100.0 * value / supplied, 2) } else { NOTHING.to_owned() };
        vec![name.to_owned(), significant(value * 1e9, 3), share]
    })
    .collect();
    Some(Table {
        caption: "Energy ledger of the calibrated run.".into(),
        columns: vec![
            Column::words("Energy"),
            Column::numbers("value").unit("nJ"),
            Column::numbers("share of what was supplied").unit("%"),
        ],
        rows,
    })
}

/// Files read, with their digests.
pub(super) fn inputs(report: &CalibrationReport) -> Table {
    Table {
        caption: "Files read.".into(),
        columns: vec![Column::words("What"), Column::words("File"), Column::words("SHA-256")],
        rows: report
            .provenance
            .inputs
            .iter()
            .map(|input| vec![input.role.clone(), input.path.clone(), input.sha256.clone()])
            .collect(),
    }
}

/// `features.csv`, `runs.csv` and the traces as CSV, SI, the unit in the head or beside the value.
pub(super) fn csv_files(report: &CalibrationReport) -> Files {
    let mut files: Files = Vec::new();
    let mut features = String::from(
        "feature,unit,recorded,simulated,scatter,sensitivity_per_percent_drive,published,published_uncertainty,fitted\n",
    );
    let cell = |value: Option<f64>| value.map(|value| value.to_string()).unwrap_or_default();
    for row in &report.features {
        let numbers =
            [row.recorded, row.simulated, row.scatter, row.sensitivity, row.published, row.published_uncertainty]
                .map(cell)
                .join(",");
        let _ = writeln!(features, "{},{},{numbers},{}", quoted(&row.name), quoted(&row.unit), row.fitted);
    }
    files.push(("features.csv".into(), features.into_bytes()));
    for law in &report.laws {
        let key = law.key();
        let below = law.rungs.as_ref().map(|rungs| (format!("{key}-chain"), rungs.below.as_ref()));
        for (key, law) in [(key, law)].into_iter().chain(below) {
            let heads =
                law.parameters.iter().map(|parameter| quoted(&format!("{} [{}]", parameter.name, parameter.unit)));
            let mut runs = format!("run,{},misfit\n", heads.collect::<Vec<_>>().join(","));
            for (index, run) in law.runs.iter().enumerate() {
                let parameters: Vec<String> = run.parameters.iter().map(f64::to_string).collect();
                let _ = writeln!(runs, "{},{},{}", index + 1, parameters.join(","), cell(run.misfit));
            }
            files.push((format!("runs-{key}.csv").into(), runs.into_bytes()));
        }
    }
    let quantity = report.measurand.name();
    let unit = match report.measurand {
        Measurand::Velocity => "m_per_s",
        Measurand::Pressure => "pa",
    };
    for (name, series) in [("recorded", &report.recorded), ("simulated", &report.simulated)] {
        let Some(series) = series else { continue };
        let mut text = format!("time_s,{quantity}_{unit}\n");
        for (index, value) in series.values.iter().enumerate() {
            let _ = writeln!(text, "{:.9e},{value}", series.time(index));
        }
        files.push((format!("{name}_{quantity}.csv").into(), text.into_bytes()));
    }
    files
}

/// A cell as CSV wants it (RFC 4180).
fn quoted(cell: &str) -> String {
    if cell.contains([',', '"', '\n', '\r']) { format!("\"{}\"", cell.replace('"', "\"\"")) } else { cell.to_owned() }
}
