//! The settings, the orders, the features beyond the window, the references.

use super::{line_name, percent, setting_of, value_said};
use crate::accuracy::{Accuracy, Seconds, ladder::Setting, stored::Stored};
use granchain_model::scene;
use granchain_report::{
    number::significant,
    page::{Column, Table},
};

fn times(seconds: &Seconds) -> [String; 2] {
    [seconds.least, seconds.median].map(|seconds| significant(1e3 * seconds, 2))
}

/// Every setting: error, seconds, memory, work.
pub fn settings(accuracy: &Accuracy) -> Table {
    let found = &accuracy.found;
    let front = found.front();
    let rows = found.measured.iter().enumerate().map(|(place, measured)| {
        let cost = &measured.cost;
        let ([setup, setup_median], [run, run_median]) = (times(&cost.setup_s), times(&cost.run_s));
        let error = if found.is_below_limit(measured) {
            format!("below {}", significant(100.0 * found.least_quotable(), 2))
        } else {
            significant(100.0 * measured.error, 2)
        };
        let is_stored = accuracy.fresh.get(place) != Some(&true);
        let marks = [
            (is_default(&found.scene, &measured.setting), "default"),
            (front.contains(&place), "front"),
            (is_stored, "stored"),
        ];
        let marks: Vec<&str> = marks.iter().filter(|(applies, _)| *applies).map(|(_, mark)| *mark).collect();
        vec![
            setting_of(measured),
            error,
            setup,
            setup_median,
            run,
            run_median,
            cost.run_s.repetitions.to_string(),
            cost.peak_memory_bytes.map_or("–".into(), |bytes| significant(1e-6 * bytes as f64, 3)),
            measured.work.unknowns.to_string(),
            measured.work.steps.to_string(),
            count(measured.work.evaluations),
            count(measured.work.solves),
            count(measured.work.contact_sweeps),
            count(measured.work.active_sets),
            significant(1e3 * measured.energy, 2),
            marks.join(", "),
        ]
    });
    Table {
        caption: "Total error over the window, seconds of one thread for the whole scene (least and median), largest resident memory of the \
                  program, and the work in counts. Energy: unaccounted for at the end over the largest."
            .into(),
        columns: vec![
            Column::words("Setting"),
            Column::numbers("Error").unit("%"),
            Column::numbers("Bodies, least").unit("ms"),
            Column::numbers("median").unit("ms"),
            Column::numbers("Run, least").unit("ms"),
            Column::numbers("median").unit("ms"),
            Column::numbers("Repeated"),
            Column::numbers("Memory").unit("MB"),
            Column::numbers("Unknowns"),
            Column::numbers("Steps"),
            Column::numbers("Evaluations"),
            Column::numbers("Solves"),
            Column::numbers("Contact sweeps"),
            Column::numbers("Active sets"),
            Column::numbers("Energy").unit("10⁻³"),
            Column::words(""),
        ],
        rows: rows.collect(),
    }
}

/// Whether the scene runs so when only the model is named.
fn is_default(scene: &str, setting: &Setting) -> bool {
    let model = format!("model.kind={}", setting.fidelity.model().name());
    matches!((scene::load(scene, &setting.sets), scene::load(scene, &[model])), (Ok(set), Ok(default)) if set == default)
}

fn count(count: u64) -> String {
    if count == 0 { "–".into() } else { count.to_string() }
}

/// Every line: its errors, its order.
pub fn orders(found: &Stored) -> Table {
    let rows = found.own.iter().map(|own| {
        let errors: Vec<String> = own
            .points
            .iter()
            .map(|point| {
                let error =
                    if point.quoted { percent(point.error) } else { format!("below {}", percent(10.0 * own.change)) };
                format!("{}: {error}", value_said(own.varied, point.value))
            })
            .collect();
        vec![
            line_name(own).to_owned(),
            own.varied.name().to_owned(),
            own.order.map_or("–".into(), |order| significant(order, 2)),
            errors.join("; "),
        ]
    });
    Table {
        caption: "Error against the limit of the same model as one number goes to its end, all others kept. Order: slope of the error over the \
                  tolerance, step or element size, by least squares over what lies below 30 % and above four times what the limit may be off; – with fewer than three."
            .into(),
        columns: vec![
            Column::words("Model"),
            Column::words("Varied"),
            Column::numbers("Order"),
            Column::words("Value: error"),
        ],
        rows: rows.collect(),
    }
}

/// Features of the whole run beside their scatter.
pub fn features(found: &Stored) -> Table {
    let features = &found.chaos.features;
    let mut columns = vec![Column::words("Setting")];
    columns.extend(features.iter().map(|feature| {
        let name = feature.key.replace('_', " ");
        if feature.unit == "1" { Column::numbers(name) } else { Column::numbers(name).unit(feature.unit.clone()) }
    }));
    let cell = |value: Option<f64>| value.map_or("–".into(), |value| significant(value, 3));
    let row =
        |name: String, values: Vec<Option<f64>>| std::iter::once(name).chain(values.into_iter().map(cell)).collect();
    let mut rows: Vec<Vec<String>> = vec![
        row(
            format!("mean of {} jittered copies ({})", found.chaos.replicates, found.chaos.setting.fidelity.name()),
            features.iter().map(|feature| feature.mean).collect(),
        ),
        row("scatter of one copy".into(), features.iter().map(|feature| feature.scatter).collect()),
    ];
    rows.extend(found.measured.iter().map(|measured| row(setting_of(measured), measured.features.clone())));
    Table {
        caption: "Features over the whole drive, one run each, velocities below 1.5 MHz. Differences below the scatter say nothing about a setting."
            .into(),
        columns,
        rows,
    }
}

/// The references and how far each has converged.
pub fn references(found: &Stored) -> Table {
    let rows = found.references.iter().map(|reference| {
        vec![
            reference.key.clone(),
            format!("{}, {}", reference.setting.fidelity.name(), reference.setting),
            reference.next.to_string(),
            significant(reference.change, 2),
            significant(reference.least_quotable(), 2),
        ]
    });
    Table {
        caption: "The references: how they were computed, the next level, the relative change of the waveform to it over the window. Errors below \
                  ten times that change are not quoted."
            .into(),
        columns: vec![
            Column::words("Limit of"),
            Column::words("Setting"),
            Column::words("Next level"),
            Column::numbers("Change"),
            Column::numbers("Least error quoted"),
        ],
        rows: rows.collect(),
    }
}
