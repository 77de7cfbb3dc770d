//! Margins of a scene: how far its step, its contacts and its energy stay from where they would spoil the answer.
//!
//! A margin is a number and what it should stay below. Up to half of that it is `good`, up to that `close`, beyond `too large`. The limits:
//!
//! - step over the shortest contact T: 1/10. A force that rises and falls as half a sine in T is followed by the central difference with a relative error of
//!   (π h/T)²/24 in frequency, 0.4 % there.
//! - overlap gained in a step over the largest: as many times more as Hertz' collision is longer than δ_max/v, 0.29
//! - dashpot times half the step over the reduced mass, (c + γ √(v h)) h/2m_r in the step that closes a contact: 1. Half of a step takes up the motion by the
//!   dashpot's force at its end, half by that at its beginning: a stronger one turns the motion round instead of ending it.
//! - passes over the contacts of a step: 30, from where on they are solved one after another
//! - energy unaccounted for over the largest: 1 %, from where on a run warns
//! - step, or tolerance of the chain: the largest that changes the answer by less than 1 %

mod contact;

use rayon::prelude::*;
use serde::Serialize;

use self::contact::{onset, overlap_gained, shortest_contact, stiffest_dashpot};
use super::{
    MARGIN, Purpose, Study, conditioned,
    list::{Step, Variation, method_of},
    relative_error,
};
use crate::{engine::trace, observation::highest_cutoff, predict::replicates::Watch};
use granchain_model::{
    ModelError, Prepared, prepare_with,
    reduced::Cache,
    response::{EnergyBalance, Response, SMALL_RESIDUAL},
    scene::{DampingCoefficients, Integrator, ModelKind, Scene, Support},
};
use granchain_signal::feature::Measurand;

/// Motion after the onset of the drive over which energy is balanced, s.
const MOTION: f64 = 2e-3;
/// What runs may take for one number, s; energy is balanced over less motion then, the step is not varied.
const SECONDS: f64 = 2.0;
/// Change of the answer that a step may make, 1.
const CHANGE: f64 = 0.01;
/// Largest step over the shortest contact, 1.
const OF_CONTACT: f64 = 0.1;
/// T v/δ_max of Hertz' collision.
const COLLISION: f64 = 2.943_275;
/// Passes after which contacts are solved one after another.
const PASSES: f64 = 30.0;
/// Steps of the reference in the shortest contact, or in a fifth of a period where there is none, at least, and in a step of the scene.
const FINEST: (f64, f64) = (200.0, 4.0);
/// Longest step that is tried, over the scene's own.
const LONGEST: f64 = 4.0;
/// Tolerance of the reference, at most.
const LEAST_TOLERANCE: f64 = 1e-12;

#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize)]
#[serde(rename_all = "kebab-case")]
pub enum Word {
    Good,
    Close,
    TooLarge,
}

impl Word {
    #[must_use]
    pub const fn text(self) -> &'static str {
        match self {
            Self::Good => "good",
            Self::Close => "close",
            Self::TooLarge => "too large",
        }
    }
}

#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Margin {
    pub name: &'static str,
    pub value: f64,
    /// `1` or `s`.
    pub unit: &'static str,
    /// What it should stay below.
    pub below: f64,
    /// None where the model sees to it itself.
    pub word: Option<Word>,
    pub note: String,
}

impl Margin {
    fn new(name: &'static str, value: f64, below: f64, note: String) -> Self {
        let word = match value / below {
            share if share <= 0.5 => Word::Good,
            share if share <= 1.0 => Word::Close,
            _ => Word::TooLarge,
        };
        Self { name, value, unit: "1", below, word: Some(word), note }
    }
}

/// Margins of a scene, and what could not be computed, with the reason.
#[derive(Debug, Clone, PartialEq, Default, Serialize)]
pub struct Margins {
    pub rows: Vec<Margin>,
    pub left_out: Vec<[String; 2]>,
}

impl Margins {
    /// Of a scene, in about a second. Bodies are read from `cache` if present.
    ///
    /// # Errors
    /// [`ModelError::Stopped`]; what else fails is left out, with its reason.
    pub fn of(scene: &Scene, cache: Option<&Cache>, watch: &dyn Watch) -> Result<Self, ModelError> {
        let mut margins = Self::default();
        let of_contact = scene.model.step().zip(shortest_contact(scene));
        margins.rows.extend(of_contact.map(|(step, (shortest, contact))| {
            let note = format!("{} ns of {:.3} us, contact {contact} (1 = piston)", nanoseconds(step), 1e6 * shortest);
            Margin::new("step over the shortest contact", step / shortest, OF_CONTACT, note)
        }));
        let meshed = scene.model.step().filter(|_| scene.model.kind != ModelKind::Chain);
        margins.rows.extend(meshed.and_then(|step| stiffest_dashpot(scene, step)).map(|(stiffness, contact)| {
            let note = format!("contact {contact} (1 = piston), in the step that closes it");
            Margin::new("dashpot times half the step over the mass", stiffness, 1.0, note)
        }));
        if scene.model.kind == ModelKind::Fea {
            let reason = "finite elements take too long: `granchain replay` prints the energy, `granchain accuracy --fea` varies the step";
            margins.leave_out("energy, overlap in a step, change of the answer", reason);
            return Ok(margins);
        }
        match prepare_with(scene, cache) {
            Ok(prepared) => margins.with_runs(scene, &prepared, watch)?,
            Err(error) => margins.leave_out("all that needs a run", error),
        }
        Ok(margins)
    }

    fn leave_out(&mut self, what: &str, reason: impl ToString) {
        self.left_out.push([what.to_owned(), reason.to_string()]);
    }

    /// A row, or why there is none.
    fn enter(&mut self, what: &str, row: Result<Margin, ModelError>) -> Result<(), ModelError> {
        match row {
            Ok(row) => self.rows.push(row),
            Err(error @ ModelError::Stopped { .. }) => return Err(error),
            Err(error) => self.leave_out(what, error),
        }
        Ok(())
    }

    fn with_runs(&mut self, scene: &Scene, prepared: &Prepared, watch: &dyn Watch) -> Result<(), ModelError> {
        self.rows.extend(scene.model.step().and_then(|step| of_modes(scene, prepared, step)));
        let (scene, motion) = &balanced(scene);
        let undamped = (!scene.damping.coefficients.are_absent()).then(|| {
            let mut scene = scene.clone();
            scene.damping.coefficients = DampingCoefficients::default();
            scene
        });
        let run = |scene: &Scene| prepared.run(scene, &mut |_| !watch.stop());
        let ((damped, undamped), study) = rayon::join(
            || rayon::join(|| run(scene), || undamped.as_ref().map(run)),
            || Study::new(scene, Purpose::default()),
        );
        let window = match &study {
            Ok(study) => self.enter_overlap(study, scene, prepared, watch).map(|()| Some(study))?,
            Err(error) => {
                self.leave_out("overlap in a step, change of the answer", error);
                None
            }
        };
        if let Ok(response) = &damped {
            self.rows.extend(of_passes(response));
        }
        let energy = |what, outcome: Result<Response, ModelError>| of_energy(what, outcome, motion);
        self.enter("energy", energy("energy unaccounted for over the largest", damped))?;
        if let Some(undamped) = undamped {
            self.enter("energy without dampers", energy("the same without dampers", undamped))?;
        }
        match window {
            Some(study) => self.enter_step(study, scene, prepared, watch),
            None => Ok(()),
        }
    }

    fn enter_overlap(
        &mut self,
        study: &Study,
        scene: &Scene,
        prepared: &Prepared,
        watch: &dyn Watch,
    ) -> Result<(), ModelError> {
        let Some(step) = scene.model.step() else { return Ok(()) };
        let fine = until(scene, study.window[1], step);
        let outcome = prepared.run(&fine, &mut |_| !watch.stop());
        let row = outcome.map(|response| {
            let (gained, contact) = overlap_gained(scene, &response);
            let note = format!("contact {contact} (1 = piston), first {:.0} us", 1e6 * fine.duration);
            Margin::new("overlap gained in a step over the largest", gained, COLLISION * OF_CONTACT, note)
        });
        self.enter("overlap in a step", row)
    }

    /// The largest step or tolerance that changes the answer by less than 1 %.
    fn enter_step(
        &mut self,
        study: &Study,
        scene: &Scene,
        prepared: &Prepared,
        watch: &dyn Watch,
    ) -> Result<(), ModelError> {
        let (what, own) = own_step(scene);
        let steps = ladder(scene, own);
        let window = until(scene, study.window[1] + MARGIN, study.scene.output_step);
        if expected(&stepped(&window, steps[0]), window.duration).1 > SECONDS {
            self.leave_out("change of the answer", "its runs take too long here: `granchain accuracy` measures it");
            return Ok(());
        }
        // A sample of every run: all but a tolerance divide it.
        let longest = steps.iter().rev().find_map(|step| if let Step::Time(step) = step { Some(*step) } else { None });
        let run = |step: &Step| -> Result<Vec<f64>, ModelError> {
            let mut scene = stepped(&window, *step);
            if let Some(output) = longest {
                scene = until(&scene, window.duration, output);
            }
            let own_bodies = if prepared.fits(&scene) { None } else { Some(prepare_with(&scene, None)?) };
            let response = own_bodies.as_ref().unwrap_or(prepared).run(&scene, &mut |_| !watch.stop())?;
            let seen = conditioned(&scene, &trace(response, study.measurand)?);
            let last = ((study.window[1] / seen.step).round() as usize + 1).min(seen.len());
            Ok(seen.values[..last].to_vec())
        };
        let mut runs: Vec<Result<Vec<f64>, ModelError>> = steps.par_iter().map(run).collect();
        let reference = match runs.remove(0) {
            Ok(reference) => reference,
            Err(error) => return self.enter("change of the answer", Err(error)),
        };
        let change = |run: &Result<Vec<f64>, ModelError>| {
            run.as_ref().map_or(f64::INFINITY, |values| relative_error(values, &reference))
        };
        let changes: Vec<(Step, f64)> = steps[1..].iter().copied().zip(runs.iter().map(change)).collect();
        let within = changes.iter().take_while(|(_, change)| *change < CHANGE).last();
        let at_own = changes.iter().find(|(step, _)| *step == own).map(|(_, change)| *change);
        let cycles = (study.window[1] - study.window[0]) * scene.drive.frequency;
        let seen = if study.measurand == Measurand::Pressure { "pressure" } else { "last bead" };
        let at_own = at_own
            .filter(|change| change.is_finite())
            .map_or("not compared at its own".to_owned(), |change| format!("{:.2} % at its own", 100.0 * change));
        let least = if within.is_none() { "no step that was tried does, the shortest is given; " } else { "" };
        let note = format!("{least}waveform of the {seen} over {cycles:.1} periods, rms: {at_own}");
        let below = within.unwrap_or(&changes[0]).0.value();
        self.rows.push(Margin { unit: own.unit(), ..Margin::new(what, own.value(), below, note) });
        if within.is_none()
            && let Some(row) = self.rows.last_mut()
        {
            row.word = Some(Word::TooLarge);
        }
        Ok(())
    }
}

impl Step {
    const fn value(self) -> f64 {
        match self {
            Self::Tolerance(value) | Self::Time(value) => value,
        }
    }

    const fn unit(self) -> &'static str {
        match self {
            Self::Tolerance(_) => "1",
            Self::Time(_) => "s",
        }
    }
}

fn nanoseconds(step: f64) -> f64 {
    1e-3 * (1e12 * step).round()
}

fn own_step(scene: &Scene) -> (&'static str, Step) {
    match (scene.model.step(), scene.model.integrator) {
        (Some(step), _) => ("step, and the longest that changes the answer by less than 1 %", Step::Time(step)),
        (None, Integrator::DormandPrince853 { tolerance }) => {
            ("tolerance, and the largest that changes the answer by less than 1 %", Step::Tolerance(tolerance))
        }
        (None, Integrator::OnDisc { step }) => ("step", Step::Time(step)),
    }
}

/// The reference first, then from the finest to the coarsest, the scene's own among them where its output could show it.
fn ladder(scene: &Scene, own: Step) -> Vec<Step> {
    match own {
        Step::Tolerance(own) => {
            let least = LEAST_TOLERANCE.min(0.01 * own).max(1e-14);
            let mut tolerances: Vec<f64> = (0..12).map(|decade| 10.0_f64.powi(decade - 13)).collect();
            tolerances.retain(|tolerance| *tolerance > 2.0 * least && (tolerance / own - 1.0).abs() > 0.01);
            tolerances.extend([least, own]);
            tolerances.sort_by(f64::total_cmp);
            tolerances.into_iter().map(Step::Tolerance).collect()
        }
        Step::Time(own) => {
            let frequency = scene.drive.frequency;
            let shortest = shortest_contact(scene).map_or(0.2 / frequency, |(time, _)| time);
            let finest = (shortest / FINEST.0).min(own / FINEST.1);
            let halvings = (own / finest - 1e-6).log2().ceil() as i32;
            // Output must show what a fit compares; the bodies of a disc are made for each step.
            let most = if matches!(scene.support, Support::Disc { .. }) { own } else { LONGEST * own };
            let longest = (0.4 / highest_cutoff(frequency)).max(finest * 2.0).min(1.01 * most);
            let rung = |power: i32| own * 2.0_f64.powi(power - halvings);
            (0..64).map(rung).take_while(|step| *step <= longest).map(Step::Time).collect()
        }
    }
}

fn stepped(scene: &Scene, step: Step) -> Scene {
    let mut scene = scene.clone();
    match (step, &mut scene.model.integrator) {
        (Step::Tolerance(value), Integrator::DormandPrince853 { tolerance }) => *tolerance = value,
        (Step::Time(value), Integrator::OnDisc { step }) if scene.model.kind == ModelKind::Chain => *step = value,
        (Step::Time(value), _) => scene.model.reduced.step = value,
        (Step::Tolerance(_), Integrator::OnDisc { .. }) => {}
    }
    scene
}

/// The scene up to an instant (s) at most, with that output step (s).
fn until(scene: &Scene, end: f64, output_step: f64) -> Scene {
    let mut scene = scene.clone();
    scene.output_step = output_step;
    scene.duration = (end.min(scene.duration) / output_step).floor().max(1.0) * output_step;
    scene
}

/// What bodies and a run over a time (s) are expected to take, s.
fn expected(scene: &Scene, duration: f64) -> (f64, f64) {
    let (_, step) = own_step(scene);
    let density = Some(scene.model.meshing().density);
    Variation { method: method_of(scene), density, step, shown: true }.expected(scene, duration)
}

/// The scene over the first 2 ms after its drive begins, or over what its runs may take; and in words.
fn balanced(scene: &Scene) -> (Scene, String) {
    let affordable = scene.duration * SECONDS / expected(scene, scene.duration).1;
    let end = (onset(scene) + MOTION).min(affordable);
    if end >= scene.duration {
        return (scene.clone(), format!("whole scene, {:.0} us", 1e6 * scene.duration));
    }
    let scene = until(scene, end, scene.output_step);
    let text = format!("first {:.0} us", 1e6 * scene.duration);
    (scene, text)
}

/// The highest mode that the step follows in time; all above respond as static ones.
fn of_modes(scene: &Scene, prepared: &Prepared, step: f64) -> Option<Margin> {
    let all = prepared.mode_frequencies(scene);
    let most = 1.0 / std::f64::consts::PI;
    let kept: Vec<f64> = all.iter().copied().filter(|frequency| frequency * step <= most).collect();
    let highest = kept.iter().copied().fold(0.0, f64::max);
    let note = format!("{:.2} MHz; {} of {} modes kept, the others static", 1e-6 * highest, kept.len(), all.len());
    let name = "step over the period of the highest mode kept";
    (!all.is_empty()).then(|| Margin { word: None, ..Margin::new(name, highest * step, most, note) })
}

fn of_passes(response: &Response) -> Option<Margin> {
    let work = &response.work;
    let mean = work.contact_sweeps as f64 / work.steps.max(1) as f64;
    let note = format!("mean {mean:.2}");
    let name = "passes over the contacts of a step, largest";
    (work.most_contact_sweeps > 0).then(|| Margin::new(name, work.most_contact_sweeps as f64, PASSES, note))
}

fn of_energy(name: &'static str, outcome: Result<Response, ModelError>, motion: &str) -> Result<Margin, ModelError> {
    let share = match outcome {
        Ok(response) => response.energy.residual_share(),
        Err(ModelError::EnergyUnbalanced { residual_j, largest_j }) => {
            EnergyBalance { residual_j, largest_j, ..EnergyBalance::default() }.residual_share()
        }
        Err(error) => return Err(error),
    };
    Ok(Margin::new(name, share.abs(), SMALL_RESIDUAL, motion.to_owned()))
}
