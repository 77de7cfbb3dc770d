//! What stands behind the last contact and is no body of the chain.

use std::ops::Range;

use super::{contact::dot, damper::DashpotBase};
use crate::{number::Number, water::loaded_disc::LoadedDisc};

/// Something behind the last contact, in one run or in several. Left as it is: nothing that moves.
pub(super) trait Backing<N: Number> {
    fn predict(&mut self) {}

    /// Add its retreat without forces to the gaps of these points of the contact (m); the dashpot's force `damping` (N) is the one last found.
    fn retreat(&self, _points: Range<usize>, _gaps: &mut [N], _damping: N) {}

    /// A lower bound of that, m; none where nothing retreats.
    fn least(&self, _damping: N) -> Option<N> {
        None
    }

    /// Where the dashpot stands under the forces of the points (N), as predicted, m.
    fn place(&self, _forces: &[N]) -> Option<N> {
        None
    }

    /// How the dashpot's foot moves under the forces of the points (N).
    fn base(&self, _forces: &[N]) -> Option<DashpotBase<N>> {
        None
    }

    /// Whether the dashpot's force moves the points of the contact.
    fn feels_dashpot(&self) -> bool {
        false
    }

    /// End the step under these forces of the points, and that of the dashpot, N.
    fn push(&mut self, _forces: &[N], _damping: N) {}
}

impl<N: Number> Backing<N> for () {}

#[derive(Debug)]
pub(super) struct Wet {
    pub(super) disc: LoadedDisc,
    /// Least retreat of the contact's points without forces at the end of the step, m.
    least: f64,
}

impl Wet {
    pub(super) fn new(disc: LoadedDisc) -> Self {
        Self { disc, least: 0.0 }
    }

    /// Energy of the disc and of what it gave to the water, J, less what the contact's own account
    /// ([`State::energy`](super::contact::State::energy)) has of it: ½ λᵀ C λ.
    pub(super) fn energy(&mut self, forces: &[f64]) -> f64 {
        let rows = self.disc.compliance().chunks_exact(forces.len()).zip(forces);
        let counted: f64 = rows.map(|(row, force)| force * dot(row, forces)).sum();
        self.disc.energies().iter().sum::<f64>() - 0.5 * counted
    }
}

impl Backing<f64> for Option<Wet> {
    fn predict(&mut self) {
        if let Some(wet) = self {
            wet.disc.predict();
            wet.least = wet.disc.predicted().iter().copied().fold(f64::INFINITY, f64::min);
        }
    }

    fn retreat(&self, points: Range<usize>, gaps: &mut [f64], damping: f64) {
        if let Some(wet) = self {
            let retreats = wet.disc.predicted().iter().skip(points.start);
            gaps.iter_mut().zip(retreats).for_each(|(gap, retreat)| *gap += retreat);
            let shares = wet.disc.coupling().iter().skip(points.start);
            gaps.iter_mut().zip(shares).for_each(|(gap, share)| *gap += share * damping);
        }
    }

    fn least(&self, damping: f64) -> Option<f64> {
        let wet = self.as_ref()?;
        let share = wet.disc.coupling().iter().fold(0.0, |least: f64, share| least.min(share * damping));
        Some(wet.least + share)
    }

    fn place(&self, forces: &[f64]) -> Option<f64> {
        self.as_ref().map(|wet| wet.disc.modes_under(forces)[0])
    }

    fn base(&self, forces: &[f64]) -> Option<DashpotBase<f64>> {
        let wet = self.as_ref()?;
        let [_, mobility] = wet.disc.mobility();
        let [_, velocity] = wet.disc.modes_under(forces);
        Some(DashpotBase { velocity, mobility })
    }

    fn feels_dashpot(&self) -> bool {
        self.as_ref().is_some_and(|wet| !wet.disc.coupling().is_empty())
    }

    fn push(&mut self, forces: &[f64], damping: f64) {
        if let Some(wet) = self {
            wet.disc.push(forces, damping);
        }
    }
}
