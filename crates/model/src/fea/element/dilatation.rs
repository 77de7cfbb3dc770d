//! The change of volume of a nearly incompressible element, held to a linear field.
//!
//! ```text
//! θ = ∂u_r/∂r + u_r/r + ∂u_z/∂z,   θ̄ = Pᵀ G⁻¹ H u,   G = ∫ P Pᵀ dV,   H = ∫ P (θ of every shape function) dV
//! K_e = ∫ Bᵀ (D − κ m mᵀ) B dV + κ Hᵀ G⁻¹ H,   m = (1, 1, 1, 0),   κ = E/(3(1 − 2ν))
//! ```
//!
//! P = (1, ξ, η) on the quadrilateral, which with its eight displacement nodes fulfils the inf–sup condition, and P = 1 on the triangle. A
//! constant or linear change of volume is represented exactly, so the patch test holds.
//!
//! Simo, Taylor & Pister (1985), *Comput. Methods Appl. Mech. Engrg* 51, 177; Hughes (2000), *The Finite Element Method*, ch. 4.

use nalgebra::{Matrix3, SMatrix, SVector};

use crate::fea::mesh::Shape;

pub(super) struct Dilatation {
    shape: Shape,
    gram: Matrix3<f64>,
    moments: SMatrix<f64, 3, 16>,
}

impl Dilatation {
    pub(crate) fn new(shape: Shape) -> Self {
        let mut gram = Matrix3::zeros();
        if shape == Shape::Triangle6 {
            // No linear part: rows of zero moments.
            (gram[(1, 1)], gram[(2, 2)]) = (1.0, 1.0);
        }
        Self { shape, gram, moments: SMatrix::zeros() }
    }

    fn basis(&self, xi: f64, eta: f64) -> SVector<f64, 3> {
        match self.shape {
            Shape::Quadrilateral8 => SVector::from([1.0, xi, eta]),
            Shape::Triangle6 => SVector::from([1.0, 0.0, 0.0]),
        }
    }

    /// One integration point: its place, its volume (m³), the strains of all unknowns there.
    pub(crate) fn add(&mut self, xi: f64, eta: f64, volume: f64, strain: &[[f64; 4]; 16]) {
        let basis = self.basis(xi, eta);
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
    pub(crate) fn of(&self, displacement: &[[f64; 2]]) -> impl Fn(f64, f64) -> f64 + '_ {
        let all = SVector::<f64, 16>::from_fn(|k, _| displacement.get(k / 2).map_or(0.0, |u| u[k % 2]));
        let coefficients = self.coefficients() * all;
        move |xi, eta| self.basis(xi, eta).dot(&coefficients)
    }
}
