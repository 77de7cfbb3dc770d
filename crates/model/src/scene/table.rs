//! All keys of a scene file. Reader, listing, refusals, overlays and help read this table; only what ties several keys together is
//! checked where the scene is built.

use super::{
    AnnulusShape, Baffle, ContactLaw, ContactMass, ContactNormal, DEFAULT_CONTACT_PATCH, DEFAULT_DISC,
    DEFAULT_OUTPUT_STEP, DEFAULT_TOLERANCE, DampingKind, DampingPlacement, DampingTerm, DriveKind, Elements,
    FlatContact, Holder, Integrator, Key, MOST_BEADS, ModelKind, Rim, Scheme, Support, ValueKind,
    condition::{
        BODY_MESH, DISC, DRIVES, FORMULA, INTEGRATORS, LIQUID, MEDIA, MESHED, METHODS, OWN_BODY, OWN_NORMAL, RING,
        STEPPED, SUPPORTS, WATER_MESH,
    },
    key::When::{Beside, Damped, Is},
    key::{beside, count, nowhere, number, of_material, optional, value, word},
    listing::{
        SettingValue, absorption, beads, coefficient, damped, differing_beads, disc, gaps, given, meshing, of_sum,
        path, ring, shared_mesh, support_mesh, text, water, water_mesh, whole,
    },
    reader::Bound,
};
use granchain_signal::Dimension;

pub const KEYS: &[Key] = &[
    value("name", ValueKind::Text, |scene| text(&scene.name), "name of the scene").usually("the file's name"),
    value("description", ValueKind::Text, |scene| text(&scene.description), "one sentence on what it is")
        .usually("nothing"),
    nowhere("extends", ValueKind::Text, "built-in scene this file changes").usually("nothing"),
    number("alpha", Dimension::NONE, Bound::NotNegative, |scene| Some(scene.amplitude_scale), "α, factor on the drive")
        .or(1.0),
    number("duration", Dimension::TIME, Bound::Positive, |scene| Some(scene.duration), "simulated time")
        .needed("duration = \"120 us\""),
    number(
        "output_step",
        Dimension::TIME,
        Bound::Positive,
        |scene| Some(scene.output_step),
        "interval of the output samples",
    )
    .or(DEFAULT_OUTPUT_STEP),
    number(
        "vibrometer.bandwidth",
        Dimension::FREQUENCY,
        Bound::Positive,
        |scene| Some(scene.vibrometer_bandwidth),
        "bandwidth (−6 dB) below which simulated velocities are measured; of half the output's sample rate, all of it",
    )
    .usually("1.5 MHz, or 4 f0 where that is more"),
    count(
        "chain.beads",
        (1, MOST_BEADS as u32),
        |scene| Some(beads(scene.chain.beads.len())),
        "number of beads N, 1 to 1000",
    )
    .needed("chain.beads = 6"),
    number(
        "chain.radius",
        Dimension::LENGTH,
        Bound::Radius,
        |scene| scene.chain.beads.first().map(|bead| bead.radius),
        "radius of a bead",
    )
    .needed("chain.radius = \"0.5 mm\""),
    value(
        "chain.material",
        ValueKind::Text,
        |scene| text(&scene.chain.beads.first()?.material.name),
        "material of the beads",
    )
    .needed("chain.material = \"chrome-steel\""),
    value("chain.gaps", ValueKind::Gaps, gaps, "initial gap of every contact, or of each of the N + 1 from the piston")
        .usually("0 m"),
    number(
        "chain.precompression",
        Dimension::FORCE,
        Bound::NotNegative,
        |scene| Some(scene.chain.precompression),
        "static force along the chain before the drive starts",
    )
    .or(0.0),
    value(
        "chain.mesh",
        ValueKind::Path,
        |scene| path(shared_mesh(scene)?),
        "Gmsh file with the mesh of the beads, relative to the scene file",
    )
    .usually("a mesh of the program's own")
    .when(BODY_MESH),
    number(
        "chain.mesh_unit",
        Dimension::LENGTH,
        Bound::Positive,
        |scene| Some(shared_mesh(scene)?.unit),
        "length of its unit; default 1 m",
    )
    .or(1.0)
    .when(BODY_MESH),
    value(
        "chain.override",
        ValueKind::BeadOverrides,
        differing_beads,
        "beads that differ: number from the piston, radius, material, mesh",
    )
    .usually("none"),
    of_material(
        "materials.*.youngs_modulus",
        Dimension::PRESSURE,
        Bound::Modulus,
        |material| material.youngs_modulus,
        "Young's modulus E",
    )
    .usually("that of the program's own material of the name"),
    of_material(
        "materials.*.poissons_ratio",
        Dimension::NONE,
        Bound::PoissonsRatio,
        |material| material.poissons_ratio,
        "Poisson's ratio ν",
    )
    .usually("that of the program's own material of the name"),
    of_material("materials.*.density", Dimension::DENSITY, Bound::Density, |material| material.density, "density ρ")
        .usually("that of the program's own material of the name"),
    word::<FlatContact>(
        "piston.contact",
        |scene| text(scene.piston.name()),
        "face of the piston: rigid flat, or half-space of the bead's material",
    ),
    number(
        "horn.mass",
        Dimension::MASS,
        Bound::Positive,
        |scene| Some(scene.horn?.mass),
        "modal mass M at the horn's tip, whose free motion the drive then is: the chain's push moves it besides",
    )
    .usually("none: the tip moves as prescribed"),
    number(
        "horn.frequency",
        Dimension::FREQUENCY,
        Bound::Positive,
        |scene| Some(scene.horn?.frequency),
        "its resonance",
    )
    .usually("the drive's"),
    number(
        "horn.quality",
        Dimension::NONE,
        Bound::Positive,
        |scene| Some(scene.horn?.quality).filter(|quality| quality.is_finite()),
        "Q of the horn's resonance",
    )
    .usually("infinite"),
    optional(
        "holder.drag",
        Dimension::LINEAR_DAMPING,
        |scene| given(scene.holder?.drag),
        "viscous drag b on every bead, −b v",
    ),
    optional(
        "holder.friction_force",
        Dimension::FORCE,
        |scene| given(scene.holder?.friction_force),
        "friction on every bead under a constant load across the chain",
    ),
    optional(
        "holder.friction_coefficient",
        Dimension::NONE,
        |scene| given(scene.holder?.friction_coefficient),
        "coefficient μ of the friction that the clearance makes",
    ),
    optional(
        "holder.clearance",
        Dimension::LENGTH,
        |scene| given(scene.holder?.clearance),
        "diameter of the bore less that of the beads: lines of centres oblique by at most sin θ = e/2a",
    ),
    number(
        "holder.slip_velocity",
        Dimension::VELOCITY,
        Bound::NotNegative,
        |scene| scene.holder.filter(Holder::has_friction).map(|holder| holder.slip_velocity),
        "velocity over which friction turns its sign; 0 is the exact law, with beads that stick",
    )
    .usually("0 on the chain, else 1 mm/s"),
    value(
        "drive.kind",
        ValueKind::Choice(DRIVES),
        |scene| text(scene.drive.kind.name()),
        "waveform of the piston's displacement",
    )
    .needed("drive.kind = \"tone-burst\""),
    value(
        "drive.file",
        ValueKind::Path,
        |scene| match &scene.drive.kind {
            DriveKind::Record { file: Some(file), .. } | DriveKind::UnreadRecord { file } => {
                text(&file.display().to_string())
            }
            _ => None,
        },
        "horn-tip record, relative to the scene file",
    )
    .needed("drive.file = \"horn_tip.csv\"")
    .when(&[Is("drive.kind", &["record"])]),
    number(
        "drive.amplitude",
        Dimension::LENGTH,
        Bound::NotNegative,
        |scene| scene.drive.kind.cycles().map(|_| scene.drive.amplitude),
        "peak displacement at α = 1",
    )
    .needed("drive.amplitude = \"1 um\"")
    .when(FORMULA),
    number(
        "drive.frequency",
        Dimension::FREQUENCY,
        Bound::Positive,
        |scene| Some(scene.drive.frequency),
        "drive frequency f0",
    )
    .needed("drive.frequency = \"73 kHz\"")
    .usually("the record's own; a formula must be told")
    .when(&[Is("drive.kind", DRIVES)]),
    number(
        "drive.cycles",
        Dimension::NONE,
        Bound::Positive,
        |scene| scene.drive.kind.cycles(),
        "length of the burst in periods of f0",
    )
    .needed("drive.cycles = 40")
    .when(FORMULA),
    number(
        "drive.ring_up",
        Dimension::TIME,
        Bound::NotNegative,
        |scene| if let DriveKind::ToneBurst { ring_up, .. } = scene.drive.kind { Some(ring_up) } else { None },
        "time constant τ of ring-up and decay; 0 is rectangular",
    )
    .needed("drive.ring_up = \"100 us\"")
    .when(&[Is("drive.kind", &["tone-burst"])]),
    value("support.kind", ValueKind::Choice(SUPPORTS), |scene| text(scene.support.name()), "what holds the far end")
        .needed("support.kind = \"rigid\""),
    number(
        "support.ring_radius",
        Dimension::LENGTH,
        Bound::Radius,
        |scene| Some(ring(scene)?.ring_radius),
        "radius R of the circle of the centres of the ring's sections, and of its clamped side",
    )
    .or(AnnulusShape::published().ring_radius)
    .when(RING),
    number(
        "support.section_radius",
        Dimension::LENGTH,
        Bound::Radius,
        |scene| Some(ring(scene)?.section_radius),
        "radius b of the ring's section, a half disc; the opening has R − b",
    )
    .or(AnnulusShape::published().section_radius)
    .when(RING),
    number(
        "support.stiffness_factor",
        Dimension::NONE,
        Bound::Positive,
        |scene| {
            if let Support::Annulus { stiffness_factor, .. } = scene.support { Some(stiffness_factor) } else { None }
        },
        "factor on the stiffness of the annulus",
    )
    .or(1.0)
    .when(RING),
    value(
        "support.material",
        ValueKind::Text,
        |scene| match &scene.support {
            Support::Annulus { material, .. } | Support::Body { material, .. } => text(&material.name),
            _ => None,
        },
        "material of the annulus or body",
    )
    .usually("resin")
    .when(&[Is("support.kind", &["annulus", "body"])]),
    word::<ContactNormal>(
        "support.normal",
        |scene| scene.support.normal().filter(|_| scene.model.kind.is_meshed()).and_then(|normal| text(normal.name())),
        "contact normal: of the undeformed surface, or to the moved bead",
    )
    .when(OWN_NORMAL),
    value(
        "support.mesh",
        ValueKind::Path,
        |scene| path(support_mesh(scene)?),
        "Gmsh file with the mesh of the body, relative to the scene file",
    )
    .needed("support.mesh = \"ring.msh\"")
    .when(OWN_BODY),
    number(
        "support.mesh_unit",
        Dimension::LENGTH,
        Bound::Positive,
        |scene| Some(support_mesh(scene)?.unit),
        "length of its unit; default 1 m",
    )
    .or(1.0)
    .when(OWN_BODY),
    number(
        "support.stiffness",
        Dimension::STIFFNESS,
        Bound::Positive,
        |scene| scene.support.spring(),
        "stiffness of the one-sided spring",
    )
    .needed("support.stiffness = \"0.7e6 N/m\"")
    .when(&[Is("support.kind", &["spring"])]),
    number("disc.radius", Dimension::LENGTH, Bound::Positive, |scene| Some(disc(scene)?.radius), "radius of the disc")
        .or(DEFAULT_DISC.0)
        .when(DISC),
    number(
        "disc.thickness",
        Dimension::LENGTH,
        Bound::Positive,
        |scene| Some(disc(scene)?.thickness),
        "thickness of the disc, below its radius",
    )
    .or(DEFAULT_DISC.1)
    .when(DISC),
    value("disc.material", ValueKind::Text, |scene| text(&disc(scene)?.material.name), "material of the disc")
        .usually("vitreous-carbon")
        .when(DISC),
    word::<Rim>("disc.rim", |scene| text(disc(scene)?.rim.name()), "how the lateral face of the disc is held")
        .when(DISC),
    count(
        "disc.mesh_density",
        (1, 64),
        |scene| if let Support::Disc { mesh_density, .. } = scene.support { Some(whole(mesh_density)) } else { None },
        "elements through the disc's thickness; 4/3 as many a length along r",
    )
    .usually("6")
    .when(DISC),
    value(
        "water.medium",
        ValueKind::Choice(MEDIA),
        |scene| disc(scene).and_then(|_| text(scene.water.as_ref().map_or("none", |water| water.medium.name()))),
        "what is behind the disc; none is a vacuum",
    )
    .usually("water")
    .when(DISC),
    number(
        "water.density",
        Dimension::DENSITY,
        Bound::Positive,
        |scene| Some(water(scene)?.liquid.density),
        "density ρ of it",
    )
    .usually("the medium's")
    .when(LIQUID),
    number(
        "water.sound_speed",
        Dimension::VELOCITY,
        Bound::Positive,
        |scene| Some(water(scene)?.liquid.sound_speed),
        "speed of sound c in it",
    )
    .usually("the medium's")
    .when(LIQUID),
    number(
        "water.absorption",
        Dimension::ATTENUATION,
        Bound::NotNegative,
        |scene| Some(absorption(scene)?.at_1_mhz),
        "attenuation α₁ of amplitude at 1 MHz, α = α₁ (f/1 MHz)^y",
    )
    .or(0.0)
    .when(LIQUID),
    number(
        "water.absorption_exponent",
        Dimension::NONE,
        Bound::Between(0.01, 2.0),
        |scene| Some(absorption(scene)?.exponent),
        "y of the attenuation",
    )
    .needed("water.absorption_exponent = 1.1")
    .when(LIQUID),
    word::<Baffle>(
        "water.baffle",
        |scene| text(water(scene)?.baffle.name()),
        "plane around the disc: at rest, or free of pressure",
    )
    .when(LIQUID),
    value(
        "water.method",
        ValueKind::Choice(METHODS),
        |scene| text(water(scene)?.method.name()),
        "Rayleigh integral over the disc, or acoustic elements",
    )
    .usually("rayleigh; elements beside a soft baffle or in the fea")
    .when(LIQUID),
    value(
        "water.field_points",
        ValueKind::FieldPoints,
        |scene| Some(SettingValue::FieldPoints(water(scene)?.field_points.clone())),
        "where the pressure is heard, z from the disc's back",
    )
    .usually("one at z = 1 mm on the axis")
    .when(LIQUID),
    number(
        "water.mesh_radius",
        Dimension::LENGTH,
        Bound::Positive,
        |scene| Some(water_mesh(scene)?.radius),
        "radius of the hemisphere of acoustic elements",
    )
    .usually("2.5 radii of the disc")
    .when(WATER_MESH),
    number(
        "water.mesh_side",
        Dimension::LENGTH,
        Bound::Positive,
        |scene| Some(water_mesh(scene)?.side),
        "side of an acoustic element along the radius",
    )
    .usually("1/20 of the disc's radius")
    .when(WATER_MESH),
    word::<DampingKind>("damping.kind", |scene| text(scene.damping.kind.name()), "law of the dashpots")
        .needed("damping.kind = \"none\""),
    value(
        "damping.coefficient",
        ValueKind::DampingCoefficient,
        |scene| match scene.damping.kind.terms() {
            [term] => coefficient(scene, *term),
            _ => None,
        },
        "c of the linear, γ of the Kuwabara–Kono dashpots",
    )
    .usually("the paper's")
    .when(&[Damped(false)]),
    beside(DampingTerm::Linear, |scene| of_sum(scene, DampingTerm::Linear), "c, where both laws act")
        .when(&[Beside(DampingTerm::Linear)]),
    beside(DampingTerm::KuwabaraKono, |scene| of_sum(scene, DampingTerm::KuwabaraKono), "γ, where both laws act")
        .when(&[Beside(DampingTerm::KuwabaraKono)]),
    word::<DampingPlacement>(
        "damping.at",
        |scene| damped(scene).and_then(|damping| text(damping.placement.name())),
        "dashpots at bead–bead contacts only, or at the ends too",
    )
    .usually("all")
    .when(&[Damped(true)]),
    value(
        "damping.tension",
        ValueKind::Flag,
        |scene| damped(scene).map(|damping| SettingValue::Flag(damping.tension)),
        "whether a contact force may pull while the contact parts",
    )
    .usually("false")
    .when(&[Damped(true)]),
    word::<ContactLaw>(
        "contact.law",
        |scene| if scene.model.kind == ModelKind::Chain { text(scene.contact_law.name()) } else { None },
        "law of the chain's contacts: of half-spaces, or fitted to the bodies and coupled through them",
    )
    .when(&[Is("model.kind", &["chain"])]),
    number(
        "contact.yield_strength",
        Dimension::PRESSURE,
        Bound::Modulus,
        |scene| if scene.model.kind == ModelKind::Chain { scene.yield_strength } else { None },
        "yield strength Y of the beads: their contacts yield from a pressure of 1.6 Y in the middle",
    )
    .usually("none: elastic")
    .when(&[Is("model.kind", &["chain"])]),
    number(
        "loss.beads",
        Dimension::NONE,
        Bound::Between(0.0, 1.0),
        |scene| given(scene.loss.beads).filter(|_| scene.model.kind.is_meshed()),
        "loss factor of the beads' material at 1 MHz, growing with frequency",
    )
    .usually("0")
    .when(BODY_MESH),
    number(
        "loss.support",
        Dimension::NONE,
        Bound::Between(0.0, 1.0),
        |scene| given(scene.loss.support).filter(|_| scene.model.kind.is_meshed()),
        "the same of the support's body",
    )
    .usually("0")
    .when(OWN_NORMAL),
    number(
        "loss.relaxation",
        Dimension::NONE,
        Bound::Between(0.0, 100.0),
        |scene| Some(scene.loss.relaxation?.strength),
        "relaxation g of the annulus: E (1 + g e^(−t/τ)) of the standard linear solid",
    )
    .usually("0")
    .when(RING),
    number(
        "loss.relaxation_time",
        Dimension::TIME,
        Bound::Positive,
        |scene| Some(scene.loss.relaxation?.time),
        "its time τ",
    )
    .needed("loss.relaxation_time = \"2 us\"")
    .when(RING),
    word::<ModelKind>("model.kind", |scene| text(scene.model.kind.name()), "simulation model")
        .usually("reduced; the chain of `replay --ensemble`, of several records and of pressures"),
    count(
        "model.mesh_density",
        (2, 128),
        |scene| Some(whole(meshing(scene)?.density)),
        "elements along a block at a contact; their size goes as its inverse",
    )
    .usually("12")
    .when(MESHED),
    word::<Elements>(
        "model.elements",
        |scene| text(meshing(scene)?.elements.name()),
        "8-node quadrilaterals, or with 6-node triangles at the contacts",
    )
    .when(MESHED),
    number(
        "model.contact_patch",
        Dimension::NONE,
        Bound::Positive,
        |scene| Some(meshing(scene)?.contact_patch),
        "radius of the finely meshed patch at a bead's pole over the bead's radius; no contact may grow larger",
    )
    .or(DEFAULT_CONTACT_PATCH)
    .when(MESHED),
    count(
        "model.modes",
        (0, 200),
        |scene| (scene.model.kind == ModelKind::Reduced).then(|| whole(scene.model.reduced.modes)),
        "most elastic modes of a body in the reduced model",
    )
    .usually("8")
    .when(&[Is("model.kind", &["reduced"])]),
    word::<ContactMass>(
        "model.contact_mass",
        |scene| if scene.model.kind == ModelKind::Fea { text(scene.model.fea.contact_mass.name()) } else { None },
        "whether the nodes that may touch carry mass",
    )
    .when(&[Is("model.kind", &["fea"])]),
    value(
        "model.integrator",
        ValueKind::Choice(INTEGRATORS),
        |scene| match (scene.model.kind, scene.model.integrator) {
            (ModelKind::Reduced, _) => None,
            (ModelKind::Fea, _) => text(scene.model.fea.scheme.name()),
            (ModelKind::Chain, integrator) => text(integrator.name()),
        },
        "time integration: two of the chain, three of the fea",
    )
    .usually("dormand-prince-853; symplectic before a disc; trapezoid of the fea")
    .when(&[Is("model.kind", &["chain", "fea"])]),
    number(
        "model.numerical_dissipation",
        Dimension::NONE,
        Bound::Finite,
        |scene| match scene.model.fea.scheme {
            Scheme::HilberHughesTaylor { dissipation } | Scheme::Newmark { dissipation }
                if scene.model.kind == ModelKind::Fea =>
            {
                Some(dissipation)
            }
            _ => None,
        },
        "α of hht, g of newmark",
    )
    .needed("model.numerical_dissipation = 0.1")
    .when(&[Is("model.kind", &["fea"]), Is("model.integrator", &["hht", "newmark"])]),
    number(
        "model.tolerance",
        Dimension::NONE,
        Bound::Between(1e-14, 1e-2),
        |scene| match scene.model.integrator {
            Integrator::DormandPrince853 { tolerance } if scene.model.kind == ModelKind::Chain => Some(tolerance),
            _ => None,
        },
        "relative error allowed a step",
    )
    .or(DEFAULT_TOLERANCE)
    .when(&[Is("model.kind", &["chain"]), Is("model.integrator", &["dormand-prince-853"])]),
    number(
        "model.step",
        Dimension::TIME,
        Bound::Positive,
        |scene| match (scene.model.kind, scene.model.integrator) {
            (ModelKind::Fea, _) => Some(scene.model.fea.step),
            (ModelKind::Reduced, _) => Some(scene.model.reduced.step),
            (ModelKind::Chain, Integrator::Symplectic { step }) => Some(step),
            (ModelKind::Chain, Integrator::DormandPrince853 { .. }) => None,
        },
        "fixed step",
    )
    .needed("model.step = \"50 ns\"")
    .usually("0.1 µs of the fea, 50 ns reduced, 25 ns before a disc; symplectic must be told")
    .when(STEPPED),
];
