//! References and fronts of the built-in scenes, as `granchain accuracy --full` made them.

use serde::{Deserialize, Serialize};

use super::{
    ladder::{FidelityLevel, Setting, Varied},
    run::Cost,
};
use granchain_model::{response::SolverWork, scene::BUILT_IN};
use granchain_record::sha256;

/// A waveform that others are measured against.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Reference {
    /// What it is the limit of: a line's key, or [`BEST`].
    pub key: String,
    pub setting: Setting,
    pub next: Setting,
    /// Relative change of the waveform to the next level, rms over the window, 1.
    pub change: f64,
    /// The waveform, SI, to eight digits.
    pub values: Vec<f64>,
}

/// Waveforms are kept to eight digits.
const ROUNDING: f64 = 5e-9;
/// Key of the reference that total errors are measured against.
pub const BEST: &str = "best";

impl Reference {
    /// Errors below ten times the change to the next level are not quoted.
    #[must_use]
    pub fn least_quotable(&self) -> f64 {
        10.0 * self.change.max(ROUNDING)
    }
}

/// What perturbations far below what a laboratory controls do.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Chaos {
    /// How the copies were computed.
    pub setting: Setting,
    /// Copies: gaps jittered by 0.3 nm, the drive by 1 ± 1e-4.
    #[serde(rename = "members")]
    pub replicates: usize,
    pub seed: u64,
    /// Rms over the copies of the relative change of the waveform over the window, 1: the level below which accuracy buys nothing.
    pub floor: f64,
    /// The features beyond the window.
    pub features: Vec<FeatureSpread>,
}

/// A feature of the reference run, and how it scatters.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct FeatureSpread {
    pub key: String,
    pub unit: String,
    /// Mean over the copies; none where one of them cannot tell.
    pub mean: Option<f64>,
    /// Standard deviation of one copy.
    pub scatter: Option<f64>,
}

/// Errors of the settings of a line against its own limit.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct OwnErrors {
    pub key: String,
    #[serde(rename = "rung")]
    pub fidelity: FidelityLevel,
    pub varied: Varied,
    pub points: Vec<OwnPoint>,
    /// Observed order: slope over the points below 30 % that are at least four times what the limit may be off; none with fewer than three.
    pub order: Option<f64>,
    /// How far the limit has converged, 1.
    pub change: f64,
}

/// One setting of a line.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct OwnPoint {
    /// Value of what is varied, SI.
    pub value: f64,
    /// Error against the line's limit, 1.
    pub error: f64,
    /// Whether it is at least ten times what the limit itself may be off.
    pub quoted: bool,
}

/// A setting as it was measured.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Measured {
    pub setting: Setting,
    /// Error against the best reference over the window, 1.
    pub error: f64,
    /// |Energy unaccounted for at the end| over the largest energy, 1.
    pub energy: f64,
    /// Counts of what the run did.
    pub work: SolverWork,
    /// Features of the whole run, in the order of [`Chaos::features`].
    pub features: Vec<Option<f64>>,
    /// What it took on the machine that measured it.
    pub cost: Cost,
}

#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Stored {
    /// Program and version that made it.
    pub program: String,
    pub scene: String,
    /// SHA-256 of the scene's file.
    pub scene_sha256: String,
    pub watched: String,
    /// End of the window, s.
    pub window_s: f64,
    /// Interval of the waveforms, s.
    pub interval_s: f64,
    /// The processor that the seconds are of.
    pub processor: String,
    /// The references: the best one first, then one a line.
    pub references: Vec<Reference>,
    pub chaos: Chaos,
    /// Errors of the lines against their own limits.
    pub own: Vec<OwnErrors>,
    /// Every setting of the ladder.
    pub measured: Vec<Measured>,
}

const FILES: [(&str, &str); 3] = [
    ("rigid", include_str!("stored/rigid.json")),
    ("annulus", include_str!("stored/annulus.json")),
    ("water", include_str!("stored/water.json")),
];

impl Stored {
    /// What is stored of a built-in scene.
    ///
    /// # Errors
    /// A sentence when there is nothing, or what there is belongs to another form of the scene.
    pub fn of(scene: &str) -> Result<Self, String> {
        let known: Vec<&str> = FILES.iter().map(|(name, _)| *name).collect();
        let Some((_, text)) = FILES.iter().find(|(name, _)| *name == scene) else {
            return Err(format!("scene `{scene}`: nothing is stored; expected {}", known.join(", ")));
        };
        let stored: Self =
            serde_json::from_str(text).map_err(|error| format!("stored references of `{scene}`: {error}"))?;
        let now = digest(scene).unwrap_or_default();
        if stored.scene_sha256 != now {
            let command = format!("granchain accuracy --scene {scene} --full --out DIR");
            return Err(format!(
                "stored references of `{scene}` are of another form of the scene; make them again with `{command}`"
            ));
        }
        Ok(stored)
    }

    #[must_use]
    pub fn reference(&self, key: &str) -> Option<&Reference> {
        self.references.iter().find(|reference| reference.key == key)
    }

    /// The bytes of its file.
    ///
    /// # Errors
    /// When it cannot be written as JSON.
    pub fn to_json(&self) -> Result<Vec<u8>, serde_json::Error> {
        let mut stored = self.clone();
        // That of a program that holds references too says nothing about a setting.
        stored.measured.iter_mut().for_each(|measured| measured.cost.peak_memory_bytes = None);
        let mut bytes = serde_json::to_vec(&stored)?;
        bytes.push(b'\n');
        Ok(bytes)
    }
}

/// SHA-256 of a built-in scene's keys and values as they are written, hexadecimal.
#[must_use]
pub fn digest(scene: &str) -> Option<String> {
    let scene = BUILT_IN.iter().find(|built_in| built_in.name == scene)?;
    // What a person reads beside the keys is no other form.
    let keys: Vec<&str> =
        scene.toml.lines().map(str::trim).filter(|line| !line.is_empty() && !line.starts_with('#')).collect();
    Some(sha256(keys.join("\n").as_bytes()))
}

/// Eight significant digits: what a file keeps.
pub(super) fn kept(value: f64) -> f64 {
    format!("{value:.7e}").parse().unwrap_or(value)
}
