//! `granchain sweep`: run a scene over a grid of values.

use std::{
    ops::Range,
    path::{Path, PathBuf},
};

use anyhow::bail;
use clap::Args;
use indicatif::ProgressBar;
use serde::Serialize;
use serde_json::Value;

use super::{
    Outcome,
    arguments::{OutputArguments, SceneArguments, Session, preferred_model, whole},
    calibrated::Calibrated,
    experiment,
    forecast::Forecast,
    interrupt::{self, Interrupted},
    output::{NOTHING_SAVED, OutputFolder, PLAN, same_plan},
    parts::{self, Divisible, PartArguments, Parts},
    progress,
    reading::ReadArguments,
    summary,
    sweep_table::{Runs, SweepTable},
    timing::{self, Timing},
};
use crate::{
    calibration::bench::Bench,
    model::{Estimate, ModelError},
    report::sweep::SweepPage,
    scene::{ModelKind, Scene},
    study::{
        Axis, Bodies, EnsemblePlan, Grid,
        regime::{self, Lanes},
        sweep::{Run, Study as Each, SweepError, Watch, refuse_hopeless, sweep, sweep_part},
    },
};

#[derive(Debug, Args)]
#[command(after_help = "Example:\n  granchain sweep --scene annulus --model chain --vary alpha=0.2:2:0.1 --out sweep")]
pub struct Arguments {
    #[command(flatten)]
    pub scene: SceneArguments,
    /// Use α, damping, scene, horn record and model of an earlier calibration
    #[arg(long, value_name = "DIR", help_heading = "Scene")]
    pub calibration: Option<PathBuf>,
    /// Values of a scene key: KEY=START:STOP:STEP (ends included) or KEY=A,B,C; several make a full grid
    #[arg(long, value_name = "KEY=VALUES", required = true, value_parser = Axis::parse, help_heading = "Study")]
    pub vary: Vec<Axis>,
    /// At each point also run N variants (random gaps, drive ± 0.01 %) at each of three drive levels (99, 100 and 101 %), and print mean, standard
    /// deviation and sensitivity; the default model is then the chain
    #[arg(long, value_name = "N", value_parser = whole(2_u32, None), help_heading = "Study")]
    pub ensemble: Option<u32>,
    /// Tell at each point how the last bead moves: period 1, 2, 3 …, quasi-periodic or chaotic; draws a map over two varied numbers, a bifurcation diagram
    /// over one. Needs a steady drive of 160 periods: 60 for the transient, 100 to look at. Set drive.cycles and duration, such as --set drive.cycles=160
    /// --set duration=2.2ms at 73 kHz. A horn record is mostly too short: pass --drive none. The default model is then the chain
    #[arg(long, conflicts_with = "ensemble", help_heading = "Study")]
    pub regime: bool,
    #[command(flatten)]
    pub output: OutputArguments,
    /// Continue a sweep that was stopped; needs the same flags
    #[arg(long, requires = "out", conflicts_with = "part", help_heading = "Output")]
    pub resume: bool,
    #[command(flatten)]
    pub part: PartArguments,
    #[command(flatten)]
    pub reading: ReadArguments,
}

/// Name of the log of finished runs.
const RUNS: &str = "runs.jsonl";

/// The command, as a state names it.
const COMMAND: &str = "sweep";
/// Results that every sweep has.
const RESULTS: [&str; 4] = ["report.html", "sweep.csv", "sweep.json", timing::FILE];

pub fn execute(arguments: Arguments, session: &Session) -> anyhow::Result<Outcome> {
    let (part, resume) = (arguments.part.part, arguments.resume);
    let study = Study::new(arguments, session.clone())?;
    match part {
        Some(part) => parts::write(part, &study, session),
        None => study.run_here(resume),
    }
}

/// A sweep whose scene, grid and drive are read.
pub(super) struct Study {
    bench: Bench,
    base: Scene,
    grid: Grid,
    each: Each,
    calibrated: Option<Calibrated>,
    bodies: Bodies,
    output: OutputArguments,
    session: Session,
    timing: Timing,
}

impl Study {
    /// Read what the flags name, and refuse what cannot run.
    pub fn new(arguments: Arguments, session: Session) -> anyhow::Result<Self> {
        let Arguments { scene, calibration, vary, ensemble, regime, reading, output, .. } = arguments;
        let flags = SceneArguments { session: session.clone(), ..scene };
        let mut timing = Timing::start();
        let grid = Grid::new(vary)?;
        let calibrated = calibration.as_deref().map(Calibrated::read).transpose()?;
        let preferred = match regime && calibrated.is_none() {
            true => ModelKind::Chain,
            false => preferred_model(calibrated.as_ref(), ensemble),
        };
        let mut bench = experiment::read(&flags, &reading, calibrated.as_ref(), preferred)?;
        bench.limits = session.limits();
        let base = base(&mut bench, &grid)?;
        experiment::refuse_wrong_units(&bench, &grid)?;
        session.assumed(&bench.assumptions);
        session.warn(bench.warnings());
        if regime {
            regime::window(&base)?;
        }
        let each = match ensemble {
            Some(replicates) => Each::Ensemble(EnsemblePlan::new(replicates as usize, session.seed())),
            None if regime => Each::Regime(Lanes::new(grid.axes.len() == 1)),
            None => Each::Single,
        };
        refuse_excess(&bench, &base, &grid, each.ensemble())?;
        timing.stage("read");
        let bodies = Bodies::new(session.cache());
        Ok(Self { bench, base, grid, each, calibrated, bodies, output, session, timing })
    }

    fn bar(&self, points: usize) -> Bar<'_> {
        Bar {
            bar: progress::bar(&self.session, points as u64, "runs"),
            session: &self.session,
            forecast: Forecast::new(&self.session, "the sweep"),
            points,
        }
    }

    /// Run every point on this machine, and keep each as it is finished.
    fn run_here(mut self, resume: bool) -> anyhow::Result<Outcome> {
        let plan = self.plan()?;
        let (folder, scratch) = match &self.output.out {
            Some(out) => (Some(OutputFolder::resumable(out, &RESULTS, COMMAND, resume, self.output.force)?), None),
            None => (None, Some(super::output::scratch()?)),
        };
        let state = match (&folder, &scratch) {
            (Some(folder), _) => folder.state_path(),
            (None, Some(scratch)) => scratch.path().to_path_buf(),
            (None, None) => bail!("no place for the finished runs; give --out"),
        };
        // A sweep stopped before its first run has nothing that another plan could spoil.
        if std::fs::metadata(state.join(RUNS)).is_ok_and(|runs| runs.len() > 0) {
            same_plan(&state.join(PLAN), &plan, "sweep", "scene, grid, ensemble, seed")?;
        } else {
            if resume {
                self.session.note(NOTHING_SAVED);
            }
            super::output::write_atomically(&state.join(PLAN), &plan)?;
        }
        let watch = self.bar(self.grid.len());
        let build = |overrides: &[String]| self.bench.scene_with(overrides);
        let outcome = sweep(&self.grid, &build, &self.bodies, &self.each, &state.join(RUNS), &watch);
        watch.bar.finish_and_clear();
        let runs = match outcome {
            Ok(runs) => runs,
            Err(error) => return Err(stopped(error, folder, &self.grid)),
        };
        self.timing.stage("run");
        self.session.warn(self.bodies.warning());
        self.conclude(&runs, folder)
    }

    /// Write and print what came out.
    fn conclude(mut self, runs: &dyn Runs, folder: Option<OutputFolder>) -> anyhow::Result<Outcome> {
        let table = SweepTable::new(&self.base, &self.grid, runs, &self.each)?;
        let session = &self.session;
        let energy = table.energy_warning();
        let summary = table.json(&self.bench, self.calibrated.as_ref(), session.seed())?;
        if let Some(folder) = folder {
            let assumptions =
                self.bench.warnings().iter().chain(&self.bench.assumptions).chain(&energy).cloned().collect();
            let described = summary::described(&self.base, &self.bench.overrides);
            let fit = self.calibrated.as_ref().and_then(|calibrated| calibrated.region.as_ref());
            let page = table.page(&described, assumptions, fit)?;
            write(&folder, &table, &summary, page, &mut self.timing)?;
            let place = folder.finish()?;
            session.note(format_args!("written to {}", place.display()));
        }
        session.warn(energy);
        let (all, failed) = table.counts();
        if failed > 0 {
            session.note(format_args!("warning: {failed} of {all} runs failed; their reasons stand in the table"));
        }
        session.result(table.text(self.output.out.is_some()), &summary)?;
        Ok(Outcome::Done)
    }
}

impl Divisible for Study {
    fn points(&self) -> usize {
        self.grid.len()
    }

    fn out(&self) -> Option<&Path> {
        self.output.out.as_deref()
    }

    fn plan(&self) -> anyhow::Result<Vec<u8>> {
        plan_of(&self.base, &self.grid, &self.each)
    }

    fn run(&self, part: Range<usize>) -> anyhow::Result<Vec<Value>> {
        let build = |overrides: &[String]| self.bench.scene_with(overrides);
        refuse_hopeless(&self.grid, &build)?;
        let watch = self.bar(part.len());
        let runs = sweep_part(&self.grid, part, &build, &self.bodies, &self.each, &watch);
        watch.bar.finish_and_clear();
        parts::values(&runs.ok_or(Interrupted)?)
    }

    fn finish(self: Box<Self>, parts: &Parts) -> anyhow::Result<Outcome> {
        let folder = self.output.stage(&RESULTS)?;
        self.conclude(parts, folder)
    }
}

impl Runs for Parts {
    fn each(&self, seen: &mut dyn FnMut(usize, &Run) -> anyhow::Result<()>) -> anyhow::Result<()> {
        Parts::each(self, |index, run| seen(index, &run))
    }
}

/// A full disk behind a writer of JSON is that of the file.
fn as_written(error: serde_json::Error) -> anyhow::Error {
    if error.is_io() { std::io::Error::from(error).into() } else { error.into() }
}

/// The scene without the swept values, all points on one model.
pub fn base(bench: &mut Bench, grid: &Grid) -> anyhow::Result<Scene> {
    experiment::agree_on_model(bench, (0..grid.len()).map(|index| grid.overrides(index)));
    experiment::refuse_drive_keys(bench, grid.axes.iter().map(|axis| axis.key.as_str()))?;
    Ok(bench.scene_with(&[])?)
}

/// Points of a grid that are looked at before it is run; of a larger one as many, evenly spread.
const MOST_LOOKED_AT: usize = 20_000;

/// Refuse a grid whose points together are estimated above the limits. Points that are no scene count nothing: they are tabled as such.
pub fn refuse_excess(
    bench: &Bench,
    base: &Scene,
    grid: &Grid,
    ensemble: Option<&EnsemblePlan>,
) -> Result<(), ModelError> {
    let mut all = Estimate { work: 0.0, memory: 0.0 };
    let points = grid.spread(MOST_LOOKED_AT);
    let each = grid.len() as f64 / points.len() as f64;
    for point in points {
        let Ok(scene) = bench.scene_with(&grid.overrides(point)) else { continue };
        let one = ensemble.map_or(Estimate::of(&scene), |plan| plan.estimate(&scene));
        all = Estimate { work: all.work + each * one.work, memory: all.memory.max(one.memory) };
        all.check(&base.model.limits)?;
    }
    Ok(())
}

fn write(
    folder: &OutputFolder,
    table: &SweepTable<'_>,
    summary: &impl Serialize,
    page: SweepPage<'_>,
    timing: &mut Timing,
) -> anyhow::Result<()> {
    folder.write_as_it_comes("sweep.csv", |out| table.csv(out))?;
    folder.write_as_it_comes("sweep.json", |out| {
        serde_json::to_writer_pretty(&mut *out, summary).map_err(as_written)?;
        Ok(writeln!(out)?)
    })?;
    timing.stage("write");
    folder.write_all(page.files()?)?;
    timing.stage("figures");
    folder.write(timing::FILE, timing.to_json())?;
    Ok(())
}

/// Everything that decides what the runs are.
fn plan_of(base: &Scene, grid: &Grid, each: &Each) -> anyhow::Result<Vec<u8>> {
    summary::json(&serde_json::json!({
        "program": summary::program(), "scene_sha256": summary::scene_digest(base), "grid": grid, "ensemble": each.ensemble(),
        "regime": each.is_regime(),
    }))
}

/// What a stopped sweep leaves, and what to say.
fn stopped(error: SweepError, folder: Option<OutputFolder>, grid: &Grid) -> anyhow::Error {
    match (error, folder) {
        (SweepError::Stopped { finished, points }, Some(folder)) if finished > 0 => {
            let place = folder.path().display().to_string();
            anyhow::Error::from(Interrupted)
                .context(format!("{finished} of {points} runs are kept in {place}; continue with --resume"))
        }
        (SweepError::Stopped { .. }, folder) => {
            if let Some(folder) = folder {
                folder.discard();
            }
            Interrupted.into()
        }
        (error @ SweepError::NoValidPoint { .. }, folder) => {
            if let Some(folder) = folder {
                folder.discard();
            }
            anyhow::anyhow!(experiment::as_varied(&error, grid))
        }
        (error, _) => error.into(),
    }
}

struct Bar<'a> {
    bar: ProgressBar,
    session: &'a Session,
    forecast: Forecast,
    points: usize,
}

impl Watch for Bar<'_> {
    fn finished(&self, points: usize) {
        self.bar.set_position(points as u64);
        self.forecast.at(points as f64 / self.points as f64);
    }

    fn stop(&self) -> bool {
        interrupt::requested()
    }

    fn warn(&self, text: &str) {
        self.bar.suspend(|| self.session.note(format_args!("warning: {text}")));
    }
}
