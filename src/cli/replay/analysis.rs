//! A finite element analysis behind `granchain replay`, advanced step by step, with fields on the way.

use std::path::Path;

use anyhow::Context;
use clap::Args;
use serde::Serialize;

use crate::{
    cli::{
        arguments::{Session, positive_time, usage},
        forecast::Forecast,
        interrupt,
        output::OutputFolder,
        progress,
    },
    model::fea::{Control, Cut, Frames, Simulation, control::Complementarity},
    report::number::engineering,
    response::{Response, write_pvd, write_vtu},
    scene::{ModelKind, Scene},
};

/// Flags of a finite element run.
#[derive(Debug, Clone, Default, Args)]
pub struct AnalysisArguments {
    /// With --model fea: write displacement, velocity and stress of all bodies at this interval, such as 5us, for ParaView
    #[arg(long, value_name = "INTERVAL", value_parser = positive_time, requires = "out", help_heading = "Finite elements")]
    pub fields: Option<f64>,
}

/// Folder of the frames in the results.
const FIELDS: &str = "fields";
/// List of the frames, for ParaView.
const SERIES: &str = "fields.pvd";

/// What `summary.json` says of an analysis besides what every run has.
#[derive(Debug, Clone, Serialize)]
pub struct AnalysisSummary {
    pub elements: u64,
    /// Points of every contact at which it may press.
    pub contact_points: Vec<usize>,
    /// Non-zeros of the factors of the nominal step.
    pub factor_nonzeros: usize,
    /// Largest residual of the energy at any sample over the largest energy, 1.
    pub energy_balance: f64,
    /// Energy that contacts made by opening and closing within steps, J: part of the residual.
    pub contact_energy_j: f64,
    /// How well the contact conditions were met.
    pub complementarity: Complementarity,
    /// Steps taken back and tried again at half their size.
    pub cuts: Vec<Cut>,
    #[serde(skip_serializing_if = "Option::is_none")]
    pub field_frames: Option<usize>,
}

/// What a finished analysis leaves.
pub struct Finished {
    pub response: Response,
    pub summary: AnalysisSummary,
    /// What a person should read.
    pub warnings: Vec<String>,
    /// Stage and seconds, for `timing.json`.
    pub stages: Vec<(&'static str, f64)>,
}

/// Refuse flags that a run of this model does not use.
pub fn refuse_idle(flags: &AnalysisArguments, scene: &Scene) -> anyhow::Result<()> {
    match flags.fields {
        Some(_) if scene.model.kind != ModelKind::Fea => {
            Err(usage(format!("--fields belongs to --model fea; model `{}` has no fields", scene.model.kind.name())))
        }
        _ => Ok(()),
    }
}

/// A run in the making.
pub struct Analysis<'a> {
    scene: &'a Scene,
    session: &'a Session,
    folder: Option<&'a OutputFolder>,
    simulation: Simulation<'static>,
    frames: Frames,
    /// Steps a frame.
    frame: Option<usize>,
    /// Interval of the frames, s, as given.
    interval: f64,
}

impl<'a> Analysis<'a> {
    /// Mesh and factor the scene.
    pub fn new(
        scene: &'a Scene,
        flags: &AnalysisArguments,
        folder: Option<&'a OutputFolder>,
        session: &'a Session,
    ) -> anyhow::Result<Self> {
        let step = scene.model.fea.step;
        let frame = flags.fields.map(|interval| whole_steps("--fields", interval, step)).transpose()?;
        let simulation = Simulation::new(scene, Control::default())?;
        let frames = Frames::new(simulation.arrangement());
        let interval = flags.fields.unwrap_or(0.0);
        Ok(Self { frames, scene, session, folder, simulation, frame, interval })
    }

    pub fn run(mut self) -> anyhow::Result<Finished> {
        let bar = progress::simulated_time(self.session, "simulated time");
        let outcome = self.advance(&bar);
        bar.finish_and_clear();
        outcome?;
        let response = self.simulation.response();
        crate::model::check_energy(&response.energy)?;
        let mut warnings = self.simulation.warnings();
        warnings.extend(response.energy.warning());
        let stages = self.simulation.profile().stages();
        Ok(Finished {
            summary: self.summary(),
            warnings,
            stages: stages.iter().map(|(name, time)| (*name, time.as_secs_f64())).collect(),
            response,
        })
    }

    fn advance(&mut self, bar: &indicatif::ProgressBar) -> anyhow::Result<()> {
        self.write_frame()?;
        let forecast = Forecast::new(self.session, "the run");
        let mut reported = self.simulation.cuts().len();
        while !self.simulation.is_done() {
            interrupt::check()?;
            self.simulation.advance()?;
            for cut in &self.simulation.cuts()[reported..] {
                bar.suspend(|| self.session.note(cut_note(cut)));
            }
            reported = self.simulation.cuts().len();
            if self.frame.is_some_and(|steps| self.taken().is_multiple_of(steps)) {
                self.write_frame()?;
            }
            forecast.at(self.simulation.time() / self.scene.duration);
            progress::advance_to(bar, self.simulation.time(), self.scene.duration);
        }
        self.write_series()
    }

    fn taken(&self) -> usize {
        (self.simulation.time() / self.scene.model.fea.step).round() as usize
    }

    fn summary(&self) -> AnalysisSummary {
        let arrangement = self.simulation.arrangement();
        let bodies = arrangement.beads.iter().chain(&arrangement.support);
        AnalysisSummary {
            elements: bodies.map(|&kind| arrangement.kinds[kind].mesh().elements.len() as u64).sum(),
            contact_points: arrangement.contacts.iter().map(|&pair| arrangement.pairs[pair].len()).collect(),
            factor_nonzeros: self.simulation.factor_nonzeros(),
            energy_balance: self.simulation.balance().balance(),
            contact_energy_j: self.simulation.balance().contact_energy(),
            complementarity: self.simulation.complementarity(),
            cuts: self.simulation.cuts().to_vec(),
            field_frames: self.frame.map(|steps| self.taken() / steps + 1),
        }
    }
}

impl Analysis<'_> {
    /// Write the frame of this instant, and the list of all so far.
    fn write_frame(&mut self) -> anyhow::Result<()> {
        let (Some(steps), Some(folder)) = (self.frame, self.folder) else { return Ok(()) };
        let number = self.taken() / steps;
        let field = self.frames.field(&self.simulation);
        let mut bytes = Vec::new();
        write_vtu(&field, &mut bytes)?;
        if let (0, Some(steps)) = (self.taken(), self.frame) {
            let frames = (self.scene.duration / self.scene.model.fea.step).round() as usize / steps + 1;
            let megabytes = 1e-6 * bytes.len() as f64;
            self.session.note(format_args!(
                "--fields: {frames} frames of {megabytes:.1} MB, {:.0} MB in all",
                frames as f64 * megabytes
            ));
        }
        folder.write(Path::new(FIELDS).join(frame_name(number)), bytes)?;
        Ok(())
    }

    /// Write the list of the frames.
    fn write_series(&self) -> anyhow::Result<()> {
        let (Some(steps), Some(folder)) = (self.frame, self.folder) else { return Ok(()) };
        let names: Vec<String> = (0..=self.taken() / steps).map(frame_name).collect();
        let list = names.iter().enumerate().map(|(number, name)| (number as f64 * self.interval, name.as_str()));
        let mut bytes = Vec::new();
        write_pvd(list, &mut bytes).context("the list of the frames cannot be made")?;
        folder.write(Path::new(FIELDS).join(SERIES), bytes)?;
        Ok(())
    }
}

fn frame_name(number: usize) -> String {
    format!("field_{number:06}.vtu")
}

fn cut_note(cut: &Cut) -> String {
    format!(
        "step of {} at {} taken back and halved, contact {}: {}",
        engineering(cut.step_s, "s", 3),
        engineering(cut.time_s, "s", 6),
        cut.contact,
        cut.cause
    )
}

/// An interval as a number of steps.
fn whole_steps(flag: &str, interval: f64, step: f64) -> anyhow::Result<usize> {
    let ratio = interval / step;
    // Rounding of two decimal numbers and their quotient, with room.
    if ratio.round() >= 1.0 && (ratio - ratio.round()).abs() <= 1e-9 * ratio {
        return Ok(ratio.round() as usize);
    }
    let (interval, step) = (engineering(interval, "s", 6), engineering(step, "s", 6));
    Err(usage(format!("{flag} {interval}: expected a whole number of steps of {step} (model.step)")))
}
