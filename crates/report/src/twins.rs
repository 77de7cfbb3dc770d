//! The proof of the intervals: twins with known truth, how many intervals hold it, how wide they are.

use serde::{Deserialize, Serialize};

use super::{
    figure::{Axis, Bar, Colour, ErrorPoint, Figure, Layer, Marker, Panel, Stroke},
    number::{fixed, significant},
    page::{Block, Column, Files, Page, Plate, ReportError, Table, Tone, provenance},
};

/// Fits of records whose truth is known.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct TwinsReport {
    /// What was done, in one sentence.
    pub description: String,
    /// Probability the intervals claim, 1.
    pub level: f64,
    /// Names of the parameters, such as `amplitude scale α`.
    pub parameters: Vec<String>,
    /// The twins, one fit each.
    pub twins: Vec<TwinFit>,
    /// Further statements, such as how often the right law was named.
    pub statements: Vec<String>,
    /// Version of the program.
    pub version: String,
    /// Seed.
    pub seed: u64,
    /// Command line as typed.
    pub command_line: String,
}

/// One twin and its fit.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct TwinFit {
    /// Number of the twin.
    pub index: u64,
    /// Kind of twin whose coverage is told apart, such as `annulus, linear`.
    pub group: String,
    /// Truth and interval of each parameter.
    pub intervals: Vec<TwinInterval>,
}

/// Truth and fit of one parameter, SI, all positive.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct TwinInterval {
    /// What the twin was made with.
    pub truth: f64,
    /// Point estimate.
    pub value: f64,
    /// Lower end.
    pub low: f64,
    /// Upper end.
    pub high: f64,
}

impl TwinInterval {
    /// Whether the interval holds the truth.
    #[must_use]
    pub fn covers(&self) -> bool {
        self.low <= self.truth && self.truth <= self.high
    }

    /// ln(high/low).
    #[must_use]
    pub fn width(&self) -> f64 {
        (self.high / self.low).ln()
    }

    /// |ln(value/truth)|.
    #[must_use]
    pub fn error(&self) -> f64 {
        (self.value / self.truth).ln().abs()
    }

    fn usable(&self) -> bool {
        let ascending = self.low <= self.high;
        ascending && [self.truth, self.value, self.low, self.high].iter().all(|x| x.is_finite() && *x > 0.0)
    }
}

/// Interval for a probability of which `hits` of `count` trials speak (Wilson 1927), `z` standard deviations wide.
///
/// p = (k + z²/2)/(n + z²) ± z/(n + z²) √(k(n − k)/n + z²/4). Unlike p ± √(p(1 − p)/n) it never leaves 0…1.
///
/// ```
/// use granchain_report::twins::wilson;
/// // 66 of 80 is the smallest count that a true probability of 0.9 explains at z = 2.576 (99 %).
/// assert!(wilson(66, 80, 2.576).1 > 0.9 && wilson(65, 80, 2.576).1 < 0.9);
/// ```
#[must_use]
pub fn wilson(hits: usize, count: usize, z: f64) -> (f64, f64) {
    if count == 0 {
        return (0.0, 1.0);
    }
    let (k, n) = (hits as f64, count as f64);
    let middle = (k + 0.5 * z * z) / (n + z * z);
    let half = z / (n + z * z) * (k * (n - k) / n + 0.25 * z * z).sqrt();
    ((middle - half).max(0.0), (middle + half).min(1.0))
}

/// Bars are 68 %: one standard deviation of a binomial count.
const BAR_Z: f64 = 1.0;
/// A count is called compatible with the claim within 99 %.
const CLAIM_Z: f64 = 2.576;

impl TwinsReport {
    /// `report.html`, `report.md`, the figures, `twins.csv` and `report.json`.
    ///
    /// # Errors
    /// [`ReportError`] when there are no twins, or one has a truth or interval that is not finite, positive and ascending.
    pub fn files(&self) -> Result<Files, ReportError> {
        if self.twins.is_empty() || self.parameters.is_empty() {
            return Err(ReportError::Missing { field: "twins" });
        }
        for twin in &self.twins {
            for (name, interval) in self.parameters.iter().zip(&twin.intervals) {
                if !interval.usable() {
                    let field = format!("{name} of twin {}", twin.index);
                    return Err(ReportError::NotFinite { field, found: interval.value });
                }
            }
        }
        let mut files = self.page().files()?;
        files.push(("twins.csv".into(), self.csv().into_bytes()));
        let mut json = serde_json::to_vec(self)?;
        json.push(b'\n');
        files.push(("report.json".into(), json));
        Ok(files)
    }

    /// Truth against interval for each parameter, coverage by kind of twin, widths.
    #[must_use]
    pub fn plates(&self) -> Vec<Plate> {
        let mut plates: Vec<Plate> = (0..self.parameters.len())
            .map(|index| Plate::new(format!("intervals-{}", index + 1), self.interval_figure(index)))
            .collect();
        plates.push(Plate::new("coverage", self.coverage_figure()));
        plates.push(Plate::new("widths", self.width_figure()));
        plates
    }

    fn of_parameter(&self, index: usize) -> impl Iterator<Item = (&TwinFit, &TwinInterval)> {
        self.twins.iter().filter_map(move |twin| Some((twin, twin.intervals.get(index)?)))
    }

    fn groups(&self) -> Vec<&str> {
        let mut groups: Vec<&str> = Vec::new();
        for twin in &self.twins {
            if !groups.contains(&twin.group.as_str()) {
                groups.push(&twin.group);
            }
        }
        groups
    }

    /// (covered, all) of a parameter within a group, or among all twins.
    fn coverage(&self, index: usize, group: Option<&str>) -> (usize, usize) {
        let among = self.of_parameter(index).filter(|(twin, _)| group.is_none_or(|group| twin.group == group));
        among.fold((0, 0), |(hits, count), (_, interval)| (hits + usize::from(interval.covers()), count + 1))
    }

    fn interval_figure(&self, index: usize) -> Figure {
        let mut intervals: Vec<&TwinInterval> = self.of_parameter(index).map(|(_, interval)| interval).collect();
        intervals.sort_by(|a, b| (a.value / a.truth).total_cmp(&(b.value / b.truth)));
        let points = |covered: bool| -> Vec<ErrorPoint> {
            let ranked = intervals.iter().enumerate().filter(|(_, interval)| interval.covers() == covered);
            let over = |interval: &TwinInterval, value: f64| value / interval.truth;
            ranked
                .map(|(rank, interval)| {
                    let (low, high) = (over(interval, interval.low), over(interval, interval.high));
                    ErrorPoint::vertical(rank as f64 + 1.0, over(interval, interval.value), low, high)
                })
                .collect()
        };
        let name = &self.parameters[index];
        let x = Axis::new("Twin, in the order of fit over truth", "1");
        let panel = Panel::new(x, Axis::new(format!("Fit over truth, {name}"), "1").logarithmic())
            .height(45.0)
            .mark_y(1.0, "", Stroke::new(Colour::Black).width(0.7))
            .error_points("truth inside", points(true), Colour::Blue, Marker::Dot)
            .error_points("truth outside", points(false), Colour::Vermillion, Marker::Diamond);
        Figure::new(format!(
            "Every {:.0} % interval of the {name} over its truth; the line at 1 is the truth.",
            100.0 * self.level
        ))
        .panel(panel)
    }

    fn coverage_figure(&self) -> Figure {
        let groups = self.groups();
        let mut names: Vec<(f64, String)> = vec![(0.0, "all".into())];
        names.extend(groups.iter().enumerate().map(|(index, group)| (index as f64 + 1.0, (*group).to_owned())));
        let kinds = names.len() as f64;
        // Names of groups are words, so they stand along the vertical axis.
        let y = Axis::new("Kind of twin", "1").range(-0.6, kinds - 0.4).named_ticks(names);
        let all = || std::iter::once(None).chain(groups.iter().copied().map(Some));
        let lowest = (0..self.parameters.len())
            .flat_map(|index| all().map(move |group| self.coverage(index, group)))
            .map(|(hits, count)| wilson(hits, count, BAR_Z).0)
            .fold(self.level, f64::min);
        let x = Axis::new("Share of intervals that hold the truth", "1").range((lowest - 0.05).max(0.0), 1.02);
        let mut panel = Panel::new(x, y).height(18.0 + 7.0 * kinds).mark_x(self.level, "claimed");
        let markers = [Marker::Disc, Marker::Square, Marker::Diamond, Marker::Ring];
        for (index, name) in self.parameters.iter().enumerate() {
            let shift = 0.28 * (index as f64 - 0.5 * (self.parameters.len() as f64 - 1.0));
            let points = all()
                .enumerate()
                .map(|(row, group)| {
                    let (hits, count) = self.coverage(index, group);
                    let share = hits as f64 / count.max(1) as f64;
                    ErrorPoint {
                        x: share,
                        y: row as f64 + shift,
                        y_interval: None,
                        x_interval: Some(wilson(hits, count, BAR_Z)),
                    }
                })
                .collect();
            let colour = Colour::CYCLE[(index + 1) % Colour::CYCLE.len()];
            panel = panel.error_points(name.clone(), points, colour, markers[index % markers.len()]);
        }
        Figure::new("Share of intervals that hold the truth, by kind of twin; bars are 68 % (binomial, Wilson).")
            .panel(panel)
    }

    fn width_figure(&self) -> Figure {
        const BINS_PER_DECADE: f64 = 6.0;
        let bin = |width: f64| (width.max(1e-6).log10() * BINS_PER_DECADE).floor() as i32;
        let edge = |bin: i32| 10f64.powf(f64::from(bin) / BINS_PER_DECADE);
        let mut figure = Figure::new("Widths of the intervals, ln(high/low).");
        let all: Vec<i32> = (0..self.parameters.len())
            .flat_map(|index| self.of_parameter(index))
            .map(|(_, i)| bin(i.width()))
            .collect();
        let (Some(first), Some(last)) = (all.iter().min(), all.iter().max()) else { return figure };
        for (index, name) in self.parameters.iter().enumerate() {
            let bars: Vec<Bar> = (*first..=*last)
                .map(|number| Bar {
                    from: edge(number),
                    to: edge(number + 1),
                    height: self.of_parameter(index).filter(|(_, i)| bin(i.width()) == number).count() as f64,
                })
                .collect();
            let x = Axis::new(format!("Width, {name}"), "1").logarithmic();
            let median = median(self.of_parameter(index).map(|(_, interval)| interval.width()));
            let mut panel = Panel::new(x, Axis::new("Twins", "count")).height(24.0).layer(Layer::Bars {
                label: String::new(),
                bars,
                colour: [Colour::Vermillion, Colour::Blue][index % 2],
            });
            if let Some(median) = median {
                panel = panel.mark_x(median, format!("median {}", significant(median, 2)));
            }
            figure = figure.panel(panel);
        }
        figure
    }

    fn page(&self) -> Page {
        let mut blocks = vec![self.headline(), Block::Paragraph(self.description.clone()), Block::Table(self.table())];
        if !self.statements.is_empty() {
            blocks.push(Block::List(self.statements.clone()));
        }
        blocks.push(Block::Plates(self.plates()));
        let facts = vec![("version".into(), self.version.clone()), ("seed".into(), self.seed.to_string())];
        blocks.extend(provenance(facts, &self.command_line));
        Page {
            title: format!("{} twins: do the intervals hold the truth?", self.twins.len()),
            subtitle: "Records simulated with known parameters, fitted as if they came from the laboratory".into(),
            blocks,
        }
    }

    fn headline(&self) -> Block {
        let counts: Vec<(usize, usize)> = (0..self.parameters.len()).map(|index| self.coverage(index, None)).collect();
        let words: Vec<String> = self
            .parameters
            .iter()
            .zip(&counts)
            .map(|(name, (hits, count))| format!("{name}: {hits} of {count}"))
            .collect();
        let bounds = |(hits, count): &(usize, usize)| wilson(*hits, *count, CLAIM_Z);
        let (tone, verdict) = if counts.iter().any(|count| bounds(count).1 < self.level) {
            (Tone::Bad, "intervals too narrow")
        } else if counts.iter().any(|count| bounds(count).0 > self.level) {
            (Tone::Careful, "intervals wider than claimed")
        } else {
            (Tone::Good, "intervals as claimed")
        };
        let text = format!(
            "Intervals that claim {:.0} % hold the truth as follows: {}. Compatible means within 99 % of a binomial count.",
            100.0 * self.level,
            words.join("; ")
        );
        Block::Headline { tone, verdict: verdict.into(), text }
    }

    fn table(&self) -> Table {
        let groups = self.groups();
        let kinds = std::iter::once(None).chain(groups.iter().copied().map(Some)).collect::<Vec<_>>();
        let mut rows = Vec::new();
        for (index, name) in self.parameters.iter().enumerate() {
            for group in &kinds {
                let (hits, count) = self.coverage(index, *group);
                let (low, high) = wilson(hits, count, BAR_Z);
                let among = || {
                    self.of_parameter(index)
                        .filter(|(twin, _)| group.is_none_or(|group| twin.group == group))
                        .map(|(_, interval)| interval)
                };
                let typical = |value: fn(&TwinInterval) -> f64| {
                    median(among().map(value)).map_or("–".to_owned(), |value| significant(value, 2))
                };
                rows.push(vec![
                    name.clone(),
                    group.unwrap_or("all").to_owned(),
                    format!("{hits} of {count}"),
                    fixed(hits as f64 / count.max(1) as f64, 2),
                    format!("{} to {}", fixed(low, 2), fixed(high, 2)),
                    typical(TwinInterval::width),
                    typical(TwinInterval::error),
                ]);
            }
        }
        Table {
            caption:
                "Coverage with its 68 % binomial range, median width ln(high/low) and median error |ln(fit/truth)|."
                    .into(),
            columns: vec![
                Column::words("Parameter"),
                Column::words("Twins"),
                Column::words("Truth inside"),
                Column::numbers("Coverage").unit("1"),
                Column::words("68 % range"),
                Column::numbers("Median width").unit("ln"),
                Column::numbers("Median error").unit("ln"),
            ],
            rows,
        }
    }

    fn csv(&self) -> String {
        let mut text = String::from("twin,group,parameter,truth,value,low,high,inside\n");
        for twin in &self.twins {
            for (name, interval) in self.parameters.iter().zip(&twin.intervals) {
                let TwinInterval { truth, value, low, high } = interval;
                let cells = [twin.index.to_string(), quoted(&twin.group), quoted(name)].join(",");
                text.push_str(&format!("{cells},{truth},{value},{low},{high},{}\n", interval.covers()));
            }
        }
        text
    }
}

/// A cell as CSV wants it (RFC 4180).
fn quoted(cell: &str) -> String {
    if cell.contains([',', '"', '\n', '\r']) { format!("\"{}\"", cell.replace('"', "\"\"")) } else { cell.to_owned() }
}

fn median(values: impl Iterator<Item = f64>) -> Option<f64> {
    let mut values: Vec<f64> = values.collect();
    values.sort_by(f64::total_cmp);
    let middle = values.len() / 2;
    let upper = *values.get(middle)?;
    Some(if values.len() % 2 == 1 { upper } else { 0.5 * (values[middle - 1] + upper) })
}
