//! The discrete chain: one unknown a bead.
//!
//! m_i ü_i = F_{i−1} − F_i, i = 1…N, with the contact forces
//!
//! F_i = F_el,i(δ_i) + (c_i + γ_i √δ_i) δ̇_i for δ_i > 0, else 0, and never negative unless `damping.tension` says so,
//!
//! and the overlaps δ_i = δ⁰_i − g_i + u_i − u_{i+1}. u₀ is the prescribed motion of the piston times α, u_{N+1} = 0 the support; g_i
//! are the initial gaps, and δ⁰_i the overlaps that carry the precompression F₀, so a precompressed chain starts in exact
//! equilibrium with the flats moved in by as much. The beads start at rest unless an [`InitialState`] says otherwise. A striker is one
//! bead more, in front of the first, with a velocity and no piston. Gravity adds m_i g, and to the static force of a contact the weight
//! of the beads before it.
//!
//! A scene may ask for more: a compliant horn, drag and friction of the bead guide, contacts that yield, an annulus that relaxes, gravity
//! (`effect_state.rs`).
//! Left out: bead elasticity outside the contact law (the lowest bead mode lies at 36 times the drive), rotation, friction between beads.

mod coupling;
mod crossing;
mod dormand_prince;
mod effect_state;
mod effects;
pub mod ensemble;
mod equation;
mod event;
mod finite_body;
mod forecast;
mod integrate;
mod lane;
mod laws;
mod on_spring;
mod pace;
mod record;
mod system;
mod tableau;
mod variation;

pub use finite_body::FiniteBodyLaws;

use equation::Marked;
use integrate::Control;
use record::Grid;
use system::System;

use super::{
    Estimate, ModelError, Progress,
    contact_law::{ALL_TERMS, Law, for_terms},
    estimate::refuse_excess,
};
use crate::{
    response::{EnergyBalance, ObservedPoint, Response, SolverWork},
    scene::{Integrator, PistonMotion, Scene},
    valid::need,
};

#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub struct ChainModel;

/// Where the beads are and how they move at time zero, relative to the scene's own start.
#[derive(Debug, Clone, PartialEq)]
pub struct InitialState {
    /// Displacement of each bead, m.
    pub displacements: Vec<f64>,
    /// Velocity of each bead, m/s.
    pub velocities: Vec<f64>,
}

impl InitialState {
    pub fn at_rest(beads: usize) -> Self {
        Self { displacements: vec![0.0; beads], velocities: vec![0.0; beads] }
    }

    /// The same behind a striker of that velocity (m/s) that touches the first bead.
    fn behind(&self, velocity: f64) -> Self {
        let joined = |first: f64, rest: &[f64]| [&[first], rest].concat();
        Self { displacements: joined(0.0, &self.displacements), velocities: joined(velocity, &self.velocities) }
    }
}

impl ChainModel {
    /// Run the scene from rest (or precompressed equilibrium) to its duration.
    pub fn run(&self, scene: &Scene, progress: Progress<'_>) -> Result<Response, ModelError> {
        self.run_from(scene, &InitialState::at_rest(scene.chain.beads.len()), progress)
    }

    /// Run the scene from a given state of the beads. A gap of `f64::INFINITY` takes a contact away, such as piston or support of a
    /// free chain.
    pub fn run_from(
        &self,
        scene: &Scene,
        initial: &InitialState,
        progress: Progress<'_>,
    ) -> Result<Response, ModelError> {
        let motion = scene.drive.motion(scene.amplitude_scale);
        self.run_with_laws(scene, None, motion.as_ref(), initial, progress)
    }

    /// As [`ChainModel::run_from`], with the piston moving as `motion` instead of the scene's drive, and with the laws of the scene's bodies where
    /// they are known already: see [`FiniteBodyLaws`]. They have no effect where the scene asks for the law of Hertz.
    pub fn run_with_laws(
        &self,
        scene: &Scene,
        fitted: Option<&FiniteBodyLaws>,
        motion: &dyn PistonMotion,
        initial: &InitialState,
        progress: Progress<'_>,
    ) -> Result<Response, ModelError> {
        refuse_excess(scene)?;
        let mut system = System::new(scene, fitted)?;
        let struck;
        let initial = match scene.striker_velocity() {
            Some(velocity) => {
                struck = initial.behind(velocity);
                &struck
            }
            None => initial,
        };
        let mut grid = Grid::new(scene, &system, motion);
        let velocity_scale = scale(&mut system, initial, grid.piston_speed());
        let (energy, work) = match scene.model.integrator {
            Integrator::DormandPrince853 { tolerance } => {
                let control = control(scene, &system, tolerance, velocity_scale, grid.end())?;
                adaptive(&system, motion, initial, &control, &mut grid, progress)?
            }
            Integrator::OnDisc { .. } => {
                let reason =
                    "the clock of a disc is of a chain before one; set `model.integrator` = \"dormand-prince-853\"";
                return Err(ModelError::Unsupported { model: "chain", reason: reason.into() });
            }
        };
        let observed = ObservedPoint::of(scene.support.presses_the_pole());
        Ok(grid.response(observed, energy, work).counted(scene.is_struck(), |forces| scene.chain.reading(forces)))
    }
}

/// Steps that the adaptive integrator takes in the natural time of a contact, at the default tolerance: 12 to 14 of the rigid scene at moduli of
/// 200 GPa to 1 PPa.
const STEPS_A_CONTACT: f64 = 12.0;

/// Velocity scale of the run (m/s): the piston's and the beads' own; sets the system's natural time.
fn scale(system: &mut System, initial: &InitialState, piston_speed: f64) -> f64 {
    let largest = |values: &[f64]| values.iter().fold(0.0, |largest, value| f64::max(largest, value.abs()));
    let velocity = f64::max(piston_speed, largest(&initial.velocities));
    // A chain that nothing moves still needs a scale for its rounding errors.
    system.set_natural_time(if velocity > 0.0 { velocity } else { 1e-6 });
    let displaced = largest(&initial.displacements) / system.natural_time;
    let velocity = f64::max(velocity, displaced);
    let velocity = if velocity > 0.0 { velocity } else { 1e-6 };
    system.set_natural_time(velocity);
    velocity
}

fn control(
    scene: &Scene,
    system: &System,
    tolerance: f64,
    velocity_scale: f64,
    last_sample: f64,
) -> Result<Control, ModelError> {
    let expected = "a relative tolerance between 1e-14 and 0.1";
    need((1e-14..=0.1).contains(&tolerance), "model.tolerance", expected, tolerance)?;
    let (end, limits) = (scene.duration.max(last_sample), &scene.model.limits);
    system.refuse_stiffness(velocity_scale, limits)?;
    let beads = system.beads as f64;
    let work = beads * STEPS_A_CONTACT * end / system.natural_time;
    Estimate { work, memory: 0.0 }.check(limits)?;
    Ok(Control { tolerance, velocity_scale, end, most_steps: limits.work / beads })
}

/// Pick the loop specialised for the effects, dampers and support of this system, once a run.
fn adaptive(
    system: &System,
    motion: &dyn PistonMotion,
    initial: &InitialState,
    control: &Control,
    grid: &mut Grid,
    progress: Progress<'_>,
) -> Result<(EnergyBalance, SolverWork), ModelError> {
    use integrate::integrate as run;
    let law = system.laws[system.beads];
    let terms = system.dashpots.iter().fold(0, |terms, dashpot| terms | dashpot.terms());
    // Effects that are beside the contacts cost more than a dashpot that is zero, too.
    match (&system.effects, &system.coupling) {
        (Some(_), Some(_)) => {
            run::<ALL_TERMS, _>(system, Marked::<true, true>(law), motion, initial, control, grid, progress)
        }
        (Some(_), None) => {
            run::<ALL_TERMS, _>(system, Marked::<false, true>(law), motion, initial, control, grid, progress)
        }
        // Coupled contacts cost more than a dashpot that is zero, so all dampers share one copy.
        (None, Some(_)) if terms != 0 => {
            run::<ALL_TERMS, _>(system, Marked::<true, false>(law), motion, initial, control, grid, progress)
        }
        (None, Some(_)) => run::<0, _>(system, Marked::<true, false>(law), motion, initial, control, grid, progress),
        (None, None) => match law {
            Law::Hertz(law) => {
                for_terms!(terms, DAMPED => run::<DAMPED, _>(system, law, motion, initial, control, grid, progress))
            }
            // Any other law of the one contact at the support is picked within the loop: it is worth no copy of the code.
            law => for_terms!(terms, DAMPED => run::<DAMPED, _>(system, law, motion, initial, control, grid, progress)),
        },
    }
}
