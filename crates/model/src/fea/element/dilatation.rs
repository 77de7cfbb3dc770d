//! The change of volume of a nearly incompressible element, held to a linear field.
//!
//! ```text
//! θ = ∂u_r/∂r + u_r/r + ∂u_z/∂z,   θ̄ = Pᵀ G⁻¹ H u,   G = ∫ P Pᵀ dV,   H = ∫ P (θ of every shape function) dV
//! K_e = ∫ Bᵀ (D − κ m mᵀ) B dV + κ Hᵀ G⁻¹ H,   m = (1, 1, 1, 0),   κ = E/(3(1 − 2ν))
//! ```
//!
//! P = (1, ξ, η), which with the eight displacement nodes fulfils the inf–sup condition. A constant or linear change of volume is
//! represented exactly, so the patch test holds.
//!
//! Simo, Taylor & Pister (1985), *Comput. Methods Appl. Mech. Engrg* 51, 177; Hughes (2000), *The Finite Element Method*, ch. 4.

use nalgebra::{Matrix3, SMatrix, SVector};

pub(super) struct Dilatation {
    gram: Matrix3<f64>,
    moments: SMatrix<f64, 3, 16>,
}

impl Dilatation {
    pub(crate) fn new() -> Self {
        Self { gram: Matrix3::zeros(), moments: SMatrix::zeros() }
    }

    /// One integration point: its place, its volume (m³), the strains of all unknowns there.
    pub(crate) fn add(&mut self, xi: f64, eta: f64, volume: f64, strain: &[[f64; 4]; 16]) {
        let basis = SVector::from([1.0, xi, eta]);
        self.gram += volume * basis * basis.transpose();
        let change = SMatrix::<f64, 1, 16>::from_fn(|_, k| strain[k][0] + strain[k][1] + strain[k][2]);
        self.moments += volume * basis * change;
    }

    /// G⁻¹ H: coefficients of θ̄ for unit displacements.
    fn coefficients(&self) -> SMatrix<f64, 3, 16> {
        // Positive definite: a sum over the points of an element whose Jacobian is positive.
        self.gram.cholesky().map_or_else(SMatrix::zeros, |factor| factor.solve(&self.moments))
    }

    /// Hᵀ G⁻¹ H, m.
    pub(crate) fn stiffness(&self) -> SMatrix<f64, 16, 16> {
        self.moments.transpose() * self.coefficients()
    }

    /// θ̄ as a function of place, for the displacements u_r, u_z of the nodes (m).
    pub(crate) fn of(&self, displacement: &[[f64; 2]; 8]) -> impl Fn(f64, f64) -> f64 + use<> {
        let all = SVector::<f64, 16>::from_fn(|k, _| displacement[k / 2][k % 2]);
        let coefficients = self.coefficients() * all;
        move |xi, eta| SVector::from([1.0, xi, eta]).dot(&coefficients)
    }
}
