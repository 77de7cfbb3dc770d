//! Energy of a run, step by step: initial + piston work = kinetic + stored + dissipated + lost in other channels + residual.

use serde::{Deserialize, Serialize};

use super::{Channels, EnergyBalance};

/// Energies (J) as every stepper keeps them.
#[derive(Debug, Clone, Copy, PartialEq, Default, Serialize, Deserialize)]
pub(crate) struct EnergySums {
    pub(crate) initial: f64,
    pub(crate) piston_work: f64,
    pub(crate) dissipated: f64,
    pub(crate) kinetic: f64,
    pub(crate) stored: f64,
    /// Largest energy so far, of all that the piston's work went into.
    pub(crate) largest: f64,
    /// What went elsewhere; none where the scene has nothing of the kind.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub(crate) channels: Option<Channels>,
}

impl EnergySums {
    /// At the start, with the energies (kinetic, stored).
    pub(crate) fn starting((kinetic, stored): (f64, f64), channels: Option<Channels>) -> Self {
        let initial = kinetic + stored;
        Self { initial, kinetic, stored, largest: initial, channels, ..Self::default() }
    }

    pub(crate) fn step(&mut self, piston_work: f64, dissipated: f64) {
        self.piston_work += piston_work;
        self.dissipated += dissipated;
    }

    /// The energies (kinetic, stored) now.
    pub(crate) fn hold(&mut self, (kinetic, stored): (f64, f64)) {
        (self.kinetic, self.stored) = (kinetic, stored);
    }

    /// Lost in other channels than the dashpots.
    pub(crate) fn lost(&self) -> f64 {
        self.channels.map_or(0.0, |channels| channels.lost())
    }

    /// Remember the energy that must be there now, if it is the largest.
    pub(crate) fn note(&mut self) {
        self.largest = self.largest.max(self.initial + self.piston_work - self.dissipated - self.lost());
    }

    pub(crate) fn residual(&self) -> f64 {
        self.initial + self.piston_work - self.kinetic - self.stored - self.dissipated - self.lost()
    }

    pub(crate) fn balance(&self) -> EnergyBalance {
        EnergyBalance {
            initial_j: self.initial,
            piston_work_j: self.piston_work,
            kinetic_j: self.kinetic,
            stored_j: self.stored,
            dissipated_j: self.dissipated,
            disc_j: None,
            water_j: None,
            channels: self.channels,
            residual_j: self.residual(),
            largest_j: self.largest,
        }
    }
}
