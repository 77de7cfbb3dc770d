//! What was measured, in rows.

use serde::{Deserialize, Serialize};

use super::front;
use granchain_signal::feature::Measurand;

/// How contacts and bodies are computed; one line of the figure.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Method {
    #[default]
    Hertz,
    FiniteBody,
    Reduced,
    Fea,
    /// The scene as it is, with one effect off.
    Effect,
}

impl Method {
    pub const ALL: [Self; 4] = [Self::Hertz, Self::FiniteBody, Self::Reduced, Self::Fea];

    #[must_use]
    pub const fn name(self) -> &'static str {
        match self {
            Self::Hertz => "Hertz chain",
            Self::FiniteBody => "finite-body chain",
            Self::Reduced => "reduced",
            Self::Fea => "finite elements",
            Self::Effect => "without an effect",
        }
    }
}

/// One variation, measured.
#[derive(Debug, Clone, PartialEq, Default, Serialize, Deserialize)]
pub struct Row {
    /// Model, or the effect that is off.
    pub name: String,
    pub method: Method,
    /// Mesh density, where it has a mesh.
    pub mesh: Option<u32>,
    /// Step or tolerance, in words.
    pub step: String,
    /// Keys that make it, `KEY=VALUE`; empty for the scene as it is, and for effects.
    pub sets: Vec<String>,
    /// Whether the scene is computed so where nothing is chosen.
    pub is_default: bool,
    /// Making the bodies, once for any number of runs, s.
    pub bodies_s: f64,
    /// A run of the whole scene, s: in proportion to the run over the window.
    pub run_s: f64,
    /// Differences of times below this share are noise, 1.
    pub time_noise: f64,
    /// Distance to the reference, 1; for effects the change to the scene as it is.
    pub total: f64,
    /// What step and mesh leave, 1; unknown for effects.
    pub own: Option<f64>,
    /// Relative changes of the positive and the negative peak, 1.
    pub peaks: [Option<f64>; 2],
    /// Changes of A(f₀/3)/A(f₀) and A(2f₀/3)/A(f₀), 1.
    pub ratios: [Option<f64>; 2],
    /// By how much a fit with it is off, ln α and ln of the damping coefficient.
    pub shift: [Option<f64>; 2],
}

impl Row {
    /// Model, mesh and step.
    #[must_use]
    pub fn label(&self) -> String {
        let mesh = self.mesh.map_or(String::new(), |density| format!(" {density}"));
        let step = if self.step.is_empty() { String::new() } else { format!(", {}", self.step) };
        format!("{}{mesh}{step}", self.name)
    }
}

/// What the variations of a scene cost and change.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Accuracy {
    pub scene: String,
    pub measurand: Measurand,
    /// Motion begins, and comparison ends, s.
    pub window_s: [f64; 2],
    /// What all are compared with.
    pub reference: String,
    /// What the reference is known to, 1; 0 where it is the scene itself.
    pub reference_error: f64,
    /// White noise of a sample of the trace over its peak, 1.
    pub noise: f64,
    /// Half of the 90 % interval that a fit of the window would state, ln α and ln of the damping coefficient.
    pub half_widths: [Option<f64>; 2],
    pub rows: Vec<Row>,
    /// Variations that the scene cannot be computed in, and why.
    pub left_out: Vec<[String; 2]>,
}

impl Accuracy {
    /// Places of the rows that none beats, cheapest first.
    #[must_use]
    pub fn front(&self) -> Vec<usize> {
        front(&self.rows, self.reference_error)
    }

    /// The cheapest row whose ranked error is at most `level`, of methods that the caller takes.
    #[must_use]
    pub fn cheapest_within(&self, level: f64, takes: impl Fn(Method) -> bool) -> Option<&Row> {
        let within = |row: &&Row| row.ranked_error(self.reference_error).is_some_and(|error| error <= level);
        let taken = self.rows.iter().filter(|row| takes(row.method)).filter(within);
        taken.min_by(|a, b| a.seconds().total_cmp(&b.seconds()))
    }

    /// The smallest ranked error of methods that the caller takes.
    #[must_use]
    pub fn most_accurate(&self, takes: impl Fn(Method) -> bool) -> Option<(&Row, f64)> {
        let taken = self.rows.iter().filter(|row| takes(row.method));
        let ranked = taken.filter_map(|row| Some((row, row.ranked_error(self.reference_error)?)));
        ranked.min_by(|a, b| a.1.total_cmp(&b.1))
    }
}
