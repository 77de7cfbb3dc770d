//! What a chain has of effects beside contacts and dashpots, fixed for a run: how they act stands in [`super::effect_state`].

use crate::{
    ModelError,
    contact_law::{Law, Yielding},
    scene::{Holder, Horn, Relaxation, Scene},
};

/// Places in the state behind work and dissipated energy, from the end of the velocities on; the state is longer by [`FURTHER`] for them.
pub(super) mod place {
    /// q and q̇ of the horn, m and m/s.
    pub(crate) const HORN: [usize; 2] = [2, 3];
    /// Energy lost in drag and friction, J.
    pub(crate) const DRAG: usize = 4;
    pub(crate) const FRICTION: usize = 5;
    /// Energy lost in the horn and work of its source, J.
    pub(crate) const HORN_LOST: usize = 6;
    pub(crate) const SOURCE: usize = 7;
    /// Force of the annulus' relaxation s, N, and the work that it took, J.
    pub(crate) const RELAXING: usize = 8;
    pub(crate) const RELAXED: usize = 9;
}
pub(super) const FURTHER: usize = 8;

#[derive(Debug, Clone, PartialEq)]
pub(super) struct Effects {
    pub horn: Option<Horn>,
    /// Acceleration g along the axis, m/s².
    pub gravity: Option<f64>,
    pub holder: Option<Holder>,
    /// tan θ of the line of centres at each contact; 0 at both ends.
    pub obliquity: Vec<f64>,
    /// How each contact yields, if it does.
    pub yielding: Vec<Option<Yielding>>,
    pub relaxation: Option<Relaxation>,
}

impl Effects {
    /// Those of a scene; none where it has none.
    pub(crate) fn of(scene: &Scene, laws: &[Law], is_coupled: bool) -> Result<Option<Self>, ModelError> {
        let relaxation = scene.loss.relaxation.filter(|_| scene.support.ring().is_some());
        let gravity = Some(scene.chain.gravity).filter(|gravity| *gravity > 0.0);
        let none = scene.horn.is_none() && scene.holder.is_none() && scene.yield_strength.is_none();
        if none && relaxation.is_none() && gravity.is_none() {
            return Ok(None);
        }
        let unsupported = |key: &str| {
            let reason = format!("`{key}` needs contacts that do not feel one another; set `contact.law` = \"hertz\"");
            ModelError::Unsupported { model: "chain", reason }
        };
        if is_coupled && scene.yield_strength.is_some() {
            return Err(unsupported("contact.yield_strength"));
        }
        if is_coupled && relaxation.is_some() {
            return Err(unsupported("loss.relaxation"));
        }
        let sines = between_beads(scene, Holder::obliquity);
        let cosine = |contact: usize| (1.0 - sines[contact] * sines[contact]).sqrt();
        let beads = &scene.chain.beads;
        let yielding = laws.iter().enumerate().map(|(contact, law)| {
            let strength = scene.yield_strength.filter(|_| matches!(law, Law::Hertz(_)))?;
            let law = match (contact, beads.get(contact)) {
                (0, _) => Yielding::of(&beads[0], Err(scene.piston_face()), strength),
                (_, Some(next)) => Yielding::of(&beads[contact - 1], Ok(next), strength),
                (_, None) => Yielding::of(
                    &beads[contact - 1],
                    Err(scene.support.flat()?.material(&beads[contact - 1].material)),
                    strength,
                ),
            };
            Some(law.oblique(cosine(contact)))
        });
        Ok(Some(Self {
            horn: scene.horn,
            gravity,
            holder: scene.holder,
            yielding: yielding.collect(),
            obliquity: between_beads(scene, Holder::tangent),
            relaxation,
        }))
    }

    /// Most that friction holds the bead in a slot with, N.
    #[inline(always)]
    pub(crate) fn friction(&self, force: &[f64], slot: usize) -> f64 {
        let Some(holder) = &self.holder else { return 0.0 };
        let across = force[slot - 1] * self.obliquity[slot - 1] + force[slot] * self.obliquity[slot];
        holder.friction_force + holder.friction_coefficient * across.max(0.0)
    }

    /// Velocity v_s (m/s) of a regularised friction under a constant load, where a bead guide with it, or without any yet, is all there is.
    pub(crate) fn regularised_friction(&self) -> Option<f64> {
        let others = self.horn.is_some() || self.gravity.is_some() || self.relaxation.is_some();
        let yields = self.yielding.iter().any(Option::is_some);
        let holder = self.holder.filter(|holder| holder.slip_velocity > 0.0 && !others && !yields)?;
        (holder.drag == 0.0 && holder.clearance == 0.0).then_some(holder.slip_velocity)
    }

    pub(crate) fn rubs(&self) -> Option<&Holder> {
        self.holder.as_ref().filter(|holder| holder.has_friction())
    }
}

/// Radii of the two beads in a bead guide, at each of the N + 1 contacts; 0 at both ends.
fn between_beads(scene: &Scene, of: impl Fn(&Holder, f64, f64) -> f64) -> Vec<f64> {
    let beads = &scene.chain.beads;
    let mut found = vec![0.0; beads.len() + 1];
    if let Some(holder) = &scene.holder {
        for (found, pair) in found[1..].iter_mut().zip(beads.windows(2)) {
            *found = of(holder, pair[0].radius, pair[1].radius);
        }
    }
    found
}

/// Soften the contacts between beads whose line of centres is oblique: F = k cos^(5/2) θ δ^(3/2) along the axis.
pub(super) fn tilt(scene: &Scene, laws: &mut [Law]) {
    if scene.holder.is_none_or(|holder| holder.clearance == 0.0) {
        return;
    }
    for (law, sine) in laws.iter_mut().zip(between_beads(scene, Holder::obliquity)) {
        let factor = (1.0 - sine * sine).powf(1.25);
        match law {
            Law::Hertz(law) => law.stiffness *= factor,
            Law::FiniteHertz(law) => law.stiffness *= factor,
            Law::Annulus(_) | Law::Spring(_) | Law::HertzOnSpring(_) => {}
        }
    }
}
