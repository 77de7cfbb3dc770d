//! Whether a mesh can feel what a scene does.

use super::FeaError;
use crate::{
    contact_law::bead_pair_stiffness,
    scene::{DriveKind, Scene},
};

/// Points that the smallest contact must press: with fewer its stiffness is that of a stamp, tens of per cent off.
const FEWEST: usize = 3;

/// Refuse a scene whose motion is too small for the points of its contacts: two bodies that approach by δ touch where their gap was at most
/// δ/2 (Hertz).
///
/// - `contacts`: gaps (m) of the points of every kind of contact when it just touches
pub(crate) fn check<'a>(scene: &Scene, contacts: impl Iterator<Item = &'a [f64]>) -> Result<(), FeaError> {
    let approach = approach(scene);
    for gaps in contacts {
        let mut sorted = gaps.to_vec();
        sorted.sort_by(f64::total_cmp);
        let needed = sorted.get(FEWEST - 1).map_or(0.0, |gap| 2.0 * gap);
        if approach > 0.0 && approach < needed {
            return Err(FeaError::Unresolved { approach, needed });
        }
    }
    Ok(())
}

/// The approach of two beads that a scene is about, m: under its static force, else its drive's largest displacement.
fn approach(scene: &Scene) -> f64 {
    let chain = &scene.chain;
    if chain.precompression > 0.0 {
        let bead = &chain.beads[0];
        return (chain.precompression / bead_pair_stiffness(bead, bead)).powf(2.0 / 3.0);
    }
    let peak = match &scene.drive.kind {
        DriveKind::Record { displacement, .. } => displacement.peak(),
        DriveKind::UnreadRecord { .. } => return 0.0,
        // Largest overlap of Hertz' collision, from its duration.
        DriveKind::Striker { velocity, .. } => velocity / (2.943 * scene.drive.frequency),
        _ => scene.drive.amplitude,
    };
    (scene.amplitude_scale * peak).abs()
}
