//! Words of the keys' choices, and when keys have an effect.

use super::key::When::{self, Is};

/// Words of choices that are more than one value of a scene.
pub(super) const DRIVES: &[&str] = &["record", "tone-burst", "gaussian-burst", "sine", "striker"];
pub(super) const SUPPORTS: &[&str] = &["rigid", "half-space", "annulus", "spring", "foundation", "disc", "free"];
pub(super) const MEDIA: &[&str] = &["water", "tissue", "none"];
pub(super) const METHODS: &[&str] = &["rayleigh", "elements"];
pub(super) const INTEGRATORS: &[&str] = &["dormand-prince-853", "symplectic", "trapezoid", "hht"];
pub(super) const CHAIN_INTEGRATORS: &[&str] = &["dormand-prince-853", "symplectic"];
pub(super) const FEA_INTEGRATORS: &[&str] = &["trapezoid", "hht"];

/// A piston drives.
pub(super) const HORN: &[When] = &[Is("drive.kind", &["record", "tone-burst", "gaussian-burst", "sine"])];
/// Its face is elastic.
pub(super) const FACE: &[When] = &[HORN[0], Is("piston.contact", &["half-space"])];
pub(super) const STRIKER: &[When] = &[Is("drive.kind", &["striker"])];
pub(super) const FOUNDATION: &[When] = &[Is("support.kind", &["foundation"])];
pub(super) const RING: &[When] = &[Is("support.kind", &["annulus"])];
pub(super) const BODY_MESH: &[When] = &[Is("model.kind", &["reduced", "fea"])];
pub(super) const MESHED: &[When] =
    &[Is("model.kind", &["chain", "reduced", "fea"]), Is("contact.law", &["finite-body"])];
pub(super) const FORMULA: &[When] = &[Is("drive.kind", &["tone-burst", "gaussian-burst", "sine"])];
pub(super) const OWN_NORMAL: &[When] = &[Is("model.kind", &["reduced", "fea"]), Is("support.kind", &["annulus"])];
pub(super) const DISC: &[When] = &[Is("support.kind", &["disc"])];
pub(super) const LIQUID: &[When] = &[Is("support.kind", &["disc"]), Is("water.medium", &["water", "tissue"])];
pub(super) const WATER_MESH: &[When] =
    &[Is("support.kind", &["disc"]), Is("water.medium", &["water", "tissue"]), Is("water.method", &["elements"])];
pub(super) const STEPPED: &[When] =
    &[Is("model.kind", &["chain", "reduced", "fea"]), Is("model.integrator", &["symplectic", "trapezoid", "hht"])];
