//! Which physical effects a scene switches on.

use serde::Serialize;

use super::{
    AnnulusShape, ContactLaw, ContactMass, ContactNormal, DampingPlacement, DampingTerm, DriveKind, FlatContact, Horn,
    ModelKind, Relaxation, Scene, Scheme, Sensor, Support, TermDescription, setting::given,
};
use granchain_signal::{Dimension, Quantity};

#[derive(Debug, Clone, PartialEq, Eq, Serialize)]
pub struct Effect {
    pub name: &'static str,
    pub on: bool,
    pub why: String,
}

/// An effect that is on or off, and why.
fn effect(name: &'static str, (on, why): (bool, impl Into<String>)) -> Effect {
    Effect { name, on, why: why.into() }
}

/// A key and its value, as a scene has them.
fn setting(key: &str, value: f64, dimension: Dimension) -> String {
    format!("{key} = {}", Quantity::new(value, dimension))
}

fn on(why: impl Into<String>) -> (bool, String) {
    (true, why.into())
}

fn off(why: impl Into<String>) -> (bool, String) {
    (false, why.into())
}

fn model(scene: &Scene) -> String {
    format!("model.kind = {}", scene.model.kind.name())
}

/// Keys that have their defaults where an effect is off, by how they begin. What has no line here is no choice of a scene: its first bead, its drive.
const KEYS_OF: &[(&str, &[&str])] = &[
    ("pulling dampers", &["damping.tension"]),
    ("precompression", &["chain.precompression"]),
    ("initial gaps", &["chain.gaps"]),
    ("unequal beads", &["chain.override"]),
    ("resin annulus", &["support.", "loss."]),
    ("spring support", &["support."]),
    ("elastic disc", &["support.", "disc.", "water."]),
    ("elastic foundation", &["support."]),
    ("plate on the foundation", &["support.plate_"]),
    ("elastic flats", &["piston."]),
    ("finite-body contacts", &["contact.law", "model.mesh_density", "model.elements", "model.contact_patch"]),
    ("loaded horn", &["horn."]),
    ("drag in the bead guide", &["holder.drag"]),
    ("friction in the bead guide", &["holder.friction_force", "holder.slip_velocity"]),
    ("oblique contacts", &["holder.clearance", "holder.friction_coefficient"]),
    ("yielding contacts", &["contact.yield_strength"]),
    ("relaxing annulus", &["loss.relaxation"]),
    ("loss in the bodies", &["loss.beads", "loss.support"]),
    ("gravity", &["chain.gravity"]),
    ("absorption in the water", &["water.absorption"]),
    ("elastic bodies", &["model.", "loss.beads", "loss.support", "support.normal", "chain.mesh"]),
    ("mass at the contact nodes", &["model.contact_mass"]),
    ("numerical dissipation", &["model.integrator", "model.numerical_dissipation"]),
    ("moving contact normal", &["support.normal"]),
];

/// The effects that a scene has and can be run without, with the scene in which they are off.
pub fn without_each(scene: &Scene) -> Vec<(&'static str, Scene)> {
    let of_dampers = |name| DampingTerm::ALL.iter().any(|term| term.description().effect == name);
    let is_on = |scene: &Scene, name| effects(scene).iter().any(|effect| effect.name == name && effect.on);
    let mut all: Vec<(&'static str, Scene)> = Vec::new();
    for effect in effects(scene).iter().filter(|effect| effect.on) {
        let dampers: &[&str] = &["damping."];
        let listed = KEYS_OF.iter().find(|(name, _)| *name == effect.name).map(|(_, keys)| *keys);
        let Some(keys) = listed.or(of_dampers(effect.name).then_some(dampers)) else { continue };
        let Ok(without) = scene.changed(keys, &[]) else { continue };
        if !is_on(&without, effect.name) && all.iter().all(|(_, other)| *other != without) {
            all.push((effect.name, without));
        }
    }
    all
}

/// What a run of a scene simulates, in one line.
///
/// ```
/// use granchain_model::scene::{load, simulated};
/// let line = simulated(&load("annulus", &[])?);
/// assert_eq!(line, "Effects simulated: Hertz contacts, linear dampers, dampers at piston and support, resin annulus, ring-up of the drive. All others off, at no cost");
/// # Ok::<(), granchain_model::scene::SceneError>(())
/// ```
pub fn simulated(scene: &Scene) -> String {
    let is_hertz = scene.model.kind == ModelKind::Chain && scene.contact_law == ContactLaw::Hertz;
    let on: Vec<&str> = effects(scene).iter().filter(|effect| effect.on).map(|effect| effect.name).collect();
    let all: Vec<&str> = is_hertz.then_some("Hertz contacts").into_iter().chain(on).collect();
    format!("Effects simulated: {}. All others off, at no cost", all.join(", "))
}

pub fn effects(scene: &Scene) -> Vec<Effect> {
    let dampers = DampingTerm::ALL.map(|term| {
        let (TermDescription { effect: name, symbol, dimension, .. }, value) =
            (term.description(), scene.damping.coefficients[term]);
        effect(name, (value > 0.0, setting(symbol, value, *dimension)))
    });
    let parts = [contact_effects(scene), further_effects(scene), water_effects(scene), mesh_effects(scene)];
    dampers.into_iter().chain(parts.into_iter().flatten()).chain(impact_effects(scene)).collect()
}

fn contact_effects(scene: &Scene) -> Vec<Effect> {
    let (chain, damping) = (&scene.chain, &scene.damping);
    let damped = !damping.coefficients.are_absent();
    let of_dampers = |is_on: bool, why: String| if damped { (is_on, why) } else { off("there are no dampers") };
    let placement = match damping.placement {
        DampingPlacement::All => "damping.at = all",
        DampingPlacement::Beads => "damping.at = beads",
    };
    let unequal = chain.beads.iter().filter(|bead| Some(*bead) != chain.beads.first()).count();
    let largest_gap = Quantity::new(chain.gaps.iter().copied().fold(0.0, f64::max), Dimension::LENGTH);
    let gaps = match chain.gaps.iter().filter(|gap| **gap > 0.0).count() {
        0 => off("all contacts are closed"),
        open => on(format!("{open} of {} contacts open, at most {largest_gap}", chain.gaps.len())),
    };
    let annulus = match scene.support.ring() {
        Some((shape, factor, _)) if *shape == AnnulusShape::published() => {
            on(format!("support.stiffness_factor = {factor}"))
        }
        Some((shape, factor, _)) => on(format!(
            "support.stiffness_factor = {factor}, {}, {}",
            setting("support.ring_radius", shape.ring_radius, Dimension::LENGTH),
            setting("support.section_radius", shape.section_radius, Dimension::LENGTH)
        )),
        None => off("support.kind is not annulus"),
    };
    let spring = match scene.support.spring() {
        Some(stiffness) => on(setting("support.stiffness", stiffness, Dimension::STIFFNESS)),
        None => off("support.kind is not spring"),
    };
    let half_space = match (scene.piston, scene.support.flat()) {
        (FlatContact::HalfSpace, Some(FlatContact::HalfSpace)) => on("piston and support are half-spaces"),
        (FlatContact::HalfSpace, _) => on("piston.contact = half-space"),
        (_, Some(FlatContact::HalfSpace)) => on("support.kind = half-space"),
        _ => off("no flat is a half-space"),
    };
    let finite_body = match (scene.model.kind, scene.contact_law) {
        (ModelKind::Chain, ContactLaw::FiniteBody) => {
            on(format!("contact.law = finite-body, model.mesh_density = {}", scene.model.meshing().density))
        }
        (ModelKind::Chain, ContactLaw::Hertz) => off("contact.law = hertz"),
        _ => off(format!("{}: the contacts are computed", model(scene))),
    };
    let ring_up = match scene.drive.kind {
        DriveKind::ToneBurst { ring_up, .. } => (ring_up > 0.0, setting("drive.ring_up", ring_up, Dimension::TIME)),
        _ => off("drive.kind is not tone-burst"),
    };
    let record = match &scene.drive.kind {
        DriveKind::Record { displacement, .. } => on(format!("a record of {} samples", displacement.len())),
        DriveKind::UnreadRecord { file } => on(format!("drive.file = {}", file.display())),
        _ => off("the drive is a formula"),
    };
    let force = chain.precompression;
    vec![
        effect(
            "dampers at piston and support",
            of_dampers(damping.placement == DampingPlacement::All, placement.to_owned()),
        ),
        effect("pulling dampers", of_dampers(damping.tension, format!("damping.tension = {}", damping.tension))),
        effect("precompression", (force > 0.0, setting("chain.precompression", force, Dimension::FORCE))),
        effect("initial gaps", gaps),
        effect(
            "unequal beads",
            (unequal > 0, format!("{unequal} of {} beads differ from the first", chain.beads.len())),
        ),
        effect("resin annulus", annulus),
        effect("spring support", spring),
        effect("elastic flats", half_space),
        effect("finite-body contacts", finite_body),
        effect("ring-up of the drive", ring_up),
        effect("recorded drive", record),
    ]
}

fn further_effects(scene: &Scene) -> Vec<Effect> {
    let horn = match scene.horn {
        Some(Horn { mass, frequency, quality }) => on(format!(
            "{}, {}, horn.quality = {quality}",
            setting("horn.mass", mass, Dimension::MASS),
            setting("horn.frequency", frequency, Dimension::FREQUENCY)
        )),
        None => off("horn.mass is not given: the tip moves as prescribed"),
    };
    let (holder, loss) = (scene.holder.unwrap_or_default(), scene.loss);
    let friction = format!(
        "{}, {}",
        setting("holder.friction_force", holder.friction_force, Dimension::FORCE),
        setting("holder.slip_velocity", holder.slip_velocity, Dimension::VELOCITY)
    );
    let oblique = format!(
        "{}, holder.friction_coefficient = {}",
        setting("holder.clearance", holder.clearance, Dimension::LENGTH),
        holder.friction_coefficient
    );
    let relaxation = match (loss.relaxation, scene.support.ring()) {
        (Some(Relaxation { strength, time }), Some(_)) => {
            on(format!("loss.relaxation = {strength}, {}", setting("loss.relaxation_time", time, Dimension::TIME)))
        }
        (None, Some(_)) => off("loss.relaxation = 0"),
        (_, None) => off("support.kind is not annulus"),
    };
    let is_chain = scene.model.kind == ModelKind::Chain;
    let yields = match scene.yield_strength {
        _ if !is_chain => off(model(scene)),
        Some(strength) => on(setting("contact.yield_strength", strength, Dimension::PRESSURE)),
        None => off("contact.yield_strength is not given: elastic"),
    };
    let lossy = match scene.model.kind.is_meshed() {
        true => (
            loss.beads > 0.0 || loss.support > 0.0,
            format!("loss.beads = {}, loss.support = {}", loss.beads, loss.support),
        ),
        false => off(model(scene)),
    };
    vec![
        effect("loaded horn", horn),
        effect(
            "drag in the bead guide",
            (holder.drag > 0.0, setting("holder.drag", holder.drag, Dimension::LINEAR_DAMPING)),
        ),
        effect("friction in the bead guide", (holder.friction_force > 0.0, friction)),
        effect(
            "oblique contacts",
            (holder.clearance > 0.0 && (is_chain || holder.friction_coefficient > 0.0), oblique),
        ),
        effect("yielding contacts", yields),
        effect("relaxing annulus", relaxation),
        effect("loss in the bodies", lossy),
    ]
}

/// What a column under a striker has; listed where it is on only.
fn impact_effects(scene: &Scene) -> impl Iterator<Item = Effect> {
    let chain = &scene.chain;
    let striker = scene.drive.kind.striker().map(|(bead, velocity)| {
        let velocity = setting("drive.velocity", velocity, Dimension::VELOCITY);
        format!("{velocity}, {}", setting("drive.radius", bead.radius, Dimension::LENGTH))
    });
    let gravity = given(chain.gravity).map(|gravity| setting("chain.gravity", gravity, Dimension::ACCELERATION));
    let foundation = match &scene.support {
        Support::Foundation { youngs_modulus, loss_time, .. } => Some(format!(
            "{}, {}",
            setting("support.youngs_modulus", *youngs_modulus, Dimension::PRESSURE),
            setting("support.loss_time", *loss_time, Dimension::TIME)
        )),
        _ => None,
    };
    let plate = scene.support.plate();
    let plate = plate.map(|plate| setting("support.plate_thickness", plate.thickness, Dimension::LENGTH));
    let sensor =
        chain.sensor.map(|Sensor { bead, share }| format!("chain.sensor = {bead}, chain.sensor_share = {share}"));
    [
        ("striker", striker),
        ("gravity", gravity),
        ("elastic foundation", foundation),
        ("plate on the foundation", plate),
        ("force at a sensor bead", sensor),
    ]
    .into_iter()
    .filter_map(|(name, why)| Some(effect(name, on(why?))))
}

fn water_effects(scene: &Scene) -> Vec<Effect> {
    let disc = scene.support.disc().map(|(shape, _)| shape);
    let not_given = || off(if disc.is_some() { "water.medium = none" } else { "support.kind is not disc" });
    let elastic = disc.map_or_else(not_given, |shape| {
        on(format!("disc.material = {}, disc.rim = {}", shape.material.name, shape.rim.name()))
    });
    let water = scene.water.as_ref().filter(|_| disc.is_some());
    let behind = water.map_or_else(not_given, |water| {
        let (medium, method, baffle) = (water.medium.name(), water.method.name(), water.baffle.name());
        on(format!("water.medium = {medium}, water.method = {method}, water.baffle = {baffle}"))
    });
    let absorption = water.map_or_else(not_given, |water| match water.absorption {
        None => off("water.absorption = 0 Np/m"),
        Some(law) => {
            let at_1_mhz = setting("water.absorption", law.at_1_mhz, Dimension::ATTENUATION);
            on(format!("{at_1_mhz} at 1 MHz, exponent {}", law.exponent))
        }
    });
    vec![
        effect("elastic disc", elastic),
        effect("water behind the disc", behind),
        effect("absorption in the water", absorption),
    ]
}

fn mesh_effects(scene: &Scene) -> Vec<Effect> {
    let (kind, fea) = (scene.model.kind, &scene.model.fea);
    let under = |has: bool, setting: (bool, String)| if has { setting } else { off(model(scene)) };
    let in_fea = |setting| under(kind == ModelKind::Fea, setting);
    let in_meshed = |setting| under(kind.is_meshed(), setting);
    let off_axis = match scene.support.normal() {
        Some(normal) => (normal == ContactNormal::Moving, format!("support.normal = {}", normal.name())),
        None => off("no contact lies off the axis"),
    };
    let meshed = scene.chain.beads.iter().filter(|bead| bead.mesh.is_some()).count();
    let own = scene.support.mesh_file().is_some();
    let support = if own { "the support" } else { "no support" };
    let dissipation = match (fea.scheme, fea.scheme.dissipation()) {
        (Scheme::Trapezoid, _) => off("model.integrator = trapezoid"),
        (scheme, value) => {
            (value > 0.0, format!("model.integrator = {}, model.numerical_dissipation = {value}", scheme.name()))
        }
    };
    let density = format!("{}, model.mesh_density = {}", model(scene), scene.model.meshing().density);
    let modes = scene.model.reduced.modes;
    let kept = (modes > 0, format!("model.modes = {modes}, the rest as static flexibility"));
    let contact_mass = fea.contact_mass;
    let mass = (contact_mass == ContactMass::Consistent, format!("model.contact_mass = {}", contact_mass.name()));
    vec![
        effect("elastic bodies", in_meshed(on(density))),
        effect("modes of the bodies", under(kind == ModelKind::Reduced, kept)),
        effect("mass at the contact nodes", in_fea(mass)),
        effect("numerical dissipation", in_fea(dissipation)),
        effect("moving contact normal", in_meshed(off_axis)),
        effect(
            "bodies from mesh files",
            in_meshed((meshed > 0 || own, format!("{meshed} beads and {support} from mesh files"))),
        ),
    ]
}
