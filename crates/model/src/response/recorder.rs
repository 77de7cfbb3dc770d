//! What every stepper records at the samples.

use serde::{Deserialize, Serialize};

use super::{EnergyBalance, ObservedPoint, Response, SolverWork};
use granchain_signal::Series;

/// One column a place: of the piston (m), the beads (m, m/s) and the contacts (N; m, where the model resolves them).
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub(crate) struct Recorder {
    pub(crate) piston: Vec<f64>,
    pub(crate) displacement: Vec<Vec<f64>>,
    pub(crate) velocity: Vec<Vec<f64>>,
    pub(crate) force: Vec<Vec<f64>>,
    pub(crate) radius: Vec<Vec<f64>>,
}

impl Recorder {
    /// Columns with room for the samples; `resolves` says whether the model knows the radii of its contacts.
    pub(crate) fn new(samples: usize, beads: usize, resolves: bool) -> Self {
        let columns = |count: usize| empty_columns(count, samples);
        Self {
            piston: Vec::with_capacity(samples),
            displacement: columns(beads),
            velocity: columns(beads),
            force: columns(beads + 1),
            radius: columns(if resolves { beads + 1 } else { 0 }),
        }
    }

    /// `pole`: velocity of the last bead's far pole, m/s; none where it is that of the rigid bead.
    pub(crate) fn response(
        self,
        output_step: f64,
        pole: Option<Vec<f64>>,
        observed: ObservedPoint,
        energy: EnergyBalance,
        work: SolverWork,
    ) -> Response {
        let series = |values: Vec<f64>| Series::new(0.0, output_step, values);
        let all = |columns: Vec<Vec<f64>>| columns.into_iter().map(series).collect::<Vec<_>>();
        let pole = pole.or_else(|| self.velocity.last().cloned());
        Response {
            piston_displacement: series(self.piston),
            bead_displacement: all(self.displacement),
            bead_velocity: all(self.velocity),
            pole_velocity: series(pole.unwrap_or_default()),
            observed,
            contact_radius: (!self.radius.is_empty()).then(|| all(self.radius)),
            contact_force: all(self.force),
            sensor_force: None,
            disc: None,
            energy,
            work,
        }
    }
}

/// Each with room of its own: a copy of an empty vector has none.
pub(crate) fn empty_columns<N>(count: usize, samples: usize) -> Vec<Vec<N>> {
    (0..count).map(|_| Vec::with_capacity(samples)).collect()
}

/// One value to the end of every column.
pub(crate) fn push<N>(columns: &mut [Vec<N>], values: impl IntoIterator<Item = N>) {
    columns.iter_mut().zip(values).for_each(|(column, value)| column.push(value));
}
