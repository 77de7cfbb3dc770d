//! The water as a baffled Rayleigh integral over the disc, in the disc's modes: no mesh of the water.
//!
//! The back moves with v(r, t) = Σ_k φ_k(r) v_k(t), a rigid plane around it. With R the distance from a point of the disc,
//!
//! ```text
//! p(x, t) = ρ/(2π) ∫ v̇(x′, t − R/c)/R dS′                       pressure anywhere in the half-space, Pa
//! F_j = ∫ φ_j p dS = ρ ∫₀^{2a/c} H_jk(τ) v̇_k(t − τ) dτ           force of the disc's mode j on the water
//! H_jk(τ) = (c/2π) ∫ φ_j(x) [∫ φ_k dθ on the circle of radius cτ about x] dS
//! ```
//!
//! Integrated by parts the force is −ρ (H(0) v + H′ * v) on the disc: a plane wave at once, H(0) = c ∫ φ_j φ_k dS, and a memory that
//! ends after the sound has crossed the disc. H is c times the correlation of the two shapes over the disc at the lag cτ; on the axis the
//! integral for p needs no quadrature over angles, dS/R = 2π dR ([`field`]).
//!
//! [`radiation`] has H and what follows from it: impedance, added mass; [`motion`] the disc in its modes on the water, in time and in
//! frequency. With a soft baffle the pressure beside the disc vanishes instead of the velocity: the known velocity then gives no explicit
//! integral for the pressure (a hypersingular equation on the disc does), so that case belongs to the acoustic elements alone.
//!
//! Rayleigh (1896), *The Theory of Sound*, §278; Stepanishen (1971), *J. Acoust. Soc. Am.* 49, 1629 and 841.

pub mod field;
pub mod instant;
mod memory;
pub mod motion;
pub mod radiation;
