//! Whether contacts of meshed bodies, which are elastic, carried more than their beads' material bears.

use crate::{
    contact_law::{touching, yield_force},
    scene::{Bead, FlatContact, Material, Scene},
};
use granchain_signal::{Dimension, Quantity, Series};

/// Yield strength of a chrome-steel bead without a key that says so, Pa.
const CHROME_STEEL: f64 = 2.03e9;

/// Force at which every contact between beads, or of a bead and a flat, begins to yield, N; none where that is not known.
pub(crate) fn yield_forces(scene: &Scene) -> Vec<Option<f64>> {
    let beads = &scene.chain.beads;
    let strength = |bead: &Bead| {
        let own = (bead.material.name == "chrome-steel").then_some(CHROME_STEEL);
        scene.yield_strength.or(own)
    };
    let on = |bead: &Bead, other: Result<&Bead, Option<&Material>>| {
        let weaker = other.map_or(Some(f64::INFINITY), strength)?.min(strength(bead)?);
        let (modulus, radius) = touching(bead, other);
        Some(yield_force(modulus, radius, weaker))
    };
    let on_flat = |bead: Option<&Bead>| on(bead?, Err(None));
    let between = beads.windows(2).map(|pair| on(&pair[0], Ok(&pair[1])));
    let last = scene.support.flat().filter(|flat| *flat == FlatContact::Rigid).and_then(|_| on_flat(beads.last()));
    std::iter::once(on_flat(beads.first())).chain(between).chain([last]).collect()
}

pub(crate) fn warning(limits: &[Option<f64>], forces: &[Series]) -> Option<String> {
    let most = |force: &Series| force.values.iter().fold(0.0, |most: f64, value| most.max(*value));
    let passed = limits.iter().zip(forces).enumerate().filter_map(|(contact, (limit, force))| {
        let (limit, most) = ((*limit)?, most(force));
        (most > limit).then_some((contact, limit, most))
    });
    let (contact, limit, most) = passed.max_by(|(_, a, b), (_, c, d)| (b / a).total_cmp(&(d / c)))?;
    let newtons = |value: f64| Quantity::new((value * 1e3).round() / 1e3, Dimension::FORCE);
    Some(format!(
        "contact {} (1 = piston) carried {}, and yields from {} on (central pressure 1.6 times the yield strength), but this model is elastic; only \
         `model.kind = \"chain\"` with `contact.yield_strength` models yield",
        contact + 1,
        newtons(most),
        newtons(limit)
    ))
}
