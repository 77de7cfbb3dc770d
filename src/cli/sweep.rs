//! `granchain sweep`: run a scene over a grid of values.

use std::path::{Path, PathBuf};

use anyhow::bail;
use clap::Args;
use indicatif::ProgressBar;

use super::{
    Outcome,
    arguments::{OutputArguments, SceneArguments, Session, preferred_model},
    calibrated::Calibrated,
    experiment,
    forecast::Forecast,
    interrupt::{self, Interrupted},
    output::{NOTHING_SAVED, OutputFolder},
    progress,
    reading::ReadArguments,
    summary, sweep_table,
    timing::{self, Timing},
};
use crate::{
    calibration::bench::Bench,
    model::{Estimate, ModelError},
    report::sweep::sweep_figure,
    scene::Scene,
    study::{
        Axis, Bodies, EnsemblePlan, Grid,
        ensemble::STEPS_PER_PERIOD,
        grid::GridError,
        published::published,
        sweep::{Run, SweepError, Watch, sweep},
    },
};

/// Arguments of `granchain sweep`.
#[derive(Debug, Args)]
#[command(after_help = "Example:\n  granchain sweep --scene annulus --model chain --vary alpha=0.2:2:0.1 --out sweep")]
pub struct Arguments {
    /// What is simulated.
    #[command(flatten)]
    pub scene: SceneArguments,
    /// Take amplitude scale, damping and scene from an earlier calibration
    #[arg(long, value_name = "DIR", help_heading = "Scene")]
    pub calibration: Option<PathBuf>,
    /// Values of a scene key: KEY=START:STOP:STEP (ends included) or KEY=A,B,C; several make a full grid
    #[arg(long, value_name = "KEY=VALUES", required = true, value_parser = axis, help_heading = "Study")]
    pub vary: Vec<Axis>,
    /// At each point also run N perturbed copies at each of three drive levels: mean, scatter and sensitivity
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u32).range(2..), help_heading = "Study")]
    pub ensemble: Option<u32>,
    /// Where results go.
    #[command(flatten)]
    pub output: OutputArguments,
    /// Continue a sweep that was stopped; needs the same flags
    #[arg(long, requires = "out", help_heading = "Output")]
    pub resume: bool,
    /// How the drive record is to be read.
    #[command(flatten)]
    pub reading: ReadArguments,
    /// Session flags.
    #[command(flatten)]
    pub session: Session,
}

fn axis(text: &str) -> Result<Axis, GridError> {
    Axis::parse(text)
}

/// Name of the plan among the state files.
const PLAN: &str = "plan.json";
/// Name of the log of finished runs.
const RUNS: &str = "runs.jsonl";

/// The command, as a state names it.
const COMMAND: &str = "sweep";
/// Results that every sweep has.
const RESULTS: [&str; 3] = ["sweep.csv", "sweep.json", timing::FILE];

/// Run it.
///
/// # Errors
/// Whatever is wrong with scene, grid, calibration or record; a folder that cannot be written; Ctrl-C.
pub fn execute(arguments: Arguments) -> anyhow::Result<Outcome> {
    let Arguments { scene: flags, calibration, vary, ensemble, resume, reading, output, session } = arguments;
    let mut timing = Timing::start();
    let grid = Grid::new(vary)?;
    let calibrated = calibration.as_deref().map(Calibrated::read).transpose()?;
    let preferred = preferred_model(calibrated.as_ref(), ensemble);
    let mut bench = experiment::read(&flags, &reading, calibrated.as_ref(), preferred)?;
    bench.limits = session.limits();
    experiment::agree_on_model(&mut bench, (0..grid.len()).map(|index| grid.overrides(index)));
    experiment::refuse_drive_keys(&bench, grid.axes.iter().map(|axis| axis.key.as_str()))?;
    let base = bench.scene_with(&[])?;
    session.assumed(&bench.assumptions);
    for warning in bench.warnings() {
        session.note(format_args!("warning: {warning}"));
    }
    let ensemble = ensemble.map(|members| EnsemblePlan::new(members as usize, session.seed()));
    refuse_excess(&bench, &base, &grid, ensemble.as_ref())?;
    let plan = plan_of(&base, &grid, ensemble.as_ref())?;
    timing.stage("read");

    let (folder, scratch) = match &output.out {
        Some(out) => (Some(OutputFolder::resumable(out, &RESULTS, COMMAND, resume, output.force)?), None),
        None => (None, Some(tempfile::tempdir()?)),
    };
    let state = match (&folder, &scratch) {
        (Some(folder), _) => folder.state_path(),
        (None, Some(scratch)) => scratch.path().to_path_buf(),
        (None, None) => bail!("no place for the finished runs"),
    };
    // A sweep stopped before its first run has nothing that another plan could spoil.
    if std::fs::metadata(state.join(RUNS)).is_ok_and(|runs| runs.len() > 0) {
        same_plan(&state.join(PLAN), &plan)?;
    } else {
        if resume {
            session.note(NOTHING_SAVED);
        }
        super::output::write_atomically(&state.join(PLAN), &plan)?;
    }
    let watch = Bar {
        bar: progress::bar(&session, grid.len() as u64, "runs"),
        session: &session,
        forecast: Forecast::new(&session, "the sweep"),
        points: grid.len(),
    };
    let build = |overrides: &[String]| bench.scene_with(overrides);
    let bodies = Bodies::new(session.cache());
    let outcome = sweep(&grid, &build, &bodies, ensemble.as_ref(), &state.join(RUNS), &watch);
    watch.bar.finish_and_clear();
    let runs = match outcome {
        Ok(runs) => runs,
        Err(error) => return Err(stopped(error, folder)),
    };
    timing.stage("run");
    if let Some(warning) = bodies.warning() {
        session.note(format_args!("warning: {warning}"));
    }

    let table = sweep_table::SweepTable {
        scene: &base,
        grid: &grid,
        runs: &runs,
        published: published(&base),
        ensemble: ensemble.is_some(),
    };
    let summary = table.json(&bench, calibrated.as_ref(), session.seed())?;
    if let Some(folder) = folder {
        write(&folder, &table, &summary, &mut timing)?;
        let place = folder.finish()?;
        session.note(format_args!("written to {}", place.display()));
    }
    let failed = runs.iter().filter(|run| matches!(run, Run::Failed { .. })).count();
    if failed > 0 {
        session.note(format_args!("warning: {failed} of {} runs failed; their reasons stand in the table", runs.len()));
    }
    session.result(table.text(output.out.is_some()), &summary)?;
    Ok(Outcome::Done)
}

/// Refuse a grid whose points together are estimated above the limits. Points that are no scene count nothing: they are tabled as such.
fn refuse_excess(bench: &Bench, base: &Scene, grid: &Grid, ensemble: Option<&EnsemblePlan>) -> Result<(), ModelError> {
    let mut all = Estimate { work: 0.0, memory: 0.0 };
    for point in 0..grid.len() {
        let Ok(scene) = bench.scene_with(&grid.overrides(point)) else { continue };
        let one = ensemble.map_or(Estimate::of(&scene), |plan| plan.estimate(&scene, STEPS_PER_PERIOD));
        all = Estimate { work: all.work + one.work, memory: all.memory.max(one.memory) };
        all.check(&base.model.limits)?;
    }
    Ok(())
}

fn write(
    folder: &OutputFolder,
    table: &sweep_table::SweepTable<'_>,
    summary: &serde_json::Value,
    timing: &mut Timing,
) -> anyhow::Result<()> {
    folder.write("sweep.csv", table.csv())?;
    folder.write("sweep.json", summary::json(summary)?)?;
    timing.stage("write");
    let figures: Vec<_> = table.figures().iter().map(|(name, report)| (name.clone(), sweep_figure(report))).collect();
    for (name, figure) in figures {
        folder.write(format!("{name}.svg"), figure.to_svg()?)?;
        folder.write(format!("{name}.png"), figure.to_png()?)?;
    }
    timing.stage("figures");
    folder.write(timing::FILE, timing.to_json())?;
    Ok(())
}

/// Everything that decides what the runs are.
fn plan_of(base: &Scene, grid: &Grid, ensemble: Option<&EnsemblePlan>) -> anyhow::Result<Vec<u8>> {
    summary::json(&serde_json::json!({
        "program": summary::program(), "scene_sha256": summary::scene_digest(base), "grid": grid, "ensemble": ensemble,
    }))
}

fn same_plan(path: &Path, plan: &[u8]) -> anyhow::Result<()> {
    let kept = std::fs::read(path).unwrap_or_default();
    if kept == plan {
        return Ok(());
    }
    bail!(
        "{}: the sweep to resume has another scene, grid, ensemble, seed or program version; give the same flags, or \
         start anew with --force",
        path.display()
    )
}

/// What a stopped sweep leaves, and what to say.
fn stopped(error: SweepError, folder: Option<OutputFolder>) -> anyhow::Error {
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
            error.into()
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
