//! The margins of a scene, printed.

use crate::{
    calibration::design::variations::{Margin, Margins, Word},
    cli::{
        arguments::{SceneArguments, Session},
        experiment,
        interrupt::{self, Interrupted},
        output::aligned,
        progress::{self, Bar},
        reading::ReadArguments,
    },
    model::ModelError,
    report::{
        number::significant,
        page::{Column, Table},
    },
    scene::{ModelKind, Scene},
};

/// Margins of a scene that is named so, driven by the record of its horn where it names one that can be read.
pub(super) fn of(session: &Session, name: &str, set: &[String], scene: &Scene) -> anyhow::Result<Margins> {
    let driven = match scene.pending_record() {
        None => scene.clone(),
        Some(_) => {
            let flags = SceneArguments { scene: Some(name.into()), set: set.to_vec(), ..SceneArguments::default() };
            let read = experiment::read(&flags, &ReadArguments::default(), None, ModelKind::Reduced);
            match read.and_then(|bench| Ok(bench.scene_with(&[])?)) {
                Ok(scene) => scene.with_limits(session.limits()),
                Err(error) => return Ok(none(&format!("the drive record cannot be read: {error:#}"))),
            }
        }
    };
    let bar = Bar(progress::bar(session, 1, "margins"));
    let margins = Margins::of(&driven, session.cache().as_ref(), &bar);
    bar.0.finish_and_clear();
    match margins {
        Err(ModelError::Stopped { .. }) if interrupt::requested() => Err(Interrupted.into()),
        margins => Ok(margins?),
    }
}

/// No margins, and why.
pub(super) fn none(reason: &str) -> Margins {
    Margins { rows: Vec::new(), left_out: vec![["margins".into(), reason.into()]] }
}

/// The section of the page.
pub(super) fn section(margins: &Margins) -> String {
    let columns = ["", "value", "below", "", ""].map(Column::words).to_vec();
    let number = |margin: &Margin, value: f64| match margin.unit {
        "s" => format!("{} ns", significant(1e9 * value, 3)),
        _ if value != 0.0 && value.abs() < 1e-3 => format!("{value:.1e}"),
        _ => significant(value, 2),
    };
    let row = |margin: &Margin| {
        let word = margin.word.map_or("", Word::text);
        let numbers = [number(margin, margin.value), number(margin, margin.below)];
        [&[margin.name.to_owned()][..], &numbers, &[word.to_owned(), margin.note.clone()]].concat()
    };
    let table = Table { caption: String::new(), columns, rows: margins.rows.iter().map(row).collect() };
    let mut text = "\nMargins\n".to_owned();
    if !margins.rows.is_empty() {
        text.extend(aligned(&table).lines().map(|line| format!("  {line}\n")));
    }
    text.extend(margins.left_out.iter().map(|[what, reason]| format!("  left out: {what}: {reason}\n")));
    text
}
