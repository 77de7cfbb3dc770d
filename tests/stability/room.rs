//! Where a case runs on one fidelity level: scenes, runs, and what every run is held against.

use super::{Check, FidelityLevel, Limit};
use granchain::study::{
    Bodies,
    replicates::{self, Unwatched},
};
use granchain_model::{
    ModelError,
    chain::ensemble::Variation,
    fea::{
        Simulation,
        control::{Complementarity, Control, PENETRATION},
    },
    response::Response,
    scene::{self, PistonMotion, Scene},
};
use granchain_signal::{
    Series,
    feature::{FeatureError, Measurand},
};

/// Energy (J) unaccounted for over the largest that is allowed.
#[derive(Debug, Clone, Copy)]
pub(super) struct Balance {
    pub chain: f64,
    pub reduced: f64,
    /// Of the finite element analysis.
    pub fea: f64,
}

impl Balance {
    /// Of an undamped chain at the default steps.
    pub(crate) const UNDAMPED: Self = Self { chain: 1e-6, reduced: 2e-3, fea: 1e-2 };
    /// With dashpots that switch within a step.
    pub const DAMPED: Self = Self { chain: 1e-5, reduced: 2e-2, fea: 2e-2 };
    /// In front of a disc, where the chain has a fixed step: contacts switch within it.
    pub(crate) const WATER: Self = Self { chain: 1e-2, reduced: 1e-2, fea: 1e-2 };

    fn of(self, fidelity: FidelityLevel) -> f64 {
        match fidelity {
            FidelityLevel::Hertz | FidelityLevel::FiniteBody => self.chain,
            FidelityLevel::Reduced => self.reduced,
            FidelityLevel::Fea => self.fea,
        }
    }
}

/// A case on one fidelity level.
pub(super) struct Room<'a> {
    /// Overrides of every scene that uses their keys.
    overrides: &'a [String],
    pub fidelity: FidelityLevel,
    pub checks: Vec<Check>,
    bodies: &'a Bodies,
}

impl<'a> Room<'a> {
    pub fn new(overrides: &'a [String], fidelity: FidelityLevel, bodies: &'a Bodies) -> Self {
        Self { overrides, fidelity, checks: Vec::new(), bodies }
    }

    /// A built-in scene on this fidelity level, changed as `sets` says.
    pub fn scene(&self, name: &str, sets: &[&str]) -> Result<Scene, String> {
        let fidelity: &[&str] = match self.fidelity {
            FidelityLevel::Hertz => &["model.kind=chain", "contact.law=hertz"],
            FidelityLevel::FiniteBody => &["model.kind=chain", "contact.law=finite-body"],
            FidelityLevel::Reduced => &["model.kind=reduced"],
            FidelityLevel::Fea => &["model.kind=fea"],
        };
        let text = |set: &&str| (*set).to_owned();
        let requested: Vec<String> = fidelity.iter().chain(sets).map(text).collect();
        let all = [&requested[..], self.overrides].concat();
        scene::load(name, &all).map_err(|error| error.to_string())
    }

    /// Run a scene with its own drive.
    pub fn run(&self, scene: &Scene) -> Result<Ran, String> {
        self.run_with(scene, scene.drive.motion(scene.amplitude_scale).as_ref())
    }

    /// Run a scene with the piston moving as `motion`.
    pub fn run_with(&self, scene: &Scene, motion: &dyn PistonMotion) -> Result<Ran, String> {
        if self.fidelity == FidelityLevel::Fea {
            return self.analyse(scene, motion).map_err(|error| error.to_string());
        }
        let prepared = self.bodies.prepared(scene).map_err(|error| error.to_string())?;
        let response = prepared.run_with(scene, motion, &mut |_| true).map_err(|error| error.to_string())?;
        Ok(Ran { response, contacts: None })
    }

    /// Run perturbed copies of a scene; one that failed leaves its reason.
    pub fn replicates<T: Send>(
        &self,
        scene: &Scene,
        variations: &[Variation],
        steps_per_period: u32,
        see: impl Fn(usize, &Series) -> Result<T, FeatureError> + Sync,
    ) -> Result<Vec<Result<T, String>>, String> {
        replicates::run(self.bodies, scene, variations, steps_per_period, Measurand::Velocity, &Unwatched, see)
            .map_err(|error| error.to_string())
    }

    fn analyse(&self, scene: &Scene, motion: &dyn PistonMotion) -> Result<Ran, ModelError> {
        let mut simulation = Simulation::with_motion(scene, Box::new(motion), Control::default())?;
        while !simulation.is_done() {
            simulation.advance()?;
        }
        Ok(Ran { response: simulation.response(), contacts: Some(simulation.complementarity()) })
    }

    pub fn check(&mut self, criterion: impl Into<String>, measured: f64, limit: Limit, unit: &'static str) {
        self.keep(criterion.into(), Some(measured), limit, unit, None);
    }

    /// Note what a run lost (J), which is of the piston's work and no more of it than there is.
    pub fn lost(&mut self, which: &str, lost: f64, ran: &Ran) {
        let share = lost / ran.response.energy.piston_work_j;
        for limit in [Limit::AtMost(1.02), Limit::AtLeast(0.0)] {
            self.check(format!("{which}: lost over the piston’s work"), share, limit, "1");
        }
    }

    /// Note that a run that should have worked did not.
    pub fn failed(&mut self, which: &str, reason: String) {
        self.keep(format!("{which}: runs to its end"), None, Limit::AtLeast(1.0), "1", Some(reason));
    }

    /// Note a refusal that is the right answer: its message names what to change.
    pub fn refused(&mut self, which: &str, reason: String, names: &str) {
        let named = f64::from(u8::from(reason.contains(names)));
        self.keep(format!("{which}: refused, naming {names}"), Some(named), Limit::AtLeast(1.0), "1", Some(reason));
    }

    fn keep(
        &mut self,
        criterion: String,
        measured: Option<f64>,
        limit: Limit,
        unit: &'static str,
        note: Option<String>,
    ) {
        let holds = measured.is_some_and(|measured| limit.holds(measured));
        let fidelity = self.fidelity;
        self.checks.push(Check { fidelity, criterion, measured, limit, unit, holds, note });
    }

    /// What every run is held against: finite numbers, a balance of energy, no pull, no penetration.
    pub fn sound(&mut self, which: &str, ran: &Ran, balance: Balance) {
        let response = &ran.response;
        let all = || {
            let of_beads = response.bead_displacement.iter().chain(&response.bead_velocity);
            let of_disc = response.disc.iter().flat_map(|disc| disc.pressure.iter().chain([&disc.velocity]));
            of_beads.chain(&response.contact_force).chain(of_disc).flat_map(|series| &series.values)
        };
        let void = all().filter(|value| !value.is_finite()).count();
        self.check(format!("{which}: samples that are not finite"), void as f64, Limit::AtMost(0.0), "1");
        let energy = &response.energy;
        let missing = (energy.residual_j / energy.largest_j.max(f64::MIN_POSITIVE)).abs();
        self.check(
            format!("{which}: energy unaccounted for over the largest"),
            missing,
            Limit::AtMost(balance.of(self.fidelity)),
            "1",
        );
        let forces = || response.contact_force.iter().flat_map(|force| &force.values);
        let peak = forces().copied().fold(f64::MIN_POSITIVE, f64::max);
        let pull = -forces().copied().fold(0.0, f64::min) / peak;
        self.check(format!("{which}: largest pull over the largest push"), pull, Limit::AtMost(0.0), "1");
        if let Some(contacts) = ran.contacts {
            let deepest = contacts.penetration_m;
            self.check(format!("{which}: deepest penetration of a point"), deepest, Limit::AtMost(PENETRATION), "m");
        }
    }
}

pub(super) struct Ran {
    pub response: Response,
    /// Of the finite element analysis.
    pub contacts: Option<Complementarity>,
}

impl Ran {
    /// Velocity of the last bead, m/s.
    pub fn last(&self) -> &[f64] {
        self.response.bead_velocity.last().map_or(&[], |series| &series.values)
    }
}

/// rms of the difference of two traces of one length over the rms of the second, 1.
pub(super) fn difference(one: &[f64], other: &[f64]) -> f64 {
    let square = |sum: f64, value: f64| sum + value * value;
    let apart = one.iter().zip(other).map(|(a, b)| a - b).fold(0.0, square);
    if one.len() == other.len() { (apart / other.iter().copied().fold(0.0, square)).sqrt() } else { f64::NAN }
}
