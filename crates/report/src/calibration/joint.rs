//! Several records fitted together: what each narrows, and how each is met.

use super::{
    CalibrationReport, content, figures,
    shown::{Estimate, Law, estimates},
    table,
};
use crate::{
    figure::{Axis, Colour, Dash, ErrorPoint, Figure, Layer, Map, Marker, PAGE_WIDTH_MM, Panel, Stroke},
    number::{significant, with_interval},
    page::{Block, Column, Plate, Table},
};

/// Strokes of the records' regions, in order; the joint one is drawn apart.
const COLOURS: [Colour; 5] = [Colour::Blue, Colour::Orange, Colour::Green, Colour::Purple, Colour::SkyBlue];
const DASHES: [Dash; 3] = [Dash::Dashed, Dash::Dotted, Dash::DashDotted];

pub(super) fn title(report: &CalibrationReport) -> String {
    let titles: Vec<&str> = report.records.iter().map(|record| record.title.as_str()).collect();
    format!("Calibration against {}", titles.join(", "))
}

/// What each record says by itself and what all say together, law by law.
pub(super) fn shares(laws: &[Law<'_>], blocks: &mut Vec<Block>) {
    if laws.iter().all(|law| law.fit.records.is_empty()) {
        return;
    }
    blocks.push(Block::Heading("What each record narrows".into()));
    blocks.push(Block::Paragraph(
        "All records share one set of parameters; their likelihoods multiply. What a record says by itself is read from the runs made for \
         all of them, no run is made for it alone: far from the values fitted together these runs are few, so a wide interval is wide only roughly."
            .into(),
    ));
    for law in laws {
        blocks.push(Block::Table(share_table(law)));
        if law.fit.verdict.explains() {
            blocks.push(Block::Plates(vec![width_plate(law)].into_iter().chain(region_plate(law)).collect()));
        }
    }
}

/// ln(high/low).
fn width(estimate: &Estimate) -> Option<f64> {
    Some((estimate.high? / estimate.low?).ln())
}

/// What each record says by itself: its name, its estimates.
fn alone(law: &Law<'_>) -> Vec<(String, Vec<Estimate>)> {
    let of = |parameters| estimates(parameters, &law.drawn.parameters, &law.fit.damping_kind);
    law.fit.records.iter().map(|record| (record.label.clone(), of(&record.alone))).collect()
}

fn share_table(law: &Law<'_>) -> Table {
    let row = |label: &str, parameters: &[Estimate], correlation: Option<f64>, misfit: f64| {
        let mut cells = vec![label.to_owned()];
        for estimate in parameters {
            let shown = |value: f64| significant(value, 2);
            cells.push(with_interval(estimate.value, estimate.low.zip(estimate.high)));
            cells.push(width(estimate).map_or("–".into(), shown));
        }
        cells.push(correlation.map_or("–".into(), |value| significant(value, 2)));
        cells.push(significant(misfit, 2));
        cells
    };
    let several = law.parameters.len() > 1;
    let alone = alone(law).into_iter().zip(&law.fit.records).map(|((label, parameters), record)| {
        row(&format!("{label} alone"), &parameters, several.then_some(record.correlation), record.misfit)
    });
    let together = row("all together", &law.parameters, law.correlation(), law.fit.misfit);
    let mut columns = vec![Column::words("Record")];
    for parameter in &law.parameters {
        columns.push(parameter.column());
        columns.push(Column::numbers(format!("Width of {}", parameter.symbol)).unit("ln"));
    }
    columns.push(Column::numbers("Correlation").unit("1"));
    columns.push(Column::numbers("Misfit").unit("1"));
    Table {
        caption: format!(
            "Values with 90 % intervals and their widths ln(high/low) from each record by itself and from all, {}. Misfit: per feature of that \
             record at the runs that are best for all; of all together that of the worst record.",
            law.name()
        ),
        columns,
        rows: alone.chain([together]).collect(),
    }
}

/// The interval of every parameter from each record and from all.
fn width_plate(law: &Law<'_>) -> Plate {
    let mut rows = alone(law);
    rows.push(("all".into(), law.parameters.clone()));
    let last = rows.len() as f64 - 1.0;
    // The first record stands on top.
    let names: Vec<(f64, String)> =
        rows.iter().enumerate().map(|(index, (name, _))| (last - index as f64, name.clone())).collect();
    let title = format!("90 % interval of each parameter from every record by itself and from all, {}.", law.name());
    let mut figure = Figure::new(title).sized(PAGE_WIDTH_MM, 2);
    for (d, parameter) in law.parameters.iter().enumerate() {
        let points = |together: bool| -> Vec<ErrorPoint> {
            let of = |(index, (_, estimates)): (usize, &(String, Vec<Estimate>))| {
                let estimate = estimates.get(d)?;
                let y = last - index as f64;
                let x_interval = Some((estimate.low?, estimate.high?));
                ((y == 0.0) == together).then_some(ErrorPoint { x: estimate.value, y, y_interval: None, x_interval })
            };
            rows.iter().enumerate().filter_map(of).collect()
        };
        let y = Axis::new("Record", "").range(-0.6, last + 0.6).named_ticks(names.clone());
        let panel = Panel::new(figures::axis(parameter), y)
            .height(16.0 + 6.0 * rows.len() as f64)
            .error_points("alone", points(false), Colour::Blue, Marker::Disc)
            .error_points("all together", points(true), Colour::Vermillion, Marker::Square);
        figure = figure.panel(panel);
    }
    Plate::new(format!("widths-{}", law.key()), figure)
}

/// Where the accepted cells of all maps and their neighbours lie along one axis, up to which their contours reach.
fn extent(maps: &[(Map, f64)], along: fn(&Map) -> &[f64], place: fn(&Map, usize) -> usize) -> Option<(f64, f64)> {
    let accepted = maps.iter().flat_map(|(map, level)| {
        let cells = map.values.iter().enumerate().filter(|(_, density)| **density >= *level);
        let places = along(map);
        let around = move |(cell, _): (usize, &f64)| {
            let index = place(map, cell);
            [places[index.saturating_sub(1)], places[(index + 1).min(places.len() - 1)]]
        };
        cells.flat_map(around).collect::<Vec<_>>()
    });
    let (low, high) = accepted.fold((f64::INFINITY, 0.0_f64), |(low, high), at| (low.min(at), high.max(at)));
    let margin = (high / low).powf(0.03);
    (low > 0.0 && high > low).then(|| (low / margin, high * margin))
}

/// The same map with a rim of nothing around it, so that a region which reaches its edge is closed there.
fn rimmed(map: &Map) -> Map {
    let wider = |places: &[f64]| -> Vec<f64> {
        // Steps of one ratio stay positive.
        let ratio = places[1] / places[0];
        let last = places[places.len() - 1];
        [places[0] / ratio].into_iter().chain(places.iter().copied()).chain([last * ratio]).collect()
    };
    let columns = map.x.len();
    let empty = vec![0.0; columns + 2];
    let inner = map.values.chunks_exact(columns).flat_map(|row| [&[0.0], row, &[0.0]].concat());
    let values = empty.iter().copied().chain(inner).chain(empty.iter().copied()).collect();
    Map { x: wider(&map.x), y: wider(&map.y), values }
}

/// The 90 % regions of every record and of all on common axes.
fn region_plate(law: &Law<'_>) -> Option<Plate> {
    let [first, second, ..] = law.parameters.as_slice() else { return None };
    let drawn = law.drawn.alone.iter().chain([&law.drawn.map]);
    let maps: Vec<(Map, f64)> = drawn
        .map(|map| Some((rimmed(&map.as_ref()?.shown(first, second)), map.as_ref()?.accepted_level)))
        .collect::<Option<_>>()?;
    let bounded =
        |axis: Axis, along: fn(&Map) -> &[f64], place: fn(&Map, usize) -> usize| match extent(&maps, along, place) {
            Some((low, high)) => axis.range(low, high),
            None => axis,
        };
    let x = bounded(figures::axis(first), |map| &map.x, |map, cell| cell % map.x.len());
    let y = bounded(figures::axis(second), |map| &map.y, |map, cell| cell / map.x.len());
    let mut panel = Panel::new(x, y).height(60.0);
    for (index, (map, level)) in maps.into_iter().enumerate() {
        let (label, stroke) = match law.fit.records.get(index) {
            Some(record) => {
                let stroke = Stroke::new(COLOURS[index % COLOURS.len()]).width(0.9);
                (format!("{} alone", record.label), stroke.dash(DASHES[index % DASHES.len()]))
            }
            None => ("all together".into(), Stroke::new(Colour::Vermillion).width(1.3)),
        };
        panel = panel.layer(Layer::Contour { label, map, level, stroke });
    }
    let title = format!(
        "90 % regions of every record by itself and of all together, {}. A straight edge is where the runs end.",
        law.name()
    );
    Some(Plate::new(format!("regions-{}", law.key()), Figure::new(title).panel(panel)))
}

/// How every further record is met: notes, drive, traces, spectra, features.
pub(super) fn companions(report: &CalibrationReport, blocks: &mut Vec<Block>) {
    for (index, record) in report.records.iter().enumerate().skip(1) {
        blocks.push(Block::Heading(format!("Record {}: {}", index + 1, record.label)));
        blocks.extend(Block::noticed(&record.record_notes));
        blocks.push(Block::Paragraph(format!(
            "{} of {}; the piston follows {}.{}",
            content::recorded_quantity(report),
            record.title,
            record.drive_origin,
            if record.alignment.is_empty() { String::new() } else { format!(" Alignment: {}.", record.alignment) }
        )));
        let drive = figures::drive(report, record).into_iter().take(1);
        let plates = drive.chain(figures::traces(report, record)).chain(figures::spectra(report, record));
        let numbered = plates.map(|mut plate| {
            plate.name = format!("{}-{}", plate.name, index + 1);
            plate
        });
        blocks.push(Block::Plates(numbered.collect()));
        blocks.extend(table::features(report, index).map(Block::Table));
    }
}
