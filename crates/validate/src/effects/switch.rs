//! How every effect is taken out of a scene, or put into one that does not have it.

use granchain_model::scene::{
    Absorption, ContactLaw, DEFAULT_MODES, Damping, DampingKind, DampingPlacement, DampingTerm, DriveKind, FlatContact,
    Horn, Integrator, ModelKind, Relaxation, Scene, Scheme, Support, TermDescription, WaterMesh, WaterMethod,
};
use granchain_signal::Quantity;

/// Whether an effect belongs to the experiment or to how it is computed.
#[derive(Debug, Clone, Copy, PartialEq, Eq, serde::Serialize)]
#[serde(rename_all = "kebab-case")]
pub enum Belongs {
    /// To what stands on the bench: without it the experiment is another one.
    Bench,
    /// To the model: the experiment is the same, computed more or less closely.
    Model,
}

/// An effect that can be taken out or put in.
#[derive(Clone, Copy)]
pub(super) enum Switch {
    /// A term of the dashpots.
    Damper(DampingTerm),
    Other(&'static Change),
}

impl Switch {
    /// All of them, in the order of [`granchain_model::scene::effects`].
    pub(super) fn all() -> impl ExactSizeIterator<Item = Self> {
        let all: Vec<Self> =
            DampingTerm::ALL.into_iter().map(Self::Damper).chain(CHANGES.iter().map(Self::Other)).collect();
        all.into_iter()
    }

    /// As [`granchain_model::scene::effects`] calls it.
    pub(super) fn name(self) -> &'static str {
        match self {
            Self::Damper(term) => term.description().effect,
            Self::Other(change) => change.name,
        }
    }

    pub(super) fn belongs(self) -> Belongs {
        match self {
            Self::Damper(_) => Belongs::Bench,
            Self::Other(change) => change.belongs,
        }
    }

    /// The scene key that takes it out, or puts it in with the strength it is tried at.
    pub(super) fn key(self, is_on: bool) -> String {
        match self {
            Self::Damper(_) if is_on => "damping.kind = none".into(),
            Self::Damper(term) => {
                let TermDescription { default, dimension, .. } = *term.description();
                let law = DampingKind::of_terms(|other| other == term).map_or("none", DampingKind::name);
                format!("damping.kind = {law}, damping.coefficient = {}", Quantity::new(default, dimension))
            }
            Self::Other(change) => if is_on { change.out } else { change.key }.into(),
        }
    }

    /// Take it out of a scene that has it; false where that makes no scene.
    pub(super) fn remove(self, scene: &mut Scene) -> bool {
        match self {
            Self::Damper(term) => damp(scene, term, 0.0),
            Self::Other(change) => (change.remove)(scene),
        }
    }

    /// Put it into a scene that does not have it; false where it does not go with the scene.
    pub(super) fn insert(self, scene: &mut Scene) -> bool {
        match self {
            Self::Damper(term) => damp(scene, term, term.description().default),
            Self::Other(change) => (change.insert)(scene),
        }
    }

    /// What both runs have beside it, such as a model in which it can be computed; false where there is none.
    pub(super) fn ground(self, scene: &mut Scene) -> bool {
        match self {
            Self::Damper(_) => true,
            Self::Other(change) => (change.ground)(scene),
        }
    }
}

/// How an effect is taken out or put in.
pub(super) struct Change {
    name: &'static str,
    belongs: Belongs,
    /// The scene key that takes it out.
    out: &'static str,
    /// Take it out of a scene that has it; false where that makes no scene.
    remove: fn(&mut Scene) -> bool,
    /// The scene key that puts it in, with the strength it is tried at.
    key: &'static str,
    /// Put it into a scene that does not have it; false where it does not go with the scene.
    insert: fn(&mut Scene) -> bool,
    /// What both runs have beside it, such as a model in which it can be computed; false where there is none.
    ground: fn(&mut Scene) -> bool,
}

fn never(_: &mut Scene) -> bool {
    false
}

fn as_it_is(_: &mut Scene) -> bool {
    true
}

/// Give a term of the dashpots a coefficient, or take it out; false where no law is what is left.
fn damp(scene: &mut Scene, term: DampingTerm, coefficient: f64) -> bool {
    let mut coefficients = scene.damping.coefficients;
    coefficients[term] = coefficient;
    let kind = DampingKind::of_terms(|term| coefficients[term] > 0.0);
    kind.map(|kind| scene.damping = Damping { kind, coefficients, ..scene.damping }).is_some()
}

fn is_damped(scene: &mut Scene) -> bool {
    !scene.damping.coefficients.are_absent()
}

fn rigid_wall(scene: &mut Scene) -> bool {
    scene.water = None;
    scene.support = Support::Flat(FlatContact::Rigid);
    true
}

fn has_flat(scene: &Scene) -> bool {
    matches!(scene.support, Support::Flat(_))
}

/// The chain with Hertz contacts, on the clock a disc needs.
fn point_masses(scene: &mut Scene) -> bool {
    let step = match scene.model.kind {
        ModelKind::Reduced => scene.model.reduced.step,
        _ => scene.model.fea.step,
    };
    if matches!(scene.support, Support::Disc { .. }) {
        scene.model.integrator = Integrator::OnDisc { step };
    }
    scene.model.kind = ModelKind::Chain;
    scene.contact_law = ContactLaw::Hertz;
    true
}

fn elastic_bodies(scene: &mut Scene) -> bool {
    if let Integrator::OnDisc { step } = scene.model.integrator {
        scene.model.reduced.step = step;
    }
    scene.model.kind = ModelKind::Reduced;
    scene.contact_law = ContactLaw::Hertz;
    true
}

/// Elastic bodies that do not ring.
fn still_bodies(scene: &mut Scene) -> bool {
    scene.model.reduced.modes = 0;
    elastic_bodies(scene)
}

/// Contacts of finite bodies do not relax: the chain then has the usual ones.
fn takes_effects(scene: &mut Scene) -> bool {
    if scene.model.kind == ModelKind::Chain && !matches!(scene.support, Support::Disc { .. }) {
        scene.contact_law = ContactLaw::Hertz;
    }
    true
}

/// A bead guide that does nothing is none.
fn emptied(scene: &mut Scene) {
    scene.holder = scene.holder.filter(|holder| holder.acts() || holder.clearance > 0.0);
}

const CHANGES: &[Change] = &[
    Change {
        name: "dampers at piston and support",
        belongs: Belongs::Bench,
        out: "damping.at = beads",
        remove: |scene| {
            scene.damping.placement = DampingPlacement::Beads;
            true
        },
        key: "damping.at = all",
        insert: |scene| {
            scene.damping.placement = DampingPlacement::All;
            true
        },
        ground: is_damped,
    },
    Change {
        name: "pulling dampers",
        belongs: Belongs::Bench,
        out: "damping.tension = false",
        remove: |scene| {
            scene.damping.tension = false;
            true
        },
        key: "damping.tension = true",
        insert: |scene| {
            scene.damping.tension = true;
            true
        },
        ground: is_damped,
    },
    Change {
        name: "precompression",
        belongs: Belongs::Bench,
        out: "chain.precompression = 0 N",
        remove: |scene| {
            scene.chain.precompression = 0.0;
            true
        },
        key: "chain.precompression = 0.05 N",
        insert: |scene| {
            scene.chain.precompression = 0.05;
            scene.chain.gaps.iter().all(|gap| *gap <= 0.0)
        },
        ground: as_it_is,
    },
    Change {
        name: "initial gaps",
        belongs: Belongs::Bench,
        out: "chain.gaps = 0",
        remove: |scene| {
            scene.chain.gaps.fill(0.0);
            true
        },
        key: "chain.gaps = { contact1 = 5 nm }",
        insert: |scene| {
            scene.chain.gaps[0] = 5e-9;
            scene.chain.precompression == 0.0
        },
        ground: as_it_is,
    },
    Change {
        name: "unequal beads",
        belongs: Belongs::Bench,
        out: "no [[chain.override]]",
        remove: |scene| {
            let first = scene.chain.beads[0].clone();
            scene.chain.beads.fill(first);
            true
        },
        key: "[[chain.override]] bead = 2, radius 1 % larger",
        insert: |scene| match scene.chain.beads.get_mut(1) {
            Some(bead) => {
                bead.radius *= 1.01;
                true
            }
            None => false,
        },
        ground: as_it_is,
    },
    Change {
        name: "resin annulus",
        belongs: Belongs::Bench,
        out: "support.kind = rigid",
        remove: rigid_wall,
        key: "support.kind = annulus",
        insert: |scene| {
            let fits = has_flat(scene);
            scene.support = Support::resin_annulus(1.0);
            fits
        },
        ground: as_it_is,
    },
    Change {
        name: "spring support",
        belongs: Belongs::Bench,
        out: "support.kind = rigid",
        remove: rigid_wall,
        key: "support.kind = spring, support.stiffness = 10 N/um",
        insert: |scene| {
            let fits = has_flat(scene);
            scene.support = Support::Spring { stiffness: 1e7 };
            fits
        },
        ground: as_it_is,
    },
    Change {
        name: "elastic flats",
        belongs: Belongs::Bench,
        out: "piston.contact = rigid, support.kind = rigid",
        remove: |scene| {
            scene.piston = FlatContact::Rigid;
            if has_flat(scene) {
                scene.support = Support::Flat(FlatContact::Rigid);
            }
            true
        },
        key: "piston.contact = half-space, support.kind = half-space",
        insert: |scene| {
            scene.piston = FlatContact::HalfSpace;
            if has_flat(scene) {
                scene.support = Support::Flat(FlatContact::HalfSpace);
            }
            true
        },
        // A half-space cannot be meshed: in the chain, where its stiffness is known.
        ground: |scene| scene.model.kind == ModelKind::Chain || point_masses(scene),
    },
    Change {
        name: "finite-body contacts",
        belongs: Belongs::Model,
        out: "contact.law = hertz",
        remove: |scene| {
            scene.contact_law = ContactLaw::Hertz;
            true
        },
        key: "contact.law = finite-body",
        insert: |scene| {
            scene.contact_law = ContactLaw::FiniteBody;
            true
        },
        // Meshed bodies have their own.
        ground: |scene| scene.model.kind == ModelKind::Chain && !matches!(scene.support, Support::Disc { .. }),
    },
    Change {
        name: "ring-up of the drive",
        belongs: Belongs::Bench,
        out: "drive.ring_up = 0 s",
        remove: |scene| match &mut scene.drive.kind {
            DriveKind::ToneBurst { ring_up, .. } => {
                *ring_up = 0.0;
                true
            }
            _ => false,
        },
        key: "",
        insert: never,
        ground: as_it_is,
    },
    Change {
        name: "loaded horn",
        belongs: Belongs::Bench,
        out: "no horn.mass",
        remove: |scene| {
            scene.horn = None;
            true
        },
        key: "horn.mass = 100 mg, horn.quality = 50",
        insert: |scene| {
            let frequency = scene.drive.frequency;
            scene.horn = Some(Horn { mass: 1e-4, frequency, quality: 50.0 });
            true
        },
        ground: takes_effects,
    },
    Change {
        name: "drag in the bead guide",
        belongs: Belongs::Bench,
        out: "holder.drag = 0",
        remove: |scene| {
            scene.holder_mut().drag = 0.0;
            emptied(scene);
            true
        },
        key: "holder.drag = 0.02 N s/m",
        insert: |scene| {
            scene.holder_mut().drag = 0.02;
            true
        },
        ground: takes_effects,
    },
    Change {
        name: "friction in the bead guide",
        belongs: Belongs::Bench,
        out: "holder.friction_force = 0",
        remove: |scene| {
            scene.holder_mut().friction_force = 0.0;
            emptied(scene);
            true
        },
        key: "holder.friction_force = 5 mN",
        insert: |scene| {
            scene.holder_mut().friction_force = 5e-3;
            true
        },
        ground: takes_effects,
    },
    Change {
        name: "oblique contacts",
        belongs: Belongs::Bench,
        out: "holder.clearance = 0, no holder.friction_coefficient",
        remove: |scene| {
            let holder = scene.holder_mut();
            (holder.clearance, holder.friction_coefficient) = (0.0, 0.0);
            emptied(scene);
            true
        },
        key: "holder.clearance = 20 um, holder.friction_coefficient = 0.15",
        insert: |scene| {
            let holder = scene.holder_mut();
            (holder.clearance, holder.friction_coefficient) = (20e-6, 0.15);
            scene.chain.beads.len() > 1
        },
        ground: takes_effects,
    },
    Change {
        name: "yielding contacts",
        belongs: Belongs::Bench,
        out: "no contact.yield_strength",
        remove: |scene| {
            scene.yield_strength = None;
            true
        },
        key: "contact.yield_strength = 2 GPa",
        insert: |scene| {
            scene.yield_strength = Some(2e9);
            true
        },
        ground: |scene| {
            // The chain alone yields, its contacts each for itself.
            !matches!(scene.support, Support::Disc { .. }) && point_masses(scene)
        },
    },
    Change {
        name: "relaxing annulus",
        belongs: Belongs::Bench,
        out: "loss.relaxation = 0",
        remove: |scene| {
            scene.loss.relaxation = None;
            true
        },
        key: "loss.relaxation = 0.1, loss.relaxation_time = 2 us",
        insert: |scene| {
            scene.loss.relaxation = Some(Relaxation { strength: 0.1, time: 2e-6 });
            true
        },
        ground: |scene| matches!(scene.support, Support::Annulus { .. }) && takes_effects(scene),
    },
    Change {
        name: "loss in the bodies",
        belongs: Belongs::Bench,
        out: "loss.beads = 0, loss.support = 0",
        remove: |scene| {
            (scene.loss.beads, scene.loss.support) = (0.0, 0.0);
            true
        },
        key: "loss.beads = 0.001",
        insert: |scene| {
            scene.loss.beads = 1e-3;
            true
        },
        ground: |scene| scene.model.kind.is_meshed() || elastic_bodies(scene),
    },
    Change {
        name: "elastic disc",
        belongs: Belongs::Bench,
        out: "support.kind = rigid",
        remove: rigid_wall,
        key: "",
        insert: never,
        ground: as_it_is,
    },
    Change {
        name: "water behind the disc",
        belongs: Belongs::Bench,
        out: "water.medium = none",
        remove: |scene| {
            scene.water = None;
            true
        },
        key: "",
        insert: never,
        ground: as_it_is,
    },
    Change {
        name: "water by elements",
        belongs: Belongs::Model,
        out: "water.method = rayleigh",
        remove: |scene| match &mut scene.water {
            Some(water) => {
                water.method = WaterMethod::Rayleigh;
                water.baffle == granchain_model::scene::Baffle::Rigid
            }
            None => false,
        },
        key: "water.method = elements",
        insert: |scene| {
            let Support::Disc { shape, .. } = &scene.support else { return false };
            let Some(water) = &mut scene.water else { return false };
            let mesh = WaterMesh { radius: 2.5 * shape.radius, side: shape.radius / 20.0 };
            water.method = WaterMethod::Elements(mesh);
            water.field_points.iter().all(|point| point.radius.hypot(point.distance) < mesh.radius)
        },
        ground: as_it_is,
    },
    Change {
        name: "absorption in the water",
        belongs: Belongs::Bench,
        out: "water.absorption = 0",
        remove: |scene| match &mut scene.water {
            Some(water) => {
                water.absorption = None;
                true
            }
            None => false,
        },
        // Fresh water: Pinkerton (1949), as in the model's own documentation.
        key: "water.absorption = 0.025 Np/m, water.absorption_exponent = 2",
        insert: |scene| match &mut scene.water {
            Some(water) => {
                water.absorption = Some(Absorption { at_1_mhz: 0.025, exponent: 2.0 });
                true
            }
            None => false,
        },
        ground: as_it_is,
    },
    Change {
        name: "elastic bodies",
        belongs: Belongs::Model,
        out: "model.kind = chain",
        remove: point_masses,
        key: "model.kind = reduced",
        insert: elastic_bodies,
        ground: as_it_is,
    },
    Change {
        name: "modes of the bodies",
        belongs: Belongs::Model,
        out: "model.modes = 0",
        remove: |scene| {
            scene.model.reduced.modes = 0;
            true
        },
        key: "model.modes = 8",
        insert: |scene| {
            scene.model.reduced.modes = DEFAULT_MODES;
            true
        },
        ground: |scene| {
            scene.model.kind == ModelKind::Reduced || scene.model.kind == ModelKind::Chain && still_bodies(scene)
        },
    },
    Change {
        name: "numerical dissipation",
        belongs: Belongs::Model,
        out: "model.integrator = trapezoid",
        remove: |scene| {
            scene.model.fea.scheme = Scheme::Trapezoid;
            true
        },
        key: "",
        insert: never,
        ground: |scene| scene.model.kind == ModelKind::Fea,
    },
];
