//! A body in a few modes and its static flexibility.
//!
//! With the rigid translation Z, m free modes φ_k of frequency ω_k and the residual flexibility of all others, the interface moves as
//!
//! ```text
//! u_b = 1 Z + Σ_k φ_bk q_k + R f_b,        R = S − Σ_k φ_bk φ_bkᵀ / ω_k²
//! ```
//!
//! - S: static compliance of the interface, m/N; of a free body relative to its mass mean, under inertia relief
//! - f_b: forces on the interface, N
//!
//! The contact nodes carry no mass, so nothing of them is lost by leaving out modes: the static answer is exact for every m.

use crate::fea::{
    FeaError,
    arrangement::Arrangement,
    assembly::{Direction, DofMap},
    factor::StaticFactor,
    modes::modes,
};

#[derive(Debug, Clone, PartialEq)]
pub(crate) struct Basis {
    pub mass: f64,
    pub is_free: bool,
    /// ω² of every elastic mode kept, 1/s², ascending.
    pub stiffness: Vec<f64>,
    /// Mode by mode, its displacement of every interface unknown, 1/√kg.
    pub shapes: Vec<Vec<f64>>,
    /// S row by row, m/N.
    pub compliance: Vec<f64>,
    /// Which interface unknowns lie along z.
    pub axial: Vec<bool>,
}

impl Basis {
    /// Reduce a kind of body to its interface and `most` elastic modes.
    pub(crate) fn new(
        arrangement: &Arrangement,
        kind: usize,
        interface: &[u32],
        most: usize,
    ) -> Result<Self, FeaError> {
        let body = &arrangement.kinds[kind];
        let factor = StaticFactor::new(body, interface).map_err(|source| arrangement.factor_error(kind, source))?;
        let compliance = factor.interface_compliance(body);
        drop(factor);
        let rigid = usize::from(body.is_free());
        let (mut stiffness, mut shapes) = (Vec::new(), Vec::new());
        if most > 0 {
            let found = modes(body, most + rigid).map_err(|source| arrangement.modes_error(kind, source))?;
            for (frequency, shape) in found.frequencies.iter().zip(&found.shapes).skip(rigid) {
                let angular = 2.0 * std::f64::consts::PI * frequency;
                stiffness.push(angular * angular);
                shapes.push(interface.iter().map(|&unknown| shape[unknown as usize]).collect());
            }
        }
        let axial = interface.iter().map(|&unknown| DofMap::place(unknown).1 == Direction::Axial).collect();
        Ok(Self { mass: body.total_mass(), is_free: body.is_free(), stiffness, shapes, compliance, axial })
    }
}
