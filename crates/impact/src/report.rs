//! The answer in lines, and its page.

use std::fmt::Write as _;

use granchain_calibration::{fit::Verdict, outcome::FittedParameter};
use granchain_report::{
    figure::{Axis, Colour, Figure, PAGE_WIDTH_MM, Panel, Stroke, trace},
    page::{Block, Column, Files, Page, Plate, ReportError, Table, Tone, provenance},
};
use granchain_signal::{
    Series,
    number::{engineering, fixed, significant},
};

use crate::{Experiment, Finding, ImpactFit, ImpactOutcome, hit};

/// A trace over its incident impulse, which arrives at 0.
fn shown(series: &Series) -> Series {
    let level = hit::levelled(series);
    let found = hit::observe(series, 0.0).map(|found| (found.arrival, found.peak));
    let (arrival, peak) = found.unwrap_or_else(|| (level.start, level.peak()));
    Series { start: level.start - arrival, ..level.map(|value| value / peak) }
}

/// A parameter with its interval in the unit people use.
fn value(parameter: &FittedParameter) -> [String; 2] {
    let number = |value: f64| match parameter.unit.as_str() {
        "1" => significant(value, 3),
        unit => engineering(value, unit, 3),
    };
    let interval = match (parameter.low, parameter.high) {
        (Some(low), Some(high)) => format!("{} … {}", number(low), number(high)),
        _ => "none is quoted".into(),
    };
    let remark = match (parameter.unidentified, parameter.at_bound) {
        (true, _) => " (unidentified: the hits hardly depend on it)",
        (false, true) => " (at a bound)",
        _ => "",
    };
    [number(parameter.value), format!("{interval}{remark}")]
}

fn microseconds(time: f64) -> String {
    fixed(1e6 * time, 1)
}

fn cause(finding: &Finding) -> String {
    format!("{} (p = {})", finding.text, significant(finding.p_value, 2))
}

/// The answer in lines of plain text.
#[must_use]
pub fn lines(outcome: &ImpactOutcome) -> String {
    let mut text = String::new();
    let widest = outcome.parameters.keys().map(String::len).max().unwrap_or(0).max(11);
    for (name, parameter) in &outcome.parameters {
        let [number, interval] = value(parameter);
        let _ = writeln!(text, "  {name:<widest$} {number}   90 % interval {interval}");
    }
    for (number, finding) in outcome.diagnosis.iter().enumerate() {
        let lead = if number == 0 { "look at:" } else { "     or:" };
        let _ = writeln!(text, "  {lead} {}", cause(finding));
    }
    let times = &outcome.return_time;
    let _ = writeln!(
        text,
        "  {:<widest$} measured {} µs, model {} µs; {} of {} hits between {} and {} µs",
        "return time",
        microseconds(times.measured),
        microseconds(times.predicted),
        times.within,
        outcome.hits.len(),
        microseconds(times.low),
        microseconds(times.high)
    );
    for name in ["peak_ratio", "width_ratio"] {
        if let Some(feature) = outcome.fitted_features.get(name) {
            let _ = writeln!(
                text,
                "  {:<widest$} measured {}, model {} ({:+.1} SD)",
                name.replace('_', " "),
                significant(feature.measured, 3),
                significant(feature.expected, 3),
                feature.deviation
            );
        }
    }
    if let Some(feature) = outcome.fitted_features.get(hit::NAMES[3]) {
        let _ = writeln!(
            text,
            "  {:<widest$} measured {} µs, model {} µs ({:+.1} SD)",
            "incident width",
            microseconds(feature.measured),
            microseconds(feature.expected),
            feature.deviation
        );
    }
    if let Some(foot) = &outcome.foot {
        let _ = writeln!(
            text,
            "  {:<widest$} at most {} in a hit, {} at rest",
            "foot pressure",
            engineering(foot.pressure, "Pa", 3),
            engineering(foot.resting_pressure, "Pa", 3)
        );
    }
    let _ = writeln!(text, "  p = {}\n  {}", significant(outcome.p_value, 2), outcome.set_up);
    text
}

/// `report.html`, `report.md` and the figure.
///
/// # Errors
/// A figure or table that cannot be written.
pub fn page(
    outcome: &ImpactOutcome,
    experiment: &Experiment,
    fit: &ImpactFit,
    command_line: &str,
) -> Result<Files, ReportError> {
    let (tone, verdict) = match outcome.verdict {
        Verdict::WithinScatter => (Tone::Good, "Consistent"),
        Verdict::Doubtful => (Tone::Careful, "Doubtful"),
        Verdict::NotConverged => (Tone::Careful, "Not converged"),
        Verdict::OutsideScatter => (Tone::Bad, "Inconsistent"),
    };
    let text = format!("{} hits; p = {}.", outcome.hits.len(), significant(outcome.p_value, 2));
    let mut blocks = vec![Block::Headline { tone, verdict: verdict.into(), text }];
    blocks.extend(Block::noticed(&outcome.warnings));
    blocks.push(Block::Table(parameters(outcome)));
    blocks.push(Block::List(vec![outcome.set_up.clone()]));
    blocks.extend(Block::listed("Likely causes", outcome.diagnosis.iter().map(cause).collect()));
    blocks.extend(Block::Plates(vec![Plate::new("impulses", figure(experiment, fit))]).under("Impulses"));
    blocks.extend([Block::Table(features(outcome)), Block::Table(hits(outcome))]);
    blocks.extend(Block::List(outcome.assumptions.clone()).under("Assumed"));
    let files =
        outcome.inputs.iter().map(|(role, input)| (role.clone(), format!("{}, SHA-256 {}", input.path, input.sha256)));
    let facts = [("program".to_owned(), outcome.program.clone()), ("seed".into(), outcome.seed.to_string())];
    blocks.extend(provenance(facts.into_iter().chain(files).collect(), command_line));
    let title = format!("Hits on the scene {}", outcome.scene);
    Page { title, subtitle: experiment.scene.description.clone(), blocks }.files()
}

fn figure(experiment: &Experiment, fit: &ImpactFit) -> Figure {
    let (time, force) =
        (Axis::new("Time after the incident impulse", "ms").times(1e3), Axis::new("Force over its peak", "1"));
    let traces: Vec<Series> = experiment.hits.iter().map(|hit| shown(&hit.record.series)).collect();
    let mut panel = Panel::new(time, force).height(60.0);
    for (number, series) in traces.iter().enumerate() {
        panel = panel.line(if number == 0 { "measured" } else { "" }, trace(series), Stroke::new(Colour::Grey));
    }
    let until = traces.iter().map(Series::end).fold(0.0, f64::max);
    if let Ok(simulated) = experiment.simulated(fit) {
        let simulated = shown(&simulated);
        panel = panel.line("model", trace(&simulated.window(simulated.start, until)), Stroke::new(Colour::Vermillion));
    }
    Figure::new("Sensor force over the peak of its incident impulse: all hits, and the model at the answer.")
        .sized(PAGE_WIDTH_MM, 1)
        .panel(panel)
}

fn parameters(outcome: &ImpactOutcome) -> Table {
    let row = |(name, parameter): (&String, &FittedParameter)| {
        let [number, interval] = value(parameter);
        vec![name.clone(), number, interval]
    };
    Table {
        caption: "Fitted parameters.".into(),
        columns: ["Parameter", "Value", "90 % interval"].map(Column::words).to_vec(),
        rows: outcome.parameters.iter().map(row).collect(),
    }
}

fn features(outcome: &ImpactOutcome) -> Table {
    let rows = outcome.fitted_features.iter().map(|(name, feature)| {
        let factor = if [hit::NAMES[0], hit::NAMES[3]].contains(&name.as_str()) { 1e6 } else { 1.0 };
        let mut row = vec![if factor > 1.0 { format!("{name} (µs)") } else { name.clone() }];
        row.extend([feature.measured, feature.expected].map(|value| significant(factor * value, 4)));
        row.extend([significant(100.0 * feature.scatter, 2), fixed(feature.deviation, 1)]);
        row
    });
    Table {
        caption:
            "Mean of the hits and the model; scatter from hit to hit; deviation in standard deviations of the mean."
                .into(),
        columns: vec![
            Column::words("Feature"),
            Column::numbers("Measured"),
            Column::numbers("Model"),
            Column::numbers("Scatter").unit("%"),
            Column::numbers("Deviation"),
        ],
        rows: rows.collect(),
    }
}

fn hits(outcome: &ImpactOutcome) -> Table {
    let rows = outcome.hits.iter().map(|hit| {
        let mut row = vec![hit.label.clone(), microseconds(hit.return_time), significant(hit.peak_ratio, 3)];
        row.extend(hit.widths.map(microseconds));
        row.extend([significant(hit.peak, 3), if hit.within { "yes" } else { "no" }.into()]);
        row
    });
    let times = &outcome.return_time;
    Table {
        caption: format!(
            "The hits; predicted for one hit: {} to {} µs.",
            microseconds(times.low),
            microseconds(times.high)
        ),
        columns: vec![
            Column::words("Record"),
            Column::numbers("Return time").unit("µs"),
            Column::numbers("Ratio of peaks"),
            Column::numbers("Width, incident").unit("µs"),
            Column::numbers("Width, returned").unit("µs"),
            Column::numbers("Peak, in the file's unit"),
            Column::words("Within the prediction"),
        ],
        rows: rows.collect(),
    }
}
