//! What a run produced: traces tagged by place, the energy balance, the solver's work.

mod balance;
mod field;
mod npy;
mod recorder;
mod table;
mod vtu;
mod work;

pub(crate) use balance::EnergySums;
pub use field::{Field, FieldBody, FieldError, FieldMesh};
pub use npy::write_npy;
pub(crate) use recorder::{Recorder, empty_columns, push};
pub use table::{columns, write_csv};
pub use vtu::{VtuError, write_pvd, write_vtu};
pub use work::{Preparation, SolverWork};

use serde::{Deserialize, Serialize};

use granchain_signal::Series;

/// Everything a run produced, unfiltered, positive from piston to support, all series on one time grid.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Response {
    /// Displacement of the piston, or of the striker in its place, m.
    pub piston_displacement: Series,
    /// Displacement of each bead, m.
    pub bead_displacement: Vec<Series>,
    /// Velocity of each bead, m/s.
    pub bead_velocity: Vec<Series>,
    /// Velocity of the last bead's far pole, m/s.
    pub pole_velocity: Series,
    #[serde(default)]
    pub observed: ObservedPoint,
    /// Force of each of the N + 1 contacts, N, ≥ 0 pressing.
    pub contact_force: Vec<Series>,
    /// What the scene's sensor reads of the two contacts of its bead, N.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub sensor_force: Option<Series>,
    /// Radius of each of the N + 1 contacts, m, ≥ 0, 0 where open: half the width of the pressed zone along the surface. Only where the
    /// model resolves it.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub contact_radius: Option<Vec<Series>>,
    /// What the disc at the far end and the water behind it did. Only where the scene has a disc.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub disc: Option<DiscResponse>,
    pub energy: EnergyBalance,
    /// What the run cost, in counts that do not depend on the machine.
    pub work: SolverWork,
}

/// Where on the last bead a laser looks: one definition for every model. Beads of the chain are rigid, so there both move alike.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum ObservedPoint {
    /// The far pole, of a bead that a ring holds at its side; before a disc the point that touches it.
    #[default]
    Pole,
    /// The centre, where the pole is pressed on a wall or a spring: a point that stands still as long as it is pressed tells nothing of the bead.
    Centre,
}

impl ObservedPoint {
    /// Of a bead whose far pole is pressed on a wall or a spring, or not.
    pub(crate) fn of(pole_is_pressed: bool) -> Self {
        if pole_is_pressed { Self::Centre } else { Self::Pole }
    }

    pub fn name(self) -> &'static str {
        match self {
            Self::Pole => "pole",
            Self::Centre => "centre",
        }
    }
}

impl Response {
    /// As its scene counts: a striker, the first bead of the chain that ran, in the piston's place, and what a sensor reads of its contacts.
    pub(crate) fn counted(mut self, is_struck: bool, reading: impl Fn(&[Series]) -> Option<Series>) -> Self {
        if is_struck {
            self.piston_displacement = self.bead_displacement.remove(0);
            self.bead_velocity.remove(0);
            self.contact_force.remove(0);
            self.contact_radius.as_mut().map(|radii| radii.remove(0));
        }
        self.sensor_force = reading(&self.contact_force);
        self
    }

    /// Velocity of the point of the last bead that a laser looks at, m/s: what a vibrometer's record is held against.
    pub fn observed_velocity(&self) -> &Series {
        match self.observed {
            ObservedPoint::Pole => &self.pole_velocity,
            ObservedPoint::Centre => self.bead_velocity.last().unwrap_or(&self.pole_velocity),
        }
    }
}

#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct DiscResponse {
    /// Velocity of the middle of its back, m/s.
    pub velocity: Series,
    /// Pressure at each field point of the scene, Pa, about the ambient one; none in a vacuum.
    pub pressure: Vec<Series>,
}

/// Energy that went into effects beside the dashpots, and the energy balance of a compliant horn, J.
#[derive(Debug, Clone, Copy, PartialEq, Default, Serialize, Deserialize)]
pub struct Channels {
    pub drag_j: f64,
    pub friction_j: f64,
    pub yielding_j: f64,
    /// Lost within the bodies: loss factors and relaxation.
    pub material_j: f64,
    /// Work of the source that the horn is: its free motion against the force of the first contact. The piston's work is what the chain got of it.
    pub source_work_j: f64,
    /// Energy in the horn's own motion at the end, kinetic and elastic.
    pub horn_j: f64,
    pub horn_lost_j: f64,
}

impl Channels {
    /// All that the chain lost in them, J.
    pub(crate) fn lost(&self) -> f64 {
        self.drag_j + self.friction_j + self.yielding_j + self.material_j
    }

    /// Residual of the horn's energy balance, J: source work − piston work − energy in the horn − loss in the horn.
    pub fn horn_residual(&self, piston_work_j: f64) -> f64 {
        self.source_work_j - piston_work_j - self.horn_j - self.horn_lost_j
    }
}

/// Energies at the end of the run and the works done on the way, J.
#[derive(Debug, Clone, Copy, PartialEq, Default, Serialize, Deserialize)]
pub struct EnergyBalance {
    /// Energy at the start: stored in the contacts (precompression) and kinetic, J.
    pub initial_j: f64,
    /// Work done by the piston on the chain, J.
    pub piston_work_j: f64,
    /// Kinetic energy at the end, J.
    pub kinetic_j: f64,
    /// Elastic energy in the contacts at the end, J.
    pub stored_j: f64,
    /// Energy lost in the dashpots, J, ≥ 0.
    pub dissipated_j: f64,
    /// Energy of the disc at the end, kinetic and elastic, J; where only disc and water together are known, none.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub disc_j: Option<f64>,
    /// Work done on the water, or on disc and water together, J.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub water_j: Option<f64>,
    /// What went elsewhere; none where a scene has nothing but dashpots to lose energy in.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub channels: Option<Channels>,
    /// initial + piston work − kinetic − stored − dissipated − disc − water − all losses of the channels, J: the integrator's error.
    pub residual_j: f64,
    /// Largest total energy seen, J: what the residual is to be held against.
    pub largest_j: f64,
}

/// Share of the largest energy that a run may leave unaccounted for without a warning, 1.
pub const SMALL_RESIDUAL: f64 = 0.01;

/// Share of the largest energy above which what is unaccounted for makes a run an error, 1.
pub(crate) const LARGEST_RESIDUAL: f64 = 0.1;

impl EnergyBalance {
    /// Energy unaccounted for over the largest energy, 1; 0 where nothing moved.
    pub fn residual_share(&self) -> f64 {
        if self.largest_j > 0.0 { self.residual_j / self.largest_j } else { 0.0 }
    }

    pub fn warning(&self) -> Option<String> {
        let share = self.residual_share();
        (share.abs() > SMALL_RESIDUAL).then(|| {
            let (percent, what) = (100.0 * share.abs(), if share > 0.0 { "is lost" } else { "comes from nowhere" });
            format!(
                "{percent:.1} % of the largest energy {what} in the integration: expected at most {:.0} %; shorten `model.step` or lower `model.tolerance`, \
                 and refine the mesh, until the peaks stay the same",
                100.0 * SMALL_RESIDUAL
            )
        })
    }

    pub(crate) fn is_broken(&self) -> bool {
        self.residual_share().abs() > LARGEST_RESIDUAL
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_balance_open_by_a_hundredth_is_warned_of_and_by_a_tenth_refused() {
        let open = |residual_j| EnergyBalance { residual_j, largest_j: 2.0, ..EnergyBalance::default() };
        assert_eq!(
            (open(0.02).warning(), open(-0.02).warning(), EnergyBalance::default().warning()),
            (None, None, None)
        );
        assert!(open(0.03).warning().is_some_and(|warning| warning.starts_with("1.5 % of the largest energy is lost")));
        assert!(open(-0.03).warning().is_some_and(|warning| warning.contains("comes from nowhere")));
        assert!(!open(0.2).is_broken() && !open(-0.2).is_broken() && !EnergyBalance::default().is_broken());
        for residual in [0.21, -0.21, 5.0] {
            assert!(open(residual).is_broken());
        }
    }
}
