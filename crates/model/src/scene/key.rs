//! The keys of a scene file: name, kind of value, meaning; which choices use which keys.

use super::DampingKind;
use granchain_signal::Dimension;

/// What kind of value a key takes.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum ValueKind {
    /// A quantity of one dimension; a plain number is SI.
    Quantity(Dimension),
    /// A damping coefficient, whose dimension follows `damping.kind`.
    DampingCoefficient,
    /// A whole number.
    Count,
    /// `true` or `false`.
    Flag,
    /// One of some words.
    Choice(&'static [&'static str]),
    /// Any text.
    Text,
    /// The path of a file.
    Path,
    /// Gaps: one length, a list of N + 1, or a table `all`, `contact1` … `contact{N+1}`.
    Gaps,
    /// A list of tables with `bead` and what differs for it.
    BeadOverrides,
    /// Points of the water: a list of tables with `r` and `z`.
    FieldPoints,
}

/// One key of a scene file.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Key {
    /// Its name with its tables; `*` stands for the name of a material.
    pub name: &'static str,
    /// What it takes.
    pub kind: ValueKind,
    /// What it means.
    pub meaning: &'static str,
}

const fn key(name: &'static str, kind: ValueKind, meaning: &'static str) -> Key {
    Key { name, kind, meaning }
}

const fn quantity(name: &'static str, dimension: Dimension, meaning: &'static str) -> Key {
    key(name, ValueKind::Quantity(dimension), meaning)
}

pub(super) const FLAT_KINDS: &[&str] = &["rigid", "half-space"];
pub(super) const DRIVE_KINDS: &[&str] = &["record", "tone-burst", "gaussian-burst", "sine"];
pub(super) const SUPPORT_KINDS: &[&str] = &["rigid", "half-space", "annulus", "spring", "body", "disc"];
pub(super) const RIMS: &[&str] = &["clamped", "supported", "free"];
pub(super) const MEDIA: &[&str] = &["water", "tissue", "none"];
pub(super) const BAFFLES: &[&str] = &["rigid", "soft"];
pub(super) const WATER_METHODS: &[&str] = &["rayleigh", "elements"];
pub(super) const NORMALS: &[&str] = &["fixed", "moving"];
pub(super) const DAMPING_KINDS: &[&str] = &DampingKind::NAMES;
pub(super) const PLACEMENTS: &[&str] = &["beads", "all"];
pub(super) const CONTACT_LAWS: &[&str] = &["hertz", "finite-body"];
pub(super) const MODEL_KINDS: &[&str] = &["chain", "reduced", "fea"];
const INTEGRATORS: &[&str] = &["dormand-prince-853", "symplectic", "trapezoid", "hht", "newmark"];
pub(super) const CHAIN_INTEGRATORS: &[&str] = &["dormand-prince-853", "symplectic"];
pub(super) const FEA_INTEGRATORS: &[&str] = &["trapezoid", "hht", "newmark"];
pub(super) const ELEMENTS: &[&str] = &["quadrilaterals", "mixed"];
pub(super) const CONTACT_MASSES: &[&str] = &["massless", "consistent"];

/// All keys, in the order in which they are written.
pub const KEYS: &[Key] = &[
    key("name", ValueKind::Text, "name of the scene"),
    key("description", ValueKind::Text, "one sentence on what it is"),
    key("extends", ValueKind::Text, "built-in scene this file changes"),
    quantity("alpha", Dimension::NONE, "α, factor on the drive"),
    quantity("duration", Dimension::TIME, "simulated time"),
    quantity("output_step", Dimension::TIME, "interval of the output samples"),
    quantity(
        "vibrometer.bandwidth",
        Dimension::FREQUENCY,
        "bandwidth (−6 dB) below which simulated velocities are measured; of half the output's sample rate, all of it",
    ),
    key("chain.beads", ValueKind::Count, "number of beads N, 1 to 1000"),
    quantity("chain.radius", Dimension::LENGTH, "radius of a bead"),
    key("chain.material", ValueKind::Text, "material of the beads"),
    key("chain.gaps", ValueKind::Gaps, "initial gap of every contact, or of each of the N + 1 from the piston"),
    quantity("chain.precompression", Dimension::FORCE, "static force along the chain before the drive starts"),
    key("chain.mesh", ValueKind::Path, "Gmsh file with the mesh of the beads, relative to the scene file"),
    quantity("chain.mesh_unit", Dimension::LENGTH, "length of its unit; default 1 m"),
    key(
        "chain.override",
        ValueKind::BeadOverrides,
        "beads that differ: number from the piston, radius, material, mesh",
    ),
    quantity("materials.*.youngs_modulus", Dimension::PRESSURE, "Young's modulus E"),
    quantity("materials.*.poissons_ratio", Dimension::NONE, "Poisson's ratio ν"),
    quantity("materials.*.density", Dimension::DENSITY, "density ρ"),
    key(
        "piston.contact",
        ValueKind::Choice(FLAT_KINDS),
        "face of the piston: rigid flat, or half-space of the bead's material",
    ),
    key("drive.kind", ValueKind::Choice(DRIVE_KINDS), "waveform of the piston's displacement"),
    key("drive.file", ValueKind::Path, "horn-tip record, relative to the scene file"),
    quantity("drive.amplitude", Dimension::LENGTH, "peak displacement at α = 1"),
    quantity("drive.frequency", Dimension::FREQUENCY, "drive frequency f0"),
    quantity("drive.cycles", Dimension::NONE, "length of the burst in periods of f0"),
    quantity("drive.ring_up", Dimension::TIME, "time constant τ of ring-up and decay; 0 is rectangular"),
    key("support.kind", ValueKind::Choice(SUPPORT_KINDS), "what holds the far end"),
    quantity("support.stiffness_factor", Dimension::NONE, "factor on the stiffness of the annulus"),
    key("support.material", ValueKind::Text, "material of the annulus or body"),
    key(
        "support.normal",
        ValueKind::Choice(NORMALS),
        "contact normal: of the undeformed surface, or to the moved bead",
    ),
    key("support.mesh", ValueKind::Path, "Gmsh file with the mesh of the body, relative to the scene file"),
    quantity("support.mesh_unit", Dimension::LENGTH, "length of its unit; default 1 m"),
    quantity("support.stiffness", Dimension::STIFFNESS, "stiffness of the one-sided spring"),
    quantity("disc.radius", Dimension::LENGTH, "radius of the disc"),
    quantity("disc.thickness", Dimension::LENGTH, "thickness of the disc, below its radius"),
    key("disc.material", ValueKind::Text, "material of the disc"),
    key("disc.rim", ValueKind::Choice(RIMS), "how the lateral face of the disc is held"),
    key("disc.mesh_density", ValueKind::Count, "elements through the disc's thickness; 4/3 as many a length along r"),
    key("water.medium", ValueKind::Choice(MEDIA), "what is behind the disc; none is a vacuum"),
    quantity("water.density", Dimension::DENSITY, "density ρ of it"),
    quantity("water.sound_speed", Dimension::VELOCITY, "speed of sound c in it"),
    quantity("water.absorption", Dimension::ATTENUATION, "attenuation α₁ of amplitude at 1 MHz, α = α₁ (f/1 MHz)^y"),
    quantity("water.absorption_exponent", Dimension::NONE, "y of the attenuation"),
    key("water.baffle", ValueKind::Choice(BAFFLES), "plane around the disc: at rest, or free of pressure"),
    key("water.method", ValueKind::Choice(WATER_METHODS), "Rayleigh integral over the disc, or acoustic elements"),
    key("water.field_points", ValueKind::FieldPoints, "where the pressure is heard, z from the disc's back"),
    quantity("water.mesh_radius", Dimension::LENGTH, "radius of the hemisphere of acoustic elements"),
    quantity("water.mesh_side", Dimension::LENGTH, "side of an acoustic element along the radius"),
    key("damping.kind", ValueKind::Choice(DAMPING_KINDS), "law of the dashpots"),
    key("damping.coefficient", ValueKind::DampingCoefficient, "c of the linear, γ of the Kuwabara–Kono dashpots"),
    quantity("damping.linear_coefficient", Dimension::LINEAR_DAMPING, "c, where both laws act"),
    quantity("damping.kuwabara_kono_coefficient", Dimension::KUWABARA_KONO_DAMPING, "γ, where both laws act"),
    key("damping.at", ValueKind::Choice(PLACEMENTS), "dashpots at bead–bead contacts only, or at the ends too"),
    key("damping.tension", ValueKind::Flag, "whether a contact force may pull while the contact parts"),
    key(
        "contact.law",
        ValueKind::Choice(CONTACT_LAWS),
        "law of the chain's contacts: of half-spaces, or fitted to the bodies and coupled through them",
    ),
    key("model.kind", ValueKind::Choice(MODEL_KINDS), "rung of the fidelity ladder"),
    key("model.mesh_density", ValueKind::Count, "elements along a block at a contact; their size goes as its inverse"),
    key(
        "model.elements",
        ValueKind::Choice(ELEMENTS),
        "8-node quadrilaterals, or with 6-node triangles at the contacts",
    ),
    quantity(
        "model.contact_patch",
        Dimension::NONE,
        "radius of the finely meshed patch at a bead's pole over the bead's radius; no contact may grow larger",
    ),
    key("model.modes", ValueKind::Count, "most elastic modes of a body in the reduced model"),
    key("model.contact_mass", ValueKind::Choice(CONTACT_MASSES), "whether the nodes that may touch carry mass"),
    key("model.integrator", ValueKind::Choice(INTEGRATORS), "time integration: two of the chain, three of the fea"),
    quantity("model.numerical_dissipation", Dimension::NONE, "α of hht, g of newmark"),
    quantity("model.tolerance", Dimension::NONE, "relative error allowed a step"),
    quantity("model.step", Dimension::TIME, "fixed step"),
];

/// The key that decides which of a table's keys have an effect, and the keys each of its values uses.
pub(super) struct Governor {
    /// The deciding key.
    pub(super) key: &'static str,
    /// The keys that depend on it.
    pub(super) governed: &'static [&'static str],
    /// Value → keys it uses.
    pub(super) uses: &'static [(&'static str, &'static [&'static str])],
    /// Keys whose meaning changes with the value.
    pub(super) reinterpreted: &'static [&'static str],
}

const CHAIN_USES: &[&str] = &[
    "contact.law",
    "model.mesh_density",
    "model.elements",
    "model.contact_patch",
    "model.integrator",
    "model.tolerance",
    "model.step",
];
const MESHED_LAW_USES: &[&str] = &["model.mesh_density", "model.elements", "model.contact_patch"];

const WATER_MESH: &[&str] = &["water.mesh_radius", "water.mesh_side"];
const LIQUID_USES: &[&str] = &[
    "water.density",
    "water.sound_speed",
    "water.absorption",
    "water.absorption_exponent",
    "water.baffle",
    "water.method",
    "water.field_points",
    "water.mesh_radius",
    "water.mesh_side",
];
const DISC_USES: &[&str] = &[
    "disc.radius",
    "disc.thickness",
    "disc.material",
    "disc.rim",
    "disc.mesh_density",
    "water.medium",
    "water.density",
    "water.sound_speed",
    "water.absorption",
    "water.absorption_exponent",
    "water.baffle",
    "water.method",
    "water.field_points",
    "water.mesh_radius",
    "water.mesh_side",
];

pub(super) const GOVERNORS: &[Governor] = &[
    // First: it decides which integrators there are.
    Governor {
        key: "model.kind",
        governed: &[
            "chain.mesh",
            "chain.mesh_unit",
            "contact.law",
            "support.normal",
            "support.mesh",
            "support.mesh_unit",
            "model.mesh_density",
            "model.elements",
            "model.contact_patch",
            "model.modes",
            "model.contact_mass",
            "model.integrator",
            "model.numerical_dissipation",
            "model.tolerance",
            "model.step",
        ],
        uses: &[
            ("chain", CHAIN_USES),
            (
                "reduced",
                &[
                    "model.mesh_density",
                    "model.elements",
                    "model.contact_patch",
                    "model.modes",
                    "model.step",
                    "chain.mesh",
                    "chain.mesh_unit",
                    "support.normal",
                    "support.mesh",
                    "support.mesh_unit",
                ],
            ),
            (
                "fea",
                &[
                    "model.mesh_density",
                    "model.elements",
                    "model.contact_patch",
                    "model.contact_mass",
                    "model.integrator",
                    "model.numerical_dissipation",
                    "model.step",
                    "chain.mesh",
                    "chain.mesh_unit",
                    "support.normal",
                    "support.mesh",
                    "support.mesh_unit",
                ],
            ),
        ],
        reinterpreted: &["model.integrator", "model.numerical_dissipation", "model.tolerance", "model.step"],
    },
    // Says what it uses only where the model is the chain.
    Governor {
        key: "contact.law",
        governed: MESHED_LAW_USES,
        uses: &[("hertz", &[]), ("finite-body", MESHED_LAW_USES)],
        reinterpreted: &[],
    },
    Governor {
        key: "drive.kind",
        governed: &["drive.file", "drive.amplitude", "drive.frequency", "drive.cycles", "drive.ring_up"],
        uses: &[
            ("record", &["drive.file", "drive.frequency"]),
            ("tone-burst", &["drive.amplitude", "drive.frequency", "drive.cycles", "drive.ring_up"]),
            ("gaussian-burst", &["drive.amplitude", "drive.frequency", "drive.cycles"]),
            ("sine", &["drive.amplitude", "drive.frequency", "drive.cycles"]),
        ],
        reinterpreted: &[],
    },
    Governor {
        key: "support.kind",
        governed: &[
            "support.stiffness_factor",
            "support.material",
            "support.normal",
            "support.stiffness",
            "support.mesh",
            "support.mesh_unit",
            "disc.radius",
            "disc.thickness",
            "disc.material",
            "disc.rim",
            "disc.mesh_density",
            "water.medium",
            "water.density",
            "water.sound_speed",
            "water.absorption",
            "water.absorption_exponent",
            "water.baffle",
            "water.method",
            "water.field_points",
            "water.mesh_radius",
            "water.mesh_side",
        ],
        uses: &[
            ("rigid", &[]),
            ("half-space", &[]),
            ("annulus", &["support.stiffness_factor", "support.material", "support.normal"]),
            ("spring", &["support.stiffness"]),
            ("body", &["support.mesh", "support.mesh_unit", "support.material", "support.normal"]),
            ("disc", DISC_USES),
        ],
        reinterpreted: &[],
    },
    Governor {
        key: "water.medium",
        governed: LIQUID_USES,
        uses: &[("none", &[]), ("water", LIQUID_USES), ("tissue", LIQUID_USES)],
        reinterpreted: &["water.density", "water.sound_speed"],
    },
    // Says what it uses only where there is water.
    Governor {
        key: "water.method",
        governed: WATER_MESH,
        uses: &[("rayleigh", &[]), ("elements", WATER_MESH)],
        reinterpreted: &[],
    },
    Governor {
        key: "damping.kind",
        governed: &[
            "damping.coefficient",
            "damping.linear_coefficient",
            "damping.kuwabara_kono_coefficient",
            "damping.at",
            "damping.tension",
        ],
        uses: &DampingKind::USES,
        reinterpreted: &["damping.coefficient"],
    },
    Governor {
        key: "model.integrator",
        governed: &["model.tolerance", "model.step", "model.numerical_dissipation"],
        uses: &[
            ("dormand-prince-853", &["model.tolerance"]),
            ("symplectic", &["model.step"]),
            ("trapezoid", &["model.step"]),
            ("hht", &["model.step", "model.numerical_dissipation"]),
            ("newmark", &["model.step", "model.numerical_dissipation"]),
        ],
        reinterpreted: &[],
    },
];

impl Governor {
    /// The keys a value uses; `None` for a value that does not exist.
    pub(super) fn used_by(&self, value: &str) -> Option<&'static [&'static str]> {
        self.uses.iter().find(|(choice, _)| *choice == value).map(|(_, keys)| *keys)
    }
}

impl Key {
    /// The key of a full name such as `materials.brass.density` or `chain.gaps.contact2`.
    #[must_use]
    pub fn find(name: &str) -> Option<&'static Self> {
        KEYS.iter().find(|key| key.matches(name))
    }

    fn matches(&self, name: &str) -> bool {
        if let Some((before, after)) = self.name.split_once('*') {
            return name
                .strip_prefix(before)
                .and_then(|rest| rest.strip_suffix(after))
                .is_some_and(|middle| !middle.is_empty() && !middle.contains('.'));
        }
        self.name == name
            || self.kind == ValueKind::Gaps
                && name.strip_prefix(self.name).is_some_and(|rest| rest == ".all" || rest.starts_with(".contact"))
    }

    /// Whether `table` is a table of some key.
    pub(super) fn is_table(table: &str) -> bool {
        let inside = |name: &str| name.strip_prefix(table).is_some_and(|rest| rest.starts_with('.'));
        KEYS.iter().any(|key| inside(key.name)) || table == "chain.gaps" || table.starts_with("materials.")
    }

    /// The valid key most like `name`: the spelling as a whole, or the same last word in another table.
    #[must_use]
    pub fn nearest(name: &str) -> Option<String> {
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
        plain()
            .find(|key| key.rsplit('.').next() == Some(last) && strsim::jaro_winkler(key, name) > 0.7)
            .or_else(|| closest(name, plain()))
            .or_else(|| plain().find(|key| key.rsplit('.').next() == Some(last)))
            .or_else(|| {
                let words = plain().filter_map(|key| key.rsplit('.').next());
                let word = closest(last, words)?;
                plain().find(|key| key.rsplit('.').next() == Some(word))
            })
            .map(str::to_owned)
    }
}

/// The candidate that `text` is most likely a misspelling of; `None` when none is near.
pub(super) fn closest<'a>(text: &str, candidates: impl Iterator<Item = &'a str>) -> Option<&'a str> {
    candidates
        .map(|candidate| (strsim::damerau_levenshtein(text, candidate), candidate))
        .filter(|(distance, candidate)| 3 * distance <= candidate.len().max(3))
        .min_by_key(|(distance, _)| *distance)
        .map(|(_, candidate)| candidate)
}
