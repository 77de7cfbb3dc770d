//! Coverage on the user's own bench and what further experiments would give: tables and a page.

use crate::own_bench::{ExperimentCount, OwnCount, OwnPlan, ParameterCoverage, Power};
use granchain_report::{
    figure::{Axis, Bar, Colour, Dash, Figure, Layer, Marker, PAGE_WIDTH_MM, Panel, Stroke},
    number::{fixed, significant},
    page::{Block, Column, Files, Page, Plate, ReportError, Table, Tone, provenance},
};

/// Bins of the histogram of ranks.
const BINS: usize = 10;

/// What was made, and what came of it.
#[derive(Debug)]
pub struct OwnBenchReport<'a> {
    pub plan: &'a OwnPlan,
    pub count: &'a OwnCount,
    /// The model that makes and fits the records.
    pub model: &'a str,
    /// Plan, version and seed.
    pub facts: Vec<(String, String)>,
    pub command_line: String,
}

impl OwnBenchReport<'_> {
    /// `report.html`, `report.md` and the figures.
    ///
    /// # Errors
    /// [`ReportError`].
    pub fn files(&self) -> Result<Files, ReportError> {
        let experiments = &self.count.0;
        let fitted: Vec<&ExperimentCount> = experiments.iter().filter(|it| it.fits > 0 && self.plan.fits).collect();
        let mut blocks = vec![self.headline()];
        blocks.push(Block::Paragraph(format!(
            "True values are drawn from the posterior of the plan's own fit, gaps and everything else that is not controlled as its uncertainties \
             state. The records are simulated by the model `{}` with an integrator{} that no fit uses, under the measured motion of the horn, and \
             written with the sampling, trigger, noise, resolution, filter and gaps of the measured record; they are read and fitted as that one was.",
            self.model,
            if self.model == "chain" { "" } else { " and a mesh" }
        )));
        blocks.extend(tables(self.plan, self.count).into_iter().map(Block::Table));
        blocks.extend(fitted.iter().take(1).map(|it| Block::Plates(vec![Plate::new("ranks", ranks(it))])));
        if experiments.len() > 1 {
            blocks.push(Block::Plates(vec![Plate::new("widths", widths(experiments))]));
        }
        blocks.extend(provenance(self.facts.clone(), &self.command_line));
        let title = if self.plan.fits { "Coverage on this bench" } else { "Expected interval widths" };
        let subtitle = "Records made on the user's own bench with known values, and what a fit makes of them".into();
        Page { title: title.into(), subtitle, blocks }.files()
    }

    fn headline(&self) -> Block {
        let first = &self.count.0[0];
        let all = || self.count.0.iter().flat_map(|it| &it.parameters);
        let text = sentences(self.plan, self.count).join(" ");
        let (tone, verdict) = match first.parameters.iter().any(|it| it.count > 0) && self.plan.fits {
            false => (Tone::Good, "expected widths"),
            true if all().any(|it| it.widen.is_some()) => (Tone::Bad, "intervals too narrow"),
            true if all().any(|it| it.ecdf_distance > it.ecdf_band) => (Tone::Careful, "ranks not uniform"),
            true => (Tone::Good, "intervals as claimed"),
        };
        Block::Headline { tone, verdict: verdict.into(), text }
    }
}

/// The answer in sentences.
#[must_use]
pub fn sentences(plan: &OwnPlan, count: &OwnCount) -> Vec<String> {
    let mut out = Vec::new();
    for (experiment, parameter) in count.0.iter().flat_map(|it| it.parameters.iter().map(move |own| (it, own))) {
        let of =
            if count.0.len() > 1 { format!("{}, {}", experiment.name, parameter.name) } else { parameter.name.clone() };
        if plan.fits && count.0.len() == 1 {
            out.push(format!(
                "{of}: {} of {} intervals of 90 % hold the true value.",
                parameter.covered, parameter.count
            ));
        }
        out.extend(parameter.widen.map(|factor| {
            format!(
                "{of}: the intervals are too narrow; {} times as wide they would hold 90 %.",
                significant(factor, 3)
            )
        }));
    }
    let names = count.0[0].parameters.iter().map(|parameter| &parameter.name).enumerate();
    out.extend(names.filter_map(|(d, name)| {
        let best = count.best(d)?;
        Some(format!("Narrowest interval of {name}: {} (±{}).", best.name, half_width(best.parameters[d].width())))
    }));
    out
}

/// Half of a width in ln, as a percentage.
fn half_width(width: Option<f64>) -> String {
    width.map_or("–".into(), |width| format!("{} %", significant(100.0 * (0.5 * width).exp_m1(), 2)))
}

/// Tables of coverage, of widths and of the power to reject a wrong bench, as far as they were asked for.
#[must_use]
pub fn tables(plan: &OwnPlan, count: &OwnCount) -> Vec<Table> {
    let mut tables = Vec::new();
    let each = || count.0.iter().flat_map(|it| it.parameters.iter().map(move |parameter| (it, parameter)));
    let named = |it: &ExperimentCount, parameter: &ParameterCoverage| vec![it.name.clone(), parameter.name.clone()];
    let words = || vec![Column::words("Experiment"), Column::words("Parameter")];
    if plan.fits {
        let row = |(it, parameter): (&ExperimentCount, &ParameterCoverage)| {
            let (low, high) = parameter.coverage;
            let mut row = named(it, parameter);
            row.extend([
                format!("{} of {}", parameter.covered, parameter.count),
                format!("{}–{} %", fixed(100.0 * low, 0), fixed(100.0 * high, 0)),
                format!("{} ({})", fixed(parameter.ecdf_distance, 2), fixed(parameter.ecdf_band, 2)),
                parameter.widen.map_or("1".into(), |factor| significant(factor, 3)),
                it.outside.to_string(),
                it.not_converged.to_string(),
                it.refused.to_string(),
            ]);
            row
        };
        let mut columns = words();
        columns.extend([
            Column::words("Covered"),
            Column::words("Coverage, 95 % interval"),
            Column::words("Distance of ranks (5 % limit)"),
            Column::numbers("Widen by"),
            Column::numbers("Outside scatter"),
            Column::numbers("Not converged"),
            Column::numbers("Refused"),
        ]);
        let caption = "Right benches: 90 % intervals that hold the true value; largest distance of the distribution of ranks from a uniform one; \
                       false rejections";
        tables.push(Table { caption: caption.into(), columns, rows: each().map(row).collect() });
    }
    let row = |(it, parameter): (&ExperimentCount, &ParameterCoverage)| {
        let optional =
            |value: Option<f64>, digits: usize| value.map_or("–".into(), |value| significant(value, digits));
        let mut row = named(it, parameter);
        row.extend([optional(parameter.expected_width, 3), optional(parameter.median_width, 3)]);
        row.extend([half_width(parameter.width()), optional(parameter.width_over_bound, 3)]);
        row.push(it.cycles.map_or("–".into(), |cycles| fixed(cycles, 0)));
        let pair = |(a, b, value): &(String, String, f64)| {
            let other = if *a == parameter.name { b } else { a };
            (a == &parameter.name || b == &parameter.name).then(|| format!("{other} {}", fixed(*value, 2)))
        };
        row.push(it.correlations.iter().filter_map(pair).collect::<Vec<_>>().join(", "));
        row
    };
    let mut columns = words();
    columns.extend([
        Column::numbers("Expected"),
        Column::numbers("Fitted"),
        Column::numbers("Half-width"),
        Column::numbers("Over bound"),
        Column::numbers("Predictable cycles"),
        Column::words("Correlated with"),
    ]);
    let caption = "Median widths of the 90 % intervals, ln(high/low): expected of the bound, reached by fits, over the Cramér–Rao bound";
    tables.push(Table { caption: caption.into(), columns, rows: each().map(row).collect() });
    let power = |it: &ExperimentCount| {
        let row = |power: &Power| {
            let (low, high) = power.chance;
            let chance = format!("{}–{} %", fixed(100.0 * low, 0), fixed(100.0 * high, 0));
            vec![it.name.clone(), power.wrong.words().into(), format!("{} of {}", power.rejected, power.count), chance]
        };
        it.power.iter().map(row).collect::<Vec<_>>()
    };
    let rows: Vec<Vec<String>> = count.0.iter().flat_map(power).collect();
    if !rows.is_empty() {
        let titles = ["Experiment", "Bench differs by", "Rejected", "Chance to be rejected, 95 % interval"];
        let columns = titles.map(Column::words).to_vec();
        let caption = "Wrong benches: records that a fit of the stated bench does not call consistent (or refuses)";
        tables.push(Table { caption: caption.into(), columns, rows });
    }
    tables
}

/// Ranks of the true values in their posteriors: histogram, and distribution function minus that of a uniform distribution.
fn ranks(experiment: &ExperimentCount) -> Figure {
    let title = format!(
        "Ranks of the true values in their posteriors ({}): uniform where intervals are right",
        experiment.name
    );
    let letters = 'a'..;
    let mut figure = Figure::new(title).sized(PAGE_WIDTH_MM, 2);
    for (parameter, letter) in experiment.parameters.iter().zip(letters.step_by(2)) {
        let ranks = &parameter.ranks;
        let count = ranks.len().max(1) as f64;
        let inside = |bin: usize| {
            ranks.iter().filter(|rank| ((**rank * BINS as f64) as usize).min(BINS - 1) == bin).count() as f64
        };
        let bar = |bin: usize| Bar {
            from: bin as f64 / BINS as f64,
            to: (bin + 1) as f64 / BINS as f64,
            height: inside(bin),
        };
        let axis = || Axis::new(format!("Rank of {}", parameter.name), "1").range(0.0, 1.0);
        let expected = count / BINS as f64;
        let histogram = Panel::new(axis(), Axis::new("Records", "1"))
            .layer(Layer::Bars { label: String::new(), bars: (0..BINS).map(bar).collect(), colour: Colour::Blue })
            .mark_y(expected, "uniform", Stroke::new(Colour::Grey).dash(Dash::Dashed))
            .titled(format!("({letter}) {}", parameter.name));
        let mut steps = vec![(0.0, 0.0)];
        for (index, rank) in ranks.iter().enumerate() {
            steps.extend([index, index + 1].map(|below| (*rank, below as f64 / count - rank)));
        }
        steps.push((1.0, 0.0));
        let band = parameter.ecdf_band;
        let next = char::from_u32(letter as u32 + 1).unwrap_or('b');
        let distribution = Panel::new(axis(), Axis::new("Distribution − uniform", "1"))
            .band("95 % of studies", vec![(0.0, -band, band), (1.0, -band, band)], Colour::Grey)
            .line("ranks", steps, Stroke::new(Colour::Blue))
            .titled(format!("({next}) {}", parameter.name));
        figure = figure.panel(histogram).panel(distribution);
    }
    figure
}

/// Half-widths of the intervals in every experiment.
fn widths(experiments: &[ExperimentCount]) -> Figure {
    let at = |index: usize| index as f64;
    let ticks: Vec<(f64, String)> = experiments.iter().enumerate().map(|(i, it)| (at(i), it.name.clone())).collect();
    let figure = Figure::new("Half-width of the 90 % interval in every experiment").sized(PAGE_WIDTH_MM, 1);
    (0..experiments[0].parameters.len()).fold(figure, |figure, d| {
        let x = Axis::new("Experiment", "").named_ticks(ticks.clone()).range(-0.5, experiments.len() as f64 - 0.5);
        let y =
            Axis::new(format!("Half-width of {}", experiments[0].parameters[d].name), "%").times(100.0).logarithmic();
        let points = |width: fn(&ParameterCoverage) -> Option<f64>| -> Vec<(f64, f64)> {
            let width =
                |(i, it): (usize, &ExperimentCount)| Some((at(i), (0.5 * width(it.parameters.get(d)?)?).exp_m1()));
            experiments.iter().enumerate().filter_map(width).collect()
        };
        let panel = Panel::new(x, y)
            .points("expected", points(|it| it.expected_width), Colour::Blue, Marker::Ring)
            .points("fitted", points(|it| it.median_width), Colour::Black, Marker::Disc);
        figure.panel(panel)
    })
}
