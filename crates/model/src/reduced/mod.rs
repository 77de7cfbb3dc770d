//! The contact finite element analysis reduced to a few modes a body, at the cost of a chain.
//!
//! Bodies, meshes and contacts are those of [`super::fea`]. Each body keeps its rigid translation, its lowest free modes and, as static
//! flexibility of its massless contact nodes, everything else (`basis`):
//!
//! ```text
//! m Z̈ = F,    q̈_k + ω_k² q_k = φ_bkᵀ f_b
//! g = g⁰ − Bᵀ (1 Z + Σ φ_b q) + W λ,    g ≥ 0, λ ≥ 0, λ g = 0,    W = Bᵀ R B
//! ```
//!
//! Stepped by kick, drift, kick (velocity Verlet) with modal masses μ_k = 1/sinc²(ω_k h/2), which makes both the frequency of a mode and its
//! static flexibility exact at any step with ω h ≤ 2 (after Gautschi 1961, *Numer. Math.* 3, 381). The contacts are quasi-static in Z and
//! q, so that the whole is symplectic; dashpots act on the rigid motions, implicit in the second kick.
//!
//! Left out: the inertia of the modes not kept. Massless-boundary component mode synthesis: Monjaraz Tec, Gross, Krack (2022), *J. Sound
//! Vib.*, arXiv 2111.07693.

mod array;
mod backing;
pub(crate) mod basis;
mod cache;
mod chain;
mod contact;
mod damper;
mod equilibrium;
mod losses;
mod mechanics;
mod motion;
mod rank;
mod record;
pub(crate) mod reduction;
mod run;
mod stepping;

pub use cache::{Cache, Origin};
pub use reduction::Reduction;
pub(crate) use run::{FEWEST_TOGETHER, MOST_TOGETHER, can_run_together};
