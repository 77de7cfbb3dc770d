//! Elements of axisymmetric linear elasticity: 8-node quadrilaterals.
//!
//! Strain and stress have four components in the order (rr, zz, θθ, rz), the shear strain being γ_rz = 2 ε_rz:
//!
//! ```text
//! ε = (∂u_r/∂r, ∂u_z/∂z, u_r/r, ∂u_r/∂z + ∂u_z/∂r),   σ = D ε,   dV = 2π r |J| dξ dη
//! K_e = ∫ Bᵀ D B dV,   M_e = ∫ ρ N Nᵀ dV  (one scalar matrix for both directions)
//! ```
//!
//! Integration: 3 × 3 Gauss points. They integrate the volume and the nodal forces of a constant stress exactly, curved sides included, so
//! the patch test holds to rounding and the mass is that of the meshed volume.
//!
//! Nearly incompressible material, ν > 0.45: the change of volume is held to a linear field in each element, else it would
//! lock; below, that would gain nothing.
//!
//! Hughes (2000), *The Finite Element Method*, ch. 2 and 3; Zienkiewicz & Taylor (2000), *The Finite Element Method*, vol. 1, ch. 5 and 8.

mod dilatation;
mod matrix;
mod quadrature;
mod shape;
mod stress;

pub use matrix::{ElementError, elasticity};

pub(crate) use matrix::ElementMatrices;
pub(crate) use quadrature::GAUSS_LINE;
pub use quadrature::rule;
pub use shape::{Interpolation, edge, interpolate};
pub(crate) use stress::node_stress;
pub use stress::von_mises;
