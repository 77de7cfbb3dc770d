//! The water as acoustic finite elements with an absorbing boundary, the disc in quadratic elasticity, in one factor.
//!
//! The unknowns are the disc's displacements u, a potential ψ of the water with p = ψ̇ and v = −∇ψ/ρ, and an auxiliary unknown η on the
//! absorbing hemisphere r = R. Linear 4-node elements between circles and rays, the innermost ones collapsed to triangles. With
//! Q = ∫NNᵀ/(ρc²), H = ∫∇N·∇Nᵀ/ρ, M_Γ = ∫_Γ NNᵀ, T = ∫_Γ ∂N ∂Nᵀ and the coupling A = ∫ N_z N dS over the disc's back:
//!
//! ```text
//! M ü + K u + A ψ̇ = F
//! Q ψ̈ + M_Γ ψ̇/(ρc) + (H + M_Γ/(ρR)) ψ + T η/(2ρ) − Aᵀ u̇ = 0
//! T (ψ − η/R − η̇/c)/(2ρ) = 0
//! ```
//!
//! The last two lines are the second-order condition of Bayliss & Turkel on a sphere, p_r = −(s/c + 1/R) p + Δ_Γ p/(2 (s/c + 1/R)) with
//! s = ∂/∂t: exact for outgoing spherical harmonics of order 0 and 1. The rest of the plane z = 0 is rigid (natural) or soft (ψ = 0).
//!
//! The trapezoidal rule in its midpoint form solves for the mean velocities of a step, V = ū̇, X = ψ̄̇, E = η̄̇. With the water's row negated
//! the matrix is symmetric quasi-definite (+ for V and E, − for X), so it has L D Lᵀ without pivoting in the order of least fill; it is
//! factored once. Energy is balanced to rounding: what the disc does on the water is stored there or leaves through the hemisphere.
//!
//! Both mesh and step are of second order. With a soft baffle the pressure rises from the disc's edge like a square root, which costs
//! order: halve the side.
//!
//! Bayliss & Turkel (1980), *Comm. Pure Appl. Math.* 33, 707; Everstine (1981), *J. Sound Vib.* 79, 157 (symmetric potential form).

mod assembly;
mod coupled;
mod driven;
mod factor;
mod mesh;
mod sparse;
mod waves;

pub use crate::scene::{Baffle, WaterMesh};
pub use coupled::{DiscOnWater, DiscOnWaterSettings};
pub use driven::DrivenWater;
pub(crate) use mesh::Hemisphere;
pub use sparse::Sparse;

use thiserror::Error;

use super::Water;

#[derive(Debug, Clone, PartialEq, Error)]
#[non_exhaustive]
pub enum ElementsError {
    #[error("mesh of the water: {name}: expected {expected}, found {found:e}")]
    Mesh { name: &'static str, expected: &'static str, found: f64 },
    #[error("step of the water: expected finite and > 0 s, found {found:e} s")]
    Step { found: f64 },
    #[error(
        "field point r = {radius:e} m, z = {distance:e} m: expected inside the hemisphere of {hemisphere:e} m, z ≥ 0; enlarge the \
         hemisphere or use the Rayleigh integral"
    )]
    FieldPoint { radius: f64, distance: f64, hemisphere: f64 },
    #[error("the factor of {unknowns} unknowns of disc and water does not fit ({source}); coarsen the mesh")]
    Size { unknowns: usize, source: faer::sparse::FaerError },
    #[error(transparent)]
    Disc(#[from] Box<super::disc::DiscError>),
    #[error(
        "the {unknowns} unknowns of disc and water have no factor: a pivot is zero or not a number; check materials and step"
    )]
    Singular { unknowns: usize },
}
