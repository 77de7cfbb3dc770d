//! Static loads, on a body that is held and on one that is not.

use super::{Factor, FactorError, Half, symmetric};
use crate::fea::{
    assembly::{Columns, Direction, DofMap},
    body::Body,
};

/// The static factor of a body.
///
/// A clamped body: u = K⁻¹ f. A free body under a load of resultant F = Σ f_z is accelerated as a whole (inertia relief):
///
/// ```text
/// K u = f − F M 1 / m,     ∫ρ u_z dV = 0
/// ```
///
/// which has one solution: the displacement relative to the mass-mean motion. It is found with one unknown pinned, where the balanced load
/// leaves no reaction, and shifted to zero mean.
#[derive(Debug, Clone)]
pub struct StaticFactor {
    factor: Factor,
    /// By nodes, M 1 / m; none for a clamped body.
    share: Option<Vec<f64>>,
    axial: Vec<u32>,
}

impl StaticFactor {
    /// Factor K.
    ///
    /// - `interface`: unknowns 2 n + d of the interface, as in [`Factor::new`]
    pub fn new(body: &Body, interface: &[u32]) -> Result<Self, FactorError> {
        let axial: Vec<u32> =
            body.dofs().free().iter().copied().filter(|&dof| DofMap::place(dof).1 == Direction::Axial).collect();
        let (pinned, share) = if body.is_free() {
            let taken: std::collections::BTreeSet<u32> = interface.iter().copied().collect();
            // Any will do; heavy ones lie inside.
            let weight = |dof: &u32| body.node_mass()[(dof / 2) as usize];
            let pinned =
                axial.iter().copied().filter(|dof| !taken.contains(dof)).max_by(|a, b| weight(a).total_cmp(&weight(b)));
            (pinned, Some(body.node_mass().iter().map(|mass| mass / body.total_mass()).collect()))
        } else {
            (None, None)
        };
        let factor = Factor::without(body, 1.0, 0.0, interface, pinned)?;
        Ok(Self { factor, share, axial })
    }

    /// The factor of K without the pinned unknown.
    pub fn factor(&self) -> &Factor {
        &self.factor
    }

    /// Static displacement of each column of `load` (N); of a free body relative to its mass mean, under inertia relief. `load` becomes the
    /// balanced load; `half` is work space of [`Factor::half`].
    pub fn solve(&self, load: &mut Columns, half: &mut Half, u: &mut Columns) {
        let Some(share) = &self.share else { return self.factor.solve(load, half, u) };
        let width = load.width();
        for column in 0..load.count() {
            let resultant: f64 = self.axial.iter().map(|&dof| load.as_slice()[dof as usize * width + column]).sum();
            for &dof in &self.axial {
                load.as_mut_slice()[dof as usize * width + column] -= resultant * share[(dof / 2) as usize];
            }
        }
        self.factor.solve(load, half, u);
        for column in 0..u.count() {
            let mean: f64 = self
                .axial
                .iter()
                .map(|&dof| share[(dof / 2) as usize] * u.as_slice()[dof as usize * width + column])
                .sum();
            for &dof in &self.axial {
                u.as_mut_slice()[dof as usize * width + column] -= mean;
            }
        }
    }

    /// Static compliance of the interface, m/N, dense and symmetric, row by row: column j is the displacement of the interface under a unit force on its
    /// unknown j; of a free body relative to the mass mean, under inertia relief. With the pinned inverse G and s = M 1 / m, a_i = 1 along z and else 0,
    ///
    /// ```text
    /// S_ij = G_ij − a_j g_i − a_i g_j + a_i a_j sᵀ g,     g = G s
    /// ```
    ///
    /// so that one solve does for all columns.
    pub fn interface_compliance(&self, body: &Body) -> Vec<f64> {
        let held = self.factor.interface_compliance();
        let Some(share) = &self.share else { return held };
        let (mut load, mut u, mut half) = (body.columns(1), body.columns(1), self.factor.half(1));
        self.axial.iter().for_each(|&dof| load.set(dof as usize, 0, share[(dof / 2) as usize]));
        self.factor.solve(&load, &mut half, &mut u);
        let at = |dof: u32| u.get(dof as usize, 0);
        let all: f64 = self.axial.iter().map(|&dof| share[(dof / 2) as usize] * at(dof)).sum();
        let interface = self.factor.interface();
        let along = |k: usize| f64::from(u8::from(DofMap::place(interface[k]).1 == Direction::Axial));
        symmetric(interface.len(), |i, j| {
            let (a, b) = (along(i), along(j));
            held[i * interface.len() + j] - b * at(interface[i]) - a * at(interface[j]) + a * b * all
        })
    }
}
