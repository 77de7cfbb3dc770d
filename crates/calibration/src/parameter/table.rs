//! Table of fitted parameters. A new parameter is a row here and a variant of [`Target`]. The damping coefficients
//! follow from the table of damping laws.

use super::{ParameterError, Target, highest_cutoff};
use granchain_model::{
    chain::ensemble::Variation,
    scene::{Bead, Scene, Support},
};

/// How far a box may be widened, unless its bounds are user-given.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Widening {
    Far,
    BothWays,
    /// Upwards only: below the lower bound the effect is absent.
    Up,
    Not,
}

/// Presentation of a parameter: name, symbol, unit, and the factor from SI to that unit.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Shown {
    pub name: &'static str,
    pub symbol: &'static str,
    pub unit: &'static str,
    pub factor: f64,
}

#[derive(Debug, Clone, Copy)]
pub struct Row {
    pub(super) target: Target,
    pub key: &'static str,
    /// Presentation, by SI unit if that depends on the scene.
    pub shown: fn(&str) -> Shown,
    /// Key of the scene, by SI unit.
    pub scene_key: fn(&str) -> &'static str,
    /// SI unit, lower and upper bound of the default box.
    pub(super) bounds: fn(&Scene) -> Result<Bounds, ParameterError>,
    pub(super) widening: Widening,
    pub(super) set: fn(&mut Scene, f64),
    pub(super) vary: fn(&Scene, &mut Variation, f64),
    /// Which further record would determine it.
    pub remedy: &'static str,
}

/// SI unit, lower and upper bound.
type Bounds = (&'static str, f64, f64);

const fn shown(name: &'static str, symbol: &'static str, unit: &'static str, factor: f64) -> Shown {
    Shown { name, symbol, unit, factor }
}

/// Box of the amplitude scale: the source paper swept 0.1 to 1.5.
pub(super) const ALPHA: (f64, f64) = (0.05, 3.0);

/// All parameters except the damping coefficients.
pub const PARAMETERS: &[Row] = &[
    Row {
        target: Target::Alpha,
        key: "alpha",
        shown: |_| shown("drive over true horn motion", "α", "1", 1.0),
        scene_key: |_| "alpha",
        bounds: |_| Ok(("1", ALPHA.0, ALPHA.1)),
        widening: Widening::Far,
        set: |scene, value| scene.amplitude_scale = value,
        vary: |_, variation, value| variation.amplitude_scale = value,
        remedy: "A record of the horn tip taken at the face that drives the chain tells it apart.",
    },
    Row {
        target: Target::Precompression,
        key: "precompression",
        shown: |_| shown("precompression", "F₀", "mN", 1e3),
        scene_key: |_| "chain.precompression",
        // The paper's impulses vanish between 10 and 20 mN.
        bounds: |scene| match scene.support {
            Support::Free => Err(ParameterError::FreeEnd),
            _ => Ok(("N", 1e-4, 1.0)),
        },
        widening: Widening::Up,
        set: |scene, value| scene.chain.precompression = value,
        vary: |_, variation, value| variation.precompression = value,
        remedy: "A record of a weak pulse through the resting chain tells it, whose speed grows as the sixth root of the force; or a load cell.",
    },
    Row {
        target: Target::SupportStiffness,
        key: "support_stiffness",
        shown: |unit| match unit {
            "1" => shown("stiffness factor of the annulus", "κ", "1", 1.0),
            "Pa" => shown("modulus of the foundation", "E", "MPa", 1e-6),
            _ => shown("stiffness of the spring", "k", "N/m", 1.0),
        },
        scene_key: |unit| match unit {
            "1" => "support.stiffness_factor",
            "Pa" => "support.youngs_modulus",
            _ => "support.stiffness",
        },
        bounds: |scene| {
            let own = scene.support.stiffness().ok_or(ParameterError::NoStiffness)?;
            let unit = match scene.support {
                Support::Spring { .. } => "N/m",
                Support::Foundation { .. } => "Pa",
                _ => "1",
            };
            Ok((unit, 0.25 * own, 4.0 * own))
        },
        widening: Widening::BothWays,
        set: |scene, value| {
            if let Some(own) = scene.support.stiffness_mut() {
                *own = value;
            }
        },
        vary: |scene, variation, value| {
            variation.support_stiffness_factor = value / scene.support.stiffness().unwrap_or(value);
        },
        remedy: "A record with the last bead against a hard flat, fitted together with this one, tells what is not the support's; or its static \
                 force against displacement.",
    },
    Row {
        target: Target::SupportModulus,
        key: "support_modulus",
        shown: |_| shown("modulus of the foundation", "E", "MPa", 1e-6),
        scene_key: |_| "support.youngs_modulus",
        bounds: |scene| match scene.support {
            Support::Foundation { youngs_modulus, .. } => Ok(("Pa", 0.25 * youngs_modulus, 4.0 * youngs_modulus)),
            _ => Err(ParameterError::NoFoundation { name: "support_modulus" }),
        },
        widening: Widening::BothWays,
        set: |scene, value| {
            if let Support::Foundation { youngs_modulus, .. } = &mut scene.support {
                *youngs_modulus = value;
            }
        },
        vary: |scene, variation, value| {
            variation.support_stiffness_factor = value / scene.support.stiffness().unwrap_or(value);
        },
        remedy: "A record of the same column on a foundation of known modulus, such as steel, tells what is not the foundation's.",
    },
    Row {
        target: Target::Gap,
        key: "gap",
        shown: |_| shown("gap before the first bead", "g", "nm", 1e9),
        scene_key: |_| "chain.gaps.contact1",
        // From what is drawn into every contact of every run.
        bounds: |scene| match scene.chain.precompression > 0.0 {
            true => Err(ParameterError::ClosedGap),
            false => Ok(("m", 3e-10, 3e-7)),
        },
        widening: Widening::Up,
        set: |scene, value| scene.chain.gaps[0] = value,
        vary: |scene, variation, value| variation.gap_offsets[0] += value - scene.chain.gaps[0],
        remedy: "A record at another drive level, fitted together with this one, tells it, for the same gap counts less under a larger drive; or \
                 more quiet samples of the horn tip before the burst.",
    },
    Row {
        target: Target::Bandwidth,
        key: "bandwidth",
        shown: |_| shown("bandwidth of the instrument", "B", "kHz", 1e-3),
        scene_key: |_| "vibrometer.bandwidth",
        // Up to the highest frequency that is compared.
        bounds: |scene| Ok(("Hz", 1.5 * scene.drive.frequency, highest_cutoff(scene.drive.frequency))),
        widening: Widening::Not,
        // It is none of the scene's.
        set: |_, _| {},
        vary: |_, _, _| {},
        remedy: "The vibrometer's data sheet states it (--read bandwidth=…); or a record of a short pulse by the same vibrometer shows it.",
    },
    Row {
        target: Target::HornMass,
        key: "horn_mass",
        shown: |_| shown("modal mass of the horn", "M", "mg", 1e6),
        scene_key: |_| "horn.mass",
        // Of a horn that resonates where the scene says, else at the drive.
        bounds: |scene| {
            let bead = scene.chain.beads.first().map_or(1e-6, Bead::mass);
            Ok(("kg", bead, 3e3 * bead))
        },
        widening: Widening::BothWays,
        set: |scene, value| scene.set_horn_mass(value),
        vary: |_, variation, value| variation.effects.horn_mass = Some(value),
        remedy: "A record of the horn tip with the chain and one without tell it: what the chain's pulses take from the tip's motion.",
    },
    Row {
        target: Target::Drag,
        key: "drag",
        shown: |_| shown("drag of the bead guide", "b", "mN·s/m", 1e3),
        scene_key: |_| "holder.drag",
        bounds: |_| Ok(("N s/m", 1e-3, 1.0)),
        widening: Widening::Up,
        set: |scene, value| scene.holder_mut().drag = value,
        vary: |_, variation, value| variation.effects.drag = Some(value),
        remedy: "A record at a lower drive level, fitted together with this one, tells it: drag stays where the contacts' losses fall.",
    },
    Row {
        target: Target::Friction,
        key: "friction",
        shown: |_| shown("friction of the bead guide", "F_c", "mN", 1e3),
        scene_key: |_| "holder.friction_force",
        bounds: |_| Ok(("N", 1e-4, 0.3)),
        widening: Widening::Up,
        set: |scene, value| scene.holder_mut().friction_force = value,
        vary: |_, variation, value| variation.effects.friction_force = Some(value),
        remedy: "A record at a lower drive level, fitted together with this one, tells it: friction counts the more the weaker the drive.",
    },
];

/// Young's modulus of the beads over the scene's own, used by the diagnosis only.
pub(super) const MODULUS: Row = Row {
    target: Target::Modulus,
    key: "modulus",
    shown: |_| shown("Young's modulus over the scene's", "E/E₀", "1", 1.0),
    scene_key: |_| "materials.*.youngs_modulus",
    bounds: |_| Ok(("1", 0.2, 5.0)),
    widening: Widening::Not,
    set: |scene, value| scene.chain.beads.iter_mut().for_each(|bead| bead.material.youngs_modulus *= value),
    vary: |_, variation, value| variation.modulus_factor = value,
    remedy: "The time a weak pulse takes through a chain of known static force tells it.",
};
