//! Coverage on the user's own bench and what further experiments would give: tables and a page.

use crate::{
    figure::{Axis, Bar, Colour, Dash, Figure, Layer, Marker, PAGE_WIDTH_MM, Panel, Stroke},
    number::{fixed, significant},
    page::{Block, Column, Files, Page, Plate, ReportError, Table, Tone, provenance},
};
use granchain_calibration::design::{Experiment, ExperimentCount, OwnCount, OwnPlan, ParameterCoverage, deviations};

/// Bins of the histogram of ranks.
const BINS: usize = 10;

/// `report.html`, `report.md` and the figures of a study of that `model`.
///
/// # Errors
/// [`ReportError`].
pub fn files(
    plan: &OwnPlan,
    count: &OwnCount,
    model: &str,
    facts: Vec<(String, String)>,
    command_line: &str,
) -> Result<Files, ReportError> {
    let all = || count.right().flat_map(|it| &it.parameters);
    let (tone, verdict) = match plan.fits {
        false => (Tone::Good, "expected widths"),
        true if all().any(|it| it.widen.is_some()) => (Tone::Bad, "intervals too narrow"),
        true if all().any(|it| it.ecdf_distance > it.ecdf_band) => (Tone::Careful, "ranks not uniform"),
        true => (Tone::Good, "intervals as claimed"),
    };
    let text = sentences(count).join(" ");
    let mut blocks = vec![Block::Headline { tone, verdict: verdict.into(), text }];
    blocks.extend(section(plan, count, model));
    blocks.extend(provenance(facts, command_line));
    let title = if plan.fits { COVERAGE } else { "Expected interval widths" };
    let subtitle = "Records made on the user's own bench with known values, and what a fit makes of them".into();
    Page { title: title.into(), subtitle, blocks }.files()
}

/// Title of what is counted.
pub const COVERAGE: &str = "Coverage on this bench";

/// How the records were made, tables and figures.
#[must_use]
pub fn section(plan: &OwnPlan, count: &OwnCount, model: &str) -> Vec<Block> {
    let mut blocks = vec![Block::Paragraph(format!(
        "True values are drawn from the posterior of the record's own fit, and what is not controlled as its uncertainties state. The records are \
         simulated by the model `{model}` with an integrator and a mesh that no fit uses, under the measured motion of the horn. They have the \
         sampling, trigger, noise, resolution, filter and gaps of the measured record, are written as files, and are read and fitted like it."
    ))];
    blocks.extend(tables(plan, count).into_iter().map(Block::Table));
    let experiments: Vec<&ExperimentCount> = count.right().collect();
    let mut plates: Vec<Plate> =
        experiments.first().filter(|_| plan.fits).map(|it| Plate::new("ranks", ranks(it))).into_iter().collect();
    plates.extend((experiments.len() > 1).then(|| Plate::new("widths", widths(&experiments))));
    blocks.push(Block::Plates(plates));
    blocks
}

/// The answer in sentences.
#[must_use]
pub fn sentences(count: &OwnCount) -> Vec<String> {
    let mut out = Vec::new();
    for (it, own) in
        count.right().flat_map(|it| it.parameters.iter().map(move |own| (it, own))).filter(|(it, _)| it.fits > 0)
    {
        let held =
            format!("{}, {}: {} of {} intervals of 90 % hold the true value", it.name, own.name, own.covered, it.fits);
        out.push(own.widen.map_or_else(
            || format!("{held}."),
            |factor| format!("{held}, too few; `calibrate --widen {:.2}` makes them hold 90 %.", up(factor)),
        ));
    }
    let names = count.right().next().map_or(&[][..], |it| &it.parameters);
    out.extend(names.iter().enumerate().filter_map(|(d, parameter)| {
        let (best, width) = count.narrowest(d)?;
        let now = parameter.width().filter(|_| count.0[0].name == Experiment::AS_RECORDED).map(half_width);
        let now = now.map_or_else(String::new, |now| format!("; now ±{now}"));
        Some(format!("Narrowest interval of {}: {} (±{}{now}).", parameter.name, best.name, half_width(width)))
    }));
    out
}

/// A factor of which two decimals are to suffice.
fn up(factor: f64) -> f64 {
    (100.0 * factor).ceil() / 100.0
}

/// Half of a width in ln, as a percentage.
fn half_width(width: f64) -> String {
    format!("{} %", significant(100.0 * (0.5 * width).exp_m1(), 2))
}

/// Widths and coverage of every parameter; of fits also how often a bench was rejected.
#[must_use]
pub fn tables(plan: &OwnPlan, count: &OwnCount) -> Vec<Table> {
    let optional = |value: Option<f64>| value.map_or("–".into(), |value| significant(value, 3));
    let percent = |(low, high): (f64, f64)| format!("{}–{} %", fixed(100.0 * low, 0), fixed(100.0 * high, 0));
    let row = |(it, own): (&ExperimentCount, &ParameterCoverage)| {
        let pair = |(a, b, value): &(String, String, f64)| {
            let other = if *a == own.name { b } else { a };
            (*a == own.name || *b == own.name).then(|| format!("{other} {}", fixed(*value, 2)))
        };
        let mut row = vec![it.name.clone(), own.name.clone()];
        row.extend([own.expected_width, own.fitted_width].map(optional));
        row.push(own.width().map_or("–".into(), half_width));
        row.push(it.correlations.iter().filter_map(pair).collect::<Vec<_>>().join(", "));
        if plan.fits {
            row.push(optional(own.width_over_bound));
            row.extend([format!("{} of {}", own.covered, it.fits), percent(own.coverage)]);
            row.push(format!("{} ({})", fixed(own.ecdf_distance, 2), fixed(own.ecdf_band, 2)));
            row.push(own.widen.map_or("–".into(), |factor| fixed(up(factor), 2)));
        }
        row
    };
    let mut columns = ["Experiment", "Parameter"].map(Column::words).to_vec();
    columns.extend(["Expected", "Fitted", "Half-width"].map(Column::numbers));
    columns.push(Column::words("Correlated with"));
    if plan.fits {
        columns.push(Column::numbers("Over bound"));
        columns.extend(["Covered", "95 % interval", "Ranks off (limit)"].map(Column::words));
        columns.push(Column::numbers("Widen by"));
    }
    let each = count.right().flat_map(|it| it.parameters.iter().map(move |own| (it, own)));
    let mut caption =
        "Median widths of 90 % intervals, ln(high/low): expected from the Cramér–Rao bound, and fitted".to_owned();
    if plan.fits {
        caption +=
            "; intervals that hold the true value; largest distance of the ranks' distribution from a uniform one";
    }
    let mut tables = vec![Table { caption, columns, rows: each.map(row).collect() }];
    if plan.fits {
        let row = |it: &ExperimentCount| {
            let bench = it.wrong.clone().unwrap_or_else(|| "right".into());
            let rejected = format!("{} of {}", it.rejected, it.fits + it.refused);
            let cycles = it.cycles.map_or("–".into(), |cycles| fixed(cycles, 0));
            let counts = [it.not_converged, it.refused].map(|count| count.to_string());
            [vec![it.name.clone(), bench, rejected, percent(it.rejection)], counts.to_vec(), vec![cycles]].concat()
        };
        let mut columns = ["Experiment", "Bench of the fit", "Rejected", "95 % interval"].map(Column::words).to_vec();
        columns.extend(["Not converged", "Refused", "Predictable cycles"].map(Column::numbers));
        let caption =
            "Records that their fit rejects (p < 0.05) or refuses; on the right bench 5 % are expected".into();
        tables.push(Table { caption, columns, rows: count.0.iter().map(row).collect() });
    }
    tables
}

/// Ranks of the true values in their posteriors: histogram, and distribution function minus that of a uniform distribution.
fn ranks(experiment: &ExperimentCount) -> Figure {
    let title =
        format!("Ranks of the true values in their posteriors ({}): uniform if intervals are right", experiment.name);
    let count = experiment.fits.max(1) as f64;
    experiment.parameters.iter().fold(Figure::new(title).sized(PAGE_WIDTH_MM, 2), |figure, parameter| {
        let (ranks, limit) = (&parameter.ranks, parameter.ecdf_band);
        let bar = |bin: usize| {
            let [from, to] = [bin, bin + 1].map(|edge| edge as f64 / BINS as f64);
            let inside = ranks.iter().filter(|rank| **rank >= from && (**rank < to || bin + 1 == BINS));
            Bar { from, to, height: inside.count() as f64 }
        };
        let axis = || Axis::new(format!("Rank of {}", parameter.name), "1").range(0.0, 1.0);
        let histogram = Panel::new(axis(), Axis::new("Records", "1"))
            .layer(Layer::Bars { label: String::new(), bars: (0..BINS).map(bar).collect(), colour: Colour::Blue })
            .mark_y(count / BINS as f64, "uniform", Stroke::new(Colour::Grey).dash(Dash::Dashed));
        let distribution = Panel::new(axis(), Axis::new("Distribution − uniform", "1"))
            .band("95 % of studies", vec![(0.0, -limit, limit), (1.0, -limit, limit)], Colour::Grey)
            .line(
                "ranks",
                [(0.0, 0.0)].into_iter().chain(deviations(ranks)).chain([(1.0, 0.0)]).collect(),
                Stroke::new(Colour::Blue),
            );
        figure.panel(histogram).panel(distribution)
    })
}

/// Half-widths of the intervals in every experiment.
fn widths(experiments: &[&ExperimentCount]) -> Figure {
    let ticks: Vec<(f64, String)> = experiments.iter().enumerate().map(|(i, it)| (i as f64, it.name.clone())).collect();
    let figure = Figure::new("Half-width of the 90 % interval in every experiment").sized(PAGE_WIDTH_MM, 1);
    experiments[0].parameters.iter().enumerate().fold(figure, |figure, (d, parameter)| {
        let x = Axis::new("Experiment", "").named_ticks(ticks.clone()).range(-0.5, experiments.len() as f64 - 0.5);
        let y = Axis::new(format!("Half-width of {}", parameter.name), "%").times(100.0).logarithmic();
        let points = |width: fn(&ParameterCoverage) -> Option<f64>| -> Vec<(f64, f64)> {
            let point =
                |(i, it): (usize, &&ExperimentCount)| Some((i as f64, (0.5 * width(it.parameters.get(d)?)?).exp_m1()));
            experiments.iter().enumerate().filter_map(point).collect()
        };
        let kinds = [
            ("expected", points(|it| it.expected_width), Colour::Blue, Marker::Ring),
            ("fitted", points(|it| it.fitted_width), Colour::Black, Marker::Disc),
        ];
        let drawn = kinds.into_iter().filter(|(_, points, ..)| !points.is_empty());
        figure.panel(
            drawn.fold(Panel::new(x, y), |panel, (name, points, colour, marker)| {
                panel.points(name, points, colour, marker)
            }),
        )
    })
}
