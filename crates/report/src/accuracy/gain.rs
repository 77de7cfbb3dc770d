//! What calibration gains: intervals against seconds spent, in a figure, a table and a sentence.

use std::fmt::Write as _;

use serde_json::{Value, json};

use super::percent;
use crate::{
    figure::{Axis, Colour, Dash, ErrorPoint, Figure, Marker, PAGE_WIDTH_MM, Panel, Stroke},
    number::{engineering, significant},
    page::{Block, Column, Plate, Table},
};
use granchain_calibration::fit::Verdict;
use granchain_studies::accuracy::{
    gain::{Fitted, Gain, GainLine, GainPoint, Interval, Truth, Way},
    ladder::Rung,
};

/// Width in ln above which `calibrate` calls a parameter poorly determined.
const WIDE: f64 = 0.5;

/// A point of a line, the records taken together.
struct Summary {
    /// Processor time with the bodies made, s.
    seconds: f64,
    /// Records with a fit, and all.
    fitted: usize,
    records: usize,
    /// Fits that ended within scatter.
    within: usize,
    runs: f64,
    own_runs: f64,
    misfit: f64,
    parameters: Vec<Spread>,
}

/// One parameter of a point.
struct Spread {
    /// Median, least and largest width, ln.
    width: f64,
    narrowest: f64,
    widest: f64,
    /// Median of ln(median/truth), and of its magnitude.
    bias: f64,
    error: f64,
    holding: usize,
}

fn median(values: impl Iterator<Item = f64>) -> f64 {
    let mut sorted: Vec<f64> = values.collect();
    sorted.sort_by(f64::total_cmp);
    match sorted.len() {
        0 => f64::NAN,
        count => 0.5 * (sorted[(count - 1) / 2] + sorted[count / 2]),
    }
}

impl Summary {
    /// None where no record was fitted.
    fn of(gain: &Gain, line: &GainLine, point: &GainPoint) -> Option<Self> {
        let fits: Vec<&Fitted> = point.fits.iter().filter_map(|fit| fit.outcome.as_ref().ok()).collect();
        if fits.is_empty() {
            return None;
        }
        let parameters = gain.truth.iter().enumerate().map(|(d, truth)| {
            let intervals: Vec<&Interval> = fits.iter().filter_map(|fit| fit.intervals.get(d)).collect();
            let widths = || intervals.iter().map(|interval| interval.width());
            let errors = || intervals.iter().map(|interval| interval.error(truth.value));
            Spread {
                width: median(widths()),
                narrowest: widths().fold(f64::INFINITY, f64::min),
                widest: widths().fold(0.0, f64::max),
                bias: median(errors()),
                error: median(errors().map(f64::abs)),
                holding: intervals.iter().filter(|interval| interval.holds(truth.value)).count(),
            }
        });
        Some(Self {
            seconds: line.setup_s + median(point.fits.iter().map(|fit| fit.fit_s)),
            fitted: fits.len(),
            records: point.fits.len(),
            within: fits.iter().filter(|fit| fit.verdict == Verdict::WithinScatter).count(),
            runs: median(fits.iter().map(|fit| fit.runs as f64)),
            own_runs: median(fits.iter().map(|fit| fit.own_runs as f64)),
            misfit: median(fits.iter().map(|fit| fit.misfit)),
            parameters: parameters.collect(),
        })
    }

    /// Whether most of the records' intervals hold the truth, in one parameter or in all.
    fn holds(&self, parameter: Option<usize>) -> bool {
        let most = |spread: &Spread| 2 * spread.holding > self.records;
        parameter.map_or_else(|| self.parameters.iter().all(most), |d| self.parameters.get(d).is_some_and(most))
    }

    /// Whether no parameter is as poorly determined as `calibrate` would call it.
    fn is_narrow(&self) -> bool {
        self.parameters.iter().all(|spread| spread.width <= WIDE)
    }

    /// Whether most fits end within scatter: of others `calibrate` quotes no interval, or says that it was still moving.
    fn is_quoted(&self) -> bool {
        2 * self.within > self.records
    }
}

fn summaries(gain: &Gain, line: &GainLine) -> Vec<Summary> {
    line.points.iter().filter_map(|point| Summary::of(gain, line, point)).collect()
}

/// A rung and how its runs are used.
fn name(line: &GainLine) -> String {
    let setting = line.setting.to_string();
    let told = if setting.is_empty() { String::new() } else { format!(", {setting}") };
    match line.way {
        Way::Search if line.setting.rung == Rung::Chain => "chain of Hertz contacts".to_owned(),
        Way::Search => format!("{}{told}", line.setting.rung.name()),
        Way::Correction => format!("chain corrected on {}{told}", line.setting.rung.name()),
    }
}

/// As one says it: α is a letter.
fn called(truth: &Truth) -> &str {
    if truth.name == "alpha" { "α" } else { &truth.name }
}

/// Colour by model and use, marker and dash by the order within them.
fn look(lines: &[GainLine], place: usize) -> (Colour, Marker, Dash) {
    let kind = |line: &GainLine| (line.setting.rung, line.way);
    let colour = match kind(&lines[place]) {
        (_, Way::Correction) => Colour::Blue,
        (Rung::Chain, _) => Colour::Black,
        (Rung::FiniteBody, _) => Colour::Green,
        (Rung::ChainFixed, _) => Colour::Purple,
        _ => Colour::Vermillion,
    };
    let order = lines[..place].iter().filter(|line| kind(line) == kind(&lines[place])).count();
    let looks = [(Marker::Disc, Dash::Solid), (Marker::Square, Dash::Dashed), (Marker::Diamond, Dash::Dotted)];
    let (marker, dash) = looks[order % looks.len()];
    (colour, marker, dash)
}

/// Width of the interval and error of its median against seconds, two panels a parameter.
fn figure(gain: &Gain) -> Figure {
    let figure = Figure::new(
        "What calibration gains: width of the 90 % interval (bars: least and largest of the records) and error of its median against processor \
         time of one fit, bodies made. Crosses: most records' intervals miss the truth. Rings: most fits do not end within scatter, so that no \
         interval is quoted.",
    );
    let panels = gain.truth.iter().enumerate().flat_map(|(d, truth)| {
        let seconds = || Axis::new("Time of a fit, bodies made", "s").logarithmic();
        let percent = |label: String| Axis::new(label, "%").times(100.0).logarithmic();
        let width = percent(format!("90 % interval of {}, ln(high/low)", called(truth)));
        let error = percent(format!("Error of {}, |ln(median/truth)|", called(truth)));
        let of_width = |summary: &Summary| {
            let spread = &summary.parameters[d];
            ErrorPoint::vertical(summary.seconds, spread.width, spread.narrowest, spread.widest)
        };
        let of_error = |summary: &Summary| ErrorPoint::exact(summary.seconds, summary.parameters[d].error);
        // The legend stands once, above the first row.
        [panel(gain, d, seconds(), width, &of_width, d == 0), panel(gain, d, seconds(), error, &of_error, false)]
    });
    panels.fold(figure.sized(PAGE_WIDTH_MM, 2), Figure::panel)
}

fn panel(gain: &Gain, d: usize, x: Axis, y: Axis, point: &dyn Fn(&Summary) -> ErrorPoint, legend: bool) -> Panel {
    let mut panel = Panel::new(x, y).height(60.0);
    let mut missing = Vec::new();
    let label = |text: String| if legend { text } else { String::new() };
    for (place, line) in gain.lines.iter().enumerate() {
        let all = summaries(gain, line);
        let drawn = |summary: &Summary| Some(point(summary)).filter(|point| point.y > 0.0 && point.x > 0.0);
        let points: Vec<ErrorPoint> = all.iter().filter_map(drawn).collect();
        if points.is_empty() {
            continue;
        }
        let (colour, marker, dash) = look(&gain.lines, place);
        let along = points.iter().map(|point| (point.x, point.y)).collect();
        panel = panel.line(String::new(), along, Stroke::new(colour).dash(dash));
        panel = panel.error_points(label(name(line)), points, colour, marker);
        let at = |chosen: &dyn Fn(&Summary) -> bool| -> Vec<(f64, f64)> {
            let chosen = all.iter().filter(|summary| chosen(summary)).filter_map(drawn);
            chosen.map(|point| (point.x, point.y)).collect()
        };
        missing.extend(at(&|summary| !summary.holds(Some(d))));
        let unquoted = at(&|summary| !summary.is_quoted());
        if !unquoted.is_empty() {
            panel = panel.points(String::new(), unquoted, colour, Marker::Ring);
        }
    }
    if !missing.is_empty() {
        panel = panel.points(label("truth missed".to_owned()), missing, Colour::Black, Marker::Cross);
    }
    panel
}

/// What the dearer rung buys.
pub fn sentence(gain: &Gain) -> String {
    let all: Vec<(&GainLine, Summary)> = gain
        .lines
        .iter()
        .flat_map(|line| summaries(gain, line).into_iter().map(move |summary| (line, summary)))
        .collect();
    let mut said = Vec::new();
    for line in &gain.lines {
        let own: Vec<&Summary> =
            all.iter().filter(|(of, _)| std::ptr::eq(*of, line)).map(|(_, summary)| summary).collect();
        for (d, truth) in gain.truth.iter().enumerate() {
            if let (Some(last), true) = (own.last(), own.iter().all(|summary| !summary.holds(Some(d)))) {
                said.push(format!(
                    "{}: {} is off by {} after {}, and most intervals miss it whatever is spent",
                    name(line),
                    called(truth),
                    signed_percent(last.parameters[d].bias),
                    engineering(last.seconds, "s", 2)
                ));
            }
        }
    }
    let good = || all.iter().filter(|(_, it)| it.holds(None) && it.is_quoted() && it.is_narrow());
    let fit_said = |(line, summary): &(&GainLine, Summary)| {
        let widths: Vec<String> = gain
            .truth
            .iter()
            .zip(&summary.parameters)
            .map(|(truth, spread)| format!("{} {} wide", called(truth), percent(spread.width)))
            .collect();
        format!(
            "{}, {} runs, {} ({})",
            name(line),
            summary.runs.round(),
            engineering(summary.seconds, "s", 2),
            widths.join(", ")
        )
    };
    let cheapest = good().min_by(|a, b| a.1.seconds.total_cmp(&b.1.seconds));
    let narrowest = good().min_by(|a, b| a.1.parameters[0].width.total_cmp(&b.1.parameters[0].width));
    match (cheapest, narrowest) {
        (Some(cheapest), Some(narrowest)) => {
            said.push(format!(
                "the cheapest fit that determines all parameters and whose intervals hold the truth in most records: {}",
                fit_said(cheapest)
            ));
            if !std::ptr::eq(cheapest, narrowest) {
                said.push(format!("the narrowest: {}", fit_said(narrowest)));
            }
        }
        _ => said.push("no fit determines all parameters and holds the truth in most records".to_owned()),
    }
    let mut text = said.join("; ");
    if let Some(first) = text.get(..1).map(str::to_uppercase) {
        text.replace_range(..1, &first);
    }
    text + "."
}

fn signed_percent(value: f64) -> String {
    format!("{}{}", if value < 0.0 { "−" } else { "+" }, percent(value.abs()))
}

fn table(gain: &Gain) -> Table {
    let mut columns = vec![
        Column::words("Rung"),
        Column::numbers("Runs"),
        Column::numbers("of them above the chain"),
        Column::numbers("A run").unit("ms"),
        Column::numbers("Bodies").unit("s"),
        Column::numbers("In all").unit("s"),
    ];
    for truth in &gain.truth {
        let called = called(truth);
        columns.push(Column::numbers(format!("{called}: width")).unit("%"));
        columns.push(Column::numbers("least to largest").unit("%"));
        columns.push(Column::numbers("error").unit("%"));
        columns.push(Column::numbers("holds"));
    }
    columns.extend([Column::numbers("Within scatter"), Column::numbers("FIT"), Column::numbers("Fitted")]);
    let hundredths = |value: f64| significant(100.0 * value, 2);
    let row = |line: &GainLine, summary: &Summary| {
        let above = line.way == Way::Correction || line.setting.rung == Rung::Reduced;
        let of_all = |count: usize| format!("{count} of {}", summary.records);
        let mut cells = vec![
            name(line),
            format!("{}", summary.runs.round()),
            if above { format!("{}", summary.own_runs.round()) } else { "–".into() },
            significant(1e3 * line.run_s, 2),
            significant(line.setup_s, 2),
            significant(summary.seconds, 2),
        ];
        for spread in &summary.parameters {
            cells.push(hundredths(spread.width));
            cells.push(format!("{} to {}", hundredths(spread.narrowest), hundredths(spread.widest)));
            cells.push(hundredths(spread.error));
            cells.push(of_all(spread.holding));
        }
        cells.extend([of_all(summary.within), significant(summary.misfit, 2), of_all(summary.fitted)]);
        cells
    };
    let rows =
        gain.lines.iter().flat_map(|line| summaries(gain, line).into_iter().map(move |summary| row(line, &summary)));
    Table {
        caption: "Fits by rung and number of runs, medians over the records. Width: 90 % interval, ln(high/low); error: |ln(median/truth)|; holds: \
                  intervals that hold the truth, whatever the verdict; FIT: misfit of the best runs in scatters, 1.5 is the limit. Time: one thread."
            .into(),
        columns,
        rows: rows.collect(),
    }
}

/// The section of the page.
pub fn blocks(gain: Option<&Gain>, is_fresh: bool, scene: &str) -> Vec<Block> {
    let heading = Block::Heading("What calibration gains".into());
    let Some(gain) = gain else {
        return vec![
            heading,
            Block::Paragraph(format!(
                "Not measured for this scene; `granchain accuracy --scene {scene} --calibration` does it."
            )),
        ];
    };
    let truth: Vec<String> = gain.truth.iter().map(value_said).collect();
    let drawn = if is_fresh { "" } else { " All of it is stored, with the seconds of the machine that measured it:" };
    let machine = if is_fresh { String::new() } else { format!(" {}.", gain.processor) };
    vec![
        heading,
        Block::Paragraph(sentence(gain)),
        Block::Paragraph(format!(
            "{} records of this scene, {}, made by {}, {}, with {} of noise; gaps, trigger, offset and sample rate drawn anew for each. Every record \
             is fitted on every rung, from the same bounds and with the same nuisances; interval and verdict are those of `calibrate`. So few \
             records show what is plainly wrong, not whether 90 % are 90 %: that is what `granchain twins` counts.{drawn}{machine}",
            gain.twins,
            truth.join(", "),
            gain.made_by.rung.name(),
            gain.made_by,
            percent(gain.noise),
        )),
        Block::Plates(vec![Plate::new("calibration-gain", figure(gain))]),
        Block::Table(table(gain)),
    ]
}

fn value_said(truth: &Truth) -> String {
    let unit = if truth.unit == "1" { String::new() } else { format!(" {}", truth.unit) };
    format!("{} = {}{unit}", called(truth), significant(truth.value, 3))
}

/// One row a fit and parameter; no seconds, so that it is the same on every machine.
pub fn csv(gain: &Gain) -> String {
    let mut text = "model,setting,way,evaluations,record,parameter,unit,truth,low,median,high,holds,verdict,misfit,runs,own_runs,failed\n".to_owned();
    for line in &gain.lines {
        let way = if line.way == Way::Search { "search" } else { "correction" };
        for point in &line.points {
            for (number, fit) in point.fits.iter().enumerate() {
                let Ok(fitted) = &fit.outcome else { continue };
                for (truth, interval) in gain.truth.iter().zip(&fitted.intervals) {
                    // Writing to a string cannot fail.
                    let _ = writeln!(
                        text,
                        "\"{}\",\"{}\",{way},{},{number},{},{},{:e},{:e},{:e},{:e},{},{},{:e},{},{},{}",
                        line.setting.rung.name(),
                        line.setting,
                        point.evaluations,
                        truth.name,
                        truth.unit,
                        truth.value,
                        interval.low,
                        interval.median,
                        interval.high,
                        interval.holds(truth.value),
                        fitted.verdict,
                        fitted.misfit,
                        fitted.runs,
                        fitted.own_runs,
                        fitted.failed
                    );
                }
            }
        }
    }
    text
}

/// All of it without what differs from machine to machine.
pub fn json(gain: &Gain) -> Value {
    let mut value = json!(gain);
    if let Some(all) = value.as_object_mut() {
        all.remove("processor");
    }
    for line in value["lines"].as_array_mut().into_iter().flatten() {
        if let Some(line) = line.as_object_mut() {
            line.remove("setup_s");
            line.remove("run_s");
        }
        for point in line["points"].as_array_mut().into_iter().flatten() {
            for fit in point["fits"].as_array_mut().into_iter().flatten() {
                if let Some(fit) = fit.as_object_mut() {
                    fit.remove("fit_s");
                }
            }
        }
    }
    value
}

/// Seconds, for `timing.json`.
pub fn timing(gain: &Gain) -> Value {
    let lines = gain.lines.iter().map(|line| {
        let points: Vec<Value> = line
            .points
            .iter()
            .map(|point| json!({"evaluations": point.evaluations, "fit_s": point.fits.iter().map(|fit| fit.fit_s).collect::<Vec<_>>()}))
            .collect();
        json!({"rung": name(line), "setup_s": line.setup_s, "run_s": line.run_s, "fits": points})
    });
    Value::Array(lines.collect())
}

#[cfg(test)]
mod tests {
    use super::*;
    use granchain_studies::accuracy::{
        gain::GainFit,
        ladder::{Setting, Varied},
    };

    fn fit(seconds: f64, alpha: (f64, f64), verdict: Verdict) -> GainFit {
        let (middle, half) = alpha;
        let interval = Interval { low: middle * (1.0 - half), median: middle, high: middle * (1.0 + half) };
        let fitted = Fitted { intervals: vec![interval], verdict, misfit: 0.5, runs: 600, own_runs: 600, failed: 0 };
        GainFit { outcome: Ok(fitted), fit_s: seconds }
    }

    fn gain() -> Gain {
        let within = Verdict::WithinScatter;
        let line = |setting, setup_s, points: Vec<(usize, Vec<GainFit>)>| GainLine {
            setting,
            way: Way::Search,
            setup_s,
            run_s: 0.01,
            points: points.into_iter().map(|(evaluations, fits)| GainPoint { evaluations, fits }).collect(),
        };
        let hertz = vec![fit(1.0, (0.56, 0.01), within), fit(1.0, (0.55, 0.01), within), fit(1.0, (0.5, 0.01), within)];
        let bodies = |half| [0.5, 0.501, 0.499].map(|middle| fit(2.0 / half, (middle, half), within)).to_vec();
        Gain {
            truth: vec![Truth { name: "alpha".into(), unit: "1".into(), value: 0.5 }],
            made_by: Setting::of(Rung::Reduced, &[(Varied::Density, 64.0)]),
            twins: 3,
            noise: 0.01,
            seed: 1,
            processor: "a machine".into(),
            lines: vec![
                line(Setting::of(Rung::Chain, &[]), 0.0, vec![(600, hertz)]),
                line(
                    Setting::of(Rung::FiniteBody, &[(Varied::Density, 6.0)]),
                    0.5,
                    vec![(150, bodies(0.1)), (600, bodies(0.05))],
                ),
            ],
        }
    }

    #[test]
    fn the_sentence_names_what_is_off_and_what_holds_the_truth_for_least_and_most() {
        let said = sentence(&gain());
        // ln(0.55/0.5) = 9.5 %; two of three miss.
        assert!(said.starts_with("Chain of Hertz contacts: α is off by +9.5 % after 1.0 s, and most"), "{said}");
        // ln(1.1/0.9) = 20 % after 20.5 s, ln(1.05/0.95) = 10 % after 40.5 s.
        assert!(
            said.contains("in most records: chain of finite bodies, mesh density 6, 600 runs, 20 s (α 20 % wide)")
                || said.contains("21 s (α 20 % wide)"),
            "{said}"
        );
        assert!(said.contains("the narrowest") && said.contains("(α 10 % wide)"), "{said}");
    }

    #[test]
    fn a_fit_outside_its_scatter_is_not_what_holds_the_truth() {
        let mut gain = gain();
        for point in &mut gain.lines[1].points {
            point
                .fits
                .iter_mut()
                .filter_map(|fit| fit.outcome.as_mut().ok())
                .for_each(|fit| fit.verdict = Verdict::OutsideScatter);
        }
        assert!(
            sentence(&gain).ends_with("no fit determines all parameters and holds the truth in most records."),
            "{}",
            sentence(&gain)
        );
    }

    #[test]
    fn files_that_are_the_same_everywhere_hold_no_seconds() {
        let (json, csv) = (json(&gain()).to_string(), csv(&gain()));
        for key in ["fit_s", "run_s", "setup_s", "machine"] {
            assert!(!json.contains(key) && !csv.contains(key), "{key}");
        }
        assert_eq!(csv.lines().count(), 1 + 9);
        assert!(timing(&gain()).to_string().contains("fit_s"));
    }

    #[test]
    fn the_figure_draws_and_a_page_without_a_measurement_says_how_to_make_one() {
        assert!(figure(&gain()).to_svg().unwrap().contains("truth missed"));
        let blocks = blocks(None, false, "water");
        assert!(matches!(&blocks[1], Block::Paragraph(text) if text.contains("--scene water --calibration")));
    }
}
