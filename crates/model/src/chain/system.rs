//! The chain as the integrators see it: masses, stiffnesses and rest positions in flat, padded arrays.

use super::{
    InitialState,
    coupling::{Coupling, Survey},
    effects::{self, Effects},
    finite_body::FiniteBodyLaws,
    laws::ContactLaws,
};
use crate::{
    ModelError,
    contact_law::{Dashpot, ElasticLaw, Law, dashpots, foundation},
    scene::{DampingTerm, Limits, Scene},
};

/// The assembled chain.
///
/// Contact i (0 at the piston, N at the support) lies between slot i and slot i + 1 of the state: slot 0 is the piston, slots
/// 1…N the beads, slot N + 1 the fixed wall. Its overlap is δ_i = `offset`_i + u_i − u_{i+1}.
#[derive(Debug, Clone)]
pub(super) struct System {
    pub beads: usize,
    /// Length of every array below and of a block of the state: N + 2 rounded up to a multiple of four.
    pub padded: usize,
    /// Mass of the bead in each slot, kg; 0 where there is none.
    pub mass: Vec<f64>,
    /// 1/m, 1/kg; 0 where there is no bead.
    pub inverse_mass: Vec<f64>,
    /// Overlap of each contact with all displacements zero, m; −∞ in the padding.
    pub offset: Vec<f64>,
    pub laws: Vec<Law>,
    pub dashpots: Vec<Dashpot>,
    pub tension: bool,
    /// Smallest of the natural times of the contacts, s: (m²/k²v)^(1/5) or √(m/k).
    pub natural_time: f64,
    /// Static force of each contact, N: the precompression F₀ and the weight of the beads before it that rest.
    pub static_force: Vec<f64>,
    /// How the contacts of finite bodies feel one another; none with the law of Hertz.
    pub coupling: Option<Coupling>,
    /// Effects beside contacts and dashpots; none where the scene has none.
    pub effects: Option<Effects>,
}

impl System {
    /// Assemble the scene's chain; `fitted` are the laws of its bodies where it asks for such and they are known already.
    pub(crate) fn new(scene: &Scene, fitted: Option<&FiniteBodyLaws>) -> Result<Self, ModelError> {
        scene.validate()?;
        let scene = &*scene.with_striker();
        let chain = &scene.chain;
        let beads = chain.beads.len();
        let padded = (beads + 2).next_multiple_of(4);
        let mut mass = vec![0.0; padded];
        for (slot, bead) in mass[1..].iter_mut().zip(&chain.beads) {
            *slot = bead.mass();
        }
        let inverse_mass = mass.iter().map(|&m| if m > 0.0 { 1.0 / m } else { 0.0 }).collect();
        let ContactLaws { mut laws, couplings } = ContactLaws::of(scene, fitted)?;
        effects::tilt(scene, &mut laws);
        let coupling = couplings.map(|beads| Coupling::new(&laws, &beads, padded));
        let mut static_force = vec![chain.precompression; beads + 1];
        let resting = if scene.is_struck() { 2 } else { 1 };
        for contact in (resting..=beads).filter(|_| chain.gravity > 0.0) {
            static_force[contact] = static_force[contact - 1] + chain.gravity * mass[contact];
        }
        let mut offset: Vec<f64> = laws
            .iter()
            .zip(&static_force)
            .zip(scene.gaps())
            .map(|((law, force), gap)| law.overlap(*force) - gap)
            .collect();
        if let Some(coupling) = &coupling {
            let moved = |contact: usize| coupling.under(contact, chain.precompression);
            offset.iter_mut().enumerate().for_each(|(contact, offset)| *offset += moved(contact));
        }
        let mut dashpots = dashpots(&scene.damping, beads + 1);
        if let (Some((_, own)), Some(last)) = (foundation(&chain.beads[beads - 1], &scene.support), dashpots.last_mut())
        {
            for term in DampingTerm::ALL {
                last.coefficients[term] += own.coefficients[term];
            }
        }
        offset.resize(padded, f64::NEG_INFINITY);
        Ok(Self {
            beads,
            padded,
            mass,
            inverse_mass,
            offset,
            natural_time: 0.0,
            static_force,
            dashpots,
            tension: scene.damping.tension,
            effects: Effects::of(scene, &laws, coupling.is_some())?,
            laws,
            coupling,
        })
    }

    /// Room for displacements and velocities of an instant, and for what effects have behind them.
    pub(crate) fn moment(&self) -> Vec<[f64; 4]> {
        let behind = if self.effects.is_some() { 1 + effects::FURTHER / 4 } else { 0 };
        vec![[0.0; 4]; self.padded / 2 + behind]
    }

    pub(crate) fn damped_contacts(&self) -> u64 {
        self.dashpots.iter().filter(|dashpot| !dashpot.is_absent()).count() as u64
    }

    /// Set the natural time for motions with velocities of order `velocity` (m/s).
    pub(crate) fn set_natural_time(&mut self, velocity: f64) {
        let lightest = self.mass[1..=self.beads].iter().copied().fold(f64::INFINITY, f64::min);
        self.natural_time = self
            .laws
            .iter()
            .zip(&self.static_force)
            .map(|(law, force)| {
                let static_time = (lightest / law.tangent_stiffness(law.overlap(*force))).sqrt();
                let moving = match law {
                    Law::Hertz(hertz) => (lightest / hertz.stiffness).powi(2) / velocity,
                    Law::FiniteHertz(law) => (lightest / law.stiffness).powi(2) / velocity,
                    Law::Annulus(_) | Law::Spring(_) | Law::HertzOnSpring(_) => {
                        (lightest / law.tangent_stiffness(1e-6)).powf(2.5)
                    }
                };
                static_time.min(moving.powf(0.2))
            })
            .fold(f64::INFINITY, f64::min);
    }

    /// Refuse a dashpot that is far faster than the contacts: with the natural time T of motions of order `velocity` (m/s), and d = c + γ √δ at an
    /// overlap δ of order `velocity` T over the static one, 4 d/m T is the stiffness ratio.
    pub(crate) fn refuse_stiffness(&self, velocity: f64, limits: &Limits) -> Result<(), ModelError> {
        let lightest = self.mass[1..=self.beads].iter().copied().fold(f64::INFINITY, f64::min);
        for (contact, (dashpot, law)) in self.dashpots.iter().zip(&self.laws).enumerate() {
            let overlap = law.overlap(self.static_force[contact]) + velocity * self.natural_time;
            let coefficient = dashpot.resistance(overlap.sqrt());
            let (ratio, limit) = (4.0 * coefficient / lightest * self.natural_time, limits.stiffness);
            if ratio > limit {
                return Err(ModelError::StiffDashpot { contact: contact + 1, coefficient, ratio, limit });
            }
        }
        Ok(())
    }

    /// Elastic energy of every contact at the state's overlaps, J.
    pub(crate) fn stored_energy(&self, displacement: &[f64]) -> f64 {
        if let Some(coupling) = &self.coupling {
            let mut survey = Survey::new(self.padded);
            self.survey(coupling, displacement, &mut survey);
            return coupling.energy(&self.laws, &survey.overlap, &survey.force);
        }
        (0..=self.beads).map(|i| self.laws[i].energy(self.overlap(i, displacement))).sum()
    }

    pub(crate) fn kinetic_energy(&self, velocity: &[f64]) -> f64 {
        self.mass.iter().zip(velocity).map(|(m, v)| 0.5 * m * v * v).sum()
    }

    /// δ_i, m.
    pub(crate) fn overlap(&self, contact: usize, displacement: &[f64]) -> f64 {
        self.offset[contact] + displacement[contact] - displacement[contact + 1]
    }

    /// Overlaps and elastic forces of coupled contacts at a state's displacements.
    pub(crate) fn survey(&self, coupling: &Coupling, displacement: &[f64], survey: &mut Survey) {
        for contact in 0..=self.beads {
            survey.rigid[contact] = self.overlap(contact, displacement);
        }
        let Survey { rigid, overlap, force, .. } = survey;
        coupling.settle(rigid, &coupling.all, overlap, force);
    }

    /// Displacements and velocities of `initial`, with the piston's and the wall's slots at zero.
    pub(crate) fn initial_blocks(&self, initial: &InitialState) -> Result<(Vec<f64>, Vec<f64>), ModelError> {
        let block = |values: &[f64], quantity: &'static str| {
            if values.len() != self.beads {
                return Err(ModelError::Count { quantity, expected: self.beads, found: values.len() });
            }
            if let Some(&found) = values.iter().find(|value| !value.is_finite()) {
                return Err(ModelError::Unphysical { quantity: quantity.into(), expected: "finite numbers", found });
            }
            let mut block = vec![0.0; self.padded];
            block[1..=self.beads].copy_from_slice(values);
            Ok(block)
        };
        Ok((block(&initial.displacements, "displacements")?, block(&initial.velocities, "velocities")?))
    }
}
