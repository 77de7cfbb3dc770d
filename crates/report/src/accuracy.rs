//! What accuracy costs, and what effects cost: tables, one work–precision figure, a page.

use serde_json::Value;

use super::{
    figure::{Axis, Colour, Dash, Figure, Layer, Marker, PAGE_WIDTH_MM, Panel, Stroke},
    number::{engineering, fixed, significant},
    page::{Block, Column, Files, Page, Plate, ReportError, Table, Tone, provenance},
};
use granchain_calibration::design::variations::{Accuracy, Method, Row};

/// Columns of what a fit sees of a change.
const CHANGES: [&str; 6] = ["+peak %", "−peak %", "1/3", "2/3", "α %", "damping %"];

/// Variations of a scene, measured, and where they come from.
#[derive(Debug, Clone, PartialEq)]
pub struct AccuracyReport {
    pub program: String,
    /// Command line that makes the same page, its times those of another machine.
    pub command_line: String,
    /// Which effects the scene has, in one line.
    pub simulated: String,
    /// Half-widths of a calibration's 90 % intervals (of ln α, ln of the damping coefficient) in place of those of the window.
    pub calibrated: Option<[Option<f64>; 2]>,
    pub accuracy: Accuracy,
}

fn percent(value: f64) -> String {
    significant(100.0 * value, 2)
}

/// Beyond it a shift is not linear in the change of the waveform, 1.
const LINEAR: f64 = 0.3;

/// A shift in per cent.
fn shifted(value: Option<f64>) -> String {
    match value {
        Some(value) if value.abs() > LINEAR => if value > 0.0 { "> 30" } else { "< −30" }.into(),
        value => changed(value),
    }
}

/// A signed change in per cent.
fn changed(value: Option<f64>) -> String {
    value.map_or("–".into(), |value| match 100.0 * value {
        change if change.abs() < 10.0 => fixed(change, 2),
        change => fixed(change, 0),
    })
}

fn cells_of_changes(row: &Row) -> Vec<String> {
    let ratio = |value: Option<f64>| value.map_or("–".into(), |value| fixed(value, 3));
    row.peaks.map(changed).into_iter().chain(row.ratios.map(ratio)).chain(row.shift.map(shifted)).collect()
}

fn columns_of_changes(first: &str) -> Vec<Column> {
    std::iter::once(Column::words(first)).chain(CHANGES.map(Column::numbers)).collect()
}

/// Seconds; what takes less than a tenth of a millisecond, such as bodies that there are none of, takes none.
fn seconds(value: f64) -> String {
    if value < 1e-4 { "–".into() } else { significant(value, 2) }
}

impl AccuracyReport {
    /// Half-widths of the intervals that shifts are held against.
    fn half_widths(&self) -> [Option<f64>; 2] {
        self.calibrated.unwrap_or(self.accuracy.half_widths)
    }

    /// The two tables: seconds and errors; changes and shifts.
    #[must_use]
    pub fn tables(&self) -> [Table; 2] {
        let Accuracy { rows, reference_error, .. } = &self.accuracy;
        let front = self.accuracy.front();
        let mark = |(place, row): (usize, &Row)| {
            let marks = [(row.is_default, "default"), (front.contains(&place), "*")];
            marks.into_iter().filter(|(is, _)| *is).map(|(_, word)| word).collect::<Vec<_>>().join(" ")
        };
        let total = |row: &Row| {
            if row.total < *reference_error { format!("< {}", percent(*reference_error)) } else { percent(row.total) }
        };
        let cost = rows.iter().enumerate().map(|(place, row)| {
            vec![
                row.name.clone(),
                row.mesh.map_or("–".into(), |density| density.to_string()),
                row.step.clone(),
                seconds(row.bodies_s),
                seconds(row.run_s),
                total(row),
                row.own.map_or("–".into(), percent),
                mark((place, row)),
            ]
        });
        let columns = ["mesh", "step", "bodies s", "run s", "error %", "own %"].map(Column::numbers);
        let columns =
            std::iter::once(Column::words("Model")).chain(columns).chain([Column::words("")]).collect::<Vec<_>>();
        [Table { caption: String::new(), columns, rows: cost.collect() }, self.changes()]
    }

    /// What the rows change, and half of the intervals that this is held against.
    fn changes(&self) -> Table {
        let rows = self.accuracy.rows.iter().filter(|row| row.own.is_some() || row.method == Method::Effect);
        let changes = rows.map(|row| std::iter::once(row.label()).chain(cells_of_changes(row)).collect());
        let half = self.half_widths().map(|half| half.map_or("–".into(), |half| format!("± {}", percent(half))));
        let interval = ["half of the 90 % interval", "", "", "", ""].map(String::from).into_iter().chain(half);
        Table {
            caption: String::new(),
            columns: columns_of_changes(""),
            rows: changes.chain([interval.collect()]).collect(),
        }
    }

    /// The effects in two tables: share of the time that goes without each, – below noise; then what it changes.
    #[must_use]
    pub fn effect_tables(&self) -> [Table; 2] {
        let rows = &self.accuracy.rows;
        let cells = rows.iter().enumerate().map(|(place, row)| {
            let saved = 1.0 - row.seconds() / rows[0].seconds();
            let time = match place {
                0 => engineering(row.seconds(), "s", 2),
                _ if is_clear(&rows[0], row, saved) => format!("{} %", fixed(-100.0 * saved, 0)),
                _ => "–".into(),
            };
            let change = if place == 0 { "–".into() } else { percent(row.total) };
            vec![row.name.clone(), time, change]
        });
        let columns = vec![Column::words("Without"), Column::numbers("time"), Column::numbers("waveform %")];
        [Table { caption: String::new(), columns, rows: cells.collect() }, self.changes()]
    }

    /// What is compared, with what, over which time.
    #[must_use]
    pub fn compared(&self) -> String {
        let Accuracy { scene, window_s: [begins, ends], reference, reference_error, .. } = &self.accuracy;
        format!(
            "Scene {scene}, compared up to {} (motion from {} on) with {reference}, known to {} %",
            engineering(*ends, "s", 3),
            engineering(*begins, "s", 3),
            percent(*reference_error)
        )
    }

    /// What the columns mean.
    #[must_use]
    pub fn legend(&self) -> String {
        let whose = if self.calibrated.is_some() { "the calibration" } else { "a fit of this window" };
        format!(
            "error: rms of the difference over rms of the reference. own: what a finer step and mesh change of the same model. *: nothing is both faster \
             and more accurate, by √(error² + own²). run: the whole scene, one thread. α, damping: by how much a fit with this setting is off; \
             ± half of the 90 % interval of {whose}. Peaks and ratios are those of the first twelve cycles."
        )
    }

    /// Variations that the scene has not, with the reason.
    #[must_use]
    pub fn left_out(&self) -> Vec<String> {
        self.accuracy.left_out.iter().map(|[name, reason]| format!("not run: {name}: {reason}")).collect()
    }

    /// Error against seconds: a line a method and mesh, the default marked.
    #[must_use]
    pub fn figure(&self) -> Figure {
        let Accuracy { rows, reference_error, scene, .. } = &self.accuracy;
        let place = |row: &Row| (row.seconds(), row.total.max(*reference_error));
        let mut panel = Panel::new(
            Axis::new("Time of bodies and one run", "s").logarithmic(),
            Axis::new("Error", "%").times(100.0).logarithmic(),
        )
        .height(80.0);
        let looks = [
            (Colour::Black, Marker::Disc, Dash::Solid),
            (Colour::Green, Marker::Diamond, Dash::DashDotted),
            (Colour::Vermillion, Marker::Square, Dash::Solid),
            (Colour::Blue, Marker::Disc, Dash::Dashed),
        ];
        for (method, (colour, marker, dash)) in Method::ALL.into_iter().zip(looks) {
            let of_method: Vec<&Row> = rows.iter().filter(|row| row.method == method && place(row).1 > 0.0).collect();
            let mut label = method.name();
            for of_mesh in of_method.chunk_by(|a, b| a.mesh == b.mesh) {
                let points: Vec<(f64, f64)> = of_mesh.iter().map(|row| place(row)).collect();
                panel = panel.line(String::new(), points.clone(), Stroke::new(colour).dash(dash));
                panel = panel.points(std::mem::take(&mut label), points, colour, marker);
            }
        }
        let front = self.accuracy.front();
        // The first of a mesh, and what is on the front: all would overlap.
        let is_named = |at: usize| {
            let row = &rows[at];
            let is_first = at == 0 || (rows[at - 1].method, rows[at - 1].mesh) != (row.method, row.mesh);
            place(row).1 > 0.0 && (is_first || front.contains(&at))
        };
        let named = rows.iter().enumerate().filter(|(at, _)| is_named(*at)).map(|(_, row)| {
            let mesh = row.mesh.map_or(String::new(), |density| format!("{density}, "));
            (place(row).0, place(row).1, format!("{mesh}{}", row.step))
        });
        panel = panel.layer(Layer::Names(named.collect()));
        let defaults: Vec<(f64, f64)> = rows.iter().filter(|row| row.is_default).map(place).collect();
        if !defaults.is_empty() {
            panel = panel.points("default", defaults, Colour::Black, Marker::Cross);
        }
        if *reference_error > 0.0 {
            let label = format!("reference known to {} %", percent(*reference_error));
            panel = panel.mark_y(*reference_error, label, Stroke::new(Colour::Grey).dash(Dash::Dotted));
        }
        let title = format!(
            "What accuracy costs, scene {scene}: error of the first cycles against seconds of one thread. Numbers: mesh density, step or tolerance."
        );
        Figure::new(title).sized(PAGE_WIDTH_MM, 1).panel(panel)
    }

    /// `report.html`, `report.md`, the figure, `NAME.json`.
    ///
    /// # Errors
    /// [`ReportError`] when an error is not finite, or the figure cannot be drawn.
    pub fn files(&self, name: &str, advice: &[String]) -> Result<Files, ReportError> {
        let Accuracy { rows, scene, .. } = &self.accuracy;
        if let Some(wrong) = rows.iter().find(|row| !row.total.is_finite()) {
            return Err(ReportError::NotFinite { field: format!("error of {}", wrong.label()), found: wrong.total });
        }
        let is_of_models = rows.iter().any(|row| row.own.is_some());
        let (verdict, text) = match advice.split_first() {
            Some((first, rest)) => (first.clone(), rest.join(" ")),
            None => (self.simulated.clone(), String::new()),
        };
        let mut blocks = vec![Block::Headline { tone: Tone::Good, verdict, text: format!(" {text}") }];
        blocks.extend([Block::Paragraph(self.compared() + "."), Block::Paragraph(self.simulated.clone() + ".")]);
        if is_of_models {
            blocks.push(Block::Plates(vec![Plate::new("work-precision", self.figure())]));
        }
        let tables = if is_of_models { self.tables() } else { self.effect_tables() };
        blocks.extend(tables.into_iter().map(Block::Table));
        blocks.push(Block::Paragraph(self.legend()));
        blocks.extend(Block::listed("Not run", self.left_out()));
        blocks.extend(provenance(vec![("version".into(), self.program.clone())], &self.command_line));
        let (title, subtitle) = match is_of_models {
            true => (format!("What accuracy costs, scene {scene}"), "Models, meshes and steps: seconds and errors"),
            false => (format!("Effects of the scene {scene}"), "What each costs, and what leaving it out changes"),
        };
        let mut files = Page { title, subtitle: subtitle.into(), blocks }.files()?;
        let mut json = serde_json::to_vec_pretty(&without_times(self.json()))?;
        json.push(b'\n');
        files.push((format!("{name}.json").into(), json));
        Ok(files)
    }

    /// All that was found, times included.
    #[must_use]
    pub fn json(&self) -> Value {
        let mut json = serde_json::json!(self.accuracy);
        json["program"] = self.program.clone().into();
        json["simulated"] = self.simulated.clone().into();
        json["calibrated_half_widths"] = serde_json::json!(self.calibrated);
        json["front"] = self.accuracy.front().iter().map(|place| self.accuracy.rows[*place].label()).collect();
        json
    }

    /// What each row took, for `timing.json`.
    #[must_use]
    pub fn timing(&self) -> Value {
        let one = |row: &Row| serde_json::json!({"row": row.label(), "bodies_s": row.bodies_s, "run_s": row.run_s});
        self.accuracy.rows.iter().map(one).collect()
    }
}

/// Results are the same bytes on every machine: times stand in `timing.json` alone, and so does what depends on them.
fn without_times(mut json: Value) -> Value {
    if let Some(report) = json.as_object_mut() {
        report.remove("front");
    }
    for row in json["rows"].as_array_mut().into_iter().flatten().filter_map(Value::as_object_mut) {
        for key in ["bodies_s", "run_s", "time_noise"] {
            row.remove(key);
        }
    }
    json
}

/// The effects, the most time first: what a run without each saves and changes, in a sentence; those that change the waveform by at most `target` (1).
#[must_use]
pub fn advice(effects: &Accuracy, target: Option<f64>) -> Vec<String> {
    let Some((base, others)) = effects.rows.split_first() else { return Vec::new() };
    let saved = |row: &Row| 1.0 - row.seconds() / base.seconds();
    let mut saving: Vec<(&Row, f64)> =
        others.iter().map(|row| (row, saved(row))).filter(|(row, saved)| is_clear(base, row, *saved)).collect();
    saving.sort_by(|a, b| b.1.total_cmp(&a.1));
    let sentence = |(row, saved): (&Row, f64)| {
        let moves =
            row.shift[0].map_or_else(String::new, |shift| format!(", α of a fit moves by {} %", shifted(Some(shift))));
        format!(
            "without {}: {:.0} % less time{moves}, the waveform changes by {} %",
            row.name,
            100.0 * saved,
            percent(row.total)
        )
    };
    let accepted = |(row, saved): &(&Row, f64)| *saved > 0.0 && target.is_none_or(|target| row.total <= target);
    let mut advice: Vec<String> = saving.into_iter().filter(accepted).map(sentence).collect();
    if advice.is_empty() {
        let within = target
            .map_or(String::new(), |target| format!(" and changes the waveform by at most {} %", percent(target)));
        advice.push(format!("no effect of this scene costs time that could be measured{within}"));
    }
    advice
}

/// Whether a saving is more than the noise of the times.
fn is_clear(base: &Row, row: &Row, saved: f64) -> bool {
    saved.abs() > (base.time_noise + row.time_noise).max(LEAST_SAVING)
}

/// Savings below it say nothing about another machine, 1.
const LEAST_SAVING: f64 = 0.1;
