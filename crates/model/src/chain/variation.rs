//! What one run of many changes in the scene.

use crate::{
    ModelError,
    contact_law::dashpots,
    scene::{DampingCoefficients, DampingTerm, DriveKind, Scene},
    valid::{damping, finite, not_negative, positive},
};
use granchain_signal::{Series, spline::cubic};

#[derive(Debug, Clone, PartialEq)]
pub struct Variation {
    /// α, in place of the scene's own, 1.
    pub amplitude_scale: f64,
    /// Of the dashpots in place of the scene's own, SI; 0 for none.
    pub damping: DampingCoefficients,
    /// Added to the scene's N + 1 gaps, m; may be negative. Under precompression the chain then starts that far from its equilibrium.
    pub gap_offsets: Vec<f64>,
    /// F₀ in place of the scene's own, N.
    pub precompression: f64,
    /// Factor on the support's force, over and above the scene's own, 1.
    pub support_stiffness_factor: f64,
    /// Factor on Young's modulus of the beads, and so on the stiffness of every Hertz contact, 1.
    pub modulus_factor: f64,
    /// How much of each of the scene's realisations of what is not known of its drive, 1; none for none.
    pub shaken: Vec<f64>,
    pub effects: EffectVariation,
}

/// Numbers of effects beside contacts and dashpots in place of the scene's own; none leaves them.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct EffectVariation {
    /// Modal mass of the horn, kg.
    pub horn_mass: Option<f64>,
    /// Viscous drag of the bead guide, N·s/m.
    pub drag: Option<f64>,
    /// Its friction under a constant load, N.
    pub friction_force: Option<f64>,
}

impl EffectVariation {
    fn write_into(self, scene: &mut Scene) {
        if let Some(mass) = self.horn_mass {
            scene.set_horn_mass(mass);
        }
        if let Some(drag) = self.drag {
            scene.holder_mut().drag = drag;
        }
        if let Some(force) = self.friction_force {
            scene.holder_mut().friction_force = force;
        }
    }
}

impl Variation {
    pub fn of(scene: &Scene) -> Self {
        let contacts = scene.chain.beads.len() + 1;
        // Contact 1 lies between two beads, unless there is only one.
        let dashpots = dashpots(&scene.damping, contacts);
        let dashpot = dashpots[1.min(contacts - 1)];
        Self {
            amplitude_scale: scene.amplitude_scale,
            damping: dashpot.coefficients,
            gap_offsets: vec![0.0; contacts],
            precompression: scene.chain.precompression,
            support_stiffness_factor: 1.0,
            modulus_factor: 1.0,
            shaken: Vec::new(),
            effects: EffectVariation::default(),
        }
    }

    /// The scene with this written into it, for models that know only scenes and take no negative gap: `closed` says what becomes of one.
    /// A precompression closes every gap, and so does gravity.
    pub fn written_into(&self, scene: &Scene, closed: fn(f64) -> f64) -> Scene {
        let mut scene = scene.clone();
        scene.amplitude_scale = self.amplitude_scale;
        scene.damping.coefficients = self.damping;
        scene.chain.precompression = self.precompression;
        let is_pressed = self.precompression > 0.0 || scene.chain.gravity > 0.0;
        for (gap, offset) in scene.chain.gaps.iter_mut().zip(&self.gap_offsets) {
            *gap = if is_pressed { 0.0 } else { closed(*gap + offset) };
        }
        if let Some(own) = scene.support.stiffness_mut() {
            *own *= self.support_stiffness_factor;
        }
        scene.chain.beads.iter_mut().for_each(|bead| bead.material.youngs_modulus *= self.modulus_factor);
        if let DriveKind::Striker { bead, .. } = &mut scene.drive.kind {
            bead.material.youngs_modulus *= self.modulus_factor;
        }
        self.effects.write_into(&mut scene);
        if let DriveKind::Record { displacement, shakes, .. } = &mut scene.drive.kind {
            for (part, shake) in self.shaken.iter().zip(shakes) {
                displacement.values.iter_mut().zip(&shake.values).for_each(|(x, more)| *x += part * more);
            }
        }
        scene
    }

    /// [`Variation::written_into`] for bodies that are made ready once, with the scene's own modulus: what a bench of another modulus does, on a clock
    /// that runs √κ times as fast. From m ẍ + c ẋ + κ f(x) = 0 follows m x″ + (c/√κ) x′ + f(x) = 0 over √κ t. A body of one's own behind
    /// the chain goes with the beads. [`Variation::on_the_record`] takes the trace back.
    pub fn written_over(&self, scene: &Scene, closed: fn(f64) -> f64) -> Scene {
        let factor = self.modulus_factor;
        if factor == 1.0 {
            return self.written_into(scene, closed);
        }
        let faster = factor.sqrt();
        let mut scene = Self { modulus_factor: 1.0, ..self.clone() }.written_into(scene, closed);
        for term in DampingTerm::ALL {
            scene.damping.coefficients[term] /= faster;
        }
        scene.chain.precompression /= factor;
        scene.chain.gravity /= factor;
        if let Some(own) = scene.support.stiffness_mut() {
            *own /= factor;
        }
        if let Some(holder) = &mut scene.holder {
            holder.drag /= faster;
            holder.friction_force /= factor;
        }
        match &mut scene.drive.kind {
            DriveKind::Record { displacement, recorded_until, .. } => {
                displacement.start *= faster;
                displacement.step *= faster;
                *recorded_until *= faster;
            }
            kind => {
                scene.drive.frequency /= faster;
                match kind {
                    DriveKind::ToneBurst { ring_up, .. } => *ring_up *= faster,
                    DriveKind::Striker { velocity, .. } => *velocity /= faster,
                    _ => {}
                }
            }
        }
        scene.duration = scene.duration * faster.max(1.0) + scene.output_step;
        scene
    }

    /// The first `count` samples of a velocity of [`Variation::written_over`] on the clock of the bench.
    pub fn on_the_record(&self, trace: Series, count: usize) -> Series {
        if self.modulus_factor == 1.0 {
            return trace;
        }
        let faster = self.modulus_factor.sqrt();
        let last = trace.len().saturating_sub(1);
        let at = |index: usize| -> f64 {
            let place = ((trace.time(index) * faster - trace.start) / trace.step).clamp(0.0, last as f64);
            let (whole, t) = (place.floor() as usize, place.fract());
            let neighbours = [0, 1, 2, 3].map(|k| trace.values[(whole + k).saturating_sub(1).min(last)]);
            cubic(neighbours, t)
        };
        let values = (0..count).map(|index| faster * at(index)).collect();
        Series::new(trace.start, trace.step, values)
    }

    pub(super) fn check(&self, scene: &Scene) -> Result<(), ModelError> {
        let contacts = scene.chain.beads.len() + 1;
        if self.gap_offsets.len() != contacts {
            let found = self.gap_offsets.len();
            return Err(ModelError::Count { quantity: "gap_offsets", expected: contacts, found });
        }
        finite("alpha", "a finite factor", self.amplitude_scale)?;
        damping(&self.damping)?;
        not_negative("chain.precompression", "a force ≥ 0, N", self.precompression)?;
        positive("support.stiffness_factor", "a positive factor", self.support_stiffness_factor)?;
        positive("materials.*.youngs_modulus", "a positive factor", self.modulus_factor)?;
        for (contact, offset) in self.gap_offsets.iter().enumerate() {
            finite(&format!("gap_offsets[{contact}]"), "a finite length, m", *offset)?;
        }
        for (number, part) in self.shaken.iter().enumerate() {
            finite(&format!("shaken[{number}]"), "a finite factor", *part)?;
        }
        scene.chain.refuse_open_gap(self.precompression)
    }
}
