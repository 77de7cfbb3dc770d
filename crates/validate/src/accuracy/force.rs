//! The static force of two beads: what the order in the element size is an order of.
//!
//! A waveform is a bad measure of a mesh: at every instant the edge of a contact lies otherwise between two points, and the chain magnifies
//! what comes of it. Over many approaches this scatter averages out.

use super::{
    AccuracyError,
    ladder::{FidelityLevel, Setting, Varied},
    run::Source,
};
use granchain_model::fea::statics::{Curve, Loading, Touching};

pub(super) const KEY: &str = "contact-force";
pub(super) const DENSITIES: [f64; 6] = [4.0, 6.0, 8.0, 12.0, 16.0, 24.0];
/// Densities of its limit and of the next level.
const LIMIT: [f64; 2] = [48.0, 64.0];
/// Approaches, and the least and the largest of them, m: contact radii of a quarter to half of the finely meshed patch of a 1 mm bead.
const APPROACHES: usize = 60;
const RANGE: (f64, f64) = (0.3e-6, 1.2e-6);

/// A mesh of that density.
pub(super) fn setting(density: f64) -> Setting {
    Setting::of(FidelityLevel::Fea, &[(Varied::Density, density)])
}

/// The limit, and the next level.
pub(super) fn limit() -> [Setting; 2] {
    LIMIT.map(setting)
}

/// Forces of two of the scene's first beads at all approaches, held by their inertia as in a collision, N.
pub(super) fn forces(source: &Source<'_>, setting: &Setting) -> Result<Vec<f64>, AccuracyError> {
    let scene = source.scene(setting, &[])?;
    let failed = |error: granchain_model::fea::FeaError| AccuracyError::Run {
        setting: format!("static force, {setting}"),
        source: Box::new(error.into()),
    };
    let curve = Curve::new(&scene, Touching::BeadBead, Loading::OneSided).map_err(failed)?;
    (0..APPROACHES)
        .map(|index| {
            let share = index as f64 / (APPROACHES - 1) as f64;
            let approach = RANGE.0 + share * (RANGE.1 - RANGE.0);
            Ok(curve.at(approach).map_err(failed)?.force)
        })
        .collect()
}
