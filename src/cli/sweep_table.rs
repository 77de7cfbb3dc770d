//! The results of a sweep: CSV, JSON, figures and a table for people, all in the order of the grid.
//!
//! The runs are read in passes and never held together: what is shown of many is thinned evenly.

use std::{collections::BTreeMap, fmt::Write, io};

use serde::{
    Serialize, Serializer,
    ser::{Error as _, SerializeSeq},
};
use serde_json::{Map, Value as Json, json};

use super::{
    calibrated::Calibrated,
    output::aligned,
    summary::{self, EnsembleTable},
};
use crate::{
    calibration::bench::Bench,
    measurement::run_log::RunIndex,
    report::{
        figure::Figure,
        number::{engineering, fixed},
        page::{Column, Table},
        regime::{self, Fit, Varied},
        sweep::{SweepCurve, SweepPage, SweepPoint, SweepReport},
    },
    response::SMALL_RESIDUAL,
    scene::{Key, ModelKind, Scene, ValueKind},
    study::{
        Axis, Grid, Value,
        observation::watched,
        steady::{Regime, SteadyMotion},
        sweep::{Run, Study},
    },
};

/// Most rows printed on a terminal.
const MOST_ROWS: usize = 60;
/// Most figures of a grid with several axes.
const MOST_FIGURES: usize = 16;
/// Most points of a curve, and most rows of the page; of more, every so many-th is shown.
const MOST_SHOWN: usize = 2000;
/// Most values of an axis that the page lists.
const MOST_VALUES: usize = 100;

/// Keys of the pressure metrics, as columns of the CSV file.
const PRESSURE: [&str; 3] = ["pressure_positive_peak_pa", "pressure_negative_peak_pa", "pressure_level_at_950_khz_db"];

/// Columns of the regime.
const MOTION: [&str; 2] = ["regime", "broadband_share"];

/// Numbers most looked at: key, name and unit on the page, head on the terminal, shown number over SI number, digits.
const SHOWN: [(&str, &str, &str, &str, f64, usize); 8] = [
    ("positive_peak", "Positive peak", "mm/s", "+ mm/s", 1e3, 1),
    ("negative_peak", "Negative peak", "mm/s", "- mm/s", 1e3, 1),
    ("ratio_1/3", "Line 1/3", "1", "1/3", 1.0, 3),
    ("ratio_1/2", "Line 1/2", "1", "1/2", 1.0, 3),
    ("ratio_2/3", "Line 2/3", "1", "2/3", 1.0, 3),
    (PRESSURE[0], "Positive pressure", "kPa", "+ kPa", 1e-3, 2),
    (PRESSURE[1], "Negative pressure", "kPa", "- kPa", 1e-3, 2),
    (PRESSURE[2], "Level at 0.95 MHz re the drive", "dB", "dB", 1.0, 1),
];

/// Curves of a figure: key, panel, name, SI unit.
const CURVES: [(&str, &str, &str, &str); 12] = [
    ("positive_peak", "Peak velocity", "positive", "m/s"),
    ("negative_peak", "Peak velocity", "negative", "m/s"),
    ("line_1/3", "Line amplitude", "1/3", "m/s"),
    ("line_1/2", "Line amplitude", "1/2", "m/s"),
    ("line_2/3", "Line amplitude", "2/3", "m/s"),
    ("line_1", "Line amplitude", "1", "m/s"),
    ("ratio_1/3", "Ratio to the drive line", "1/3", "1"),
    ("ratio_1/2", "Ratio to the drive line", "1/2", "1"),
    ("ratio_2/3", "Ratio to the drive line", "2/3", "1"),
    (PRESSURE[0], "Peak pressure", "positive", "Pa"),
    (PRESSURE[1], "Peak pressure", "negative", "Pa"),
    (PRESSURE[2], "Level at 0.95 MHz re the drive", "", "dB"),
];

/// The runs of a sweep, wherever they lie.
pub trait Runs {
    /// Hand on every run in the order of the grid.
    fn each(&self, seen: &mut dyn FnMut(usize, &Run) -> anyhow::Result<()>) -> anyhow::Result<()>;
}

impl Runs for RunIndex {
    fn each(&self, seen: &mut dyn FnMut(usize, &Run) -> anyhow::Result<()>) -> anyhow::Result<()> {
        (0..self.len()).try_for_each(|index| seen(index, &self.read(index)?))
    }
}

/// What is held of the runs of a sweep.
#[derive(Default)]
struct SweepSummary {
    runs: usize,
    failed: usize,
    /// Those that leave more energy unaccounted for than they may without a warning.
    unbalanced: usize,
    /// Whether any run has pressure metrics.
    has_water: bool,
    /// Regime of every run, and its line at f0/3 over the drive's.
    regimes: Vec<Option<(Regime, Option<f64>)>>,
    /// The rows of the terminal.
    first: Vec<Run>,
    rows: Vec<(usize, Run)>,
    /// The figures: axis along which they run, and what they show.
    slices: Option<(usize, Vec<Slice>)>,
}

pub struct SweepTable<'a> {
    /// The scene without the swept values.
    pub scene: &'a Scene,
    pub grid: &'a Grid,
    runs: &'a dyn Runs,
    /// What one pass over it showed.
    seen: SweepSummary,
    /// Whether each point has an ensemble, or a regime.
    pub ensemble: bool,
    regime: bool,
}

/// The points of a grid that differ in the swept axis only.
struct Slice {
    fixed: Vec<String>,
    members: Vec<(usize, Run)>,
}

impl<'a> SweepTable<'a> {
    /// Look once through the runs of `grid` over `scene`.
    pub fn new(scene: &'a Scene, grid: &'a Grid, runs: &'a dyn Runs, study: &Study) -> anyhow::Result<Self> {
        let is_number = |axis: &Axis| axis.values.iter().all(|value| matches!(value, Value::Number(_)));
        let swept = grid.axes.iter().position(is_number);
        let mut seen = SweepSummary { slices: swept.map(|axis| (axis, Vec::new())), ..SweepSummary::default() };
        let stride = grid.len().div_ceil(MOST_SHOWN);
        runs.each(&mut |index, run| {
            seen.runs += 1;
            seen.failed += usize::from(matches!(run, Run::Failed { .. }));
            let share = if let Run::Finished { energy_residual: Some(share), .. } = run { *share } else { 0.0 };
            seen.unbalanced += usize::from(share.abs() > SMALL_RESIDUAL);
            seen.has_water |= matches!(run, Run::Finished { pressure_metrics: Some(_), .. });
            if study.is_regime() {
                let third = || value(run, "ratio_1/3");
                seen.regimes.push(motion(run).map(|motion| (motion.regime, third())));
            }
            if index < MOST_ROWS {
                seen.first.push(run.clone());
            }
            if index % stride == 0 {
                seen.rows.push((index, run.clone()));
            }
            if let Some((axis, slices)) = &mut seen.slices {
                let [place, length] = [grid.place(index, *axis), grid.axes[*axis].values.len()];
                let fixed = others(grid, *axis, index);
                let known = slices.iter().position(|slice| slice.fixed == fixed);
                let slice = known.or_else(|| {
                    let fits = slices.len() < MOST_FIGURES;
                    fits.then(|| slices.push(Slice { fixed, members: Vec::new() }))?;
                    Some(slices.len() - 1)
                });
                if let Some(slice) = slice.filter(|_| place % length.div_ceil(MOST_SHOWN) == 0) {
                    slices[slice].members.push((index, run.clone()));
                }
            }
            Ok(())
        })?;
        let (ensemble, regime) = (study.ensemble().is_some(), study.is_regime());
        Ok(Self { scene, grid, runs, seen, ensemble, regime })
    }

    /// Runs made, and how many of them failed.
    pub fn counts(&self) -> (usize, usize) {
        (self.seen.runs, self.seen.failed)
    }

    /// What a reader must know of the energy of the runs.
    pub fn energy_warning(&self) -> Option<String> {
        let SweepSummary { runs, unbalanced, .. } = self.seen;
        (unbalanced > 0).then(|| {
            format!(
                "{unbalanced} of {runs} runs leave more than {:.0} % of their largest energy unaccounted for (`energy_residual` in sweep.json); shorten \
                 `model.step` or lower `model.tolerance`, and refine the mesh",
                100.0 * SMALL_RESIDUAL
            )
        })
    }

    /// `sweep.csv`: the swept keys with their units, `status`, the watched numbers, with an ensemble also their mean,
    /// scatter and sensitivity, and the reason of a failure.
    pub fn csv(&self, out: &mut dyn io::Write) -> anyhow::Result<()> {
        let mut header: Vec<String> = self.grid.axes.iter().map(column).collect();
        header.push("status".into());
        header.extend(MOTION.iter().filter(|_| self.regime).map(|key| (*key).to_owned()));
        for watched in watched() {
            header.push(format!("{}{}", watched.key, watched.suffix));
            if self.ensemble {
                for part in ["mean", "scatter", "sensitivity", "sensitivity_error"] {
                    header.push(format!("{}_{part}{}", watched.key, watched.suffix));
                }
            }
        }
        let pressure = PRESSURE.iter().filter(|_| self.seen.has_water);
        header.extend(pressure.clone().map(|key| (*key).to_owned()));
        header.push("reason".into());
        let mut table = csv::Writer::from_writer(out);
        table.write_record(&header)?;
        self.runs.each(&mut |index, run| {
            let mut cells: Vec<String> = self.grid.values(index).into_iter().map(|value| value.to_string()).collect();
            match run {
                Run::Finished { observation, ensemble, .. } => {
                    cells.push("done".into());
                    let motion =
                        motion(run).map(|motion| [motion.regime.to_string(), number(Some(motion.broadband_share))]);
                    cells.extend(motion.into_iter().flatten());
                    for (at, value) in observation.0.iter().enumerate() {
                        cells.push(number(*value));
                        if self.ensemble {
                            let spread = ensemble.as_ref().and_then(|ensemble| ensemble.spreads[at]);
                            cells.push(number(spread.map(|spread| spread.mean)));
                            cells.push(number(spread.map(|spread| spread.scatter)));
                            cells.push(number(spread.map(|spread| spread.sensitivity)));
                            cells.push(number(spread.map(|spread| spread.sensitivity_error)));
                        }
                    }
                    cells.extend(pressure.clone().map(|key| number(value(run, key))));
                    cells.push(String::new());
                }
                Run::Failed { reason } => {
                    cells.push("failed".into());
                    cells.resize(header.len() - 1, String::new());
                    cells.push(reason.clone());
                }
            }
            Ok(table.write_record(&cells)?)
        })?;
        Ok(table.flush()?)
    }

    /// `sweep.json`: whatever writes it reads the runs.
    pub fn json(
        &'a self,
        experiment: &Bench,
        calibrated: Option<&Calibrated>,
        seed: u64,
    ) -> anyhow::Result<impl Serialize + 'a> {
        let axes: Vec<Json> = self
            .grid
            .axes
            .iter()
            .map(|axis| json!({"key": axis.key, "unit": unit(axis).unwrap_or_default(), "values": axis.values}))
            .collect();
        let fields = json!({
            "program": summary::program(),
            "scene": experiment.source,
            "axes": axes,
            "runs": self.seen.runs,
            "failed_runs": self.seen.failed,
            "settings": summary::Settings::new(self.scene, experiment, seed),
            "assumptions": experiment.assumptions,
            "warnings": experiment.warnings(),
            "drive_origin_s": experiment.drive.as_ref().map(|drive| drive.motion.origin),
            "inputs": summary::Inputs::new(experiment, calibrated),
        });
        let Json::Object(fields) = fields else { anyhow::bail!("the summary is no object") };
        let mut parts: BTreeMap<String, Part<'a>> =
            fields.into_iter().map(|(key, value)| (key, Part::Value(value))).collect();
        parts.insert("points".into(), Part::Points(Points(self)));
        Ok(parts)
    }

    fn point(&self, index: usize, run: &Run) -> Json {
        let values: Map<String, Json> = self
            .grid
            .axes
            .iter()
            .zip(self.grid.values(index))
            .map(|(axis, value)| (axis.key.clone(), json!(value)))
            .collect();
        match run {
            Run::Finished { observation, pressure_metrics, energy_residual, ensemble, motion } => {
                let features: Map<String, Json> = watched()
                    .into_iter()
                    .zip(&observation.0)
                    .map(|(watched, value)| (format!("{}{}", watched.key, watched.suffix), json!(value)))
                    .collect();
                let mut point = json!({
                    "values": values, "status": "done", "features": features, "energy_residual": energy_residual,
                    "ensemble": ensemble.as_ref().map(EnsembleTable::new),
                });
                if let Some(motion) = motion {
                    point["motion"] = json!(motion);
                }
                if let Some(pressure_metrics) = pressure_metrics {
                    point["pressure"] = json!(pressure_metrics);
                }
                point
            }
            Run::Failed { reason } => json!({"values": values, "status": "failed", "reason": reason}),
        }
    }

    /// One figure for each combination of the other axes, against the first axis that has numbers.
    pub fn figures(&self) -> Vec<(String, SweepReport)> {
        let Some((swept, slices)) = &self.seen.slices else { return Vec::new() };
        let single = slices.len() == 1;
        let figure = |(number, slice): (usize, &Slice)| {
            let name = if single { "sweep".into() } else { format!("sweep-{}", number + 1) };
            (name, self.report(*swept, &slice.members, &slice.fixed))
        };
        slices.iter().enumerate().map(figure).collect()
    }

    /// The map of regimes over two varied numbers, or the bifurcation diagram over one.
    fn regimes(&self, fit: Option<&Fit>) -> anyhow::Result<Option<Figure>> {
        let varied: Option<Vec<Varied>> = self.grid.axes.iter().map(varied).collect();
        let (Some(mut varied), true) = (varied, self.regime) else { return Ok(None) };
        for (varied, _) in varied.iter_mut().zip(&self.grid.axes).filter(|(_, axis)| axis.key == "damping.coefficient")
        {
            let term = self.scene.damping.kind.terms().first();
            varied.unit = term.map_or("1".into(), |term| term.description().dimension.si_unit());
        }
        match varied.as_slice() {
            [x] => {
                let mut sections: Vec<(f64, Regime, Vec<f64>)> = Vec::new();
                let stride = x.values.len().div_ceil(MOST_SHOWN);
                self.runs.each(&mut |index, run| {
                    if let Some(motion) = motion(run).filter(|_| index % stride == 0) {
                        sections.push((x.values[index], motion.regime, motion.section.clone()));
                    }
                    Ok(())
                })?;
                Ok((!sections.is_empty()).then(|| regime::bifurcation(x, &sections)))
            }
            [x, y] => {
                // The last axis runs fastest in the grid, the first in the map.
                let (columns, rows) = (x.values.len(), y.values.len());
                let runs: Vec<_> =
                    (0..rows).flat_map(|row| (0..columns).map(move |column| column * rows + row)).collect();
                let runs: Vec<_> = runs.into_iter().map(|index| self.seen.regimes[index]).collect();
                let keys = [0, 1].map(|axis| self.grid.axes[axis].key.as_str());
                Ok(Some(regime::map(x, y, &runs, fit.filter(|_| keys == ["alpha", "damping.coefficient"]))))
            }
            _ => Ok(None),
        }
    }

    pub fn page(
        &'a self,
        described: &'a str,
        assumptions: Vec<String>,
        fit: Option<&Fit>,
    ) -> anyhow::Result<SweepPage<'a>> {
        let (runs, failed) = self.counts();
        let swept = self.grid.axes.iter().map(|axis| {
            let shown = axis.values.iter().take(MOST_VALUES);
            let mut values = shown.map(Value::to_string).collect::<Vec<_>>().join(", ");
            if let (true, Some(last)) = (axis.values.len() > MOST_VALUES, axis.values.last()) {
                let _ = write!(values, ", … {last} ({} values)", axis.values.len());
            }
            (axis.key.clone(), values)
        });
        let runs = [("runs".to_owned(), format!("{runs}, {failed} failed"))];
        Ok(SweepPage {
            scene: (&self.scene.name, described),
            facts: swept.chain(runs).collect(),
            regimes: self.regimes(fit)?,
            figures: self.figures(),
            table: self.rows(),
            assumptions,
        })
    }

    /// Runs with the numbers most looked at; `heads` are those of the terminal.
    fn table<'r>(&self, caption: String, heads: bool, runs: impl Iterator<Item = (usize, &'r Run)>) -> Table {
        let shown = || SHOWN.iter().filter(|(key, ..)| self.seen.has_water || !PRESSURE.contains(key));
        let axes = self.grid.axes.iter().map(|axis| Column::numbers(axis.key.clone()));
        let numbers = shown().map(|(_, name, unit, head, ..)| match heads {
            true => Column::numbers(*head),
            false => Column::numbers(*name).unit(*unit),
        });
        let row = |(index, run): (usize, &Run)| {
            let regime = self.regime.then(|| motion(run).map_or("–".into(), |motion| motion.regime.to_string()));
            let numbers = shown().map(|(key, .., factor, digits)| {
                value(run, key).map_or("–".into(), |value| fixed(factor * value, *digits))
            });
            let remark = if let Run::Failed { reason } = run { format!("failed: {reason}") } else { String::new() };
            self.grid
                .values(index)
                .into_iter()
                .map(ToString::to_string)
                .chain(regime)
                .chain(numbers)
                .chain([remark])
                .collect()
        };
        let regime = self.regime.then(|| Column::words("Regime"));
        let remarks = Column::words(if heads { "" } else { "Remark" });
        Table {
            caption,
            columns: axes.chain(regime).chain(numbers).chain([remarks]).collect(),
            rows: runs.map(row).collect(),
        }
    }

    /// Every run, or of many every so many-th.
    fn rows(&self) -> Table {
        let which = match self.seen.runs.div_ceil(MOST_SHOWN) {
            0 | 1 => "Every run".into(),
            stride => format!("One run of every {stride}, all of them in sweep.csv"),
        };
        let below = engineering(self.scene.vibrometer_bandwidth, "Hz", 3);
        let caption =
            format!("{which}: peaks of the last bead below {below}; lines are amplitudes over the drive line's.");
        self.table(caption, false, self.seen.rows.iter().map(|(index, run)| (*index, run)))
    }

    fn report(&self, swept: usize, members: &[(usize, Run)], fixed: &[String]) -> SweepReport {
        let axis = &self.grid.axes[swept];
        let name = name(axis);
        let name = if fixed.is_empty() { name } else { format!("{name} at {}", fixed.join(", ")) };
        let curve = |(key, group, name, unit): (&str, &str, &str, &str)| SweepCurve {
            group: group.into(),
            name: name.into(),
            unit: unit.into(),
            points: members.iter().filter_map(|member| self.point_of(member, swept, key)).collect(),
        };
        let curves = CURVES.into_iter().filter(|(key, ..)| self.seen.has_water || !PRESSURE.contains(key));
        SweepReport {
            name,
            unit: unit(axis).filter(|unit| !unit.is_empty()).unwrap_or("1".into()),
            curves: curves.map(curve).collect(),
        }
    }

    /// The point of a run on the curve of a number: with an ensemble its mean, else the run's own.
    fn point_of(&self, (index, run): &(usize, Run), swept: usize, key: &str) -> Option<SweepPoint> {
        let Value::Number(position) = self.grid.values(*index)[swept] else { return None };
        let Run::Finished { ensemble, .. } = run else { return None };
        let spread = watched().iter().position(|watched| watched.key == key).zip(ensemble.as_ref());
        let spread = spread.and_then(|(at, ensemble)| ensemble.spreads[at]);
        let value = spread.map(|spread| spread.mean).or_else(|| value(run, key))?;
        Some(SweepPoint { at: *position, value, scatter: spread.map(|spread| spread.scatter) })
    }

    /// A table for people: peaks in mm/s and the ratios of the subharmonics.
    pub fn text(&self, written: bool) -> String {
        let mut text = aligned(&self.table(String::new(), true, self.seen.first.iter().enumerate()));
        if self.seen.runs > MOST_ROWS {
            let _ = writeln!(text, "… {} rows more", self.seen.runs - MOST_ROWS);
        }
        if !self.grid.axes.iter().any(|axis| axis.key == "model.kind") {
            let lanes = self.regime && self.scene.model.kind == ModelKind::Chain;
            let model = if lanes {
                "chain, eight runs side by side at a fixed step".into()
            } else {
                summary::model(self.scene)
            };
            let _ = writeln!(text, "Model {model}.");
        }
        let below = engineering(self.scene.vibrometer_bandwidth, "Hz", 3);
        let _ = writeln!(text, "Peaks of the last bead below {below}; ratios are amplitudes over the drive line's.");
        if self.regime {
            let mut counts: BTreeMap<Regime, usize> = BTreeMap::new();
            self.seen.regimes.iter().flatten().for_each(|(regime, _)| *counts.entry(*regime).or_default() += 1);
            let counts: Vec<String> = counts.into_iter().map(|(regime, count)| format!("{regime} {count}")).collect();
            let _ = writeln!(text, "Runs by regime: {}.", counts.join(", "));
        }
        if self.seen.has_water {
            text.push_str("Pressure at the first field point; dB: level at 0.95 MHz re the drive's line.\n");
        }
        if !written {
            text.push_str("Nothing was written; pass --out DIR for sweep.csv, sweep.json and the figure.\n");
        }
        text
    }
}

#[derive(Serialize)]
#[serde(untagged)]
enum Part<'a> {
    Value(Json),
    Points(Points<'a>),
}

/// The points of a sweep, written while they are read.
struct Points<'a>(&'a SweepTable<'a>);

impl Serialize for Points<'_> {
    fn serialize<S: Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
        let mut points = serializer.serialize_seq(Some(self.0.seen.runs))?;
        let mut refused = None;
        let read = self.0.runs.each(&mut |index, run| {
            points.serialize_element(&self.0.point(index, run)).map_err(|error| {
                refused = Some(error);
                anyhow::anyhow!("the summary cannot be written")
            })
        });
        match (refused, read) {
            (Some(error), _) => Err(error),
            (None, Err(error)) => Err(S::Error::custom(format_args!("{error:#}"))),
            (None, Ok(())) => points.end(),
        }
    }
}

/// The values of the other axes at a point.
fn others(grid: &Grid, swept: usize, index: usize) -> Vec<String> {
    let values = grid.axes.iter().zip(grid.values(index)).enumerate();
    values.filter(|(axis, _)| *axis != swept).map(|(_, (axis, value))| format!("{} = {value}", axis.key)).collect()
}

fn motion(run: &Run) -> Option<&SteadyMotion> {
    if let Run::Finished { motion, .. } = run { motion.as_ref() } else { None }
}

/// A number of a run, SI: watched, or a pressure metric.
fn value(run: &Run, key: &str) -> Option<f64> {
    let Run::Finished { observation, pressure_metrics, .. } = run else { return None };
    match PRESSURE.iter().position(|own| *own == key) {
        Some(0) => pressure_metrics.as_ref().map(|pressure| pressure.positive_peak_pa),
        Some(1) => pressure_metrics.as_ref().map(|pressure| pressure.negative_peak_pa),
        Some(_) => pressure_metrics.as_ref()?.level_at_950_khz_db,
        None => observation.get(key),
    }
}

/// An axis for people.
fn name(axis: &Axis) -> String {
    match axis.key.as_str() {
        "alpha" => "Amplitude scale α".into(),
        "damping.coefficient" => "Damping coefficient".into(),
        key => key.to_owned(),
    }
}

/// An axis of a map: of two ascending numbers or more.
fn varied(axis: &Axis) -> Option<Varied> {
    let number = |value: &Value| if let Value::Number(number) = value { Some(*number) } else { None };
    let values: Vec<f64> = axis.values.iter().map(number).collect::<Option<_>>()?;
    let ascends = values.len() > 1 && values.windows(2).all(|pair| pair[0] < pair[1]);
    ascends.then(|| Varied {
        name: name(axis),
        unit: unit(axis).filter(|unit| !unit.is_empty()).unwrap_or("1".into()),
        values,
    })
}

/// SI unit of an axis: as the scene knows the key, else as written; `None` for words.
fn unit(axis: &Axis) -> Option<String> {
    match Key::find(&axis.key).map(|key| key.kind) {
        Some(ValueKind::Quantity(dimension)) => Some(dimension.si_unit()),
        _ if axis.values.iter().all(|value| matches!(value, Value::Number(_))) => Some(axis.unit.clone()),
        _ => None,
    }
}

/// Header of an axis: its key with its unit, such as `drive.amplitude_m`.
fn column(axis: &Axis) -> String {
    let unit = unit(axis).unwrap_or_default();
    let suffix = unit.to_lowercase().replace('/', "_per_").replace(['^', '(', ')'], "").replace([' ', '·', '.'], "_");
    if suffix.is_empty() || suffix == "1" { axis.key.clone() } else { format!("{}_{suffix}", axis.key) }
}

fn number(value: Option<f64>) -> String {
    value.map_or(String::new(), |value| Value::Number(value).to_string())
}
