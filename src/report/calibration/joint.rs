//! Several records fitted together: what each narrows, and how each is met.

use super::{CalibrationReport, DensityMap, Estimate, LawReport, RecordReport, content, figures, table};
use crate::report::{
    figure::{Axis, Colour, Dash, ErrorPoint, Figure, Layer, Map, Marker, PAGE_WIDTH_MM, Panel, Stroke},
    number::{significant, unit, with_interval},
    page::{Block, Column, Plate, Table},
};

/// Strokes of the records' regions, in order; the joint one is drawn apart.
const COLOURS: [Colour; 5] = [Colour::Blue, Colour::Orange, Colour::Green, Colour::Purple, Colour::SkyBlue];
const DASHES: [Dash; 3] = [Dash::Dashed, Dash::Dotted, Dash::DashDotted];

pub(super) fn title(report: &CalibrationReport) -> String {
    if report.companions.is_empty() {
        return format!("Calibration against {}", report.title);
    }
    let titles: Vec<&str> = std::iter::once(&report.title)
        .chain(report.companions.iter().map(|it| &it.title))
        .map(String::as_str)
        .collect();
    format!("Calibration against {}", titles.join(", "))
}

/// What each record says by itself and what all say together, law by law.
pub(super) fn shares(report: &CalibrationReport, blocks: &mut Vec<Block>) {
    let laws: Vec<&LawReport> = report.laws.iter().filter(|law| !law.shares.is_empty()).collect();
    if laws.is_empty() {
        return;
    }
    blocks.push(Block::Heading("What each record narrows".into()));
    blocks.push(Block::Paragraph(
        "All records share one set of parameters; their likelihoods multiply. What a record says by itself is read from the runs made for \
         all of them, no run is made for it alone: far from the joint answer these runs are few, so a wide interval is wide only roughly."
            .into(),
    ));
    for law in laws {
        blocks.push(Block::Table(share_table(law)));
        if law.verdict.explains() {
            blocks.push(Block::Plates(vec![width_plate(law)].into_iter().chain(region_plate(law)).collect()));
        }
    }
}

/// ln(high/low).
fn width(estimate: &Estimate) -> Option<f64> {
    Some((estimate.high? / estimate.low?).ln())
}

fn share_table(law: &LawReport) -> Table {
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
    let alone = law
        .shares
        .iter()
        .map(|share| row(&format!("{} alone", share.label), &share.parameters, share.correlation, share.misfit));
    let together = row("all together", &law.parameters, law.correlation, law.misfit);
    let mut columns = vec![Column::words("Record")];
    for parameter in &law.parameters {
        let column = Column::words(format!("{} {}", parameter.name, parameter.symbol));
        columns.push(if unit(&parameter.unit) == "1" { column } else { column.unit(unit(&parameter.unit)) });
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
fn width_plate(law: &LawReport) -> Plate {
    let rows: Vec<(&str, &[Estimate])> = law
        .shares
        .iter()
        .map(|share| (share.label.as_str(), share.parameters.as_slice()))
        .chain([("all", law.parameters.as_slice())])
        .collect();
    let last = rows.len() as f64 - 1.0;
    // The first record stands on top.
    let names: Vec<(f64, String)> =
        rows.iter().enumerate().map(|(index, (name, _))| (last - index as f64, (*name).to_owned())).collect();
    let title = format!("90 % interval of each parameter from every record by itself and from all, {}.", law.name());
    let mut figure = Figure::new(title).sized(PAGE_WIDTH_MM, 2);
    for (d, parameter) in law.parameters.iter().enumerate() {
        let points = |together: bool| -> Vec<ErrorPoint> {
            let of = |(index, (_, estimates)): (usize, &(&str, &[Estimate]))| {
                let estimate = estimates.get(d)?;
                let y = last - index as f64;
                let x_interval = Some((estimate.low?, estimate.high?));
                ((y == 0.0) == together).then_some(ErrorPoint { x: estimate.value, y, y_interval: None, x_interval })
            };
            rows.iter().enumerate().filter_map(of).collect()
        };
        let y = Axis::new("Record", "1").range(-0.6, last + 0.6).named_ticks(names.clone());
        let panel = Panel::new(figures::axis(parameter), y)
            .height(16.0 + 6.0 * rows.len() as f64)
            .error_points("alone", points(false), Colour::Blue, Marker::Disc)
            .error_points("all together", points(true), Colour::Vermillion, Marker::Square);
        figure = figure.panel(panel);
    }
    Plate::new(format!("widths-{}", law.key()), figure)
}

/// Where the accepted cells of all maps lie along one axis, with a twentieth of margin to either side in ln.
fn extent(maps: &[&DensityMap], along: fn(&DensityMap, usize) -> f64) -> Option<(f64, f64)> {
    let accepted = maps.iter().flat_map(|map| {
        let cells = map.density.iter().enumerate().filter(|(_, density)| **density >= map.accepted_level);
        cells.map(|(cell, _)| along(map, cell)).collect::<Vec<_>>()
    });
    let (low, high) = accepted.fold((f64::INFINITY, 0.0_f64), |(low, high), at| (low.min(at), high.max(at)));
    let margin = (high / low).powf(0.05);
    (low > 0.0 && high > low).then(|| (low / margin, high * margin))
}

/// The 90 % regions of every record and of all on common axes.
fn region_plate(law: &LawReport) -> Option<Plate> {
    let [first, second, ..] = law.parameters.as_slice() else { return None };
    let region = |panel: Panel, label: String, map: &DensityMap, stroke: Stroke| {
        panel.layer(Layer::Contour {
            label,
            map: Map { x: map.x.clone(), y: map.y.clone(), values: map.density.clone() },
            level: map.accepted_level,
            stroke,
        })
    };
    let maps: Vec<&DensityMap> = law.shares.iter().filter_map(|share| share.map.as_ref()).chain(&law.map).collect();
    let bounded = |axis: Axis, along: fn(&DensityMap, usize) -> f64| match extent(&maps, along) {
        Some((low, high)) => axis.range(low, high),
        None => axis,
    };
    let x = bounded(figures::axis(first), |map, cell| map.x[cell % map.x.len()]);
    let y = bounded(figures::axis(second), |map, cell| map.y[cell / map.x.len()]);
    let mut panel = Panel::new(x, y).height(60.0);
    for (index, share) in law.shares.iter().enumerate() {
        let stroke = Stroke::new(COLOURS[index % COLOURS.len()]).width(0.9).dash(DASHES[index % DASHES.len()]);
        panel = region(panel, format!("{} alone", share.label), share.map.as_ref()?, stroke);
    }
    panel = region(panel, "all together".into(), law.map.as_ref()?, Stroke::new(Colour::Vermillion).width(1.3));
    let title = format!("90 % regions of every record by itself and of all together, {}.", law.name());
    Some(Plate::new(format!("regions-{}", law.key()), Figure::new(title).panel(panel)))
}

/// How every further record is met: notes, drive, traces, spectra, features.
pub(super) fn companions(report: &CalibrationReport, blocks: &mut Vec<Block>) {
    for (index, record) in report.companions.iter().enumerate() {
        let view = of_record(report, record);
        blocks.push(Block::Heading(format!("Record {}: {}", index + 2, record.label)));
        if !record.record_notes.is_empty() {
            blocks.push(Block::Notice(record.record_notes.clone()));
        }
        blocks.push(Block::Paragraph(format!(
            "{} of {}; the piston follows {}.{}",
            content::recorded_quantity(report),
            record.title,
            record.drive_origin,
            if record.alignment.is_empty() { String::new() } else { format!(" Alignment: {}.", record.alignment) }
        )));
        let plates =
            figures::drive(&view).into_iter().take(1).chain(figures::traces(&view)).chain(figures::spectra(&view));
        let numbered = plates.map(|mut plate| {
            plate.name = format!("{}-{}", plate.name, index + 2);
            plate
        });
        blocks.push(Block::Plates(numbered.collect()));
        if !record.features.is_empty() {
            blocks.push(Block::Table(table::features(&view)));
        }
    }
}

/// The report as if `record` were its only one, for the figures and tables of a record.
fn of_record(report: &CalibrationReport, record: &RecordReport) -> CalibrationReport {
    let record = record.clone();
    CalibrationReport {
        title: record.title,
        record_label: record.record_label,
        record_notes: record.record_notes,
        warnings: Vec::new(),
        diagnosis: Vec::new(),
        drive: record.drive,
        drive_origin: record.drive_origin,
        recorded: record.recorded,
        simulated: record.simulated,
        alignment: record.alignment,
        window: record.window,
        features: record.features,
        label: record.label,
        laws: vec![],
        excluded: vec![],
        companions: vec![],
        alpha_sweep: None,
        preference: None,
        separation: vec![],
        assumptions: vec![],
        scene: report.scene.clone(),
        scene_description: report.scene_description.clone(),
        model: report.model.clone(),
        measurand: report.measurand,
        drive_frequency: report.drive_frequency,
        energy: None,
        provenance: report.provenance.clone(),
    }
}
