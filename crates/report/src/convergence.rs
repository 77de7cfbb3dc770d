//! The page of a convergence study: errors by mesh and step, what they cost, and the chain beside the finite elements.

use std::fmt::Write as _;

use super::{
    figure::{Axis, Colour, Dash, Figure, Marker, PAGE_WIDTH_MM, Panel, Stroke, trace},
    number::{engineering, fixed, short, significant},
    page::{Block, Column, Files, Page, Plate, ReportError, Table, Tone, provenance},
};
use granchain_signal::Series;
use granchain_studies::convergence::{Convergence, ConvergenceRun, Lead, Resolution};

/// A convergence study and where it comes from.
#[derive(Debug, Clone, PartialEq)]
pub struct ConvergenceReport {
    /// Program and version.
    pub program: String,
    /// Name of the scene.
    pub scene: String,
    /// What the scene is, in one sentence.
    pub description: String,
    /// The outcome.
    pub convergence: Convergence,
    /// Command line as typed.
    pub command_line: String,
}

/// Interval of `velocity.csv`, s, where the reference's own is shorter.
const WRITTEN_STEP: f64 = 1e-7;

impl ConvergenceReport {
    /// `report.html`, `report.md`, the figures, `convergence.json`, `errors.csv`, `velocity.csv`.
    ///
    /// # Errors
    /// [`ReportError`] when there is no run, or an error is not finite.
    pub fn files(&self) -> Result<Files, ReportError> {
        if self.convergence.runs.is_empty() {
            return Err(ReportError::Missing { field: "runs" });
        }
        for run in &self.convergence.runs {
            if let Some(&found) = run.errors.iter().find(|error| !error.is_finite()) {
                return Err(ReportError::NotFinite { field: format!("error at {}", name(&run.resolution)), found });
            }
        }
        let mut files = self.page().files()?;
        let mut json = serde_json::to_vec_pretty(&serde_json::json!({
            "program": self.program, "scene": self.scene, "convergence": self.convergence,
        }))?;
        json.push(b'\n');
        files.push(("convergence.json".into(), json));
        files.push(("errors.csv".into(), self.errors_csv().into_bytes()));
        files.push(("velocity.csv".into(), self.velocity_csv().into_bytes()));
        Ok(files)
    }

    /// Chain and finite elements, the first pulse, errors against cost.
    #[must_use]
    pub fn plates(&self) -> Vec<Plate> {
        let mut plates = vec![Plate::new("velocity", self.velocity_figure())];
        if let Some(lead) = &self.convergence.lead {
            plates.push(Plate::new("first-pulse", self.pulse_figure(lead)));
        }
        plates.push(Plate::new("work-precision", self.cost_figure()));
        plates
    }

    /// Error of every run in every window, with its cost in counts.
    #[must_use]
    pub fn table(&self) -> Table {
        let mut columns = vec![
            Column::numbers("Density"),
            Column::numbers("Step").unit("µs"),
            Column::numbers("Unknowns"),
            Column::numbers("Steps"),
            Column::numbers("Entries read").unit("10⁹"),
            Column::numbers("Energy residual").unit("10⁻³"),
        ];
        columns.extend(self.windows().map(|window| Column::numbers(window).unit("%")));
        let rows = self.convergence.runs.iter().map(|run| {
            let mut row = vec![
                run.resolution.density.to_string(),
                short(1e6 * run.resolution.step_s),
                run.unknowns.to_string(),
                run.steps.to_string(),
                significant(1e-9 * run.entries_read as f64, 3),
                significant(1e3 * run.energy_balance, 2),
            ];
            row.extend(run.errors.iter().map(|error| percent(*error)));
            row
        });
        Table {
            caption: format!(
                "Error of the last bead’s velocity against the refined run, {}: rms over a window relative to the reference’s rms in it. \
                 Entries read: non-zeros of the factor, twice a step. Energy residual: the largest over the largest energy.",
                name(&self.convergence.reference.resolution)
            ),
            columns,
            rows: rows.collect(),
        }
    }

    fn windows(&self) -> impl Iterator<Item = String> + '_ {
        self.convergence.plan.windows_s.iter().map(|&(from, to)| span(from, to))
    }

    fn orders(&self) -> Table {
        let cell = |order: Option<f64>| order.map_or("–".to_owned(), |order| fixed(order, 1));
        let rows = self.windows().zip(&self.convergence.orders);
        Table {
            caption: "Observed order, from the distances of three runs: in the step on the finest mesh, in the element size at the finest \
                      step. – where three runs show none. The element size is no clean measure: on each mesh the edges of the contacts \
                      fall between other points."
                .into(),
            columns: vec![Column::words("Window"), Column::numbers("in the step"), Column::numbers("in the element size")],
            rows: rows.map(|(window, order)| vec![window, cell(order.step), cell(order.mesh)]).collect(),
        }
    }

    fn rungs(&self) -> Table {
        let mut columns = vec![Column::words("Model")];
        columns.extend(self.windows().map(|window| Column::numbers(window).unit("%")));
        let row = |name: &str, errors: &[f64]| {
            std::iter::once(name.to_owned()).chain(errors.iter().map(|error| percent(*error))).collect::<Vec<_>>()
        };
        let mut rows = vec![row("chain of Hertz contacts", &self.convergence.chain_errors)];
        if let (Some(errors), Some(lead)) = (&self.convergence.stiffened_errors, &self.convergence.lead) {
            rows.push(row(&format!("the same, contacts {} % stiffer", percent(lead.excess)), errors));
        }
        Table {
            caption: "Distance of the chain from the refined finite element analysis, measured in the same way.".into(),
            columns,
            rows,
        }
    }

    /// The headline: what the paper's step on the default mesh is worth, and the best run of the table.
    fn headline(&self) -> Block {
        let runs = &self.convergence.runs;
        let said = |run: &ConvergenceRun| {
            let errors: Vec<String> = self
                .windows()
                .zip(&run.errors)
                .map(|(window, error)| format!("{} % in {window}", percent(*error)))
                .collect();
            format!("{}: {}", name(&run.resolution), errors.join(", "))
        };
        let first = |run: &ConvergenceRun| run.errors.first().copied().unwrap_or(0.0);
        // On every mesh each shorter step is closer to the reference.
        let falls = runs.windows(2).all(|pair| {
            let [a, b] = [pair[0].resolution, pair[1].resolution];
            a.density != b.density || (a.step_s > b.step_s) == (first(&pair[0]) > first(&pair[1]))
        });
        let (tone, verdict) = if falls {
            (Tone::Good, "Errors fall with the step.")
        } else {
            (Tone::Careful, "Errors do not fall with every shorter step.")
        };
        let best = runs.iter().min_by(|a, b| first(a).total_cmp(&first(b)));
        let coarsest_step = runs.iter().map(|run| run.resolution.step_s).fold(0.0, f64::max);
        let quick = runs.iter().rfind(|run| run.resolution.step_s == coarsest_step && run.resolution.density <= 12);
        let text = quick.into_iter().chain(best).map(said).collect::<Vec<_>>().join("; ");
        Block::Headline { tone, verdict: verdict.into(), text: format!(" {text}.") }
    }

    fn lead_said(&self, lead: &Lead) -> Vec<String> {
        vec![
            format!(
                "At the last bead the first pulse runs {} ahead of that of the chain of Hertz contacts: the shift that brings the two closest \
                 from {} to {}.",
                engineering(lead.fea_s, "s", 2),
                engineering(lead.pulse_s.0, "s", 3),
                engineering(lead.pulse_s.1, "s", 3)
            ),
            format!(
                "Hertz takes each body for a half-space. A sphere is finite, its surface moves less under the same force, and the contact between \
                 two colliding beads is stiffer by 0.0249 √(δ/µm) + 0.0024 δ/µm; a bead on a flat is stiffer by the same factor under the same \
                 force. At the largest overlap in the pulse, {} on average, that is {} %.",
                engineering(lead.overlap_m, "m", 2),
                percent(lead.excess)
            ),
            format!(
                "A pulse travels as k^(2/5), so stiffer contacts make it faster. The chain run again with all contacts stiffer by this one factor \
                 leads by {}: {:.0} % of what the finite elements do. The factor is that of the largest overlap; on the way there it is smaller, \
                 and vibration of the beads and the coupling through them are left out.",
                engineering(lead.stiffened_s, "s", 2),
                100.0 * lead.stiffened_s / lead.fea_s
            ),
        ]
    }

    fn page(&self) -> Page {
        let mut plates = self.plates();
        let cost = plates.split_off(plates.len() - 1);
        let mut blocks = vec![
            self.headline(),
            Block::Paragraph(format!(
                "Scene `{}`: {}. The velocity of the last bead’s centre passes through a centred moving average of {} before it is compared. \
                 The undamped chain is chaotic: whatever differs grows from window to window, so errors of late windows say how long a waveform \
                 can be trusted rather than how good a step is.",
                self.scene,
                self.description.trim_end_matches('.'),
                engineering(self.convergence.plan.filter_s, "s", 2)
            )),
            Block::Table(self.table()),
        ];
        let density = self.convergence.reference.resolution.density;
        if self.convergence.plan.densities.contains(&density) {
            blocks.push(Block::Paragraph(format!(
                "The refined run has the mesh of density {density}: the runs on it show the error of the step alone, and those of the coarser \
                 meshes lack what density {density} itself is off."
            )));
        }
        blocks.extend([
            Block::Plates(cost),
            Block::Table(self.orders()),
            Block::Heading("Chain and finite elements".into()),
            Block::Plates(plates),
        ]);
        if let Some(lead) = &self.convergence.lead {
            blocks.push(Block::List(self.lead_said(lead)));
        }
        blocks.push(Block::Table(self.rungs()));
        let reference = &self.convergence.reference;
        let refined = format!("{}, {} unknowns", name(&reference.resolution), reference.unknowns);
        let facts = vec![("version".into(), self.program.clone()), ("refined run".into(), refined)];
        blocks.extend(provenance(facts, &self.command_line));
        Page {
            title: format!("Convergence of the finite element analysis, scene {}", self.scene),
            subtitle: "Self-convergence in mesh and step, its cost, and the chain beside it".into(),
            blocks,
        }
    }

    fn velocity_figure(&self) -> Figure {
        let end = self.convergence.plan.windows_s.iter().fold(0.0, |end: f64, (_, to)| end.max(*to));
        let shown = |series: &Series| trace(&series.window(0.0, end));
        let panel = Panel::new(time_axis(), velocity_axis())
            .height(55.0)
            .line("chain of Hertz contacts", shown(&self.convergence.chain), CHAIN)
            .line("finite elements", shown(&self.convergence.reference.velocity), FINITE_ELEMENTS);
        Figure::new(format!(
            "Velocity of the last bead, chain and finite elements ({}), both through the same average: Fig. 5 of the paper.",
            name(&self.convergence.reference.resolution)
        ))
        .sized(PAGE_WIDTH_MM, 1)
        .panel(panel)
    }

    fn pulse_figure(&self, lead: &Lead) -> Figure {
        let (from, to) = lead.pulse_s;
        let shown = |series: &Series| trace(&series.window(from, to));
        let mut panel = Panel::new(time_axis(), velocity_axis())
            .height(55.0)
            .line("chain of Hertz contacts", shown(&self.convergence.chain), CHAIN)
            .line("finite elements", shown(&self.convergence.reference.velocity), FINITE_ELEMENTS);
        if let Some(stiffened) = &self.convergence.stiffened {
            let label = format!("chain, {} % stiffer", percent(lead.excess));
            panel = panel.line(label, shown(stiffened), Stroke::new(Colour::Blue).dash(Dash::Dotted));
        }
        Figure::new(
            "The first pulse at the last bead: the lead of the finite elements, and a chain with contacts as stiff as those of finite bodies.",
        )
        .panel(panel)
    }

    fn cost_figure(&self) -> Figure {
        const STYLES: [(Colour, Marker, Dash); 4] = [
            (Colour::Black, Marker::Disc, Dash::Solid),
            (Colour::Vermillion, Marker::Square, Dash::Dashed),
            (Colour::Blue, Marker::Diamond, Dash::DashDotted),
            (Colour::Green, Marker::Ring, Dash::Dotted),
        ];
        let windows: Vec<String> = self.windows().collect();
        let figure = Figure::new(
            "Error against cost in entries of the factor read by all substitutions, in three windows; points along a line are the steps on \
             one mesh (density n), the shortest on the right.",
        )
        .sized(PAGE_WIDTH_MM, 3.min(windows.len()));
        windows.iter().enumerate().fold(figure, |figure, (index, window)| {
            let x = Axis::new("Entries read", "10⁹").times(1e-9).logarithmic();
            let y = Axis::new("Error", "%").times(100.0).logarithmic();
            let mut panel = Panel::new(x, y).height(50.0).titled(window.clone());
            for (density, (colour, marker, dash)) in
                self.convergence.plan.densities.iter().zip(STYLES.into_iter().cycle())
            {
                let runs = self.convergence.runs.iter().filter(|run| run.resolution.density == *density);
                // A run that is the reference has no place on a logarithmic axis.
                let points: Vec<(f64, f64)> = runs
                    .map(|run| (run.entries_read as f64, run.errors[index]))
                    .filter(|(_, error)| *error > 0.0)
                    .collect();
                panel = panel.line(String::new(), points.clone(), Stroke::new(colour).dash(dash)).points(
                    format!("n = {density}"),
                    points,
                    colour,
                    marker,
                );
            }
            figure.panel(panel)
        })
    }

    fn errors_csv(&self) -> String {
        let mut text = String::from("density,step_s,unknowns,factor_nonzeros,steps,entries_read,energy_balance");
        for (from, to) in &self.convergence.plan.windows_s {
            // Writing to a string cannot fail.
            let _ = write!(text, ",error_{}_to_{}_us", 1e6 * from, 1e6 * to);
        }
        text.push('\n');
        for run in &self.convergence.runs {
            let Resolution { density, step_s } = run.resolution;
            let _ = write!(
                text,
                "{density},{step_s:e},{},{},{},{},{:e}",
                run.unknowns, run.factor_nonzeros, run.steps, run.entries_read, run.energy_balance
            );
            for error in &run.errors {
                let _ = write!(text, ",{error:e}");
            }
            text.push('\n');
        }
        text
    }

    fn velocity_csv(&self) -> String {
        let mut text = String::from("time_s,fea_m_per_s,chain_m_per_s");
        let Convergence { reference, chain, stiffened, .. } = &self.convergence;
        if stiffened.is_some() {
            text.push_str(",stiffened_chain_m_per_s");
        }
        text.push('\n');
        let stride = (WRITTEN_STEP / reference.velocity.step).round().max(1.0) as usize;
        let all = [Some(&reference.velocity), Some(chain), stiffened.as_ref()];
        let shortest = all.into_iter().flatten().map(Series::len).min().unwrap_or(0);
        for index in (0..shortest).step_by(stride) {
            let _ = write!(text, "{:e}", reference.velocity.time(index));
            for series in all.into_iter().flatten() {
                let _ = write!(text, ",{:e}", series.values[index]);
            }
            text.push('\n');
        }
        text
    }
}

const CHAIN: Stroke = Stroke::new(Colour::Black).dash(Dash::Dashed);
const FINITE_ELEMENTS: Stroke = Stroke::new(Colour::Vermillion);

fn time_axis() -> Axis {
    Axis::new("Time", "µs").times(1e6)
}

fn velocity_axis() -> Axis {
    Axis::new("Velocity of the last bead", "m/s")
}

/// Density and step, such as `density 12, 0.1 µs`.
#[must_use]
pub fn name(resolution: &Resolution) -> String {
    format!("density {}, {} µs", resolution.density, short(1e6 * resolution.step_s))
}

fn span(from: f64, to: f64) -> String {
    format!("{}–{} µs", short(1e6 * from), short(1e6 * to))
}

/// A part in per cent, two significant figures and at most two decimals.
fn percent(part: f64) -> String {
    if part < 0.01 { fixed(100.0 * part, 2) } else { significant(100.0 * part, 2) }
}
