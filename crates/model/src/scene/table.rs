//! All keys of a scene file. What ties several keys together is checked where the scene is built.

use super::{
    AnnulusShape, Baffle, ContactLaw, DEFAULT_CONTACT_PATCH, DEFAULT_DISC, DEFAULT_OUTPUT_STEP, DEFAULT_TOLERANCE,
    DampingKind, DampingPlacement, DampingTerm, DriveKind, FlatContact, Holder, Integrator, Key, MOST_BEADS, ModelKind,
    Rim, Scheme, Support, ValueKind,
    condition::{
        BODY_MESH, DISC, DRIVES, FACE, FORMULA, FOUNDATION, HORN, INTEGRATORS, LIQUID, MEDIA, MESHED, METHODS,
        OWN_NORMAL, RING, STEPPED, STRIKER, SUPPORTS, WATER_MESH,
    },
    key::{
        Bound,
        When::{self, Beside, Damped, Is},
        beside, count, key, number, optional, word,
    },
    setting::{
        SettingValue, absorption, beads, coefficient, damped, differing_beads, disc, gaps, given, meshing, of_sum,
        ring, text, water, water_mesh, whole,
    },
};
use granchain_signal::{Dimension, closest};

pub const KEYS: &[Key] = &[
    key("name", ValueKind::Text, "name of the scene").value(|scene| text(&scene.name)).usually("the file's name"),
    key("description", ValueKind::Text, "one sentence on what it is")
        .value(|scene| text(&scene.description))
        .usually("nothing"),
    key("extends", ValueKind::Text, "built-in scene this file changes").usually("nothing"),
    number("alpha", Dimension::NONE, Bound::NotNegative, "α, factor on the drive")
        .number(|scene| Some(scene.amplitude_scale))
        .or(1.0),
    number("duration", Dimension::TIME, Bound::Positive, "simulated time")
        .number(|scene| Some(scene.duration))
        .needed("duration = \"120 us\""),
    number("output_step", Dimension::TIME, Bound::Positive, "interval of the output samples")
        .number(|scene| Some(scene.output_step))
        .or(DEFAULT_OUTPUT_STEP),
    number(
        "vibrometer.bandwidth",
        Dimension::FREQUENCY,
        Bound::Positive,
        "−6 dB bandwidth of the simulated vibrometer; at or above half the output sample rate: no filter",
    )
    .number(|scene| Some(scene.vibrometer_bandwidth))
    .usually("1.5 MHz, or 4 f0 where that is more"),
    count("chain.beads", (1, MOST_BEADS as u32), "number of beads N, 1 to 1000")
        .value(|scene| Some(beads(scene.chain.beads.len())))
        .needed("chain.beads = 6"),
    number("chain.radius", Dimension::LENGTH, Bound::Radius, "radius of a bead")
        .number(|scene| scene.chain.beads.first().map(|bead| bead.radius))
        .needed("chain.radius = \"0.5 mm\""),
    key("chain.material", ValueKind::Text, "material of the beads")
        .value(|scene| text(&scene.chain.beads.first()?.material.name))
        .needed("chain.material = \"chrome-steel\""),
    key("chain.gaps", ValueKind::Gaps, "one initial gap for all contacts, or a list of N + 1 from the piston")
        .value(gaps)
        .usually("0 m"),
    number(
        "chain.precompression",
        Dimension::FORCE,
        Bound::NotNegative,
        "static force along the chain before the drive starts",
    )
    .number(|scene| Some(scene.chain.precompression))
    .or(0.0),
    optional(
        "chain.gravity",
        Dimension::ACCELERATION,
        "gravity along the axis towards the support: the chain starts in equilibrium",
    )
    .number(|scene| given(scene.chain.gravity)),
    count("chain.sensor", (1, MOST_BEADS as u32), "number of the sensor bead, which reads its two contact forces")
        .value(|scene| Some(beads(scene.chain.sensor?.bead)))
        .usually("none"),
    number(
        "chain.sensor_share",
        Dimension::NONE,
        Bound::Between(0.0, 1.0),
        "share of the contact before the sensor bead in its reading; 0.5 is the mean of both, 0 the contact behind it",
    )
    .number(|scene| Some(scene.chain.sensor?.share))
    .or(0.5),
    key(
        "chain.override",
        ValueKind::BeadOverrides,
        "beads that differ: number from the piston, radius, material, mass",
    )
    .value(differing_beads)
    .usually("none"),
    number("materials.*.youngs_modulus", Dimension::PRESSURE, Bound::Modulus, "Young's modulus E")
        .of_material(|material| material.youngs_modulus)
        .usually("that of the built-in material with this name"),
    number("materials.*.poissons_ratio", Dimension::NONE, Bound::PoissonsRatio, "Poisson's ratio ν")
        .of_material(|material| material.poissons_ratio)
        .usually("that of the built-in material with this name"),
    number("materials.*.density", Dimension::DENSITY, Bound::Density, "density ρ")
        .of_material(|material| material.density)
        .usually("that of the built-in material with this name"),
    word::<FlatContact>("piston.contact", "face of the piston: rigid flat, or elastic half-space")
        .value(|scene| text(scene.piston.name()).filter(|_| scene.drive.kind.striker().is_none()))
        .when(HORN),
    key("piston.material", ValueKind::Text, "material of that half-space, such as titanium")
        .value(|scene| text(&scene.piston_material.as_ref()?.name))
        .usually("that of the first bead")
        .when(FACE),
    number(
        "horn.mass",
        Dimension::MASS,
        Bound::Positive,
        "modal mass M at the horn's tip. The drive is then the tip's free motion; the chain's force adds to it",
    )
    .number(|scene| Some(scene.horn?.mass))
    .usually("none: the tip moves as prescribed")
    .when(HORN),
    number("horn.frequency", Dimension::FREQUENCY, Bound::Positive, "its resonance")
        .number(|scene| Some(scene.horn?.frequency))
        .usually("the drive's")
        .when(HORN),
    number("horn.quality", Dimension::NONE, Bound::Positive, "Q of the horn's resonance")
        .number(|scene| Some(scene.horn?.quality).filter(|quality| quality.is_finite()))
        .usually("infinite")
        .when(HORN),
    optional("holder.drag", Dimension::LINEAR_DAMPING, "viscous drag b on every bead, −b v")
        .number(|scene| given(scene.holder?.drag)),
    optional(
        "holder.friction_force",
        Dimension::FORCE,
        "friction on every bead under a constant load across the chain",
    )
    .number(|scene| given(scene.holder?.friction_force)),
    optional("holder.friction_coefficient", Dimension::NONE, "coefficient μ of friction from the tilted contacts")
        .number(|scene| given(scene.holder?.friction_coefficient)),
    optional(
        "holder.clearance",
        Dimension::LENGTH,
        "bore diameter minus bead diameter, e; lines of centres tilt by up to sin θ = e/2a",
    )
    .number(|scene| given(scene.holder?.clearance)),
    number(
        "holder.slip_velocity",
        Dimension::VELOCITY,
        Bound::NotNegative,
        "width v_s of the smooth sign change, tanh(v/v_s); 0: exact law, with beads that stick",
    )
    .number(|scene| scene.holder.filter(Holder::has_friction).map(|holder| holder.slip_velocity))
    .usually("0 on the chain, else 1 mm/s"),
    key(
        "drive.kind",
        ValueKind::Choice(DRIVES),
        "waveform of the piston's displacement, or a bead that strikes the chain",
    )
    .value(|scene| text(scene.drive.kind.name()))
    .needed("drive.kind = \"tone-burst\""),
    key("drive.file", ValueKind::Path, "horn-tip record, relative to the scene file")
        .value(|scene| match &scene.drive.kind {
            DriveKind::Record { file: Some(file), .. } | DriveKind::UnreadRecord { file } => {
                text(&file.display().to_string())
            }
            _ => None,
        })
        .needed("drive.file = \"horn_tip.csv\"")
        .when(&[Is("drive.kind", &["record"])]),
    number("drive.amplitude", Dimension::LENGTH, Bound::NotNegative, "peak displacement at α = 1")
        .number(|scene| scene.drive.kind.cycles().map(|_| scene.drive.amplitude))
        .needed("drive.amplitude = \"1 um\"")
        .when(FORMULA),
    number("drive.frequency", Dimension::FREQUENCY, Bound::Positive, "drive frequency f0")
        .number(|scene| Some(scene.drive.frequency).filter(|_| scene.drive.kind.striker().is_none()))
        .needed("drive.frequency = \"73 kHz\"")
        .usually("the record's own; required for a formula")
        .when(HORN),
    number("drive.cycles", Dimension::NONE, Bound::Positive, "length of the burst in periods of f0")
        .number(|scene| scene.drive.kind.cycles())
        .needed("drive.cycles = 40")
        .when(FORMULA),
    number(
        "drive.ring_up",
        Dimension::TIME,
        Bound::NotNegative,
        "time constant τ of ring-up and decay; 0 is rectangular",
    )
    .number(|scene| if let DriveKind::ToneBurst { ring_up, .. } = scene.drive.kind { Some(ring_up) } else { None })
    .needed("drive.ring_up = \"100 us\"")
    .when(&[Is("drive.kind", &["tone-burst"])]),
    number(
        "drive.velocity",
        Dimension::VELOCITY,
        Bound::Positive,
        "velocity of the striker at α = 1 as it touches the first bead",
    )
    .number(|scene| Some(scene.drive.kind.striker()?.1))
    .needed("drive.velocity = \"0.5 m/s\"")
    .usually("that of the drop height; one of both must be given")
    .when(STRIKER),
    number(
        "drive.height",
        Dimension::LENGTH,
        Bound::Positive,
        "height h from which it falls instead: √(2 g h), g = 9.81 m/s²",
    )
    .usually("none: its velocity is given")
    .when(STRIKER),
    number("drive.radius", Dimension::LENGTH, Bound::Radius, "radius of the striker")
        .number(|scene| Some(scene.drive.kind.striker()?.0.radius))
        .usually("the chain's")
        .when(STRIKER),
    key("drive.material", ValueKind::Text, "material of the striker")
        .value(|scene| text(&scene.drive.kind.striker()?.0.material.name))
        .usually("the chain's")
        .when(STRIKER),
    number("drive.mass", Dimension::MASS, Bound::Positive, "mass of the striker, in place of that of its material")
        .usually("that of its material")
        .when(STRIKER),
    key("support.kind", ValueKind::Choice(SUPPORTS), "what holds the far end")
        .value(|scene| text(scene.support.name()))
        .needed("support.kind = \"rigid\""),
    number(
        "support.ring_radius",
        Dimension::LENGTH,
        Bound::Radius,
        "radius R of the ring's section centres and of its clamped side",
    )
    .number(|scene| Some(ring(scene)?.ring_radius))
    .or(AnnulusShape::published().ring_radius)
    .when(RING),
    number(
        "support.section_radius",
        Dimension::LENGTH,
        Bound::Radius,
        "radius b of the ring's section, a half disc; the opening has R − b",
    )
    .number(|scene| Some(ring(scene)?.section_radius))
    .or(AnnulusShape::published().section_radius)
    .when(RING),
    number("support.stiffness_factor", Dimension::NONE, Bound::Positive, "factor on the stiffness of the annulus")
        .number(|scene| Some(scene.support.ring()?.1))
        .or(1.0)
        .when(RING),
    key("support.material", ValueKind::Text, "material of the annulus")
        .value(|scene| {
            text(&scene.support.material().filter(|_| disc(scene).is_none() && scene.support.plate().is_none())?.name)
        })
        .usually("resin")
        .when(RING),
    number("support.stiffness", Dimension::STIFFNESS, Bound::Positive, "stiffness of the one-sided spring")
        .number(|scene| scene.support.spring())
        .needed("support.stiffness = \"0.7e6 N/m\"")
        .when(&[Is("support.kind", &["spring"])]),
    number(
        "support.youngs_modulus",
        Dimension::PRESSURE,
        Bound::Modulus,
        "Young's modulus of the half-space under the last bead",
    )
    .number(|scene| match scene.support {
        Support::Foundation { youngs_modulus, .. } => Some(youngs_modulus),
        _ => None,
    })
    .needed("support.youngs_modulus = \"58 MPa\"")
    .when(FOUNDATION),
    number("support.poissons_ratio", Dimension::NONE, Bound::PoissonsRatio, "its Poisson's ratio")
        .number(|scene| match scene.support {
            Support::Foundation { poissons_ratio, .. } => Some(poissons_ratio),
            _ => None,
        })
        .or(0.3)
        .when(FOUNDATION),
    number("support.loss_time", Dimension::TIME, Bound::NotNegative, "time constant τ of its loss, E (1 + τ d/dt)")
        .number(|scene| match scene.support {
            Support::Foundation { loss_time, .. } => Some(loss_time),
            _ => None,
        })
        .or(0.0)
        .when(FOUNDATION),
    number(
        "support.plate_thickness",
        Dimension::LENGTH,
        Bound::Positive,
        "thickness of a thin plate between last bead and half-space",
    )
    .number(|scene| Some(scene.support.plate()?.thickness))
    .usually("none: no plate")
    .when(FOUNDATION),
    key("support.plate_material", ValueKind::Text, "its material")
        .value(|scene| text(&scene.support.plate()?.material.name))
        .needed("support.plate_material = \"acrylic\"")
        .usually("none; with a thickness it must be given")
        .when(FOUNDATION),
    number("disc.radius", Dimension::LENGTH, Bound::Positive, "radius of the disc")
        .number(|scene| Some(disc(scene)?.radius))
        .or(DEFAULT_DISC.0)
        .when(DISC),
    number("disc.thickness", Dimension::LENGTH, Bound::Positive, "thickness of the disc, below its radius")
        .number(|scene| Some(disc(scene)?.thickness))
        .or(DEFAULT_DISC.1)
        .when(DISC),
    key("disc.material", ValueKind::Text, "material of the disc")
        .value(|scene| text(&disc(scene)?.material.name))
        .usually("vitreous-carbon")
        .when(DISC),
    word::<Rim>("disc.rim", "how the lateral face of the disc is held")
        .value(|scene| text(disc(scene)?.rim.name()))
        .when(DISC),
    count("disc.mesh_density", (1, 64), "elements through the thickness; 4/3 as many per length along r")
        .value(|scene| Some(whole(scene.support.disc()?.1)))
        .usually("6")
        .when(DISC),
    key("water.medium", ValueKind::Choice(MEDIA), "what is behind the disc; none is a vacuum")
        .value(|scene| disc(scene).and_then(|_| text(scene.water.as_ref().map_or("none", |water| water.medium.name()))))
        .usually("water")
        .when(DISC),
    number("water.density", Dimension::DENSITY, Bound::Positive, "density ρ of it")
        .number(|scene| Some(water(scene)?.liquid.density))
        .usually("the medium's")
        .when(LIQUID),
    number("water.sound_speed", Dimension::VELOCITY, Bound::Positive, "speed of sound c in it")
        .number(|scene| Some(water(scene)?.liquid.sound_speed))
        .usually("the medium's")
        .when(LIQUID),
    number(
        "water.absorption",
        Dimension::ATTENUATION,
        Bound::NotNegative,
        "attenuation α₁ of amplitude at 1 MHz, α = α₁ (f/1 MHz)^y",
    )
    .number(|scene| Some(absorption(scene)?.at_1_mhz))
    .or(0.0)
    .when(LIQUID),
    number("water.absorption_exponent", Dimension::NONE, Bound::Between(0.01, 2.0), "y of the attenuation")
        .number(|scene| Some(absorption(scene)?.exponent))
        .needed("water.absorption_exponent = 1.1")
        .usually("none; with water.absorption it must be given")
        .when(LIQUID),
    word::<Baffle>("water.baffle", "plane around the disc: at rest, or free of pressure")
        .value(|scene| text(water(scene)?.baffle.name()))
        .when(LIQUID),
    key("water.method", ValueKind::Choice(METHODS), "Rayleigh integral over the disc, or acoustic elements")
        .value(|scene| text(water(scene)?.method.name()))
        .usually("rayleigh; elements beside a soft baffle or in the fea")
        .when(LIQUID),
    key("water.field_points", ValueKind::FieldPoints, "field point of the pressure, z from the disc's back")
        .value(|scene| Some(SettingValue::FieldPoints(water(scene)?.field_points.clone())))
        .usually("one at z = 1 mm on the axis")
        .when(LIQUID),
    number("water.mesh_radius", Dimension::LENGTH, Bound::Positive, "radius of the hemisphere of acoustic elements")
        .number(|scene| Some(water_mesh(scene)?.radius))
        .usually("2.5 radii of the disc")
        .when(WATER_MESH),
    number("water.mesh_side", Dimension::LENGTH, Bound::Positive, "side of an acoustic element along the radius")
        .number(|scene| Some(water_mesh(scene)?.side))
        .usually("1/20 of the disc's radius")
        .when(WATER_MESH),
    word::<DampingKind>("damping.kind", "law of the dashpots")
        .value(|scene| text(scene.damping.kind.name()))
        .needed("damping.kind = \"none\""),
    key("damping.coefficient", ValueKind::DampingCoefficient, "c of the linear, γ of the Kuwabara–Kono dashpots")
        .value(|scene| match scene.damping.kind.terms() {
            [term] => coefficient(scene, *term),
            _ => None,
        })
        .usually("the paper's")
        .when(&[Damped(false)]),
    beside(DampingTerm::Linear, "c, where both laws act")
        .number(|scene| of_sum(scene, DampingTerm::Linear))
        .when(&[Beside(DampingTerm::Linear)]),
    beside(DampingTerm::KuwabaraKono, "γ, where both laws act")
        .number(|scene| of_sum(scene, DampingTerm::KuwabaraKono))
        .when(&[Beside(DampingTerm::KuwabaraKono)]),
    word::<DampingPlacement>("damping.at", "dashpots at bead–bead contacts only, or at the ends too")
        .value(|scene| damped(scene).and_then(|damping| text(damping.placement.name())))
        .usually("all")
        .when(&[Damped(true)]),
    key("damping.tension", ValueKind::Flag, "whether a contact force may pull while the contact opens")
        .value(|scene| damped(scene).map(|damping| SettingValue::Flag(damping.tension)))
        .usually("false")
        .when(&[Damped(true)]),
    word::<ContactLaw>(
        "contact.law",
        "contact law of the chain: half-spaces, or finite bodies whose contacts are coupled",
    )
    .value(|scene| if scene.model.kind == ModelKind::Chain { text(scene.contact_law.name()) } else { None })
    .when(&[Is("model.kind", &["chain"])]),
    number(
        "contact.yield_strength",
        Dimension::PRESSURE,
        Bound::Modulus,
        "yield strength Y of the beads: their contacts yield from a pressure of 1.6 Y in the middle",
    )
    .number(|scene| if scene.model.kind == ModelKind::Chain { scene.yield_strength } else { None })
    .usually("none: elastic")
    .when(&[Is("model.kind", &["chain"])]),
    number(
        "loss.beads",
        Dimension::NONE,
        Bound::Between(0.0, 1.0),
        "loss factor of the beads' material at 1 MHz, growing with frequency",
    )
    .number(|scene| given(scene.loss.beads).filter(|_| scene.model.kind.is_meshed()))
    .usually("0")
    .when(BODY_MESH),
    number("loss.support", Dimension::NONE, Bound::Between(0.0, 1.0), "the same of the support's body")
        .number(|scene| given(scene.loss.support).filter(|_| scene.model.kind.is_meshed()))
        .usually("0")
        .when(OWN_NORMAL),
    number(
        "loss.relaxation",
        Dimension::NONE,
        Bound::Between(0.0, 100.0),
        "relaxation g of the annulus: E (1 + g e^(−t/τ)) of the standard linear solid",
    )
    .number(|scene| Some(scene.loss.relaxation?.strength))
    .usually("0")
    .when(RING),
    number("loss.relaxation_time", Dimension::TIME, Bound::Positive, "its time τ")
        .number(|scene| Some(scene.loss.relaxation?.time))
        .needed("loss.relaxation_time = \"2 us\"")
        .usually("none; with loss.relaxation it must be given")
        .when(RING),
    word::<ModelKind>("model.kind", "simulation model")
        .value(|scene| text(scene.model.kind.name()))
        .usually("reduced; the chain of `replay --ensemble`, of several records and of pressures"),
    count("model.mesh_density", (2, 128), "mesh density n at a contact; element size is proportional to 1/n")
        .value(|scene| Some(whole(meshing(scene)?.density)))
        .usually("16 (reduced), 12 (fea)")
        .when(MESHED),
    number(
        "model.contact_patch",
        Dimension::NONE,
        Bound::Positive,
        "radius of the fine mesh at a bead's pole / bead radius; the upper limit of a contact radius",
    )
    .number(|scene| Some(meshing(scene)?.contact_patch))
    .or(DEFAULT_CONTACT_PATCH)
    .when(MESHED),
    count("model.modes", (0, 200), "maximum number of elastic modes per reduced body")
        .value(|scene| (scene.model.kind == ModelKind::Reduced).then(|| whole(scene.model.reduced.modes)))
        .usually("8")
        .when(&[Is("model.kind", &["reduced"])]),
    key(
        "model.integrator",
        ValueKind::Choice(INTEGRATORS),
        "time integration: the first for chain, the second for chain before a disc, the rest for fea",
    )
    .value(|scene| match (scene.model.kind, scene.model.integrator) {
        (ModelKind::Reduced, _) => None,
        (ModelKind::Fea, _) => text(scene.model.fea.scheme.name()),
        (ModelKind::Chain, integrator) => text(integrator.name()),
    })
    .usually("dormand-prince-853; symplectic before a disc; trapezoid of the fea")
    .when(&[Is("model.kind", &["chain", "fea"])]),
    number("model.numerical_dissipation", Dimension::NONE, Bound::UpToAThird, "dissipation parameter of hht, 0 to 1/3")
        .number(|scene| match scene.model.fea.scheme {
            Scheme::HilberHughesTaylor { dissipation } if scene.model.kind == ModelKind::Fea => Some(dissipation),
            _ => None,
        })
        .needed("model.numerical_dissipation = 0.1")
        .when(&[Is("model.kind", &["fea"]), Is("model.integrator", &["hht"])]),
    number("model.tolerance", Dimension::NONE, Bound::Between(1e-14, 1e-2), "relative error per step")
        .number(|scene| match scene.model.integrator {
            Integrator::DormandPrince853 { tolerance } if scene.model.kind == ModelKind::Chain => Some(tolerance),
            _ => None,
        })
        .or(DEFAULT_TOLERANCE)
        .when(&[Is("model.kind", &["chain"]), Is("model.integrator", &["dormand-prince-853"])]),
    number("model.step", Dimension::TIME, Bound::Positive, "fixed step")
        .number(|scene| scene.model.step())
        .needed("model.step = \"50 ns\"")
        .usually("0.1 µs (fea), 50 ns (reduced), 25 ns (disc)")
        .when(STEPPED),
];

#[derive(Debug, Clone, Copy)]
pub(super) struct Governor {
    pub(super) name: &'static str,
    /// Keys whose meaning changes with its value.
    pub(super) reinterpreted: &'static [&'static str],
}

/// In the order in which they are checked.
pub(super) const GOVERNORS: &[Governor] = &[
    // First: it decides which integrators there are.
    Governor {
        name: "model.kind",
        reinterpreted: &["model.integrator", "model.numerical_dissipation", "model.tolerance", "model.step"],
    },
    // Says what it uses only where the model is the chain.
    Governor { name: "contact.law", reinterpreted: &[] },
    Governor { name: "drive.kind", reinterpreted: &[] },
    Governor { name: "piston.contact", reinterpreted: &[] },
    Governor { name: "support.kind", reinterpreted: &[] },
    Governor { name: "water.medium", reinterpreted: &["water.density", "water.sound_speed"] },
    // Says what it uses only where there is water.
    Governor { name: "water.method", reinterpreted: &[] },
    Governor { name: "damping.kind", reinterpreted: &["damping.coefficient"] },
    Governor { name: "model.integrator", reinterpreted: &[] },
];

impl Governor {
    pub(super) fn words(&self) -> &'static [&'static str] {
        Key::find(self.name).map_or(&[], |key| key.words())
    }

    pub(super) fn governed(&self) -> impl Iterator<Item = (&'static Key, &'static When)> {
        KEYS.iter().filter_map(|key| Some((key, key.under(self.name)?)))
    }
}

impl Key {
    /// The key of a full name such as `materials.brass.density` or `chain.gaps.contact2`.
    pub fn find(name: &str) -> Option<&'static Self> {
        KEYS.iter().find(|key| key.matches(name))
    }

    pub(super) fn is_table(table: &str) -> bool {
        let inside = |name: &str| name.strip_prefix(table).is_some_and(|rest| rest.starts_with('.'));
        KEYS.iter().any(|key| inside(key.name)) || table == "chain.gaps" || table.starts_with("materials.")
    }

    /// The valid key most like `name`: another word for it, the spelling in its table or as a whole, or the same last word in another table.
    pub(crate) fn nearest(name: &str) -> Option<String> {
        let last = name.rsplit('.').next().unwrap_or(name);
        // In `materials.NAME.…` the name is the user's, only the last word can be misspelt.
        if let Some((material, word)) = name.strip_prefix("materials.").and_then(|rest| rest.split_once('.')) {
            let words = ["youngs_modulus", "poissons_ratio", "density"];
            return closest(word, words.iter().copied()).map(|word| format!("materials.{material}.{word}"));
        }
        if let Some(inside) = KEYS.iter().find(|key| key.name.strip_prefix(name).is_some_and(|r| r.starts_with('.'))) {
            return Some(inside.name.to_owned());
        }
        let plain = || KEYS.iter().map(|key| key.name).filter(|key| !key.contains('*'));
        let table = name.rsplit_once('.').map(|(table, _)| table);
        let with_kind = table.or(Some("damping").filter(|_| last == "law"));
        let kind = with_kind.map(|table| format!("{table}.kind")).filter(|kind| plain().any(|key| key == kind));
        if kind.is_some() && ["law", "type", "model"].contains(&last) {
            return kind;
        }
        let in_table = |key: &&str| key.rsplit_once('.').map(|(own, _)| own) == table;
        let known = table.is_some_and(Self::is_table);
        plain()
            .find(|key| key.rsplit('.').next() == Some(last) && strsim::jaro_winkler(key, name) > 0.7)
            // In a table that there is only the last word can be misspelt.
            .or_else(|| match known {
                true => closest(last, plain().filter(in_table).filter_map(|key| key.rsplit('.').next()))
                    .and_then(|word| plain().filter(in_table).find(|key| key.rsplit('.').next() == Some(word))),
                false => closest(name, plain()),
            })
            .or_else(|| plain().find(|key| key.rsplit('.').next() == Some(last)))
            .or_else(|| {
                let word = closest(last, plain().filter_map(|key| key.rsplit('.').next()))?;
                plain().find(|key| key.rsplit('.').next() == Some(word))
            })
            .map(str::to_owned)
    }
}
