//! Which physical effects a scene switches on.

use serde::Serialize;

use super::{
    AnnulusShape, ContactLaw, ContactMass, ContactNormal, DampingPlacement, DampingTerm, DriveKind, FlatContact, Horn,
    ModelKind, Relaxation, Scene, Scheme, Support, TermDescription,
};
use granchain_signal::{Dimension, Quantity};

#[derive(Debug, Clone, PartialEq, Eq, Serialize)]
pub struct Effect {
    pub name: &'static str,
    pub on: bool,
    pub why: String,
}

pub fn effects(scene: &Scene) -> Vec<Effect> {
    let show = |value, dimension| Quantity::new(value, dimension).to_string();
    let chain = &scene.chain;
    let damping = &scene.damping;
    let damped = !damping.coefficients.are_absent();
    let unequal = chain.beads.iter().filter(|bead| Some(*bead) != chain.beads.first()).count();
    let largest_gap = chain.gaps.iter().copied().fold(0.0, f64::max);
    let open = chain.gaps.iter().filter(|gap| **gap > 0.0).count();
    let effect = |name, on, why| Effect { name, on, why };
    let annulus = match &scene.support {
        Support::Annulus { shape, stiffness_factor, .. } => {
            let of = |radius| show(radius, Dimension::LENGTH);
            let own = format!(
                ", support.ring_radius = {}, support.section_radius = {}",
                of(shape.ring_radius),
                of(shape.section_radius)
            );
            let own = if *shape == AnnulusShape::published() { "" } else { &own };
            (true, format!("support.stiffness_factor = {stiffness_factor}{own}"))
        }
        _ => (false, "support.kind is not annulus".to_owned()),
    };
    let spring = match scene.support.spring() {
        Some(stiffness) => (true, format!("support.stiffness = {}", show(stiffness, Dimension::STIFFNESS))),
        None => (false, "support.kind is not spring".to_owned()),
    };
    let half_space = match (scene.piston, &scene.support) {
        (FlatContact::HalfSpace, Support::Flat(FlatContact::HalfSpace)) => {
            (true, "piston and support are half-spaces".to_owned())
        }
        (FlatContact::HalfSpace, _) => (true, "piston.contact = half-space".to_owned()),
        (_, Support::Flat(FlatContact::HalfSpace)) => (true, "support.kind = half-space".to_owned()),
        _ => (false, "no flat is a half-space".to_owned()),
    };
    let finite_body = match (scene.model.kind, scene.contact_law) {
        (ModelKind::Chain, ContactLaw::FiniteBody) => {
            (true, format!("contact.law = finite-body, model.mesh_density = {}", scene.model.meshing().density))
        }
        (ModelKind::Chain, ContactLaw::Hertz) => (false, "contact.law = hertz".to_owned()),
        (kind, _) => (false, format!("model.kind = {}: the contacts are computed", kind.name())),
    };
    let ring_up = match scene.drive.kind {
        DriveKind::ToneBurst { ring_up, .. } => {
            (ring_up > 0.0, format!("drive.ring_up = {}", show(ring_up, Dimension::TIME)))
        }
        _ => (false, "drive.kind is not tone-burst".to_owned()),
    };
    let record = match &scene.drive.kind {
        DriveKind::Record { displacement, .. } => (true, format!("a record of {} samples", displacement.len())),
        DriveKind::UnreadRecord { file } => (true, format!("drive.file = {}", file.display())),
        _ => (false, "the drive is a formula".to_owned()),
    };
    let ends = damped && damping.placement == DampingPlacement::All;
    let tension = damped && damping.tension;
    let placement = match damping.placement {
        DampingPlacement::All => "damping.at = all",
        DampingPlacement::Beads => "damping.at = beads",
    };
    let undamped = || "there are no dampers".to_owned();
    let dampers = DampingTerm::ALL.map(|term| {
        let (TermDescription { effect: name, symbol, dimension, .. }, value) =
            (term.description(), damping.coefficients[term]);
        effect(name, value > 0.0, format!("{symbol} = {}", show(value, *dimension)))
    });
    let others = vec![
        effect("dampers at piston and support", ends, if damped { placement.to_owned() } else { undamped() }),
        effect(
            "pulling dampers",
            tension,
            if damped { format!("damping.tension = {}", damping.tension) } else { undamped() },
        ),
        effect(
            "precompression",
            chain.precompression > 0.0,
            format!("chain.precompression = {}", show(chain.precompression, Dimension::FORCE)),
        ),
        effect(
            "initial gaps",
            open > 0,
            if open > 0 {
                format!(
                    "{open} of {} contacts open, at most {}",
                    chain.gaps.len(),
                    show(largest_gap, Dimension::LENGTH)
                )
            } else {
                "all contacts are closed".to_owned()
            },
        ),
        effect("unequal beads", unequal > 0, format!("{unequal} of {} beads differ from the first", chain.beads.len())),
        effect("resin annulus", annulus.0, annulus.1),
        effect("spring support", spring.0, spring.1),
        effect("elastic flats", half_space.0, half_space.1),
        effect("finite-body contacts", finite_body.0, finite_body.1),
        effect("ring-up of the drive", ring_up.0, ring_up.1),
        effect("recorded drive", record.0, record.1),
    ];
    let parts = [others, further_effects(scene), water_effects(scene), fea_effects(scene)];
    dampers.into_iter().chain(parts.into_iter().flatten()).collect()
}

fn further_effects(scene: &Scene) -> Vec<Effect> {
    let show = |value, dimension| Quantity::new(value, dimension).to_string();
    let effect = |name, on, why: String| Effect { name, on, why };
    let horn = match scene.horn {
        Some(Horn { mass, frequency, quality }) => (
            true,
            format!(
                "horn.mass = {}, horn.frequency = {}, horn.quality = {quality}",
                show(mass, Dimension::MASS),
                show(frequency, Dimension::FREQUENCY)
            ),
        ),
        None => (false, "horn.mass is not given: the tip moves as prescribed".to_owned()),
    };
    let holder = scene.holder.unwrap_or_default();
    let slip = format!("holder.slip_velocity = {}", show(holder.slip_velocity, Dimension::VELOCITY));
    let loss = scene.loss;
    let (relaxes, relaxation) = match (loss.relaxation, &scene.support) {
        (Some(Relaxation { strength, time }), Support::Annulus { .. }) => {
            (true, format!("loss.relaxation = {strength}, loss.relaxation_time = {}", show(time, Dimension::TIME)))
        }
        (_, Support::Annulus { .. }) => (false, "loss.relaxation = 0".to_owned()),
        _ => (false, "support.kind is not annulus".to_owned()),
    };
    let is_chain = scene.model.kind == ModelKind::Chain;
    let yields = match scene.yield_strength {
        Some(strength) if is_chain => {
            (true, format!("contact.yield_strength = {}", show(strength, Dimension::PRESSURE)))
        }
        None if is_chain => (false, "contact.yield_strength is not given: elastic".to_owned()),
        _ => (false, format!("model.kind = {}", scene.model.kind.name())),
    };
    let lossy = scene.model.kind.is_meshed() && (loss.beads > 0.0 || loss.support > 0.0);
    vec![
        effect("loaded horn", horn.0, horn.1),
        effect(
            "drag in the holder",
            holder.drag > 0.0,
            format!("holder.drag = {}", show(holder.drag, Dimension::LINEAR_DAMPING)),
        ),
        effect(
            "friction in the holder",
            holder.friction_force > 0.0,
            format!("holder.friction_force = {}, {slip}", show(holder.friction_force, Dimension::FORCE)),
        ),
        effect(
            "oblique contacts",
            holder.clearance > 0.0 && (scene.model.kind == ModelKind::Chain || holder.friction_coefficient > 0.0),
            format!(
                "holder.clearance = {}, holder.friction_coefficient = {}",
                show(holder.clearance, Dimension::LENGTH),
                holder.friction_coefficient
            ),
        ),
        effect("yielding contacts", yields.0, yields.1),
        effect("relaxing annulus", relaxes, relaxation),
        effect(
            "loss in the bodies",
            lossy,
            if scene.model.kind.is_meshed() {
                format!("loss.beads = {}, loss.support = {}", loss.beads, loss.support)
            } else {
                format!("model.kind = {}", scene.model.kind.name())
            },
        ),
    ]
}

fn water_effects(scene: &Scene) -> Vec<Effect> {
    let effect = |name, on, why: String| Effect { name, on, why };
    let Support::Disc { shape, .. } = &scene.support else {
        let off = |name| effect(name, false, "support.kind is not disc".to_owned());
        return ["elastic disc", "water behind the disc", "absorption in the water"].map(off).to_vec();
    };
    let disc = format!("disc.material = {}, disc.rim = {}", shape.material.name, shape.rim.name());
    let none = || (false, "water.medium = none".to_owned());
    let (water, absorption) = match &scene.water {
        None => (none(), none()),
        Some(water) => {
            let (medium, baffle) = (water.medium.name(), water.baffle.name());
            let why =
                format!("water.medium = {medium}, water.method = {}, water.baffle = {baffle}", water.method.name());
            let absorption = match water.absorption {
                None => (false, "water.absorption = 0 Np/m".to_owned()),
                Some(law) => {
                    let at_1_mhz = Quantity::new(law.at_1_mhz, Dimension::ATTENUATION);
                    (true, format!("water.absorption = {at_1_mhz} at 1 MHz, exponent {}", law.exponent))
                }
            };
            ((true, why), absorption)
        }
    };
    vec![
        effect("elastic disc", true, disc),
        effect("water behind the disc", water.0, water.1),
        effect("absorption in the water", absorption.0, absorption.1),
    ]
}

fn fea_effects(scene: &Scene) -> Vec<Effect> {
    let kind = scene.model.kind;
    let fea = &scene.model.fea;
    let of = |has: bool| {
        move |name, on, why: String| {
            let why = if has { why } else { format!("model.kind = {}", kind.name()) };
            Effect { name, on: on && has, why }
        }
    };
    let (effect, meshed_effect) = (of(kind == ModelKind::Fea), of(kind.is_meshed()));
    let off_axis = match scene.support.normal() {
        Some(normal) => (normal == ContactNormal::Moving, format!("support.normal = {}", normal.name())),
        None => (false, "no contact lies off the axis".to_owned()),
    };
    let meshed = scene.chain.beads.iter().filter(|bead| bead.mesh.is_some()).count();
    let own_support = matches!(scene.support, Support::Body { .. });
    let dissipation = match fea.scheme {
        Scheme::Trapezoid => (false, "model.integrator = trapezoid".to_owned()),
        scheme => {
            let value = scheme.dissipation();
            (value > 0.0, format!("model.integrator = {}, model.numerical_dissipation = {value}", scheme.name()))
        }
    };
    vec![
        meshed_effect(
            "elastic bodies",
            true,
            format!("model.kind = {}, model.mesh_density = {}", kind.name(), scene.model.meshing().density),
        ),
        of(kind == ModelKind::Reduced)(
            "modes of the bodies",
            scene.model.reduced.modes > 0,
            format!("model.modes = {}, the rest as static flexibility", scene.model.reduced.modes),
        ),
        effect(
            "mass at the contact nodes",
            fea.contact_mass == ContactMass::Consistent,
            format!("model.contact_mass = {}", fea.contact_mass.name()),
        ),
        effect("numerical dissipation", dissipation.0, dissipation.1),
        meshed_effect("moving contact normal", off_axis.0, off_axis.1),
        meshed_effect(
            "bodies from mesh files",
            meshed > 0 || own_support,
            format!("{meshed} beads and {} from mesh files", if own_support { "the support" } else { "no support" }),
        ),
    ]
}
