//! A finite element analysis behind `granchain replay`: advanced step by step, with fields and saved states on the way.
//!
//! Work in progress lies in the state folder of a resumable output: `plan.json` (what the state belongs to), `checkpoint.json` (the last
//! saved state), `fields/` (the frames written so far, whose digests the saved state holds). A frame's name is its number, so a frame
//! computed again after a resume replaces itself; frames beyond the saved state are dropped first.

use std::{
    collections::BTreeMap,
    path::{Path, PathBuf},
};

use anyhow::{Context, bail};
use clap::Args;
use serde::{Deserialize, Serialize};

use crate::{
    calibration::drive::Input,
    cli::{
        arguments::{Session, positive_time, usage},
        forecast::Forecast,
        interrupt::{self, Interrupted},
        output::{NOTHING_SAVED, OutputFolder, PLAN, same_plan, write_atomically},
        progress, summary,
    },
    measurement::{
        read_back::{LARGE, read_back},
        seal::{sealed, unsealed},
        sha256,
    },
    model::fea::{Control, Cut, Frames, Simulation, Snapshot, control::Complementarity},
    report::number::engineering,
    response::{Response, write_pvd, write_vtu},
    scene::{ModelKind, Scene, Support},
};

/// Flags of a finite element run.
#[derive(Debug, Clone, Default, Args)]
pub struct AnalysisArguments {
    /// With --model fea: write displacement, velocity and stress of all bodies at this interval, such as 5us, for ParaView
    #[arg(long, value_name = "INTERVAL", value_parser = positive_time, requires = "out", help_heading = "Finite elements")]
    pub fields: Option<f64>,
    /// With --model fea: save the state at this interval of simulated time, such as 50us; Ctrl-C saves it in any case
    #[arg(long, value_name = "INTERVAL", value_parser = positive_time, requires = "out", help_heading = "Finite elements")]
    pub checkpoint: Option<f64>,
    /// With --model fea: continue a run that was stopped; needs the same flags
    #[arg(long, requires = "out", help_heading = "Finite elements")]
    pub resume: bool,
}

/// The command, as a state names it.
pub const COMMAND: &str = "replay --model fea";
const CHECKPOINT: &str = "checkpoint.json";
/// Folder of the frames, in the state and in the results.
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
    /// Mesh files of bodies of the user's own.
    #[serde(skip_serializing_if = "Vec::is_empty")]
    pub meshes: Vec<Input>,
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
    let AnalysisArguments { fields, checkpoint, resume, .. } = flags;
    let given = [("--fields", fields.is_some()), ("--checkpoint", checkpoint.is_some()), ("--resume", *resume)];
    match given.into_iter().find(|(_, given)| *given) {
        Some((flag, _)) if scene.model.kind != ModelKind::Fea => Err(usage(format!(
            "{flag} belongs to --model fea; model `{}` has no fields and no saved state",
            scene.model.kind.name()
        ))),
        _ => Ok(()),
    }
}

#[derive(Serialize, Deserialize)]
struct Checkpoint {
    simulation: Snapshot,
    frames: BTreeMap<String, String>,
}

/// A run in the making.
pub struct Analysis<'a> {
    scene: &'a Scene,
    session: &'a Session,
    folder: Option<&'a OutputFolder>,
    meshes: Vec<Input>,
    identity: String,
    simulation: Simulation<'static>,
    frames: Frames,
    /// SHA-256 of the frames written, by name.
    written: BTreeMap<String, String>,
    /// Steps a frame and steps a saved state.
    frame: Option<usize>,
    save: Option<usize>,
    /// Interval of the frames, s, as given.
    interval: f64,
}

impl<'a> Analysis<'a> {
    /// Mesh and factor the scene, or take up the state that an earlier run saved in `folder`.
    pub fn new(
        scene: &'a Scene,
        flags: &AnalysisArguments,
        folder: Option<&'a OutputFolder>,
        session: &'a Session,
    ) -> anyhow::Result<Self> {
        let step = scene.model.fea.step;
        let frame = flags.fields.map(|interval| whole_steps("--fields", interval, step)).transpose()?;
        let save = flags.checkpoint.map(|interval| whole_steps("--checkpoint", interval, step)).transpose()?;
        let meshes = scene.mesh_files().into_iter().map(Input::digest).collect::<Result<Vec<_>, _>>()?;
        let plan = plan_of(scene, &meshes, frame)?;
        let identity = sha256(&plan);
        let mut simulation = Simulation::new(scene, Control::default())?;
        let mut written = BTreeMap::new();
        if let Some(folder) = folder {
            interrupt::saves_first();
            let place = folder.state_path().join(PLAN);
            if is_saved(folder) {
                same_plan(&place, &plan, "run", "scene, mesh file, --fields")?;
                let state = folder.state_path().join(CHECKPOINT);
                let bytes = read_back(&state, LARGE).with_context(|| format!("{}: cannot be read", state.display()))?;
                let of_ours =
                    || format!("{}: no saved state of this program; start again with --force", state.display());
                let saved: Checkpoint =
                    serde_json::from_slice(unsealed(&bytes).with_context(of_ours)?).with_context(of_ours)?;
                simulation.restore(saved.simulation, &identity)?;
                written = saved.frames;
                session.note(format_args!("resumed at {}", engineering(simulation.time(), "s", 4)));
            } else {
                if flags.resume {
                    session.note(NOTHING_SAVED);
                    // Frames that belong to no saved state.
                    let _ = std::fs::remove_dir_all(folder.state_path().join(FIELDS));
                }
                write_atomically(&place, &plan)?;
            }
        }
        let frames = Frames::new(simulation.arrangement());
        let analysis = Self {
            frames,
            written,
            scene,
            session,
            folder,
            meshes,
            identity,
            simulation,
            frame,
            save,
            interval: flags.fields.unwrap_or(0.0),
        };
        analysis.check_frames()?;
        Ok(analysis)
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
        let start = self.taken();
        if start == 0 {
            self.write_frame()?;
        }
        let forecast = Forecast::new(self.session, "the run");
        let mut reported = self.simulation.cuts().len();
        while !self.simulation.is_done() {
            if interrupt::requested() {
                return Err(self.stopped()?);
            }
            self.simulation.advance()?;
            let taken = self.taken();
            for cut in &self.simulation.cuts()[reported..] {
                bar.suspend(|| self.session.note(cut_note(cut)));
            }
            reported = self.simulation.cuts().len();
            if self.frame.is_some_and(|steps| taken.is_multiple_of(steps)) {
                self.write_frame()?;
            }
            if self.save.is_some_and(|steps| taken.is_multiple_of(steps)) {
                self.save()?;
            }
            forecast.at(self.simulation.time() / self.scene.duration);
            progress::advance_to(bar, self.simulation.time(), self.scene.duration);
        }
        // What is stopped from here on has only to be written again; water is in no saved state.
        if matches!(self.scene.support, Support::Disc { .. }) { Ok(()) } else { self.save() }
    }

    fn taken(&self) -> usize {
        (self.simulation.time() / self.scene.model.fea.step).round() as usize
    }

    /// Save the state where there is a folder for it; the error that says so.
    fn stopped(&self) -> anyhow::Result<anyhow::Error> {
        let Some(folder) = self.folder else { return Ok(Interrupted.into()) };
        self.save()?;
        let (time, place) = (engineering(self.simulation.time(), "s", 4), folder.path().display());
        Ok(anyhow::Error::from(Interrupted)
            .context(format!("the run up to {time} is kept in {place}; continue with --resume")))
    }

    fn save(&self) -> anyhow::Result<()> {
        let Some(folder) = self.folder else { return Ok(()) };
        let saved = Checkpoint { simulation: self.simulation.snapshot(&self.identity), frames: self.written.clone() };
        let saved = serde_json::to_vec(&saved).context("the state of the analysis cannot be written")?;
        Ok(write_atomically(&folder.state_path().join(CHECKPOINT), &sealed(&saved))?)
    }

    fn frames_folder(&self) -> Option<PathBuf> {
        Some(self.folder?.state_path().join(FIELDS))
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
            meshes: self.meshes.clone(),
        }
    }
}

impl Analysis<'_> {
    /// Drop what belongs to no saved state, and see that the frames before it are as they were written.
    fn check_frames(&self) -> anyhow::Result<()> {
        let (Some(steps), Some(folder)) = (self.frame, self.frames_folder()) else { return Ok(()) };
        std::fs::create_dir_all(&folder).with_context(|| format!("{}: cannot be made", folder.display()))?;
        for entry in std::fs::read_dir(&folder).with_context(|| format!("{}: cannot be read", folder.display()))? {
            let path = entry?.path();
            let known =
                path.file_name().and_then(|name| name.to_str()).is_some_and(|name| self.written.contains_key(name));
            if !known {
                std::fs::remove_file(&path).with_context(|| format!("{}: cannot be removed", path.display()))?;
            }
        }
        for (name, digest) in &self.written {
            if Path::new(name).file_name() != Some(name.as_ref()) {
                bail!(
                    "the saved state names a frame `{}`, which is no file name; start over with --force",
                    name.escape_debug()
                );
            }
            let path = folder.join(name);
            let frame = read_back(&path, LARGE)
                .with_context(|| format!("{}: cannot be read; start again with --force", path.display()))?;
            if sha256(&frame) != *digest {
                bail!("{}: altered or damaged since it was written; start again with --force", path.display());
            }
        }
        if self.written.is_empty() { Ok(()) } else { self.write_series(&folder, self.taken() / steps) }
    }

    /// Write the frame of this instant, and the list of all so far.
    fn write_frame(&mut self) -> anyhow::Result<()> {
        let (Some(steps), Some(folder)) = (self.frame, self.frames_folder()) else { return Ok(()) };
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
        let name = frame_name(number);
        write_atomically(&folder.join(&name), &bytes)?;
        self.written.insert(name, sha256(&bytes));
        self.write_series(&folder, number)
    }

    /// Write the list of the frames up to that number.
    fn write_series(&self, folder: &Path, number: usize) -> anyhow::Result<()> {
        let names: Vec<String> = (0..=number).map(frame_name).collect();
        let list = names.iter().enumerate().map(|(number, name)| (number as f64 * self.interval, name.as_str()));
        let mut bytes = Vec::new();
        write_pvd(list, &mut bytes).context("the list of the frames cannot be made")?;
        Ok(write_atomically(&folder.join(SERIES), &bytes)?)
    }
}

/// Take the frames and their list into the results; all of them stay in the state until the results stand.
pub fn take_frames(folder: &OutputFolder, analysis: Option<&AnalysisSummary>) -> anyhow::Result<()> {
    let Some(frames) = analysis.and_then(|analysis| analysis.field_frames) else { return Ok(()) };
    let fields = folder.state_path().join(FIELDS);
    for name in (0..frames).map(frame_name).chain([SERIES.to_owned()]) {
        folder.take(&fields.join(&name), Path::new(FIELDS).join(&name))?;
    }
    Ok(())
}

/// Whether a state was saved that a later run can take up.
pub fn is_saved(folder: &OutputFolder) -> bool {
    folder.state_path().join(CHECKPOINT).exists()
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

/// Everything that decides what the state is.
fn plan_of(scene: &Scene, meshes: &[Input], frame: Option<usize>) -> anyhow::Result<Vec<u8>> {
    summary::json(&serde_json::json!({
        "program": summary::program(), "scene_sha256": summary::scene_digest(scene), "meshes": meshes, "steps_a_frame": frame,
    }))
}
