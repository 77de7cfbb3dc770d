//! What stands on the bench: beads, piston, support, dampers, drive, and how the run is to be computed.
//!
//! Scenes come from TOML files ([`load`]), laid one over another: a built-in scene, the file that `extends` it, overrides
//! `KEY=VALUE`. A plain number is SI, a text carries its unit. [`KEYS`] lists every key.
//!
//! ```toml
//! extends = "annulus"             # begin as a built-in scene: rigid, annulus, chain, water, impact
//! alpha = 0.6
//!
//! [chain]
//! beads = 8
//! gaps = { contact1 = "2 nm" }    # or one length, or a list of N + 1 from the piston
//!
//! [[chain.override]]
//! bead = 3
//! radius = "0.501 mm"
//!
//! [damping]
//! kind = "kuwabara-kono"
//! coefficient = "3660 N s/m^1.5"
//! ```
//!
//! Where a layer changes a `kind`, keys of lower layers that the new kind does not use fall away, and a damping
//! coefficient returns to the default of its new law; keys given beside a kind that does not use them are refused.

use std::borrow::Cow;

mod annulus;
mod builtin;
mod burst;
mod chain;
mod condition;
mod contact_law;
mod damping;
mod disc;
mod document;
mod drive;
mod effects;
mod error;
mod fea;
mod file;
mod holder;
mod horn;
mod key;
mod limits;
mod listing;
mod loss;
mod material;
mod mesh_file;
mod model_kind;
mod motion;
mod plausible;
mod read;
mod reader;
mod reduced;
mod setting;
mod settings;
mod shown;
mod source;
mod support;
mod table;
mod water;
mod word;

pub use annulus::AnnulusShape;
pub use builtin::BUILT_IN;
pub(crate) use builtin::BuiltIn;
pub use chain::{Bead, Chain, MOST_BEADS, Sensor};
pub use contact_law::ContactLaw;
pub use damping::{Damping, DampingCoefficients, DampingKind, DampingPlacement, DampingTerm, TermDescription};
pub(crate) use disc::{DEFAULT_DISC, DEFAULT_DISC_DENSITY};
pub use disc::{DiscShape, Rim};
pub(crate) use drive::UNREAD_FREQUENCY;
pub use drive::{Drive, DriveKind, PistonMotion};
pub use effects::{Effect, effects, simulated, without_each};
pub use error::{Place, SceneError};
pub(crate) use fea::DEFAULT_CONTACT_PATCH;
pub use fea::{ContactMass, DEFAULT_FEA_STEP, Elements, FeaSettings, Scheme};
pub use file::{Loaded, SceneText, load, load_preferring, load_text, load_with_notes};
pub use holder::{DEFAULT_SLIP_VELOCITY, Holder};
pub use horn::Horn;
pub use key::{Key, ValueKind};
pub use limits::Limits;
pub use listing::Setting;
pub use loss::{MaterialLoss, Relaxation};
pub use material::Material;
pub use mesh_file::MeshFile;
pub use model_kind::ModelKind;
pub use motion::Motion;
pub(crate) use reduced::DEFAULT_REDUCED_STEP;
pub use reduced::{DEFAULT_MODES, ReducedSettings};
pub use setting::SettingValue;
pub(crate) use settings::DEFAULT_OUTPUT_STEP;
pub use settings::{DEFAULT_TOLERANCE, DEFAULT_VIBROMETER_BANDWIDTH, Integrator, Meshing, ModelSettings};
pub use support::{ContactNormal, FlatContact, Plate, Support};
pub use table::KEYS;
pub use water::{
    Absorption, Baffle, DEFAULT_WATER_STEP, FieldPoint, Medium, Water, WaterMesh, WaterMethod, WaterSettings,
};

/// One experiment, whole: everything a model needs to run it.
#[derive(Debug, Clone, PartialEq)]
pub struct Scene {
    pub name: String,
    pub description: String,
    pub chain: Chain,
    /// The piston's face.
    pub piston: FlatContact,
    /// What it is made of, where it is a half-space of another material than the first bead's.
    pub piston_material: Option<Material>,
    pub drive: Drive,
    /// α, the factor on the drive, 1.
    pub amplitude_scale: f64,
    /// Compliant horn; `None`: the tip moves as prescribed.
    pub horn: Option<Horn>,
    /// Forces of the bead guide; `None`: no guide.
    pub holder: Option<Holder>,
    pub loss: MaterialLoss,
    pub support: Support,
    /// The half-space of water behind the support, where that is a disc; none is a vacuum.
    pub water: Option<WaterSettings>,
    /// Materials that mesh files may name, by name; empty where no body is a mesh file.
    pub materials: Vec<Material>,
    pub damping: Damping,
    pub contact_law: ContactLaw,
    /// Yield strength Y of the beads, Pa: contacts of the chain yield where the pressure in their middle would exceed 1.6 Y. None is elastic.
    pub yield_strength: Option<f64>,
    pub duration: f64,
    /// Interval of the output samples, s. Where a model has a fixed step of its own (finite elements, reduced, any in front of a disc), it is a whole multiple of it: on loading, a
    /// step that does not divide it is shortened to the next that does, and a note says so.
    pub output_step: f64,
    /// Bandwidth (−6 dB) of the vibrometer, Hz: what is measured of a simulated velocity is measured below it. Output is not filtered.
    pub vibrometer_bandwidth: f64,
    pub model: ModelSettings,
}

/// What a contact behind a free end is open by, m: more than any motion.
const FREE: f64 = 1e6;

impl Scene {
    /// What the piston's face is made of; a rigid one of nothing.
    pub fn piston_face(&self) -> Option<&Material> {
        self.piston.material(self.piston_material.as_ref().unwrap_or(&self.chain.beads[0].material))
    }

    /// Initial gaps of the N + 1 contacts, m; behind a free end there is nothing within reach.
    pub(crate) fn gaps(&self) -> impl Iterator<Item = f64> + '_ {
        let free = self.support.is_free().then_some(self.chain.beads.len());
        self.chain.gaps.iter().enumerate().map(move |(contact, gap)| if free == Some(contact) { FREE } else { *gap })
    }

    /// The scene as a chain of one bead more, where a striker drives it: the striker in front, out of the piston's reach.
    pub(crate) fn with_striker(&self) -> Cow<'_, Self> {
        let Some((bead, _)) = self.drive.kind.striker() else { return Cow::Borrowed(self) };
        let mut scene = self.clone();
        scene.chain.beads.insert(0, bead.clone());
        scene.chain.gaps.insert(0, FREE);
        Cow::Owned(scene)
    }

    pub fn is_struck(&self) -> bool {
        self.drive.kind.striker().is_some()
    }

    /// Velocity with which a striker meets the chain, m/s.
    pub(crate) fn striker_velocity(&self) -> Option<f64> {
        Some(self.amplitude_scale * self.drive.kind.striker()?.1)
    }

    /// Number of output samples, at 0, `output_step`, 2 `output_step` … up to the duration (a rounding of the quotient is no sample less).
    pub fn samples(&self) -> usize {
        (self.duration / self.output_step + 1e-6).floor() as usize + 1
    }

    pub fn mesh_files(&self) -> Vec<std::path::PathBuf> {
        let beads = self.chain.beads.iter().filter_map(|bead| bead.mesh.as_ref());
        let mut paths: Vec<std::path::PathBuf> = beads.map(|mesh| mesh.path.clone()).collect();
        paths.extend(self.support.mesh_file().map(|mesh| mesh.path.clone()));
        paths.sort();
        paths.dedup();
        paths
    }
}
